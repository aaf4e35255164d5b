"""Videos that are read frame by frame by ffmpeg."""

import contextlib
import os
import re
import struct
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Self

import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.atomic import opened_alone, partial_path, publish
from fogsim.core.files.output_targets import refuse_unwritable
from fogsim.errors import FogSimError, InputError
from fogsim.offline.image_files import Pixels
from fogsim.offline.source import Picture, Source
from fogsim.recorders.video import Encoder, encoding_command, ffmpeg_program
from fogsim.values import Camera

_RATE_FACTOR = 12
"""Constant rate factor: distant road in fog differs by only a few pixel values, which must be kept."""

_TICKS = 90_000  # a second


class VideoWriter:
    """Writes frames at uneven times, whole or not at all; `rate_factor` is libx264's constant rate factor, 0 … 51."""

    def __init__(self, out: Path, rate_factor: int = _RATE_FACTOR) -> None:
        self._out, self._rate_factor = out, rate_factor
        self._encoder: Encoder | None = None
        self._lock = contextlib.ExitStack()
        self._leftovers: tuple[Path, ...] = ()
        self._last = -1  # tick of the last frame

    def write(self, frame: Pixels, time: float) -> None:
        """Add a frame (rows, cols, 3), red first, of the first frame's size, from a time on [s], or after the last."""
        rows, cols = frame.shape[:2]
        if self._encoder is None:
            part = partial_path(self._out)
            # Not the part itself: on SMB, only the descriptor that holds a lock can write.
            lock = part.with_name(f"{part.name}.lock")
            self._lock.enter_context(opened_alone(lock))
            self._leftovers = part, lock
            # The encoder could not replace what is write-protected, and would follow a link.
            part.unlink(missing_ok=True)
            *options, sink = encoding_command(part, ["-f", "ivf"], self._rate_factor)
            # By default, times are rounded to a guessed rate.
            self._encoder = Encoder([*options, "-enc_time_base", f"1:{_TICKS}", sink])
            self._encoder.write(struct.pack("<4sHH4sHHIIQ", b"DKIF", 0, 32, b"RGBA", cols, rows, _TICKS, 1, 0))
        pixels = np.full((rows, cols, 4), 255, np.uint8)
        pixels[..., :3] = frame
        self._last = max(round(time * _TICKS), self._last + 1)
        self._encoder.write(struct.pack("<IQ", pixels.nbytes, self._last) + pixels.tobytes())

    def __enter__(self) -> Self:
        """Begin; the file is created with the first frame."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the video its name; after an error, end its encoder at once and remove it."""
        with self._lock:
            try:
                if self._encoder is not None and kind is None:
                    _finish(self._encoder)
                    publish(self._out)
                elif self._encoder is not None:
                    _kill(self._encoder)
            finally:
                for leftover in self._leftovers:
                    leftover.unlink(missing_ok=True)


def _finish(encoder: Encoder) -> None:
    try:
        encoder.finish()
    except KeyboardInterrupt:
        _kill(encoder)
        raise


def _kill(encoder: Encoder) -> None:
    with contextlib.suppress(FogSimError):
        encoder.finish(0.0)


def left_out(source: Source) -> tuple[str, ...]:
    """What a video that is made of a source's frames lacks."""
    has_sound = isinstance(source, VideoFile) and source.has_sound
    return (f"the sound of {source.paths[0]}",) if has_sound else ()


def refuse_unfit_video(out: Path, read: tuple[Path, ...], camera: Camera, *, kind: str, overwrite: bool) -> None:
    """Raise InputError unless `out` is a writable ``.mp4`` and fits the camera; `kind` is for messages."""
    if out.suffix.lower() != ".mp4":
        raise InputError(f"--out {out}: a {kind} video is written as .mp4, got {out.suffix or 'no ending'}")
    refuse_unwritable(out, "--out", overwrite=overwrite, read=read, seeks=True)
    if camera.bits > 8:
        raise InputError(f"{read[0]}: frames have 8 bits, the camera {camera.bits}; leave `bits` out of its file")
    if camera.width % 2 or camera.height % 2:
        raise InputError(
            f"{read[0]}: frames of {camera.width} × {camera.height} pixels cannot be written as .mp4, which wants "
            "even numbers; cut a row or column off and give the camera of what is left"
        )


