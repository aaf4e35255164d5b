"""The vanishing point of the lines along a road, near where the calibration expects it."""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.horizon import Horizon, weighted_mean
from fogsim.vision.lines.road_line_kernels import (
    LEAST_POINTS,
    LEAST_TURN,
    Points,
    RoadLines,
    fit_road_lines,
    hough_road_lines,
    may_lie_on_road,
    refitted_lines,
    row_points,
)
from fogsim.vision.lines.vanishing_point import VanishingPoint, all_pairs, crossings, sloped_lines, supports

Floats = NDArray[np.float64]

_MOST_ROWS = 100
"""Rows that are looked at, evenly from below the horizon to the image's bottom."""

_CLEAR_OF_HORIZON = 0.025
"""Angle below the horizon from which lines are looked at: 50 to 60 m ahead [rad]."""

_YAW, _YAW_STEP = math.radians(4.0), 0.006
"""How far the road may run to either side of the camera's axis, and the step in which that is tried [rad]."""

_STEEPEST, _SLOPE_STEP = 6.5, 0.035
"""Columns per row of lines that are sought, and the cells of their slopes [-]."""

MOST_LINES = 12
"""Lines that are kept."""

_TOLERANCE = 3.0
"""How far a line may pass by the point in which the others meet [px]."""

BEND = 5e-4
"""Standard deviation of a road's bend, half its curvature times the camera's height [-]: a radius of 1500 m."""

_FLAT, _DRAWN = math.radians(0.012), 0.05
"""Standard deviations of a vanishing point's row by roads that are not quite flat [rad], and by how images are drawn,
scaled and compressed [px]."""

AGREES = 4.0
"""Standard deviations within which a vanishing point belongs to the assumed horizon [-]."""


class SeenLines(NamedTuple):
    """Lines along a road, before it is asked where they meet."""

    points: Points  # Points of edges, from the horizon downward
    lines: RoadLines  # Straight lines through those from `_CLEAR_OF_HORIZON` downward


def seen_lines(image: LinearPixels, camera: Camera, horizon: Horizon) -> SeenLines | None:
    """Find straight lines that can run along the road.

    Edges along single rows, placed within the pixel; Hough's transform of those that can lie on lines toward the
    neighbourhood of the expected vanishing point.

    Returns None if the image shows too few rows of road.
    """
    rows = _rows(camera, horizon)
    if rows.size < LEAST_POINTS:
        return None
    points = _points(image, rows, camera, horizon)
    return SeenLines(points, straight_lines(points, camera, horizon))


