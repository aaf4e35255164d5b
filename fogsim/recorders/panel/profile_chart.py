"""A small chart of the fog along the road: what is believed of each place, and what is true."""

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from fogsim.recorders.panel.strip_chart import Axis
from fogsim.recorders.style import ADVICE, BELIEF, BELIEF_BAND, GROUND, LINE, MUTED, TEXT, TRUTH, WELL, font
from fogsim.values import FogProfile

NEAREST, FARTHEST = -100.0, 500.0
"""Distances ahead at both ends of the chart [m]."""

_TICKS = (0.0, 200.0, 400.0)
_OVERSAMPLING = 2
_DOT = 5
"""Radius of the dot of a report, before the chart is shrunk [px]."""

_FOOT = 12
"""Space for the distances below the curves [px]."""


def draw_profile(
    size: tuple[int, int],
    axis: Axis,
    believed: FogProfile,
    true: FogProfile | None,
    reported: Sequence[tuple[float, float]] = (),
) -> Image.Image:
    """Draw the visibility at places along the road, the vehicle's own a fine line.

    Takes `size` [px], `axis` [m], `reported` (float, float).
    """
    width, height = size[0] * _OVERSAMPLING, (size[1] - _FOOT) * _OVERSAMPLING
    image = Image.new("RGB", (width, height), WELL)
    draw = ImageDraw.Draw(image)

    def points(profile: FogProfile, share: float) -> list[tuple[float, float]]:
        distances: Sequence[float] = np.linspace(NEAREST, FARTHEST, 49).tolist()
        inside = [one for one in distances if profile.distance[0] <= one <= profile.distance[-1]]
        return [(_across(one, width), _up(profile.visibility_quantile(one, share), axis, height)) for one in inside]

    for tick in axis.ticks:
        draw.line([(0, _up(tick, axis, height)), (width, _up(tick, axis, height))], fill=LINE, width=_OVERSAMPLING)
    draw.polygon(points(believed, 0.05) + points(believed, 0.95)[::-1], fill=BELIEF_BAND)
    draw.line([(_across(0.0, width), 0), (_across(0.0, width), height)], fill=TEXT, width=_OVERSAMPLING)
    draw.line(points(believed, 0.5), fill=BELIEF, width=2 * _OVERSAMPLING)
    if true is not None and true.distance.size > 1:
        told = points(true, 0.5)
        for start in range(0, len(told) - 1, 3):
            draw.line(told[start : start + 3], fill=TRUTH, width=2 * _OVERSAMPLING)
    for distance, visibility in reported:
        if NEAREST <= distance <= FARTHEST:
            x, y = _across(distance, width), _up(visibility, axis, height)
            draw.ellipse([(x - _DOT, y - _DOT), (x + _DOT, y + _DOT)], fill=ADVICE)
    chart = Image.new("RGB", size, GROUND)
    chart.paste(image.reduce(_OVERSAMPLING), (0, 0))
    draw = ImageDraw.Draw(chart)
    draw.text((5, 4), "visibility along the road [m]", fill=MUTED, font=font(10), anchor="lt")
    for tick in _TICKS:
        place = (_across(tick, width) / _OVERSAMPLING, size[1])
        draw.text(place, f"{tick:.0f}", fill=MUTED, font=font(9), anchor="mb")
    return chart


def _across(distance: float, width: int) -> float:
    return width * (distance - NEAREST) / (FARTHEST - NEAREST)


def _up(visibility: float, axis: Axis, height: int) -> float:
    margin = 3 * _OVERSAMPLING
    return height - margin - axis.height(visibility) * (height - 2 * margin)
