"""The vanishing point of the lines along a road, near where the calibration expects it."""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.light.daylight import CannotTellError
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.horizon import Horizon, weighted_mean
from fogsim.vision.lines.road_line_kernels import (
    LEAST_POINTS,
    LEAST_TURN,
    Points,
    RoadFit,
    RoadLines,
    chosen_lines,
    fit_road_lines,
    hough_road_lines,
    may_lie_on_road,
    refitted_lines,
    row_points,
)
from fogsim.vision.lines.vanishing_point import VanishingPoint

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

_MISPLACED, _EACH_SIDE = math.radians(2.5), 2
"""How far from the assumed pitch lines are found to meet instead [rad], and how many must on either side of the way
ahead, for edges of one vehicle or kerb meet anywhere: on pool 0 of `benchmarks/camera_kinds.py` and in FogSim's
scenarios, whose pitches are right, so many meet nowhere else [-]."""


class SeenLines(NamedTuple):
    """Lines along a road, before it is asked where they meet."""

    points: Points  # Points of edges, from the horizon downward
    lines: RoadLines  # Straight lines through those from `_CLEAR_OF_HORIZON` downward


def seen_lines(image: LinearPixels, camera: Camera, horizon: Horizon) -> SeenLines | None:
    """Find straight lines that can run along the road.

    Edges along single rows, placed within the pixel, without those that stand upright, which are followed up to the
    horizon; Hough's transform of those that can lie on lines toward the neighbourhood of the expected vanishing point.

    Returns None if the image shows too few rows of road.
    """
    cells = cells_of(camera, horizon)
    if cells.rows.size < LEAST_POINTS:
        return None
    return _seen_lines(image, cells, camera.principal_point[0], horizon.row)


class Cells(NamedTuple):
    """Where lines are looked for."""

    rows: NDArray[np.int64]  # Rows of the image, with those above the first one that is voted for
    step: int  # From one of them to the next
    first: float  # The first row below the horizon that is voted for [px]
    least: int  # Fewest points of a line
    # offsets, slopes: of the lines that are voted for [px], [-]
    offsets: Floats
    slopes: Floats


