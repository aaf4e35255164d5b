"""Sources of images: image files and animations."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from PIL import Image, ImageSequence

from fogsim.errors import InputError
from fogsim.offline.image_files import ANIMATED_FORMATS, IMAGE_FAULTS, Pixels, read_image


@dataclass(frozen=True, slots=True)
class Picture:
    """One image of a source, or the reason why it cannot be read.

    Attributes
    ----------
    name : str or int
        The file's path as given, or the index of the frame in its video, from 0.
    time : float
        Its instant from the source's start [s].
    image : (rows, cols) or (rows, cols, 3) uint8 or uint16, or None
        Pixel values, red first; None if it cannot be read.
    error : str
        Why it cannot be read or used, otherwise empty.
    opacity : (rows, cols) uint8 or uint16, or None
        Opacity of a file whose pixels are not all opaque.
    """

    name: str | int
    time: float
    image: Pixels | None
    error: str = ""
    opacity: Pixels | None = None


class Source(Protocol):
    """A series of images."""

    @property
    def period(self) -> float:
        """Time from one image to the next [s]."""

    @property
    def temporal(self) -> bool:
        """Whether each image shows the same drive a moment after the one before."""

    @property
    def count(self) -> int:
        """Number of images; approximate for a video."""

    @property
    def description(self) -> str:
        """Short description of the source."""

    @property
    def paths(self) -> tuple[Path, ...]:
        """The files that are read."""

    def pictures(self) -> Iterator[Picture]:
        """Read the images."""


@dataclass(frozen=True, slots=True)
class ImageFiles:
    """Image files.

    Attributes
    ----------
    paths : tuple of Path
        The files, in their order.
    temporal : bool
        Whether they are a sequence.
    period : float
        Time between two of a sequence [s].
    remarks : tuple of str
        What was assumed of them, and files of their folders that are left out.
    """

    paths: tuple[Path, ...]
    temporal: bool
    period: float
    remarks: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of files."""
        return len(self.paths)

    @property
    def description(self) -> str:
        """Number of files, and whether they are a sequence."""
        if self.count == 1:
            return "1 image"
        kind = f"a sequence of {1.0 / self.period:g} a second" if self.temporal else "stills, each on its own"
        return f"{self.count} images, taken as {kind}"

    def pictures(self) -> Iterator[Picture]:
        """Read the files; an unreadable one has its reason in ``error``."""
        for index, path in enumerate(self.paths):
            time = index * self.period if self.temporal else 0.0
            try:
                stored = read_image(path)
                yield Picture(str(path), time, _red_first(stored), opacity=_opacity(stored))
            except InputError as error:
                yield Picture(str(path), time, None, str(error))


def _red_first(stored: Pixels) -> Pixels:
    """Grey unchanged, colours from blue-green-red to red-green-blue, without opacity."""
    if stored.ndim == 2:
        return stored
    if stored.shape[2] == 1:
        return stored[:, :, 0].copy()
    return stored[:, :, 2::-1].copy(order="C")


def _opacity(stored: Pixels) -> Pixels | None:
    if stored.ndim == 2 or stored.shape[2] < 4 or np.all(stored[:, :, 3] == np.iinfo(stored.dtype).max):
        return None
    return stored[:, :, 3].copy()


@dataclass(frozen=True, slots=True)
class Animation:
    """A GIF, WebP or PNG file with several frames."""

    path: Path  # The file
    temporal: bool  # Whether its frames are used in order
    times: tuple[float, ...]  # When each frame begins [s]

    @classmethod
    def open(cls, path: Path, temporal: bool = True) -> "Animation | None":
        """The frames of a file; None if it has one alone or is no such image."""
        if not path.is_file():
            return None  # a pipe would be waited for
        try:
            with Image.open(path) as image:
                if image.format not in ANIMATED_FORMATS or getattr(image, "n_frames", 1) == 1:
                    return None
                times = [0.0]
                for frame in ImageSequence.Iterator(image):
                    frame.load()
                    times.append(times[-1] + 1e-3 * (frame.info.get("duration", 0) or _USUAL_FRAME_MS))
        except IMAGE_FAULTS:
            return None  # `read_image` says why
        return cls(path, temporal, tuple(times[:-1]))

    @property
    def period(self) -> float:
        """Mean time from one frame to the next [s]."""
        return self.times[-1] / (self.count - 1)

    @property
    def count(self) -> int:
        """Number of frames."""
        return len(self.times)

    @property
    def description(self) -> str:
        """Number of frames and length."""
        kind = "" if self.temporal else ", each on its own"
        return f"an animation of {self.count} frames in {self.times[-1] + self.period:.4g} s{kind}"

    @property
    def paths(self) -> tuple[Path, ...]:
        """The path of the file."""
        return (self.path,)

    def pictures(self) -> Iterator[Picture]:
        """Read the frames; where the file is cut off, a picture without image follows the last."""
        with Image.open(self.path) as image:
            for index, time in enumerate(self.times):
                try:
                    image.seek(index)
                    yield Picture(index, time, np.array(image.convert("RGB")))
                except IMAGE_FAULTS as error:
                    yield Picture(index, time, None, f"{self.path}: the animation is damaged or cut off: {error}")
                    return


_USUAL_FRAME_MS = 100
"""Duration of a frame that states none, as browsers show it [ms]."""
