"""From pixel values to linear luminance: the inverse of the camera's response, and the weights of the colours."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.units import LUMINANCE_WEIGHTS
from fogsim.values.camera import Camera, Response
from fogsim.values.camera_response import exposure_of
from fogsim.vision.light import pixel_kernels
from fogsim.vision.light.pixel_kernels import LinearPixels, Pixels


@lru_cache(maxsize=6 * len(Response))
def linear_table(response: Response, bits: int = 8, black_level: float = 0.0) -> NDArray[np.float32]:
    """Light behind each pixel value, in linear grey levels that are the same for every bit depth.

    Returns linear grey levels, read-only: 0 at the black level, 255 the last. sRGB: IEC 61966-2-1.
    """
    share = np.arange(2**bits, dtype=np.float64) / (2**bits - 1)
    table: NDArray[np.float32] = (255.0 * exposure_of(share, response, black_level)).astype(np.float32)
    table.flags.writeable = False
    return table


def linear_pixels(image: Pixels, camera: Camera) -> LinearPixels:
    """Pair an image with the inverse of its camera's response; no pixel is touched (`image` (rows, cols))."""
    table = linear_table(camera.response, camera.bits, camera.black_level)
    weights = np.array(LUMINANCE_WEIGHTS if image.ndim == 3 else (1.0,), np.float32)
    pixels: NDArray[Any] = np.ascontiguousarray(image if image.ndim == 3 else image[:, :, None])
    return LinearPixels(pixels, weights[:, None] * table)


def linear_luminance(image: Pixels, response: Response, bits: int = 8, black_level: float = 0.0) -> NDArray[np.float32]:
    """Undo a camera's response and weigh the colours to luminance (ITU-R BT.709).

    Returns linear grey levels 0 … 255 at every bit depth; of a grey image and of a colour image with three equal
    channels the same (rows, cols). Takes `image` (rows, cols).
    """
    expected = np.uint8 if bits == 8 else np.uint16
    if image.dtype != expected:
        raise InputError(f"an image of {bits} bits must have dtype {np.dtype(expected)}, got {image.dtype}")
    # A copy of the cached table: numba would compile a second kernel for a read-only array.
    table = linear_table(response, bits, black_level).copy()
    pixels: NDArray[Any] = np.ascontiguousarray(image)
    luminance_of = pixel_kernels.grey_luminance if pixels.ndim == 2 else pixel_kernels.colour_luminance
    return luminance_of(pixels, table)
