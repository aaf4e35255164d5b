"""Videos that are written frame by frame with their times, and get their names when complete."""

import struct
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from fogsim.core.files.atomic import partial_path, publish
from fogsim.core.files.output_targets import refuse_unwritable
from fogsim.errors import InputError
from fogsim.offline.image_files import Pixels
from fogsim.recorders.video import Encoder, encoding_command
from fogsim.values import Camera

_RATE_FACTOR = 12
"""Constant rate factor: distant road in fog differs by only a few pixel values, which must be kept."""

_TICKS = 90_000  # a second


class VideoWriter:
    """Writes a video of frames at uneven times; as a context, it names the file only after success.

    `rate_factor` is libx264's constant rate factor, 0 … 51.
    """

    def __init__(self, out: Path, rate_factor: int = _RATE_FACTOR) -> None:
        self._out, self._rate_factor = out, rate_factor
        self._encoder: Encoder | None = None

    def write(self, frame: Pixels, time: float) -> None:
        """Add a frame (rows, cols, 3), red first, of the first frame's size, from a time on [s] later than the last."""
        rows, cols = frame.shape[:2]
        if self._encoder is None:
            self._encoder = Encoder(encoding_command(partial_path(self._out), ["-f", "ivf"], self._rate_factor))
            self._encoder.write(struct.pack("<4sHH4sHHIIQ", b"DKIF", 0, 32, b"RGBA", cols, rows, _TICKS, 1, 0))
        pixels = np.full((rows, cols, 4), 255, np.uint8)
        pixels[..., :3] = frame
        self._encoder.write(struct.pack("<IQ", pixels.nbytes, round(time * _TICKS)) + pixels.tobytes())

    def __enter__(self) -> Self:
        """Begin; the file is created with the first frame."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the video its name, or remove it."""
        try:
            if self._encoder is not None:
                self._encoder.finish()
                if kind is None:
                    publish(self._out)
        finally:
            partial_path(self._out).unlink(missing_ok=True)


def refuse_unfit_video(out: Path, read: tuple[Path, ...], camera: Camera, *, kind: str, overwrite: bool) -> None:
    """Raise InputError unless `out` is a writable ``.mp4`` and the camera's size is even; `kind` is for messages."""
    if out.suffix.lower() != ".mp4":
        raise InputError(f"--out {out}: a {kind} video is written as .mp4, got {out.suffix or 'no ending'}")
    refuse_unwritable(out, "--out", overwrite=overwrite, read=read, seeks=True)
    if camera.width % 2 or camera.height % 2:
        raise InputError(
            f"{read[0]}: frames of {camera.width} × {camera.height} pixels cannot be written as .mp4, which wants "
            "even numbers; cut a row or column off and give the camera of what is left"
        )
