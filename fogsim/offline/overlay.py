"""Images with the methods' results drawn over them, as a video or a single image."""

import io
import math
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fogsim.core.files.atomic import write_bytes
from fogsim.core.files.output_targets import refuse_unwritable
from fogsim.errors import InputError
from fogsim.offline.estimation import FrameEstimates
from fogsim.offline.image_files import Pixels
from fogsim.offline.results import denser_text, interval_text, metres
from fogsim.offline.source import Source
from fogsim.offline.video_source import VideoWriter
from fogsim.recorders.panel.camera_picture import found_row, scale_image
from fogsim.recorders.sign_marks import draw_signs
from fogsim.recorders.style import GROUND, MUTED, TEXT, Colour, font, method_colours
from fogsim.values import Camera, Estimate
from fogsim.values.camera_response import eight_bit

_WIDEST, _NARROWEST = 1280, 640
"""Width to which narrower and wider images are scaled [px]."""

_LOOKED_AT = 20
"""Constant rate factor of a video for viewing."""

_LINE = 30
"""Height of a line below the image [px]."""

_DASH, _GAP = 14, 10

_APART = 3.0
"""Rows nearer to one another than this share a line [px]."""


class Overlay:
    """Draws images of one camera in the same size, with a line for each method below the image."""

    def __init__(self, camera: Camera, methods: Sequence[str]) -> None:
        self._bits = camera.bits
        self._colours = method_colours(methods)
        self._scale = min(max(camera.width, _NARROWEST), _WIDEST) / camera.width
        # Videos of 4:2:0 have even sizes.
        width, height = (2 * math.ceil(self._scale * side / 2) for side in (camera.width, camera.height))
        self._picture_height = height
        self.size = (width, height + _LINE * (len(methods) + 1))

    def draw(self, result: FrameEstimates) -> Image.Image:
        """Draw an image and its estimates, as RGB."""
        canvas = Image.new("RGB", self.size, GROUND)
        if result.picture.image is not None:
            shown = _shown(result.picture.image, self._bits)
            canvas.paste(scale_image(shown, self.size[0], self._picture_height), (0, 0))
        draw = ImageDraw.Draw(canvas)
        draw_signs(draw, result.signs, self._scale, (0, 0), (self.size[0], self._picture_height))
        valid = [estimate for estimate in result.estimates if estimate.valid]
        for estimate in valid:
            self._draw_band(draw, estimate)
        self._draw_rows(draw, valid, "horizon", dashed=True)
        self._draw_rows(draw, valid, "inflection", dashed=False)
        self._draw_lines(draw, result)
        return canvas

    def _draw_band(self, draw: ImageDraw.ImageDraw, estimate: Estimate) -> None:
        band = estimate.diagnostics.get("band")
        if isinstance(band, tuple) and len(band) == 4:
            left, right, top, bottom = (float(side) for side in band)
            corners = (self._at(left - 0.5), self._at(top - 0.5), self._at(right + 0.5), self._at(bottom + 0.5) - 1)
            draw.rectangle(corners, outline=self._colours[estimate.method], width=2)

    def _draw_rows(self, draw: ImageDraw.ImageDraw, estimates: Sequence[Estimate], name: str, *, dashed: bool) -> None:
        """Draw one type of row for all methods; where some coincide, their colours alternate along it."""
        found = {e.method: row for e in estimates if (row := found_row(e, f"{name}_row")) is not None}
        for place, (method, row) in enumerate(found.items()):
            together = [other for other, its in found.items() if abs(its - row) * self._scale < _APART]
            turn = (together.index(method), len(together))
            self._draw_row(draw, row, self._colours[method], "" if place else name, turn, dashed=dashed)

    def _at(self, place: float) -> float:
        """Row or column of the drawing; a pixel's centre has an integer coordinate in the image."""
        return (place + 0.5) * self._scale

    def _draw_row(
        self,
        draw: ImageDraw.ImageDraw,
        row: float,
        colour: Colour,
        label: str,
        turn: tuple[int, int],
        *,
        dashed: bool,
    ) -> None:
        y = self._at(row)
        if not 0 <= y < self._picture_height:
            return
        width, (rank, sharers) = self.size[0], turn
        whole = not dashed and sharers == 1
        length = width if whole else _DASH if dashed else _DASH + _GAP
        for start in range(0 if whole else rank * (_DASH + _GAP), width, width if whole else sharers * (_DASH + _GAP)):
            draw.line([(start, y), (min(start + length, width), y)], fill=colour, width=2)
        # The horizon is above the inflection, so their labels never overlap.
        place = (width - 8, y - 4 if dashed else y + 4)
        anchor = "rs" if dashed else "rt"
        draw.text(place, label, fill=colour, font=font(13), anchor=anchor, stroke_width=2, stroke_fill=GROUND)

    def _draw_lines(self, draw: ImageDraw.ImageDraw, result: FrameEstimates) -> None:
        y = self._picture_height + _LINE // 2
        name = result.picture.name
        title = f"frame {name}, {result.picture.time:.2f} s" if isinstance(name, int) else name
        draw.text((12, y), title[-90:], fill=MUTED, font=font(13), anchor="lm")
        for estimate in result.estimates:
            y += _LINE
            _draw_estimate(draw, y, estimate, self._colours[estimate.method])


