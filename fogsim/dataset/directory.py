"""The directory of a data set: its files and the meaning of their values, its identity, and its progress."""

import contextlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self, cast

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, NonNegativeInt, PositiveInt, ValidationError

from fogsim.core.files.atomic import partial_path, write_bytes, write_json
from fogsim.core.files.output_targets import refuse_unwritable_folder
from fogsim.core.files.readers import open_regular, read_bytes, read_json
from fogsim.core.files.writer_lock import LOCK_NAME, WriterLock
from fogsim.errors import FogSimError, InputError, shown

DEPTH_UNIT = 0.01
"""Distance per step of a depth image [m]."""

TRANSMISSION_UNIT = 1.0 / 65_535
"""Transmission per step of a transmission image [-]."""

_MOST = 65_535
_COMPRESSION = 3  # of 9; more takes several times as long for a few per cent

_PNG_START = b"\x89PNG\r\n\x1a\n"
PNG_END = b"\0\0\0\0IEND\xaeB`\x82"
"""Last bytes of a PNG file that is not cut off."""


def encoded_depth(distance: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Distance along the ray as 16-bit values in centimetres.

    Parameters
    ----------
    distance : (rows, cols) float32
        Distance [m]; ``inf`` for the sky.

    Returns
    -------
    (rows, cols) uint16
        1 … 65 534 centimetres; 0 for the sky; 65 535 for 655.35 m and more.
    """
    steps = np.clip(np.rint(np.minimum(distance, 1e6) / DEPTH_UNIT), 1, _MOST)
    return np.where(np.isinf(distance), 0, steps).astype(np.uint16)


def decoded_depth(values: NDArray[np.uint16]) -> NDArray[np.float64]:
    """Distance along the ray from the values of a depth image.

    Parameters
    ----------
    values : (rows, cols) uint16
        Values from `encoded_depth`.

    Returns
    -------
    (rows, cols) float64
        Distance [m]; ``inf`` for the sky; 655.35 stands for that and more.
    """
    return np.where(values == 0, np.inf, values * DEPTH_UNIT)


def encoded_transmission(transmission: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Transmission 0 … 1 as 16-bit values 0 … 65 535.

    Parameters
    ----------
    transmission : (rows, cols) float32
        Transmittance, 0 … 1.
    """
    return np.rint(np.clip(transmission, 0.0, 1.0) * np.float64(_MOST)).astype(np.uint16)


def decoded_transmission(values: NDArray[np.uint16]) -> NDArray[np.float64]:
    """Transmission 0 … 1 from the values of a transmission image.

    Parameters
    ----------
    values : (rows, cols) uint16
        Values from `encoded_transmission`.
    """
    return np.asarray(values * TRANSMISSION_UNIT)


def png(image: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """PNG file of an image (rows, cols[, 3]), red first, with all its bits."""
    # OpenCV has blue first.
    pixels: NDArray[Any] = image if image.ndim == 2 else np.ascontiguousarray(image[..., ::-1])
    done, data = cv2.imencode(".png", pixels, [cv2.IMWRITE_PNG_COMPRESSION, _COMPRESSION])
    if not done:
        raise FogSimError(f"an image of {image.shape} {image.dtype} could not be written as PNG")
    return data.tobytes()


def read_png(path: Path) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Image of a PNG file, with all its bits.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    (rows, cols) or (rows, cols, 3) uint8 or uint16
        Pixel values, red first.

    Raises
    ------
    InputError
        If it is not a readable PNG file, or has opacity.
    """
    data = read_bytes(Path(path))
    if not (data.startswith(_PNG_START) and PNG_END in data):
        raise InputError(f"{path}: expected a PNG file, got another one or a part of one")
    image: NDArray[Any] | None = None
    with contextlib.suppress(cv2.error, MemoryError):  # of a header that announces more pixels than OpenCV reads
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"{path}: this PNG file is damaged")
    if image.ndim == 3 and image.shape[2] > 3:
        raise InputError(f"{path}: expected a grey or colour image as in a data set, got one with opacity")
    return image if image.ndim == 2 else np.ascontiguousarray(image[..., ::-1])


IDENTITY = "dataset.json"
_ANNOTATIONS = "annotations.json"
LAYERS = ("frames", "depth", "instance", "semantic", "transmission", "sign_map", "signs")
"""Folders of the images."""

_RECORDS = "records"


class _ImageEntry(BaseModel, strict=True):
    """Fields of a frame's entry that a continued data set, or a reader of its COCO file, needs."""

    width: PositiveInt
    height: PositiveInt
    run: NonNegativeInt
    seed: NonNegativeInt
    step: NonNegativeInt


class _Record(BaseModel, strict=True):
    """File of one frame."""

    image: _ImageEntry
    annotations: list[dict[str, Any]]


class DatasetDirectory:
    """The directory of one data set, new or to be continued, with one writer at a time.

    A frame is complete when its record is written, after its images; only the data set's own files are replaced.
    `identity` is JSON data, and InputError is raised if the directory holds anything else. A data set without frames is
    begun again, whatever its identity.
    """

    def __init__(self, path: Path, identity: Mapping[str, Any]) -> None:
        self.path = Path(path)
        refuse_unwritable_folder(self.path)
        self.path.mkdir(parents=True, exist_ok=True)
        self._lock = WriterLock(self.path)
        try:
            self._check(dict(identity))
            # The data set's identity is written before anything else.
            write_json(self.path / IDENTITY, identity)
            for folder in (*LAYERS, _RECORDS):
                (self.path / folder).mkdir(exist_ok=True)
        except BaseException:
            self._lock.release()
            raise

    def close(self) -> None:
        """Release the lock."""
        self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _check(self, identity: dict[str, Any]) -> None:
        if not (self.path / IDENTITY).is_file():
            there = sorted(p.name for p in self.path.iterdir())
            begun = partial_path(self.path / IDENTITY).name
            strangers = [name for name in there if name not in (LOCK_NAME, begun)]
            if strangers:
                raise InputError(
                    f"{self.path} holds files that are no data set of FogSim's ({strangers[0]}, …); "
                    "choose another directory with --out"
                )
            return
        there = read_json(self.path / IDENTITY)
        if not isinstance(there, dict):
            raise InputError(f"{self.path / IDENTITY}: expected what a data set was made from, got {shown(there)}")
        unlike = _differences(there, json.loads(json.dumps(identity)))
        # Without frames, as after a simulation that could not start, its inputs may have been mended since.
        if unlike and (there.keys() != identity.keys() or any(self.path.glob("*/*"))):
            raise InputError(
                f"{self.path} holds another data set: {'; '.join(unlike[:4])}{' …' if len(unlike) > 4 else ''}. "
                "Choose another directory with --out, or continue that one as it was begun"
            )

    def has(self, number: int) -> bool:
        """Whether a frame has all its files and a complete record; otherwise it is made again."""
        return all(_is_whole(self._layer(layer, number)) for layer in LAYERS) and self._found(number) is not None

    def beyond(self, frames: int) -> int:
        """Number of all frames if there are more than `frames`, otherwise 0."""
        numbers = [int(p.stem) for p in (self.path / _RECORDS).glob("[0-9]*.json") if p.stem.isdecimal()]
        return len(numbers) if any(number >= frames for number in numbers) else 0

    def write(
        self, number: int, layers: Mapping[str, NDArray[np.uint8] | NDArray[np.uint16]], record: Mapping[str, Any]
    ) -> None:
        """Write a frame: its images, then its record; InputError if one of its files exists with other content."""
        for layer in LAYERS:
            path, data = self._layer(layer, number), png(layers[layer])
            # One that was cut off, as when a machine stops, is replaced.
            if path.exists() and not data.startswith(read_bytes(path)):
                raise InputError(
                    f"{path} is there and is not what this data set has there; move it away to have it made again"
                )
            write_bytes(path, data)
        write_json(self._record(number), {**record, "image": {**self._names(number), **record["image"]}})

    def record(self, number: int) -> dict[str, Any]:
        """Record of a frame that `has` reports; InputError if it is damaged."""
        found = self._found(number)
        if found is None:
            raise InputError(f"{self._record(number)}: damaged; the same command makes its frame again")
        return found

    def _found(self, number: int) -> dict[str, Any] | None:
        """Record of a frame; None if it is missing or damaged."""
        try:
            found = read_json(self._record(number))
            entry = _Record.model_validate(found).image
        except (InputError, ValidationError):
            return None
        is_own = found["image"].items() >= self._names(number).items() and entry.run <= number
        return cast("dict[str, Any]", found) if is_own else None

    def _names(self, number: int) -> dict[str, str]:
        """Files of a frame, from its record."""
        return {_key(layer): self._layer(layer, number).relative_to(self.path).as_posix() for layer in LAYERS}

    def write_annotations(self, annotations: Mapping[str, Any]) -> None:
        """Write the COCO file, replacing an existing one."""
        write_json(self.path / _ANNOTATIONS, annotations)

    def _layer(self, layer: str, number: int) -> Path:
        return self.path / layer / f"{number:06d}.png"

    def _record(self, number: int) -> Path:
        return self.path / _RECORDS / f"{number:06d}.json"


def _is_whole(image: Path) -> bool:
    """Whether a PNG file is there and not cut off."""
    try:
        with open_regular(image) as file:
            file.seek(-len(PNG_END), os.SEEK_END)
            return file.read() == PNG_END
    except (InputError, OSError):
        return False


def _key(layer: str) -> str:
    """Name of a layer's file in a record: COCO's own for the frame."""
    return "file_name" if layer == "frames" else f"{layer}_file"


def _differences(there: Any, wanted: Any, place: str = "") -> list[str]:
    """Difference between two plain values, in words."""
    if isinstance(there, dict) and isinstance(wanted, dict):
        keys = sorted(there.keys() | wanted.keys())
        return [d for key in keys for d in _differences(there.get(key), wanted.get(key), f"{place}.{key}".lstrip("."))]
    if there == wanted:
        return []
    return [f"{place} is {json.dumps(there)} there, and {json.dumps(wanted)} was asked for"]
