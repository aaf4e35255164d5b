"""Overlays in a file: a video, or a picture of a single image."""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from fogsim.errors import InputError
from fogsim.files.atomic import partial_path, publish
from fogsim.offline.estimation import FrameEstimates
from fogsim.offline.overlay import Overlay
from fogsim.offline.source import Source
from fogsim.recorders.video import Encoder, encoder_command
from fogsim.values import Camera

PICTURE_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}
"""Endings of pictures and what they are called in Pillow."""


class OverlayFile:
    """Writes overlays under a temporary name, which becomes the file's own when all are written.

    A context manager; left by an error, it leaves no file. Images that could not be used are not in it.

    Parameters
    ----------
    path : Path
        The file: ``.mp4``, or for a single image also ``.png`` or ``.jpg``.
    source : Source
        What is estimated.
    camera : Camera
        Its calibration.
    methods : sequence of str
        Names of the methods in the order of the estimates.
    overwrite : bool
        Replace a file that is there.

    Raises
    ------
    InputError
        If the ending is another or does not suit the source, the folder is not there, the file is there and not to be
        replaced, or it is one of those that are read.
    """

    def __init__(
        self, path: Path, source: Source, camera: Camera, methods: Sequence[str], *, overwrite: bool = False
    ) -> None:
        _check(path, source, overwrite)
        self._path = path
        self._period = source.period
        self._overlay = Overlay(camera, methods)
        self._encoder: Encoder | None = None
        self._format = PICTURE_FORMATS.get(path.suffix.lower())
        self._written = False

    def add(self, result: FrameEstimates) -> None:
        """Add an image with its estimates."""
        if result.picture.image is None:
            return
        drawn = self._overlay.draw(result)
        if self._format is not None:
            drawn.save(partial_path(self._path), self._format)
        else:
            if self._encoder is None:
                command = encoder_command(partial_path(self._path), self._period, self._overlay.size)
                self._encoder = Encoder(command)
            self._encoder.write(drawn.tobytes())
        self._written = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self._encoder is not None:
                self._encoder.finish()
            if kind is None and self._written:
                publish(self._path)
        finally:
            partial_path(self._path).unlink(missing_ok=True)


def _check(path: Path, source: Source, overwrite: bool) -> None:
    ending = path.suffix.lower()
    if ending != ".mp4" and ending not in PICTURE_FORMATS:
        raise InputError(
            f"--overlay {path}: expected a name that ends in .mp4, .png or .jpg, got {ending or 'no ending'}"
        )
    if ending != ".mp4" and (source.count > 1 or source.temporal):
        raise InputError(f"--overlay {path}: a picture holds one image, and this is {source.description}: use .mp4")
    if not path.parent.is_dir():
        raise InputError(f"--overlay {path}: there is no folder {path.parent}")
    if any(one.exists() and path.exists() and path.samefile(one) for one in source.paths):
        raise InputError(f"--overlay {path} would replace what is read; give another name")
    if path.exists() and not overwrite:
        raise InputError(f"--overlay {path} is there already; --overwrite replaces it")