def _draw_estimate(draw: ImageDraw.ImageDraw, y: int, estimate: Estimate, colour: Colour) -> None:
    draw.text((12, y), estimate.method, fill=colour, font=font(15, bold=True), anchor="lm")
    if not estimate.valid:
        reason = f"no estimate: {estimate.diagnostics.get('reason', 'no reason given')}"
        draw.text((190, y), reason, fill=MUTED, font=font(13), anchor="lm")
        return
    draw.text((270, y), metres(estimate.visibility), fill=TEXT, font=font(17, bold=True), anchor="rm")
    draw.text((288, y), f"90 %: {interval_text(estimate)}", fill=MUTED, font=font(13), anchor="lm")
    category = estimate.category.value
    text = denser_text(estimate) or ("no fog" if category == "none" else f"{category} fog")
    draw.text((470, y), text, fill=TEXT, font=font(15), anchor="lm")


def _shown(image: Pixels, bits: int) -> NDArray[np.uint8]:
    """Image in 8 bits; one of 16 whose camera has 8 uses the whole range."""
    if image.dtype == np.uint8:
        return eight_bit(image, 8)
    return eight_bit(image, bits if bits > 8 else 16)


_PICTURE_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}
"""Suffixes of images, and their names in Pillow."""


class OverlayFile:
    """Writes overlays under a temporary name, which becomes the file's own when all are written.

    A context manager; after an error it leaves no file. Images that could not be used are left out.

    Parameters
    ----------
    path : path
        The file: ``.mp4``, or for a single image also ``.png`` or ``.jpg``.
    source : Source
        What is estimated.
    camera : Camera
        Its calibration.
    methods : sequence of str
        Names of the methods in the order of the estimates.
    overwrite : bool
        True to replace an existing file.

    Raises
    ------
    InputError
        If the suffix does not suit the source, or the file cannot be written or must not be replaced.
    """

    def __init__(
        self, path: str | Path, source: Source, camera: Camera, methods: Sequence[str], *, overwrite: bool = False
    ) -> None:
        self._path = path = Path(path)
        _check(path, source, overwrite)
        self._overlay = Overlay(camera, methods)
        self._video = VideoWriter(path, _LOOKED_AT)
        self._format = _PICTURE_FORMATS.get(path.suffix.lower())
        self._picture = b""
        # Stills all have the time 0, but for frames of a video.
        self._spacing, self._drawn = 0.0 if source.temporal else source.period, 0

    def add(self, result: FrameEstimates) -> None:
        """Add an image with its estimates.

        Parameters
        ----------
        result : FrameEstimates
            The image and its estimates.
        """
        if result.picture.image is None:
            return
        drawn = self._overlay.draw(result)
        if self._format is None:
            self._video.write(np.asarray(drawn), result.picture.time or self._drawn * self._spacing)
            self._drawn += 1
            return
        content = io.BytesIO()
        drawn.save(content, self._format)
        self._picture = content.getvalue()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._format is None:
            self._video.__exit__(kind, error, trace)
        elif kind is None and self._picture:
            write_bytes(self._path, self._picture)


def _check(path: Path, source: Source, overwrite: bool) -> None:
    ending = path.suffix.lower()
    if ending != ".mp4" and ending not in _PICTURE_FORMATS:
        raise InputError(
            f"--overlay {path}: expected a name that ends in .mp4, .png or .jpg, got {ending or 'no ending'}"
        )
    if ending != ".mp4" and (source.count > 1 or source.temporal):
        raise InputError(f"--overlay {path}: a picture holds one image, and this is {source.description}: use .mp4")
    refuse_unwritable(path, "--overlay", overwrite=overwrite, read=source.paths, seeks=ending == ".mp4")
