"""Images and depth maps on disk."""

import contextlib
import io
import math
import re
import struct
import tokenize
import warnings
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, TiffImagePlugin, UnidentifiedImageError

from fogsim.core.files.atomic import write_bytes
from fogsim.core.files.output_targets import refuse_unwritable
from fogsim.core.files.readers import read_bytes
from fogsim.errors import InputError, UnknownNameError
from fogsim.values import Camera

_DEPTH_KINDS = ("planar", "range")
"""Types of a depth map: distance along the optical axis, or along the viewing ray."""

IMAGE_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".pgm", ".ppm")
"""Suffixes of images in a folder, and of those that can be written."""

_DEEP = (".png", ".tif", ".tiff", ".pgm", ".ppm")
_COLOURED = tuple(ending for ending in IMAGE_ENDINGS if ending != ".pgm")
_TRANSPARENT = (".png", ".tif", ".tiff", ".bmp", ".webp")
"""Suffixes of formats that can hold 16 bits, colours and transparency."""

_EXACT = ("IMWRITE_WEBP_LOSSLESS_MODE", "IMWRITE_WEBP_LOSSLESS_PRESERVE_COLOR")
_OPTIONS: dict[str, list[int]] = {".webp": [getattr(cv2, name) for name in _EXACT if hasattr(cv2, name)]}
"""OpenCV's options by suffix. Its WebP is lossless; older versions lack an option to keep colours that do not show."""

_CHECKED_FORMATS = ("JPEG", "MPO", "PNG", "BMP", "PPM")
"""Pillow's names of formats whose truncated files OpenCV may read as far as they go."""

_LARGEST_VALUE = re.compile(
    rb"(?:P[2356](?:\s+(?:#[^\n]*\n\s*)*\d+){2}\s+(?:#[^\n]*\n\s*)*|P7\n(?:(?!ENDHDR)[^\n]*\n)*MAXVAL +)(\d+)"
)
"""Of the header of a PGM, PPM or PAM file; pixels are read as they are, whatever it says, but for 8 bits as text."""

_FULL_SCALES = (255, 1023, 4095, 65535)  # of 8, 10, 12 and 16 bits

ANIMATED_FORMATS = ("GIF", "WEBP", "PNG")
_PARTS = dict.fromkeys(ANIMATED_FORMATS, "frames") | {"TIFF": "pages"}
"""Several images in a file, by Pillow's name of the format; in others (MPO) the first is the photograph."""

_OPACITY, _UNASSOCIATED = (258, 338), (2,)  # TIFF 6.0, BitsPerSample and ExtraSamples
_BITS, _PHOTOMETRIC, _WHITE_IS_ZERO = 258, 262, 0  # the same, BitsPerSample and PhotometricInterpretation
_ORIENTATION = 0x0112  # EXIF, as below
_SIDEWAYS = (5, 6, 7, 8)
_TOP_TO_BOTTOM, _LEFT_TO_RIGHT = (3, 4, 7, 8), (2, 3, 6, 7)

_MOST_BYTES = 2**31
"""Largest file of an image or a depth map [bytes]."""

IMAGE_FAULTS = (
    *(OSError, SyntaxError, ValueError, EOFError, TypeError, LookupError, ArithmeticError, struct.error),
    Image.DecompressionBombError,
)
"""What Pillow raises for damaged files."""

Pixels = NDArray[np.uint8] | NDArray[np.uint16]


def read_image(path: Path) -> Pixels:
    """Read an image of 8 or 16 bits, turned upright by its orientation tag, with colours in OpenCV's order."""
    image = _decoded(path)
    if image.dtype == np.uint16 and (bits := _inverted_bits(path)):
        image = 2**16 - 2 ** (16 - bits) - image
    if image.dtype not in (np.uint8, np.uint16) or (image.ndim == 3 and image.shape[2] not in (1, 3, 4)):
        channels = 1 if image.ndim == 2 else image.shape[2]
        raise InputError(f"{path}: expected a grey or colour image of 8 or 16 bits, got {channels} × {image.dtype}")
    return image.astype(np.uint8, copy=False) if image.dtype == np.uint8 else image.astype(np.uint16, copy=False)


def _inverted_bits(path: Path) -> int:
    """Bits per pixel of a TIFF file in which 0 is white, which OpenCV disregards above 8 bits; 0 for others."""
    with contextlib.suppress(*IMAGE_FAULTS), warnings.catch_warnings(action="ignore"), Image.open(path) as image:
        if isinstance(image, TiffImagePlugin.TiffImageFile) and image.tag_v2.get(_PHOTOMETRIC) == _WHITE_IS_ZERO:
            return int(image.tag_v2[_BITS][0])
    return 0


