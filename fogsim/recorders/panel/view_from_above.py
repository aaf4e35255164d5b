"""A picture of a run without a camera: road, vehicles and fog about the ego, as seen from above."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from fogsim.recorders.panel.frame_panel import PICTURE_SIZE
from fogsim.recorders.style import ADVICE, AMBER, LINE, TEXT, TRUTH, font
from fogsim.values import Lamp, Step
from fogsim.values.traffic import with_pieces

SCALE = 1.6
"""Pixels a metre."""

_BEHIND = 80.0
"""How far behind the ego the picture reaches [m]."""

_CELL = 10
"""Side of the squares of even fog [px]."""

Extinctions = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Gives the extinction coefficient at (n, m, 3) places [1/m]."""

_CLEAR, _DENSE = 1e-3, 0.15
"""Extinction coefficients of the darkest and the brightest fog [1/m]: V_met of 3 km and of 20 m."""

_DARKEST, _BRIGHTEST = 26.0, 150.0

_LONGER, _WIDER = 1.5, 3.0
"""Vehicles are drawn longer and wider than they are, so that they can be distinguished."""


def draw_view_from_above(step: Step, extinction: Extinctions) -> Image.Image:
    """Draw a step, the ego heading to the right: the denser the fog, the brighter; an arc where the sight ends."""
    axes = _axes(step)
    picture = _fog(step, axes, extinction)
    draw = ImageDraw.Draw(picture)
    if step.truth.route is not None:
        draw.line([tuple(point) for point in _pixels(step.truth.route, step, axes)], fill=LINE, width=round(8 * SCALE))
    _draw_sight(draw, step, axes)
    traffic, body = with_pieces(step.traffic, None)
    drawn = replace(step, traffic=traffic)
    for row, vehicle in enumerate(body.tolist()):
        _draw_vehicle(draw, drawn, row, axes, vehicle == step.ego)
    _draw_scale(draw)
    return picture


def _axes(step: Step) -> NDArray[np.float64]:
    """Unit vectors ahead and to the right of the ego, as rows."""
    heading = float(step.traffic.heading[step.ego])
    return np.array([[math.cos(heading), math.sin(heading)], [math.sin(heading), -math.cos(heading)]])


def _pixels(points: NDArray[np.float64], step: Step, axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2): columns and rows of places."""
    offsets = points[:, None, :2] - step.traffic.position[step.ego, :2]
    ahead_and_right: NDArray[np.float64] = (offsets * axes).sum(axis=-1)
    return SCALE * ahead_and_right + (_BEHIND * SCALE, PICTURE_SIZE[1] / 2)


def _fog(step: Step, axes: NDArray[np.float64], extinction: Extinctions) -> Image.Image:
    """The extinction coefficient as a grey map, in equal steps of its logarithm."""
    width, height = PICTURE_SIZE
    columns, rows = np.meshgrid(np.arange(_CELL / 2, width, _CELL), np.arange(_CELL / 2, height, _CELL))
    ahead, right = columns / SCALE - _BEHIND, (rows - height / 2) / SCALE
    places = np.zeros((*ahead.shape, 3))
    places[..., :2] = ahead[..., None] * axes[0] + right[..., None] * axes[1] + step.traffic.position[step.ego, :2]
    places[..., 2] = step.traffic.position[step.ego, 2] + 1.2
    share = np.log(np.clip(extinction(places), _CLEAR, _DENSE) / _CLEAR) / math.log(_DENSE / _CLEAR)
    grey = np.round(_DARKEST + (_BRIGHTEST - _DARKEST) * share).astype(np.uint8)
    return Image.fromarray(grey).resize(PICTURE_SIZE, Image.Resampling.BILINEAR).convert("RGB")


def _draw_sight(draw: ImageDraw.ImageDraw, step: Step, axes: NDArray[np.float64]) -> None:
    sight = step.truth.visibility_ahead * SCALE
    if sight < 10.0 * PICTURE_SIZE[0]:
        (column, row), *_ = _pixels(step.traffic.position[step.ego : step.ego + 1], step, axes)
        draw.arc([column - sight, row - sight, column + sight, row + sight], -30.0, 30.0, fill=TRUTH, width=2)


def _draw_vehicle(draw: ImageDraw.ImageDraw, step: Step, row: int, axes: NDArray[np.float64], is_ego: bool) -> None:
    traffic = step.traffic
    heading, length = float(traffic.heading[row]), float(traffic.length[row]) * _LONGER
    forward, half = np.array([math.cos(heading), math.sin(heading)]), float(traffic.width[row]) * _WIDER / 4.0
    left, front = np.array([-forward[1], forward[0]]), traffic.position[row, :2]
    corners = np.array([front + half * left, front - half * left])
    outline = np.concatenate([corners, corners[::-1] - length * forward])
    colour = ADVICE if is_ego else AMBER if Lamp.STOP & int(traffic.lamps[row]) else TEXT
    draw.polygon([tuple(point) for point in _pixels(outline, step, axes)], fill=colour, outline=LINE)


def _draw_scale(draw: ImageDraw.ImageDraw) -> None:
    left, row = 16, PICTURE_SIZE[1] - 18
    draw.line([(left, row), (left + 100 * SCALE, row)], fill=TEXT, width=2)
    draw.text((left, row - 6), "100 m", fill=TEXT, font=font(11), anchor="ls")
    text = "the brighter, the denser the fog; arc: end of sight; vehicles longer and wider than they are"
    draw.text((left, 20), text, fill=TEXT, font=font(11), anchor="ls")
