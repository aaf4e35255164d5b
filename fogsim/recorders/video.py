"""The run as a video."""

import subprocess
import tempfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import imageio_ffmpeg
from PIL import Image

from fogsim.core.files.atomic import partial_path, publish
from fogsim.errors import FogSimError, MissingDependencyError
from fogsim.recorders.panel.camera_picture import draw_camera_picture
from fogsim.recorders.panel.frame_panel import FRAME_HEIGHT, FRAME_WIDTH, FramePanel
from fogsim.recorders.protocol import Derived
from fogsim.values import Step

CLOSING_LIMIT = 5.0
"""Time that the encoder gets to end when a run is cut short [s]; it takes a tenth of it."""


class VideoRecorder:
    """Writes a video (H.264, yuv420p), camera and panel, every `frame_period` [s]; none of a run without steps."""

    def __init__(
        self, path: Path, frame_period: float, draw_picture: Callable[[Step], Image.Image] = draw_camera_picture
    ) -> None:
        self._path = path
        self._panel = FramePanel(draw_picture)
        self._command = encoder_command(partial_path(path), frame_period)
        self._encoder: Encoder | None = None

    def record(self, step: Step, derived: Derived) -> None:
        """Add a frame."""
        frame = self._panel.draw(step, derived).tobytes()
        if self._encoder is None:
            self._encoder = Encoder(self._command)
        self._encoder.write(frame)

    def close(self, complete: bool) -> None:
        """Finish the video; after an interruption it holds what was recorded until then."""
        if self._encoder is None:
            return
        try:
            self._encoder.finish(None if complete else CLOSING_LIMIT)
            publish(self._path)
        except FogSimError:
            self._encoder = None
            raise
        self._encoder = None


class Encoder:
    """An ffmpeg process that eats raw frames."""

    def __init__(self, command: list[str]) -> None:
        # Its complaints go to a file, since no one reads a pipe while frames are written.
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 - closed in `finish`
        # A process group of its own: Ctrl-C in a terminal reaches the whole group of FogSim, and would end the
        # encoder before it has written the index without which the video cannot be played.
        self._process = subprocess.Popen(  # noqa: S603 - imageio's own ffmpeg with arguments made here
            command,
            bufsize=0,  # nothing is left to be written to an encoder that may have stopped
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._complaints,
            process_group=0,
        )

    def write(self, frame: bytes) -> None:
        """Hand over one frame."""
        assert self._process.stdin is not None  # noqa: S101 - it was opened as a pipe
        rest = memoryview(frame)
        try:
            while rest:
                rest = rest[self._process.stdin.write(rest) :]
        except OSError as error:
            raise FogSimError(f"the video encoder has ended: {self._said()}") from error

    def finish(self, limit: float | None = None) -> None:
        """Let the encoder write what it has and wait for its end (`limit` [s])."""
        assert self._process.stdin is not None  # noqa: S101 - it was opened as a pipe
        self._process.stdin.close()
        try:
            self._process.wait(limit)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            self._complaints.close()
            raise FogSimError(f"the video encoder did not end within {limit:g} s, and was killed") from None
        said = self._said()
        self._complaints.close()
        if self._process.returncode != 0:
            raise FogSimError(f"the video could not be written: {said}")

    def _said(self) -> str:
        self._complaints.seek(0)
        return self._complaints.read().decode(errors="replace").strip() or "no message"


def encoder_command(
    path: Path, frame_period: float, size: tuple[int, int] = (FRAME_WIDTH, FRAME_HEIGHT), rate_factor: int = 20
) -> list[str]:
    """Command line of an encoder that takes raw frames and writes an mp4 file that browsers can play."""
    rate = Fraction(1.0 / frame_period).limit_denominator(1001)
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", str(rate)]
    return encoding_command(path, source, rate_factor)


def encoding_command(path: Path, source: list[str], rate_factor: int) -> list[str]:
    """Command line that encodes what comes from a pipe, of the format by ffmpeg's options, at the times it has."""
    coding = ["-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", str(rate_factor), "-pix_fmt", "yuv420p"]
    sink = ["-fps_mode", "passthrough", "-movflags", "+faststart", "-f", "mp4", f"file:{path}"]
    return [ffmpeg_program(), "-y", "-loglevel", "error", *source, "-i", "-", *coding, *sink]


def encoder_report() -> str:
    """Say in a few words which video encoder is there."""
    path = ffmpeg_program()
    return f"ffmpeg {imageio_ffmpeg.get_ffmpeg_version()} at {path}"


def ffmpeg_program() -> str:
    """Path of the ffmpeg that comes with imageio-ffmpeg."""
    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError as error:
        raise MissingDependencyError(
            "videos need ffmpeg, which comes with the Python package imageio-ffmpeg: pip install imageio-ffmpeg"
        ) from error