def _decoded(path: Path) -> NDArray[np.generic]:
    data = read_bytes(path, _MOST_BYTES)
    if not data:
        raise InputError(f"{path}: the file is empty")
    orientation, image = _checked(path, data)
    with _quiet_opencv(), contextlib.suppress(cv2.error, MemoryError):
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if image is None else image
    if image is None:
        raise InputError(f"{path}: this is no image that can be read (PNG, TIFF, JPEG, …)")
    return _upright(np.asarray(image), orientation)


@contextlib.contextmanager
def _quiet_opencv() -> Iterator[None]:
    """Keep OpenCV from printing its own messages about errors that FogSim reports."""
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(level)


def _upright(image: NDArray[np.generic], orientation: int) -> NDArray[np.generic]:
    """An image turned and mirrored as EXIF's orientation (1 to 8) says."""
    turned = image.swapaxes(0, 1) if orientation in _SIDEWAYS else image
    turned = turned[::-1] if orientation in _TOP_TO_BOTTOM else turned
    turned = turned[:, ::-1] if orientation in _LEFT_TO_RIGHT else turned
    return np.ascontiguousarray(turned)


def _checked(path: Path, data: bytes) -> tuple[int, NDArray[np.generic] | None]:
    """EXIF's orientation of an image, and its pixels where OpenCV would change them.

    Refuses what OpenCV would silently fill up or cut, or would exhaust memory.
    """
    header = _LARGEST_VALUE.match(data)
    is_scaled = data[:2] in (b"P2", b"P3") and header is not None and int(header[1]) < _FULL_SCALES[0]
    if header is not None and int(header[1]) not in _FULL_SCALES and not is_scaled:
        known = ", ".join(map(str, _FULL_SCALES))
        raise InputError(f"{path}: expected a largest value of {known} in the header, got {int(header[1])}")
    pixels = None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image = Image.open(io.BytesIO(data))
            if image.format in _CHECKED_FORMATS:
                image.load()
            if isinstance(image, TiffImagePlugin.TiffImageFile) and image.mode == "RGBA":
                # OpenCV multiplies colours by an opacity that is not associated with them.
                is_straight = [image.tag_v2.get(one) for one in _OPACITY] == [(8, 8, 8, 8), _UNASSOCIATED]
                pixels = np.array(image)[..., (2, 1, 0, 3)] if is_straight else None
            parts, orientation = getattr(image, "n_frames", 1), image.getexif().get(_ORIENTATION, 1)
    except UnidentifiedImageError:
        # OpenCV knows formats that Pillow does not.
        return 1, None
    except Image.DecompressionBombError as error:
        raise InputError(f"{path}: by its header the image is larger than any camera's: {error}") from error
    except (*IMAGE_FAULTS, MemoryError) as error:
        raise InputError(f"{path}: the image is damaged or cut off: {error}") from error
    if parts > 1 and image.format in _PARTS:
        raise InputError(f"{path}: expected one image, got {parts} {_PARTS[image.format]}")
    # TIFF is turned as it is read.
    return orientation if isinstance(orientation, int) and image.format != "TIFF" else 1, pixels


class DepthMap(NamedTuple):
    """A ``.npy`` file of numbers or a 16-bit image with ``"planar"`` or ``"range"`` depth.

    `scale` is metres per unit of the file: required for an image, 1 by default for ``.npy``.
    """

    path: Path
    kind: str
    scale: float | None = None


def read_distance(depth_map: DepthMap, camera: Camera) -> NDArray[np.float64]:
    """Distances along the rays (rows, cols) [m] from a depth map; ``inf`` (sky) where it has 0 or ``inf``."""
    path, kind, scale = depth_map
    if kind not in _DEPTH_KINDS:
        raise UnknownNameError("depth kind", kind, _DEPTH_KINDS)
    if scale is not None and not (scale > 0 and math.isfinite(scale)):
        raise InputError(f"--depth-scale must be a positive number of metres, got {scale!r}")
    depth = _numbers(path) if path.suffix.lower() == ".npy" else _steps(path, scale)
    if depth.shape != (camera.height, camera.width):
        raise InputError(
            f"{path}: expected a depth map of {camera.height} rows and {camera.width} columns as the camera has, "
            f"got {' × '.join(map(str, depth.shape))}"
        )
    _refuse_impossible(path, depth)
    depth = np.where(depth == 0, math.inf, depth * (scale or 1.0))
    return depth if kind == "range" else range_from_planar(depth, camera)


