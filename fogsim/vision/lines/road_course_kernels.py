"""Compiled fit of a road's bends, sags and crests to points of its lines, followed from near to far."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of, times
from fogsim.vision.lines.road_line_kernels import FALLING, LEAST_POINTS, LEAST_SCATTER, RIDGE, RISING, Points, RoadLines

Floats = NDArray[np.float64]

KNOTS = (0.0, 40.0, 80.0, 120.0, 200.0, 320.0, 500.0)
"""Distances between which the road has a curvature of its own [m]; behind the last it is straight."""

PIECES = len(KNOTS) - 1
COLUMN, ROW, SAG, BEND, SLOPE = 0, 1, 2, 2 + PIECES, 2 + 2 * PIECES
"""Unknowns: column and row in which the road's tangent under the camera vanishes [px], vertical and horizontal
curvature by piece [1/m], and each line's slope [-]."""

_TOP = 0.3
"""Least change of the row by the inverse distance, relative to a plane's: nearer to its top, a crest hides itself."""

LIMITS = (0.05, 0.05, 0.036, 0.026, 0.019, 0.014, 0.011, 0.008, 0.008)
"""Angle below the horizon down to which lines have been followed after each step [rad]."""

REACH, _NEAREST_REACH = 4.0, 1.0
"""Distance along a row within which points belong to a line, at first and in the end [px]."""

_FEW_POINTS = 4.0
"""Fewest points of a line while it is followed."""

_CROOKED = 0.04
"""By how much a line that was painted straight is none [px]."""


_BENT_WITHIN_ROW = 0.5
"""By how much points of a line are misplaced that bends within a row's height, over its change of slope [-]."""


class CourseFit(NamedTuple):
    """Posterior of the fit."""

    unknown: Floats  # (10,): Column and row [px], vertical curvature and curvature by piece [1/m]
    covariance: Floats  # (10, 10): Theirs
    lines: int  # How many lines have points enough
    span: float  # Range of their slopes [-]
    points: int  # How many points they are of
    scatter: float  # Root mean square of their residuals [px]


@kernel
def turned(distance: float, piece: int) -> tuple[float, float]:
    """Offset that a unit of a piece's curvature has made at a distance, and its change by the distance.

    Takes `distance` [m].
    """
    start, end = KNOTS[piece], KNOTS[piece + 1]
    if distance <= start:
        return 0.0, 0.0
    if distance <= end:
        return 0.5 * (distance - start) ** 2, distance - start
    return (end - start) * (distance - 0.5 * (start + end)), end - start


@kernel
def row_on_plane(below: float, sag: Floats, unit: float, height: float, start: float) -> tuple[float, float]:
    """Row on which a point would be seen were the road a plane, and how it changes by the row on which it is seen.

    A point at a distance s, z above the tangent under the camera, is seen λ / s · (1 − z / h) below the horizon.

    Returns row below the horizon [px], 0 where the road is hidden behind a crest, and its change [-]. Takes `below`
    [px], `sag` (pieces,) [1/m], `unit` [px·m], `height` [m], `start` [px].
    """
    row = start
    for _ in range(20):
        if row <= 0.0:
            break
        distance, rise, grade = unit / row, 0.0, 0.0
        for piece in range(PIECES):
            offset, change = turned(distance, piece)
            rise += sag[piece] * offset
            grade += sag[piece] * change
        slope = 1.0 - (rise - distance * grade) / height
        if slope < _TOP:
            break
        step = (below - row * (1.0 - rise / height)) / slope
        row += max(step, -0.5 * row)
        if abs(step) < 1e-6 * row:
            return row, 1.0 / slope
    return 0.0, 0.0


@kernel
def stripe_middles(points: Points, widest: float) -> Points:
    """Make one point of both edges of a mark, in its middle."""
    count = points.across.size
    across, below, kind = points.across.copy(), points.below.copy(), points.kind.copy()
    kept, i = 0, 0
    while i < count:
        below[kept], across[kept], kind[kept] = points.below[i], points.across[i], points.kind[i]
        pair = i + 1 < count and points.kind[i] == RISING and points.kind[i + 1] == FALLING
        if pair and points.below[i + 1] == below[kept]:
            width = points.across[i + 1] - points.across[i]
            if width < widest * below[kept]:
                across[kept], kind[kept] = points.across[i] + 0.5 * width, RIDGE
                i += 1
        kept, i = kept + 1, i + 1
    return Points(across[:kept].copy(), below[:kept].copy(), kind[:kept].copy())


class _Fit(NamedTuple):
    """State of the fit: the unknowns, and of each line its weight [1/px²], its points and their squared residuals."""

    unknown: Floats
    weight: Floats
    number: Floats
    squares: Floats


class _Seen(NamedTuple):
    """What is fitted: points, tangents in which lines were found, and what those were straightened by [px²]."""

    points: Points
    lines: RoadLines
    bend: float


class _Optics(NamedTuple):
    """λ [px·m], height of the camera [m], focal length [px]."""

    unit: float
    height: float
    focal: float


