"""What images come from, and image files."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from fogsim.errors import InputError
from fogsim.offline.image_files import Pixels, read_image


@dataclass(frozen=True, slots=True)
class Picture:
    """One image of a source, or the reason why it cannot be read.

    Attributes
    ----------
    name : str or int
        The file's path as it was given, or the number of the frame in its video, counted from 0.
    time : float
        Its instant from the source's start [s].
    image : (rows, cols) or (rows, cols, 3) uint8 or uint16, or None
        Pixel values, red first; None if it cannot be read.
    error : str
        Why it cannot be read or used, else empty.
    """

    name: str | int
    time: float
    image: Pixels | None
    error: str = ""


class Source(Protocol):
    """Images one after another."""

    @property
    def period(self) -> float:
        """Time from one image to the next [s]."""
        ...

    @property
    def temporal(self) -> bool:
        """Whether each image shows the same drive a moment after the one before."""
        ...

    @property
    def count(self) -> int:
        """How many images there are; of a video, about how many."""
        ...

    @property
    def description(self) -> str:
        """What this is, in a few words."""
        ...

    @property
    def paths(self) -> tuple[Path, ...]:
        """The files that are read."""
        ...

    def pictures(self) -> Iterator[Picture]:
        """Read the images."""
        ...


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
    """

    paths: tuple[Path, ...]
    temporal: bool
    period: float

    @property
    def count(self) -> int:
        """Number of files."""
        return len(self.paths)

    @property
    def description(self) -> str:
        """How many, and whether they are taken as a sequence."""
        if self.count == 1:
            return "1 image"
        kind = f"a sequence of {1.0 / self.period:g} a second" if self.temporal else "stills, each on its own"
        return f"{self.count} images, taken as {kind}"

    def pictures(self) -> Iterator[Picture]:
        """Read the files; one that cannot be read has its reason in ``error``."""
        for index, path in enumerate(self.paths):
            time = index * self.period if self.temporal else 0.0
            try:
                yield Picture(str(path), time, _red_first(read_image(path)))
            except InputError as error:
                yield Picture(str(path), time, None, str(error))


def _red_first(stored: Pixels) -> Pixels:
    """Grey as it is, colours from blue-green-red to red-green-blue, without opacity."""
    if stored.ndim == 2:
        return stored
    if stored.shape[2] == 1:
        return stored[:, :, 0].copy()
    return stored[:, :, 2::-1].copy(order="C")
