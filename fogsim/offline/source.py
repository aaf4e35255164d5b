"""Sources of images: image files and videos."""

import re
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.offline.image_files import Pixels, read_image
from fogsim.recorders.video import ffmpeg_program


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
    """

    name: str | int
    time: float
    image: Pixels | None
    error: str = ""


class Source(Protocol):
    """A series of images."""

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
        """Number of images; approximate for a video."""
        ...

    @property
    def description(self) -> str:
        """Short description of the source."""
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
                yield Picture(str(path), time, _red_first(read_image(path)))
            except InputError as error:
                yield Picture(str(path), time, None, str(error))


def _red_first(stored: Pixels) -> Pixels:
    """Grey unchanged, colours from blue-green-red to red-green-blue, without opacity."""
    if stored.ndim == 2:
        return stored
    if stored.shape[2] == 1:
        return stored[:, :, 0].copy()
    return stored[:, :, 2::-1].copy(order="C")


_DURATION = re.compile(r"Duration: (\d+):(\d+):(\d+(?:\.\d+)?)")
_RATE = re.compile(r"Video:.*?(\d+(?:\.\d+)?k?) (?:fps|tbr)")
_ADDRESS = re.compile(r" @ 0x[0-9a-f]+")
MOST_MISSING = 0.5
"""Time by which a complete video's frames may end before its header's duration, as with longer sound [s]."""

MOST_SAID = 100_000
"""Bytes of ffmpeg's messages that are read."""

CONTAINERS = "mov,matroska,avi,mpeg,mpegvideo,mpegts,asf,flv,m4v,h264,hevc"
"""ffmpeg's names of the allowed formats: none that opens further files or addresses, such as a playlist."""

MOST_PIXELS = 16_384**2 // 2
"""Most pixels of a frame [px]."""

_HEADER_LINES = 3  # P6, size, largest value: https://netpbm.sourceforge.net/doc/ppm.html as ffmpeg writes it


@dataclass(frozen=True, slots=True)
class VideoFile:
    """A video; its frames have 8 bits a channel and are turned upright.

    Attributes
    ----------
    path : Path
        The file.
    temporal : bool
        Whether its frames are used in order; False treats each separately.
    size : tuple of int
        Columns and rows [px].
    period : float
        Time between two frames [s].
    duration : float
        Its length from its header [s]; 0 if unknown.
    """

    path: Path
    temporal: bool
    size: tuple[int, int]
    period: float
    duration: float

    @classmethod
    def open(cls, path: Path, temporal: bool = True) -> "VideoFile":
        """Read the header and the first frame of a video.

        Parameters
        ----------
        path : Path
            The file.
        temporal : bool
            Whether its frames are a sequence.

        Raises
        ------
        InputError
            If it cannot be read as one, or has no frames.
        """
        # ffmpeg would wait for a writer of a pipe.
        if not path.is_file():
            raise InputError(f"{path}: cannot be read: not a regular file")
        done = subprocess.run(  # noqa: S603 - imageio's own ffmpeg with arguments made here
            _command(path, "-frames:v", "1"), stdin=subprocess.DEVNULL, capture_output=True, check=False
        )
        told = done.stderr.decode(errors="replace")
        rate = _RATE.search(told)
        if rate is None:
            raise InputError(f"{path}: this is no video that can be read")
        header = done.stdout.split(b"\n", _HEADER_LINES)
        if len(header) <= _HEADER_LINES:
            raise InputError(f"{path}: this video has no frames that can be read")
        cols, rows = (int(part) for part in header[1].split())
        duration = _DURATION.search(told)
        seconds = 0.0
        if duration is not None:
            hours, minutes, rest = duration.groups()
            seconds = 3600.0 * int(hours) + 60.0 * int(minutes) + float(rest)
        return cls(path, temporal, (cols, rows), 1.0 / _number(rate[1]), seconds)

    @property
    def count(self) -> int:
        """Number of frames by the header."""
        return max(round(self.duration / self.period), 1)

    @property
    def description(self) -> str:
        """Size and rate."""
        kind = "" if self.temporal else ", each frame on its own"
        return f"a video of {self.size[0]} × {self.size[1]} pixels at {1.0 / self.period:.4g} frames a second{kind}"

    @property
    def paths(self) -> tuple[Path, ...]:
        """The path of the video."""
        return (self.path,)

    def pictures(self) -> Iterator[Picture]:
        """Read the frames; where the file is damaged, ffmpeg conceals or skips what it cannot decode.

        After the frames of a damaged video, or of one that ends early, a picture without image follows, whose
        ``error`` has the number of frames that were read and ffmpeg's first message.
        """
        read = 0
        # A file, not a pipe, which could fill up while frames are read.
        with (
            tempfile.TemporaryFile() as complaints,
            subprocess.Popen(  # noqa: S603 - imageio's own ffmpeg with arguments made here
                _command(self.path, log="error"), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=complaints
            ) as process,
        ):
            assert process.stdout is not None  # noqa: S101 - it was opened as a pipe
            try:
                for image in _frames(process.stdout):
                    yield Picture(read, read * self.period, image)
                    read += 1
                failed = process.wait() != 0
            finally:
                process.kill()
            complaints.seek(0)
            said = complaints.read(MOST_SAID).decode(errors="replace").splitlines()
        is_short = bool(self.duration) and self.count - read > max(MOST_MISSING / self.period, 2)
        if failed or said or is_short:
            frames = f"{read} of {self.count} frames" if is_short else f"{read} frames"
            reason = f" ({_ADDRESS.sub('', said[0])})" if said else ""
            message = f"{self.path}: the video is cut off or damaged: {frames} could be read{reason}"
            yield Picture(read, read * self.period, None, message)


def _number(text: str) -> float:
    """Rate as ffmpeg writes it: "90k" is 90,000."""
    return 1000.0 * float(text[:-1]) if text.endswith("k") else float(text)


def _command(path: Path, *limits: str, log: str = "info") -> list[str]:
    """Command line of a decoder that writes frames as PPM images, one behind the other."""
    allowed = ["-protocol_whitelist", "file", "-format_whitelist", CONTAINERS, "-max_pixels", str(MOST_PIXELS)]
    source = [*allowed, "-i", f"file:{path}", "-map", "0:v:0", *limits]
    return [
        ffmpeg_program(),
        "-hide_banner",
        "-nostdin",
        "-loglevel",
        log,
        *source,
        "-f",
        "image2pipe",
        "-c:v",
        "ppm",
        "-pix_fmt",
        "rgb24",
        "-",
    ]


def _frames(pipe: IO[bytes]) -> Iterator[NDArray[np.uint8]]:
    while pipe.readline():
        cols, rows = (int(part) for part in pipe.readline().split())
        pipe.readline()
        data = pipe.read(3 * cols * rows)
        if len(data) < 3 * cols * rows:
            return
        # A copy, since kernels would be compiled again for a read-only array.
        yield np.frombuffer(data, np.uint8).reshape(rows, cols, 3).copy()
