"""A picture like zhu2015's figures 5 and 6: region, lane lines, horizon, inflection and the road's curve."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fogsim.estimators import make
from fogsim.estimators.zhu2015 import GROWTH, GROWTH_SHARE
from fogsim.estimators.zhu2015_road import SeenRoad, Zhu2015Repair, seen_road
from fogsim.recorders.style import font
from fogsim.reproduce.road_sweeps import Moment, observed
from fogsim.values import Camera, Observation
from fogsim.vision.lines.horizon import PITCH_DEVIATION
from fogsim.vision.region.road_region import region_medians

_PICTURED = (60.0, 200.0, 600.0, float("inf"))
"""Visibilities of the picture [m], one of each class."""

_SHOWN = 10_000
"""Visibility beyond which a number would say nothing [m]."""

_TITLE, _SKY = 25, 65
"""Height of the words, and rows above the horizon that are shown, the words among them [px]."""

_WHITE, _BLACK = (255, 255, 255), (0, 0, 0)
RED, _BLUE, GREEN, YELLOW = (230, 30, 30), (30, 60, 255), (60, 200, 90), (255, 210, 0)


def picture(moment: Moment, camera: Camera) -> NDArray[np.uint8]:
    """Draw an instant in four fogs, as published on the left and corrected on the right: (rows, cols, 3) uint8."""
    rows = []
    for visibility in _PICTURED:
        seen = observed(moment, camera, visibility, np.random.default_rng(0))
        rows.append(
            np.hstack([_panel(seen, camera, visibility, as_published=published) for published in (True, False)])
        )
    return np.vstack(rows)


def _panel(seen: Observation, camera: Camera, visibility: float, *, as_published: bool) -> NDArray[np.uint8]:
    estimate = make("zhu2015", camera, as_published=as_published).update(seen)
    image = np.array(seen.image, np.uint8)
    repairs: frozenset[Zhu2015Repair] = frozenset(() if as_published else Zhu2015Repair)
    road = seen_road(image, camera, PITCH_DEVIATION, (GROWTH, GROWTH_SHARE), repairs, seen.lead)
    drawing = Image.fromarray(_with_region(image, road))
    draw = ImageDraw.Draw(drawing)
    _draw_lines_and_curve(draw, road, camera.height - 1)
    for key, colour in (("horizon_row", _BLACK), ("inflection_row", _BLUE)):
        row = estimate.diagnostics.get(key)
        if isinstance(row, int | float):
            draw.line([(0, row), (camera.width, row)], fill=colour, width=2)
    name = "published" if as_published else "corrected"
    text = f"{_metres(estimate.visibility)}, {estimate.diagnostics['class']}" if estimate.valid else "no estimate"
    top = max(round(camera.horizon_row) - _SKY, 0)
    draw.rectangle((0, top, camera.width, top + _TITLE), fill=_WHITE)
    draw.text((10, top + 2), f"{name}: {text} (true: {_metres(visibility)})", fill=_BLACK, font=font(18, bold=True))
    return np.asarray(drawing)[top:]


def _metres(visibility: float) -> str:
    return f"{visibility:.0f} m" if visibility < _SHOWN else f"over {_SHOWN} m"


def _with_region(image: NDArray[np.uint8], road: SeenRoad) -> NDArray[np.uint8]:
    """Tint the grown region."""
    part, inside = image[road.image.first_row :], road.region != 0
    part[inside] = (0.75 * part[inside] + 0.25 * np.array(GREEN)).astype(np.uint8)
    return image


def _draw_lines_and_curve(draw: ImageDraw.ImageDraw, road: SeenRoad, bottom: int) -> None:
    """Lane lines up to the horizon, and median luminance of the region's rows."""
    first = road.image.first_row
    ends = (road.horizon.row - first, float(bottom - first))
    for line in road.lines:
        draw.line([(line.column(row), row + first) for row in ends], fill=RED, width=2)
    medians = region_medians(road.image.luminance, road.region)
    rows = np.flatnonzero(medians.number)
    draw.line([(float(medians.luminance[row]), float(row + first)) for row in rows], fill=YELLOW, width=2)