@kernel
def fit_course(
    points: Points, lines: RoadLines, bend: float, precision: Floats, unit: float, height: float, focal: float
) -> CourseFit:
    """Gauss–Newton for all lines at once, of ever farther points.

    Takes `bend` [px²], `precision` (10, 10), `unit`, `height`, `focal` [px·m], [m], [px].
    """
    count = lines.slope.size
    size = SLOPE + count
    fit = _Fit(np.zeros(size), np.full(count, 1.0 / (3.0 * 0.5**2)), np.zeros(count), np.zeros(count))
    seen, optics = _Seen(points, lines, bend), _Optics(unit, height, focal)
    fit.unknown[COLUMN], fit.unknown[SLOPE:] = lines.offset.mean(), lines.slope
    fit.unknown[BEND:SLOPE] = 2.0 * bend / (focal * unit)
    inverse: Floats = np.eye(size)
    reach = REACH
    for step in range(len(LIMITS)):
        normal, gradient = np.zeros((size, size)), np.zeros(size)
        normal[:SLOPE, :SLOPE] = precision
        gradient[:SLOPE] = -times(precision, fit.unknown[:SLOPE])
        for line in range(SLOPE, size):
            normal[line, line] = 1e-3
        _add_points(seen, optics, fit, (LIMITS[step] * focal, reach, step == 0), normal, gradient)
        for a in range(size):
            for b in range(a):
                normal[b, a] = normal[a, b]
        inverse = inverse_of(normal)
        fit.unknown[:] += times(inverse, gradient)
        for m in range(count):
            number = fit.number[m]
            scatter = max(fit.squares[m] / max(number, 1.0), LEAST_SCATTER**2)
            fit.weight[m] = 1.0 / (3.0 * scatter + number * _CROOKED**2) if number >= _FEW_POINTS else 0.0
        reach = max(0.8 * reach, _NEAREST_REACH)
    return _posterior(fit, inverse)


@kernel
def _posterior(fit: _Fit, inverse: Floats) -> CourseFit:
    used, total, squares, low, high = 0, 0, 0.0, math.inf, -math.inf
    for m in range(fit.number.size):
        if fit.number[m] >= LEAST_POINTS:
            low, high = min(low, fit.unknown[SLOPE + m]), max(high, fit.unknown[SLOPE + m])
            used, total, squares = used + 1, total + int(fit.number[m]), squares + fit.squares[m]
    scatter = math.sqrt(squares / max(total, 1))
    return CourseFit(fit.unknown[:SLOPE].copy(), inverse[:SLOPE, :SLOPE].copy(), used, high - low, total, scatter)


@kernel
def _add_points(
    seen: _Seen, optics: _Optics, fit: _Fit, limits: tuple[float, float, bool], normal: Floats, gradient: Floats
) -> None:
    """Add the equations of all points down to an angle below the horizon, below the diagonal."""
    least, reach, first = limits
    unknown, points = fit.unknown, seen.points
    fit.number[:], fit.squares[:] = 0.0, 0.0
    derivative = np.zeros(SLOPE)
    last, plane, change, aside, tilt = math.inf, 0.0, 0.0, 0.0, 0.0
    for i in range(points.across.size - 1, -1, -1):
        below = points.below[i] - unknown[ROW]
        if below < least:
            break
        if below != last:
            guess = below if plane == 0.0 else plane
            plane, change = row_on_plane(below, unknown[SAG:BEND], optics.unit, optics.height, guess)
            if plane <= 0.0:
                break
            aside, tilt = _row_terms(unknown, optics, plane, change, derivative)
            last = below
        line = _nearest_line(seen, i, unknown, plane, aside, reach, first)
        if line >= 0:
            slope = unknown[SLOPE + line]
            residual = points.across[i] - unknown[COLUMN] - slope * plane - aside
            fit.number[line] += 1.0
            fit.squares[line] += residual * residual
            crooked = _BENT_WITHIN_ROW * tilt / plane
            weight = fit.weight[line] / (1.0 + fit.weight[line] * crooked * crooked)
            _add_equation(derivative, line, slope + tilt, plane, (residual, weight), normal, gradient)


@kernel
def _row_terms(
    unknown: Floats, optics: _Optics, plane: float, change: float, derivative: Floats
) -> tuple[float, float]:
    """Derivatives of a row's columns, by row and sag for a slope of 1; returns the bend's column and slope."""
    aside, tilt, distance = 0.0, 0.0, optics.unit / plane
    derivative[COLUMN], derivative[ROW] = 1.0, -change
    for piece in range(PIECES):
        offset, turn = turned(distance, piece)
        shift = optics.focal * offset / distance
        aside += unknown[BEND + piece] * shift
        tilt -= unknown[BEND + piece] * optics.focal / optics.unit * (distance * turn - offset)
        derivative[BEND + piece] = shift
        # The same row shows a point farther down the plane as the road rises.
        derivative[SAG + piece] = change * plane * offset / optics.height
    return aside, tilt


@kernel
def _nearest_line(seen: _Seen, i: int, unknown: Floats, plane: float, aside: float, reach: float, first: bool) -> int:
    """Line of a point's kind that is nearest to it within reach, −1 for none; at first of the tangents."""
    points, lines = seen.points, seen.lines
    nearest, line = reach, -1
    for m in range(lines.slope.size):
        if lines.kind[m] != points.kind[i]:
            continue
        if first:
            # A bent line's tangent passes by the point in which the road's tangent vanishes.
            column = lines.offset[m] + lines.slope[m] * points.below[i] + seen.bend / points.below[i]
        else:
            column = unknown[COLUMN] + unknown[SLOPE + m] * plane + aside
        apart = abs(points.across[i] - column)
        if apart < nearest:
            nearest, line = apart, m
    return line


@kernel
def _add_equation(
    derivative: Floats,
    line: int,
    slope: float,
    plane: float,
    datum: tuple[float, float],
    normal: Floats,
    gradient: Floats,
) -> None:
    """Add the equation of one point, of a residual and a weight."""
    (residual, weight), s = datum, SLOPE + line
    for a in range(SLOPE):
        by_a = weight * derivative[a] * (slope if ROW <= a < BEND else 1.0)
        gradient[a] += by_a * residual
        normal[s, a] += by_a * plane
        for b in range(a + 1):
            normal[a, b] += by_a * derivative[b] * (slope if ROW <= b < BEND else 1.0)
    normal[s, s] += weight * plane * plane
    gradient[s] += weight * plane * residual
