"""The directory of a data set: where its files are, whose it is, and what of it is there already."""

import json
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fogsim.dataset.encoding import png
from fogsim.errors import InputError
from fogsim.files.atomic import PARTIAL_SUFFIX, write_bytes, write_json
from fogsim.files.output_targets import refuse_unwritable_folder
from fogsim.files.writer_lock import LOCK_NAME, WriterLock

IDENTITY = "dataset.json"
ANNOTATIONS = "annotations.json"
LAYERS = ("frames", "depth", "instance", "semantic", "transmission", "sign_map", "signs")
"""Folders of the images."""

_RECORDS = "records"


class DatasetDirectory:
    """The directory of one data set, new or to be continued.

    A frame is there when its record is, which is written after its images. It has one writer at a time, and replaces
    no file but its own.

    Parameters
    ----------
    path : Path
        The directory; it is made with its parents if it is not there.
    identity : mapping
        What the data set is of; JSON values only.

    Raises
    ------
    InputError
        If the path is no directory, is written by another process, or holds something else than this data set.
    """

    def __init__(self, path: Path, identity: Mapping[str, Any]) -> None:
        self.path = Path(path)
        refuse_unwritable_folder(self.path)
        self.path.mkdir(parents=True, exist_ok=True)
        self._lock = WriterLock(self.path)
        try:
            self._check(dict(identity))
            # What is ours is told before anything is written.
            write_json(self.path / IDENTITY, identity)
            for folder in (*LAYERS, _RECORDS):
                (self.path / folder).mkdir(exist_ok=True)
        except BaseException:
            self._lock.release()
            raise

    def close(self) -> None:
        """Let others write."""
        self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _check(self, identity: dict[str, Any]) -> None:
        if not (self.path / IDENTITY).is_file():
            there = sorted(p.name for p in self.path.iterdir())
            strangers = [name for name in there if name not in (LOCK_NAME, IDENTITY + PARTIAL_SUFFIX)]
            if strangers:
                raise InputError(
                    f"{self.path} holds files that are no data set of FogSim's ({strangers[0]}, …); "
                    "choose another directory with --out"
                )
            return
        try:
            there = json.loads((self.path / IDENTITY).read_text(encoding="utf-8"))
        except ValueError as error:
            raise InputError(f"{self.path / IDENTITY} cannot be read: {error}") from error
        unlike = _differences(there, json.loads(json.dumps(identity)))
        if unlike:
            raise InputError(
                f"{self.path} holds another data set: {'; '.join(unlike[:4])}{' …' if len(unlike) > 4 else ''}. "
                "Choose another directory with --out, or continue that one as it was begun"
            )

    def has(self, number: int) -> bool:
        """Tell whether a frame is there with all its files.

        Parameters
        ----------
        number : int
            Its place in the data set, from 0.
        """
        files = [*(self._layer(layer, number) for layer in LAYERS), self._record(number)]
        return all(file.is_file() for file in files)

    def beyond(self, frames: int) -> int:
        """How many frames there are in all, where they are more than these; else 0.

        Parameters
        ----------
        frames : int
            How many are wanted.
        """
        numbers = [int(p.stem) for p in (self.path / _RECORDS).glob("*.json")]
        return len(numbers) if any(number >= frames for number in numbers) else 0

    def write(
        self, number: int, layers: Mapping[str, NDArray[np.uint8] | NDArray[np.uint16]], record: Mapping[str, Any]
    ) -> None:
        """Write a frame: its images, and then its record with their names.

        Parameters
        ----------
        number : int
            Its place in the data set, from 0.
        layers : mapping
            An image for each of `LAYERS`.
        record : mapping
            Its "image" and "annotations".

        Raises
        ------
        InputError
            If one of its files is there and is another: it is not of this data set, or was changed.
        """
        for layer in LAYERS:
            path, data = self._layer(layer, number), png(layers[layer])
            if path.exists() and path.read_bytes() != data:
                raise InputError(
                    f"{path} is there and is not what this data set has there; move it away to have it made again"
                )
            write_bytes(path, data)
        names = {_key(layer): self._layer(layer, number).relative_to(self.path).as_posix() for layer in LAYERS}
        write_json(self._record(number), {**record, "image": {**names, **record["image"]}})

    def record(self, number: int) -> dict[str, Any]:
        """Record of a frame that is there.

        Parameters
        ----------
        number : int
            Its place in the data set, from 0.

        Raises
        ------
        InputError
            If it cannot be read.
        """
        path = self._record(number)
        try:
            found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise InputError(f"{path} cannot be read: {error}; remove it to have its frame made again") from error
        return found

    def write_annotations(self, annotations: Mapping[str, Any]) -> None:
        """Write the COCO file, in place of one that is there.

        Parameters
        ----------
        annotations : mapping
            Its content; JSON values only.
        """
        write_json(self.path / ANNOTATIONS, annotations)

    def _layer(self, layer: str, number: int) -> Path:
        return self.path / layer / f"{number:06d}.png"

    def _record(self, number: int) -> Path:
        return self.path / _RECORDS / f"{number:06d}.json"


def _key(layer: str) -> str:
    """Name of a layer's file in a record: COCO's own for the frame."""
    return "file_name" if layer == "frames" else f"{layer}_file"


def _differences(there: Any, wanted: Any, place: str = "") -> list[str]:
    """What two plain values differ in, in words."""
    if isinstance(there, dict) and isinstance(wanted, dict):
        keys = sorted(there.keys() | wanted.keys())
        return [d for key in keys for d in _differences(there.get(key), wanted.get(key), f"{place}.{key}".lstrip("."))]
    if there == wanted:
        return []
    return [f"{place} is {json.dumps(there)} there, and {json.dumps(wanted)} was asked for"]