_DURATION = re.compile(r"Duration: (\d+):(\d+):(\d+(?:\.\d+)?)")
_STARTS = re.compile(r"Duration:.* start: (-?[\d.]+)(?:(?!Video:)[\s\S])*Video:.* start (-?[\d.]+)")
"""When a file begins and, if it is later, its first video [s]."""

_FROM_ZERO = re.compile(r"Input #0, (?:matroska|asf)[\s\S]*?Duration:.* start: ([\d.]+)")
"""When a file begins whose duration counts from time 0 [s], as that of a recording in segments."""

_RATE = re.compile(r"Video:.*?(\d+(?:\.\d+)?k?) (?:fps|tbr)")
_SOUND = re.compile(r"Stream #.*: Audio:")
_HIGH_RANGE = re.compile(r"Video:.*\b(arib-std-b67|smpte2084)\b")  # ITU-R BT.2100: HLG and PQ
_JOINED = "Found duplicated MOOV Atom"  # of an MP4 file that was appended to another
_ADDRESS = re.compile(r" @ 0x[0-9a-f]+")
_FRAME = re.compile(r"\[info\] n: *\d+ .*?pts_time:(\S+).*? s:(\d+)x(\d+)")
_ERROR, _TRANSPORT_STREAM, _AVI = "[error] ", "Input #0, mpegts", "Input #0, avi"
_PACKET_SIZES = (188, 192, 204)  # of MPEG transport streams: ISO/IEC 13818-1, with a time code, with error correction
_MOST_MISSING = 0.5
"""Time by which a complete video's frames or sound may end before its header's duration [s]."""

_BLOCK, _MOST_ERRORS = 100_000, 100

_CONTAINERS = "mov,matroska,avi,mpeg,mpegvideo,mpegts,asf,flv,m4v,h264,hevc"
"""ffmpeg's names of the allowed formats: none that opens further files or addresses, such as a playlist."""

_MOST_PIXELS = 16_384**2 // 2
"""Most pixels of a frame [px]."""

_SQUARE = "scale=w='if(gt(abs(sar-1),0.01),2*round(iw*sar/2),iw)':h=ih"
"""ffmpeg's filter that makes pixels square as players do, but for what rounding of a size makes of an aspect ratio."""

_HEADER_LINES = 3  # P6, size, largest value: https://netpbm.sourceforge.net/doc/ppm.html as ffmpeg writes it


