"""The camera's image as it stands in the video: scaled, with what the estimators found at its border."""

import math
from collections.abc import Sequence
from numbers import Real

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fogsim.recorders.sign_marks import draw_signs, sign_looks
from fogsim.recorders.style import AMBER, BELIEF, GROUND, Colour, font
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Estimate, Frame, Observation, Step
from fogsim.values.camera_response import eight_bit
from fogsim.vision.restoration import restore_contrast

WIDTH, HEIGHT = 640, 480
_ROWS: dict[str, tuple[str, Colour]] = {
    "horizon_row": ("horizon", BELIEF),
    "inflection_row": ("inflection", AMBER),
}
"""Rows in the diagnostics of an estimate that are marked, with label and colour."""


def draw_camera_picture(step: Step) -> Image.Image:
    """Draw the camera's image into 640 × 480 pixels, its aspect kept, with marks at rows and signs that were found."""
    pixels = shown_image(step.observation)
    picture = Image.new("RGB", (WIDTH, HEIGHT), GROUND)
    scaled = scale_image(pixels, WIDTH, HEIGHT)
    left, top = (WIDTH - scaled.width) // 2, (HEIGHT - scaled.height) // 2
    picture.paste(scaled, (left, top))
    scale = scaled.height / pixels.shape[0]
    draw = ImageDraw.Draw(picture)
    draw_signs(draw, sign_looks(step), scale, (left, top), scaled.size)
    for key, (label, colour) in _ROWS.items():
        row = _first_row(step.estimates, key)
        if row is not None and 0 <= row <= pixels.shape[0] - 1:
            # A pixel's centre has an integer coordinate, so the image begins half a pixel before row 0.
            _mark(draw, (left, left + scaled.width), top + (row + 0.5) * scale, label, colour)
    return picture


def shown_image(observation: Observation) -> NDArray[np.uint8]:
    """(rows, cols[, 3]) uint8: the image in 8 bits, whatever the camera has."""
    frame = observation.frame
    return eight_bit(frame.image, frame.camera.bits) if isinstance(frame, Frame) else eight_bit(frame, 8)


def scale_image(pixels: NDArray[np.uint8], width: int, height: int) -> Image.Image:
    """Scale an image into a box, its aspect kept (`width`, `height` [px])."""
    image = Image.fromarray(pixels).convert("RGB")
    factor = min(width / image.width, height / image.height)
    if factor == 1:
        return image
    size = (max(round(image.width * factor), 1), max(round(image.height * factor), 1))
    # Whole factors show the pixels as the estimators got them, at a tenth of the cost of an interpolation.
    whole = factor > 1 and factor == int(factor)
    return image.resize(size, Image.Resampling.NEAREST if whole else Image.Resampling.BILINEAR)


def _first_row(estimates: Sequence[Estimate], key: str) -> float | None:
    for estimate in estimates:
        row = found_row(estimate, key)
        if estimate.valid and row is not None:
            return row
    return None


def found_row(estimate: Estimate, key: str) -> float | None:
    """Row in the diagnostics of an estimate; None if there is none."""
    row = estimate.diagnostics.get(key)
    return float(row) if isinstance(row, Real) and math.isfinite(row) else None


def _mark(draw: ImageDraw.ImageDraw, sides: tuple[int, int], y: float, label: str, colour: Colour) -> None:
    for start, end in ((sides[0], sides[0] + 22), (sides[1] - 22, sides[1])):
        draw.line([(start, y), (end - 1, y)], fill=GROUND, width=4)
        draw.line([(start, y), (end - 1, y)], fill=colour, width=2)
    above = label == "horizon"
    place = (sides[1] - 5, y - 4 if above else y + 5)
    draw.text(
        place, label, fill=colour, font=font(10), anchor="rs" if above else "rt", stroke_width=2, stroke_fill=GROUND
    )


_FOGGY = 500.0
"""Visibility from which on fog takes too little contrast to be undone [m]."""

BRIGHT = 10.0
"""Illuminance below which lamps light the fog, which is not what is undone [lx]."""


def draw_restored_picture(step: Step) -> Image.Image:
    """Draw the camera's image; by day, in believed fog and calibrated, its right half is restored by the belief."""
    picture, frame = draw_camera_picture(step), step.observation.frame
    light = step.observation.light
    believed = step.belief.visibility
    if not isinstance(frame, Frame) or believed >= _FOGGY or (light is not None and light.illuminance < BRIGHT):
        return picture
    restored = restore_contrast(frame.image, frame.camera, OPTICAL_DEPTH_AT_VISIBILITY / believed, tone_map=True)
    scaled = scale_image(eight_bit(restored.image, frame.camera.bits), WIDTH, HEIGHT)
    left, top, middle = (WIDTH - scaled.width) // 2, (HEIGHT - scaled.height) // 2, scaled.width // 2
    picture.paste(scaled.crop((middle, 0, scaled.width, scaled.height)), (left + middle, top))
    draw = ImageDraw.Draw(picture)
    draw.line([(left + middle, top), (left + middle, top + scaled.height)], fill=BELIEF, width=1)
    label = f"contrast restored for {believed:.0f} m"
    draw.text((left + middle + 8, top + 16), label, fill=BELIEF, font=font(11), stroke_width=2, stroke_fill=GROUND)
    return picture