def _numbers(path: Path) -> NDArray[np.float64]:
    try:
        loaded = np.load(io.BytesIO(read_bytes(path, _MOST_BYTES)), allow_pickle=False)
    except InputError:
        raise
    except (ValueError, EOFError, MemoryError, SyntaxError, zipfile.BadZipFile, tokenize.TokenError) as error:
        reason = (str(error) or "too little memory").splitlines()[0]
        raise InputError(f"{path}: cannot be read as an array of numbers: {reason}") from error
    if not isinstance(loaded, np.ndarray) or loaded.dtype.kind not in "fiu":
        raise InputError(f"{path}: expected an array of numbers, got {getattr(loaded, 'dtype', type(loaded).__name__)}")
    while loaded.ndim > 2 and 1 in loaded.shape:
        loaded = loaded.squeeze(loaded.shape.index(1))
    return np.asarray(loaded, dtype=np.float64)


def _steps(path: Path, scale: float | None) -> NDArray[np.float64]:
    image = _decoded(path)
    if image.dtype != np.uint16 or image.ndim != 2:
        raise InputError(f"{path}: expected a grey image of 16 bits or a .npy file as depth map, got {image.dtype}")
    if scale is None:
        raise InputError(f"{path}: --depth-scale is missing: how many metres is one step of this depth map?")
    return image.astype(np.float64)


def _refuse_impossible(path: Path, depth: NDArray[np.float64]) -> None:
    wrong = np.argwhere(np.isnan(depth) | (depth < 0))
    if len(wrong):
        row, column = wrong[0]
        raise InputError(
            f"{path}: depths must be positive, or 0 or inf for the sky; got {depth[row, column]} at row {row}, "
            f"column {column}, and {len(wrong)} such in all"
        )


def refuse_unwritable_image(
    path: Path, option: str = "", *, overwrite: bool = True, read: Iterable[Path] = (), makes_folder: bool = False
) -> None:
    """Refuse a file as `refuse_unwritable` does, and one whose suffix is not in `IMAGE_ENDINGS`."""
    ending = path.suffix.lower()
    if ending not in IMAGE_ENDINGS:
        named, allowed = f"{option} {path}".lstrip(), ", ".join(IMAGE_ENDINGS)
        raise InputError(f"{named}: no image can be written with the ending {ending!r}; allowed: {allowed}")
    refuse_unwritable(path, option, overwrite=overwrite, read=read, makes_folder=makes_folder)


def write_image(path: Path, image: Pixels) -> None:
    """Write an image whole or not at all, blue first; InputError if its format has no 16 bits, colours or opacity."""
    refuse_unwritable_image(path)
    ending, channels = path.suffix.lower(), 1 if image.ndim == 2 else image.shape[2]
    if channels == 4 and ending not in _TRANSPARENT and np.all(image[..., 3] == np.iinfo(image.dtype).max):
        image, channels = image[..., :3].copy(), 3
    for kind, applies, endings in (
        ("of 16 bits", image.dtype == np.uint16, _DEEP),
        ("with colours", channels > 1, _COLOURED),
        ("with transparency", channels == 4, _TRANSPARENT),
    ):
        if applies and ending not in endings:
            raise InputError(f"{path}: an image {kind} can be written as {', '.join(endings)}, not as {ending}")
    if ending == ".ppm" and channels == 1:  # which has colours only
        image = image.reshape(*image.shape[:2], 1).repeat(3, axis=2)
    data = None
    with _quiet_opencv(), contextlib.suppress(cv2.error):
        written, encoded = cv2.imencode(ending, image, _OPTIONS.get(ending, []))
        data = encoded.tobytes() if written else None
    if data is None:
        rows, cols = image.shape[:2]
        raise InputError(f"{path}: an image of {cols} × {rows} pixels cannot be written as {ending}")
    write_bytes(path, data)


def range_from_planar(depth: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """Distance along the ray from the planar depth z (rows, cols) [m]."""
    u0, v0 = camera.principal_point
    across = (np.arange(camera.width) - u0) / camera.focal_length
    down = (np.arange(camera.height) - v0) / camera.focal_length
    return np.asarray(depth * np.sqrt(1.0 + across**2 + down[:, None] ** 2))