@dataclass(frozen=True, slots=True)
class VideoFile:
    """A video; its frames have 8 bits a channel and square pixels, and are turned upright.

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
        Its length from the first frame by its header [s]; 0 if unknown.
    has_sound : bool
        Whether it has sound, which is not read.
    """

    path: Path
    temporal: bool
    size: tuple[int, int]
    period: float
    duration: float
    has_sound: bool = False

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
            If it cannot be read as one, has no frames, is several, or is HDR.
        """
        # ffmpeg would wait for a writer of a pipe.
        if not path.is_file():
            raise InputError(f"{path}: cannot be read: not a regular file")
        done = subprocess.run(  # noqa: S603 - imageio's own ffmpeg with arguments made here
            _command(path, "-frames:v", "1"), stdin=subprocess.DEVNULL, capture_output=True, check=False
        )
        header_text = done.stderr.decode(errors="replace")
        rate = _RATE.search(header_text)
        if rate is None:
            raise InputError(f"{path}: this is no video that can be read")
        if _JOINED in header_text:
            raise InputError(
                f"{path}: several videos one after another in a file, and ffmpeg reads the first alone; give them one "
                "by one, or join them with ffmpeg's concat demuxer"
            )
        if curve := _HIGH_RANGE.search(header_text):
            raise InputError(
                f"{path}: an HDR video ({curve[1]}), whose pixel values follow no `response` of a camera; record or "
                "convert it without HDR"
            )
        header = done.stdout.split(b"\n", _HEADER_LINES)
        if len(header) <= _HEADER_LINES:
            raise InputError(f"{path}: this video has no frames that can be read")
        cols, rows = (int(part) for part in header[1].split())
        duration = _DURATION.search(header_text)
        seconds = 0.0
        if duration is not None:
            hours, minutes, rest = duration.groups()
            seconds = 3600.0 * int(hours) + 60.0 * int(minutes) + float(rest)
            if begin := _FROM_ZERO.search(header_text):
                seconds -= float(begin[1])
            if starts := _STARTS.search(header_text):
                seconds -= max(float(starts[2]) - float(starts[1]), 0.0)
        return cls(
            path, temporal, (cols, rows), 1.0 / _number(rate[1]), seconds, _SOUND.search(header_text) is not None
        )

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
        """Read the frames with their times; where the file is damaged, ffmpeg conceals or skips what it cannot decode.

        A frame of another size than the first is a picture without image. After the frames of a damaged video, or of
        one that ends early, another follows, whose ``error`` has the number of frames that were read and ffmpeg's
        first message.
        """
        read, end = 0, 0.0
        # A file, not a pipe, which could fill up while frames are read.
        with (
            tempfile.TemporaryFile() as messages,
            subprocess.Popen(  # noqa: S603 - imageio's own ffmpeg with arguments made here
                _command(self.path), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=messages
            ) as process,
        ):
            assert process.stdout is not None  # noqa: S101 - it was opened as a pipe
            log = _Log(messages.fileno(), self.period)
            try:
                for image in _frames(process.stdout):
                    time, size = log.frame(read)
                    yield self._picture(read, time, image, size)
                    read, end = read + 1, time + self.period
                failed = process.wait() != 0
            finally:
                process.kill()
            log.read()
        errors = [
            *log.errors,
            *(["the last packet is incomplete"] if log.is_stream and self._ends_in_a_packet() else []),
        ]
        missing = self.duration - log.lead - end
        is_short = missing > max(_MOST_MISSING, 2.0 * self.period) and not self._has_whole_sound()
        if failed or errors or is_short:
            frames = f"{read} of {self.count} frames" if is_short else f"{read} frames"
            reason = f" ({errors[0]})" if errors else ""
            message = f"{self.path}: the video is cut off or damaged: {frames} could be read{reason}"
            yield Picture(read, end, None, message)

    def _picture(self, index: int, time: float, image: NDArray[np.uint8], size: tuple[int, int]) -> Picture:
        # ffmpeg scales all frames to the first's size.
        if size == self.size:
            return Picture(index, time, image)
        found, first = (f"{cols} × {rows}" for cols, rows in (size, self.size))
        return Picture(index, time, None, f"{self.path}, frame {index}: it has {found} pixels, the first frame {first}")

    def _has_whole_sound(self) -> bool:
        """Whether sound lasts as long as the header says: then it is longer than the frames, and nothing is cut off."""
        if not self.has_sound:
            return False
        copy = [*_reading(self.path), "-map", "0:a", "-c", "copy", "-progress", "-", "-f", "null", "-"]
        done = subprocess.run(copy, stdin=subprocess.DEVNULL, capture_output=True, check=False)  # noqa: S603 - as above
        ends = re.findall(rb"out_time_us=(\d+)", done.stdout)
        return bool(ends) and self.duration - 1e-6 * int(ends[-1]) <= _MOST_MISSING

    def _ends_in_a_packet(self) -> bool:
        size = self.path.stat().st_size
        return all(size % packet for packet in _PACKET_SIZES)


class _Log:
    """ffmpeg's messages in a file that it writes while it decodes: times and sizes of frames, and errors."""

    def __init__(self, file: int, period: float) -> None:
        self._file, self._period = file, period
        self._at, self._rest, self._shift = 0, b"", 0.0
        self._times: list[float] = []
        self._sizes: list[tuple[int, int]] = []
        self.errors: list[str] = []
        self.is_stream, self._is_avi = False, False
        self.lead = 0.0  # before the first frame in an AVI file, whose duration includes it [s]

    def frame(self, index: int) -> tuple[float, tuple[int, int]]:
        """Time of a frame that was written, from the first [s], by the rate if the file has none; columns and rows."""
        if len(self._times) <= index:
            self.read()
        return self._times[index] - self._times[0], self._sizes[index]

    def read(self) -> None:
        """Read what has been written since."""
        while data := os.pread(self._file, _BLOCK, self._at):
            self._at += len(data)
            *lines, self._rest = (self._rest + data).split(b"\n")
            for line in lines:
                self._take(line.decode(errors="replace"))

    def _take(self, line: str) -> None:
        if frame := _FRAME.search(line):
            after = self._times[-1] + self._period if self._times else 0.0
            time = after if frame[1] == "NOPTS" else float(frame[1]) + self._shift
            if self._times and time < self._times[-1]:
                # Time has begun again, as where one file was appended to another.
                self._shift, time = self._shift + after - time, after
            if self._is_avi and not self._times:
                self.lead = time
            elif self._is_avi and len(self._times) == 1 and time - after > _MOST_MISSING:
                # Later segments have their first frame at 0, and nothing more up to their beginning.
                self.lead, self._shift, time = time - after, after - time, after
            self._times.append(time)
            self._sizes.append((int(frame[2]), int(frame[3])))
        elif _ERROR in line and len(self.errors) < _MOST_ERRORS:
            self.errors.append(_ADDRESS.sub("", line).replace(_ERROR, "").strip())
        elif _TRANSPORT_STREAM in line:
            self.is_stream = True
        elif _AVI in line:
            self._is_avi = True