@functools.lru_cache(maxsize=8)
def cells_of(camera: Camera, horizon: Horizon) -> Cells:
    """Cells of a camera; they belong to all who ask."""
    rows, reach = _rows(camera, horizon), _YAW * camera.focal_length
    offsets = np.linspace(-reach, reach, 2 * math.ceil(_YAW / _YAW_STEP) + 1)
    slopes = np.linspace(-_STEEPEST, _STEEPEST, 2 * round(_STEEPEST / _SLOPE_STEP) + 1)
    least = max(int(LEAST_POINTS), rows.size // 8)
    if rows.size < LEAST_POINTS:
        return Cells(rows, 1, 0.0, least, offsets, slopes)
    step = int(rows[1] - rows[0])
    above = np.arange(int(rows[0]) - step, max(math.floor(horizon.row), -1), -step, dtype=np.int64)[::-1]
    return Cells(np.concatenate((above, rows)), step, rows[0] - horizon.row, least, offsets, slopes)


@kernel
def _seen_lines(image: LinearPixels, cells: Cells, column: float, row: float) -> SeenLines:
    points = lying_points(image, cells.rows, cells.step, column, row)
    return SeenLines(points, straight_lines(points, cells))


@kernel
def lying_points(image: LinearPixels, rows: NDArray[np.int64], step: int, column: float, row: float) -> Points:
    """Edges on rows some way apart that may lie on the road, from a place on [px]."""
    place, kind = row_points(image.pixels, image.tables, rows)
    lies = may_lie_on_road(place, step)
    return Points(place[lies, 0] - column, place[lies, 1] - row, kind[lies])


@kernel
def straight_lines(points: Points, cells: Cells) -> RoadLines:
    """Straight lines through points that are not too near to the horizon."""
    near = _below(points, cells.first)
    found = hough_road_lines(near, cells.offsets, cells.slopes, MOST_LINES, cells.least)
    return refitted_lines(near, found, 0.5 * (cells.offsets[1] - cells.offsets[0]) + 2.0)


def road_vanishing_point(image: LinearPixels, camera: Camera, horizon: Horizon) -> VanishingPoint | None:
    """Find the vanishing point of the road's lines near the one by the calibration; see `vanishing_point_of`.

    Returns None if no two lines meet near the assumed horizon.
    """
    seen = seen_lines(image, camera, horizon)
    return None if seen is None else vanishing_point_of(seen, camera, horizon)


def seen_horizon(image: LinearPixels, camera: Camera, assumed: Horizon) -> tuple[Horizon, VanishingPoint | None]:
    """The assumed horizon weighed with the point in which the road's lines meet, and that point; None without any.

    CannotTellError if they meet far from it.
    """
    seen = seen_lines(image, camera, assumed)
    point = None if seen is None else vanishing_point_of(seen, camera, assumed)
    if point is not None:
        return weighted_mean(assumed, point.horizon), point
    if seen is not None:
        refuse_misplaced(seen, camera, assumed)
    return assumed, None


def refuse_misplaced(seen: SeenLines, camera: Camera, horizon: Horizon) -> None:
    """Refuse a horizon near which no lines meet, if they do elsewhere: CannotTellError says where."""
    offset, slope = seen.lines.offset, seen.lines.slope
    if slope.size < 2 * _EACH_SIDE:
        return
    point = vanishing_point_of(seen, camera, Horizon(horizon.row, _MISPLACED * camera.focal_length / AGREES))
    if point is None:
        return
    missed = offset + slope * (point.row - horizon.row) - (point.column - camera.principal_point[0])
    meeting = slope[np.abs(missed) <= _TOLERANCE]
    if min(int((meeting > 0.0).sum()), int((meeting < 0.0).sum())) < _EACH_SIDE:
        return
    below = (camera.principal_point[1] - row for row in (point.row, camera.horizon_row))
    seen_pitch, stated = (math.degrees(math.atan(rows / camera.focal_length)) for rows in below)
    met = f"the road's lines meet at a pitch of {seen_pitch:.1f}°, not of {stated:.1f}°"
    raise CannotTellError(f"{met}: correct it, or the road is not level")


def vanishing_point_of(seen: SeenLines, camera: Camera, horizon: Horizon) -> VanishingPoint | None:
    """Point through which most of the lines pass, and least squares of all of them at once, which lets the road bend.

    Returns None if no two lines meet near the assumed horizon.
    """
    farthest, first = AGREES * horizon.standard_deviation + 2.0, _first_row(camera, horizon) - horizon.row
    fit = _meeting(seen, farthest, first, BEND * camera.focal_length**2)
    if fit.lines < 2:
        return None
    deviation = math.hypot(math.sqrt(fit.variance), _FLAT * camera.focal_length, _DRAWN)
    apart = AGREES * math.hypot(horizon.standard_deviation, deviation)
    if fit.span < LEAST_TURN or not abs(fit.row) <= apart:
        return None
    place = camera.principal_point[0] + fit.column, horizon.row + fit.row
    return VanishingPoint(*place, deviation, fit.lines, fit.points)


@kernel
def _meeting(seen: SeenLines, farthest: float, first: float, bend: float) -> RoadFit:
    """Fit of the lines that meet, to points from a row on; without lines where no two do."""
    lines = seen.lines
    column, row = _first_point(lines, farthest)
    through = lines.offset + lines.slope * row - column
    lines = chosen_lines(lines, np.abs(through) <= _TOLERANCE)
    if lines.slope.size < 2:
        return RoadFit(0.0, 0.0, 0.0, 0, 0.0, 0.0)
    return fit_road_lines(_below(seen.points, first), lines, column, row, bend)


@kernel
def _below(points: Points, least: float) -> Points:
    """Points from a row below the horizon downward."""
    start = np.searchsorted(points.below, least)
    return Points(points.across[start:].copy(), points.below[start:].copy(), points.kind[start:].copy())


@kernel
def _first_point(found: RoadLines, farthest: float) -> tuple[float, float]:
    """Crossing of two lines, near the expected point, through which lines with most points pass: column and row.

    NaN without any. Takes `farthest` [px].
    """
    most, column, at = 0.0, np.nan, np.nan
    for i in range(found.slope.size):
        for j in range(i):
            turn = found.slope[i] - found.slope[j]
            if abs(turn) < LEAST_TURN:
                continue
            across = (found.slope[i] * found.offset[j] - found.slope[j] * found.offset[i]) / turn
            row, support = (found.offset[j] - found.offset[i]) / turn, 0.0
            for line in range(found.slope.size):
                if abs(across - found.slope[line] * row - found.offset[line]) <= _TOLERANCE:
                    support += found.points[line]
            # Of points that are about as good, the one nearer to the expected row.
            support *= 1.0 - 0.3 * abs(row) / farthest
            if abs(row) <= farthest and support > most:
                most, column, at = support, found.offset[i] + found.slope[i] * row, row
    return column, at


def _rows(camera: Camera, horizon: Horizon) -> NDArray[np.int64]:
    first = _first_row(camera, horizon)
    step = max(math.ceil((camera.height - first) / _MOST_ROWS), 1)
    return np.arange(first, camera.height - 1, step, dtype=np.int64)


def _first_row(camera: Camera, horizon: Horizon) -> int:
    return math.ceil(horizon.row + max(_CLEAR_OF_HORIZON * camera.focal_length, 8.0))