def straight_lines(points: Points, camera: Camera, horizon: Horizon) -> RoadLines:
    """Straight lines through points that are not too near to the horizon."""
    rows, (offsets, slopes) = _rows(camera, horizon), _cells(_YAW * camera.focal_length)
    near = _below(points, rows[0] - horizon.row)
    found = hough_road_lines(near, offsets, slopes, MOST_LINES, max(int(LEAST_POINTS), rows.size // 8))
    return refitted_lines(near, found, 0.5 * (offsets[1] - offsets[0]) + 2.0)


def road_vanishing_point(image: LinearPixels, camera: Camera, horizon: Horizon) -> VanishingPoint | None:
    """Find the vanishing point of the road's lines near the one by the calibration; see `vanishing_point_of`.

    Returns None if no two lines meet near the assumed horizon.
    """
    seen = seen_lines(image, camera, horizon)
    return None if seen is None else vanishing_point_of(seen, camera, horizon)


def seen_horizon(image: LinearPixels, camera: Camera, assumed: Horizon) -> tuple[Horizon, VanishingPoint | None]:
    """The assumed horizon weighed with the point in which the road's lines meet, and that point; None without any."""
    point = road_vanishing_point(image, camera, assumed)
    return (assumed if point is None else weighted_mean(assumed, point.horizon)), point


def vanishing_point_of(seen: SeenLines, camera: Camera, horizon: Horizon) -> VanishingPoint | None:
    """Point through which most of the lines pass, and least squares of all of them at once, which lets the road bend.

    Returns None if no two lines meet near the assumed horizon.
    """
    first = _first_point(seen.lines, AGREES * horizon.standard_deviation + 2.0)
    if first is None:
        return None
    lines = _lines_through(seen.lines, first, _TOLERANCE)
    if lines.slope.size < 2:
        return None
    points = _below(seen.points, _first_row(camera, horizon) - horizon.row)
    fit = fit_road_lines(points, lines, *first, BEND * camera.focal_length**2)
    deviation = math.hypot(math.sqrt(fit.variance), _FLAT * camera.focal_length, _DRAWN)
    apart = AGREES * math.hypot(horizon.standard_deviation, deviation)
    if fit.lines < 2 or fit.span < LEAST_TURN or not abs(fit.row) <= apart:
        return None
    place = camera.principal_point[0] + fit.column, horizon.row + fit.row
    return VanishingPoint(*place, deviation, fit.lines, fit.points)


def _lines_through(lines: RoadLines, point: tuple[float, float], tolerance: float) -> RoadLines:
    """Lines that pass a point (`point` [px], `tolerance` [px])."""
    return lines.chosen(np.abs(lines.offset + lines.slope * point[1] - point[0]) <= tolerance)


def _below(points: Points, least: float) -> Points:
    """Points from a row below the horizon downward."""
    start = int(np.searchsorted(points.below, least))
    return Points(points.across[start:], points.below[start:], points.kind[start:])


def _points(image: LinearPixels, rows: NDArray[np.int64], camera: Camera, horizon: Horizon) -> Points:
    """Edges on rows, without those that stand upright: these are followed up to the horizon."""
    step = int(rows[1] - rows[0])
    above = np.arange(int(rows[0]) - step, max(math.floor(horizon.row), -1), -step, dtype=np.int64)[::-1]
    place, kind = row_points(image.pixels, image.tables, np.concatenate((above, rows)))
    lies = may_lie_on_road(place, step)
    return Points(place[lies, 0] - camera.principal_point[0], place[lies, 1] - horizon.row, kind[lies])


def _first_point(found: RoadLines, farthest: float) -> tuple[float, float] | None:
    """Crossing of two lines, near the expected point, through which lines with most points pass: column and row.

    Takes `farthest` [px].
    """
    first, second = all_pairs(found.slope.size)
    lines = sloped_lines(found.offset, found.slope)
    crossed = crossings(lines, first, second, LEAST_TURN)
    aside = np.abs(crossed[:, 1])
    # Of points that are about as good, the one nearer to the expected row.
    support = supports(lines, found.points, crossed, _TOLERANCE) * (1.0 - 0.3 * aside / farthest)
    support[~(aside <= farthest)] = 0.0
    if not support.any():
        return None
    best = int(np.argmax(support))
    row = float(crossed[best, 1])
    return float(found.offset[first[best]] + found.slope[first[best]] * row), row


@functools.lru_cache(maxsize=8)
def _cells(reach: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Offsets [px] and slopes of the lines that are voted for; they belong to all who ask."""
    offsets = np.linspace(-reach, reach, 2 * math.ceil(_YAW / _YAW_STEP) + 1)
    return offsets, np.linspace(-_STEEPEST, _STEEPEST, 2 * round(_STEEPEST / _SLOPE_STEP) + 1)


def _rows(camera: Camera, horizon: Horizon) -> NDArray[np.int64]:
    first = _first_row(camera, horizon)
    step = max(math.ceil((camera.height - first) / _MOST_ROWS), 1)
    return np.arange(first, camera.height - 1, step, dtype=np.int64)


def _first_row(camera: Camera, horizon: Horizon) -> int:
    return math.ceil(horizon.row + max(_CLEAR_OF_HORIZON * camera.focal_length, 8.0))