def _number(text: str) -> float:
    """Rate as ffmpeg writes it: "90k" is 90,000."""
    return 1000.0 * float(text[:-1]) if text.endswith("k") else float(text)


def _command(path: Path, *limits: str) -> list[str]:
    """Command line of a decoder that writes each frame as a PPM image, and its time among its messages."""
    source = ["-map", "0:v:0", "-vf", f"{_SQUARE},showinfo=checksum=0", *limits]
    # Neither repeated nor dropped for a constant rate; numbered, since ffmpeg complains of times that do not increase.
    timing = ["-fps_mode", "passthrough", "-bsf:v", "setts=ts=N"]
    sink = [*timing, "-f", "image2pipe", "-c:v", "ppm", "-pix_fmt", "rgb24", "-"]
    return [*_reading(path), *source, *sink]


def _reading(path: Path) -> list[str]:
    """The beginning of command lines that read a video."""
    allowed = ["-protocol_whitelist", "file", "-format_whitelist", _CONTAINERS, "-max_pixels", str(_MOST_PIXELS)]
    options = ["-hide_banner", "-nostdin", "-nostats", "-loglevel", "level+info", *allowed]
    return [ffmpeg_program(), *options, "-i", f"file:{path}"]


def _frames(pipe: IO[bytes]) -> Iterator[NDArray[np.uint8]]:
    while pipe.readline():
        cols, rows = (int(part) for part in pipe.readline().split())
        pipe.readline()
        data = pipe.read(3 * cols * rows)
        if len(data) < 3 * cols * rows:
            return
        # A copy, since kernels would be compiled again for a read-only array.
        yield np.frombuffer(data, np.uint8).reshape(rows, cols, 3).copy()
