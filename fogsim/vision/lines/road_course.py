"""Course of the road ahead: its bends, sags and crests, as its lines show them."""

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of, times
from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.lines.road_course_kernels import (
    BEND,
    COLUMN,
    KNOTS,
    LIMITS,
    PIECES,
    ROW,
    SAG,
    SLOPE,
    CourseFit,
    fit_course,
    stripe_middles,
)
from fogsim.vision.lines.road_line_kernels import LEAST_TURN, RIDGE, Points, RoadLines, chosen_lines
from fogsim.vision.lines.road_lines import AGREES, Cells, SeenLines, cells_of, lying_points, straight_lines

Floats = NDArray[np.float64]

SAG_DEVIATION, SAG_LENGTH = 1.0 / 8000.0, 150.0
"""Standard deviation of vertical curvature where a road is curved [1/m], and the length over which it changes [m].
Least radii of crests and sags are 5000 … 13 000 m and 2600 … 8800 m on motorways, 3000 … 8000 m and 2000 … 4000 m on
roads outside towns (RAA 2008, RAL 2012; from memory)."""

BEGINS = 0.05
"""How likely it is that the road is straight up to a piece, and sags or crests from there on [-]: of a road's length a
third does, in stretches of 200 to 400 m."""


class SagsAhead(NamedTuple):
    """What is known of vertical curvature ahead, if each piece of road may have some."""

    # (1 + pieces,): Row in which the road's tangent under the camera vanishes [px], and vertical curvature by piece,
    # positive in a sag [1/m]
    mean: Floats
    covariance: Floats  # (1 + pieces, 1 + pieces): Theirs [px², px/m, 1/m²]


@kernel
def row_given(ahead: SagsAhead, sag: Floats) -> tuple[float, float]:
    """Row in which the tangent vanishes given curvatures, and its variance [px, px²] (`sag` (pieces,) [1/m])."""
    precision = inverse_of(ahead.covariance[1:, 1:].copy())
    gain = np.zeros(sag.size)
    for k in range(sag.size):
        for j in range(sag.size):
            gain[j] += ahead.covariance[0, 1 + k] * precision[k, j]
    apart, shared = 0.0, 0.0
    for j in range(sag.size):
        apart += gain[j] * (sag[j] - ahead.mean[1 + j])
        shared += gain[j] * ahead.covariance[1 + j, 0]
    return ahead.mean[0] + apart, max(ahead.covariance[0, 0] - shared, 0.0)


@kernel
def cost_given(ahead: SagsAhead, sag: Floats, before: Floats) -> float:
    """Minus twice the logarithm of how much likelier the lines are if the road is curved so, up to a constant [-].

    What is known of curvature before any lines are seen is not in it: its precision is taken away.

    Takes `sag` (pieces,) [1/m], `before` (pieces, pieces), see `sag_precision`.
    """
    precision = inverse_of(ahead.covariance[1:, 1:].copy())
    return _square(sag - ahead.mean[1:], precision) - _square(sag, before)


@kernel
def _square(values: Floats, precision: Floats) -> float:
    """Square of a vector's length in standard deviations [-]."""
    through, total = times(precision, values), 0.0
    for j in range(values.size):
        total += values[j] * through[j]
    return total


@kernel
def sag_from(piece: int, curvature: float) -> Floats:
    """(pieces,) float64: vertical curvature of a road that is straight up to a piece [1/m] (`curvature` [1/m])."""
    sag = np.zeros(PIECES)
    sag[piece:] = curvature
    return sag


@functools.cache
def sag_precision() -> Floats:
    """(pieces, pieces) float64: inverse covariance of the curvatures of a curved road [m²]; it is shared."""
    return inverse_of(sag_covariance())


@functools.cache
def sag_covariance() -> Floats:
    """(pieces, pieces) float64: covariance of the curvatures of a curved road [1/m²]; it belongs to all who ask."""
    return _curvature_covariance(SAG_DEVIATION, SAG_LENGTH)


def _curvature_covariance(deviation: float, length: float) -> Floats:
    """(pieces, pieces) float64: covariance of curvatures that change over a length [1/m²].

    Takes `deviation` [1/m], `length` [m].
    """
    knots = np.array(KNOTS[:-1])
    return np.asarray(deviation**2 * np.exp(-np.abs(knots[:, None] - knots) / length))


def unseen_sags(row: float, deviation: float) -> SagsAhead:
    """What is known of vertical curvature where no lines are seen (`row`, `deviation` [px])."""
    covariance = np.zeros((1 + PIECES, 1 + PIECES))
    covariance[0, 0], covariance[1:, 1:] = deviation**2, sag_covariance()
    return SagsAhead(np.array([row, *np.zeros(PIECES)]), covariance)


@kernel
def beginning_cost(curvature: float) -> float:
    """Minus twice the logarithm of how likely a curvature from some piece on is beforehand, but for its density [-].

    Takes `curvature` [1/m].
    """
    return (curvature / SAG_DEVIATION) ** 2 - 2.0 * math.log(BEGINS)


_BEND_DEVIATION, _BEND_LENGTH = 1.0 / 500.0, 400.0
"""Standard deviation of horizontal curvature where a road is curved [1/m], and the length over which it changes [m]."""

_CURVED_SHARE = 0.3
"""Share of roads' length in sags and on crests, and of that in bends, that matter [-]."""

_TANGENT = 0.07
"""Standard deviation of the angle between the road and the camera's axis [rad]."""

_FAR_ROWS = 0.05
"""Angle below the horizon up to which every row is looked at [rad]."""

_BENT = 1.0 / 450.0
"""Curvature that is taken off, to either side, where no straight lines are seen [1/m]."""

_SPREAD = 0.06
"""How far apart tangents of a bent road's lines may cross the horizon [rad]."""

_WIDEST = 0.45
"""Greatest width of a mark [m]."""

_FARTHEST_MARK = 6.0
"""How far to a side marks are sought [m]. What seems farther stands up, as a guard rail does. Edges of what is no
narrow stripe, such as the verge, are faint and wander."""

_LEAST_POINTS, _MOST_SCATTER = 30, 0.6
"""Fewest points of a course, and greatest root mean square of their residuals [px]."""

_SHOWN = 0.5
"""Probability from which on a road counts as curved [-]."""


@dataclass(frozen=True, slots=True)
class RoadCourse:
    """Course of the road ahead, relative to its tangent under the camera."""

    # column, row: where that tangent vanishes [px]
    column: float
    row: float
    # sag, bend (pieces,): vertical curvature, positive in a sag, and horizontal curvature, positive to the right, by
    # piece of road (see `fogsim.vision.lines.road_course_kernels.KNOTS`); 0 where none shows [1/m]
    sag: Floats
    bend: Floats
    covariance: Floats  # (1 + pieces, 1 + pieces): Of the row and the vertical curvatures [px², px/m, 1/m²]
    bend_covariance: Floats  # (pieces, pieces): Of the horizontal curvatures, where the road bends; else 0 [1/m²]
    lines: int  # How many lines showed it; 0 for what is known without any
    ahead: SagsAhead  # What is known of sags and crests that may begin farther on

    @property
    def is_straight(self) -> bool:
        """Whether neither bend nor sag nor crest shows."""
        return not (self.sag.any() or self.bend.any())

    @property
    def horizon(self) -> Horizon:
        """Horizon of the plane that touches the road under the camera."""
        return Horizon(self.row, math.sqrt(self.covariance[0, 0]))

    @property
    def sag_deviation(self) -> Floats:
        """(pieces,) float64: standard deviations of the vertical curvature [1/m]."""
        return np.sqrt(np.diagonal(self.covariance)[1:])


def unseen_course(camera: Camera, horizon: Horizon) -> RoadCourse:
    """What is known of the road's course where no lines show it: that it is straight, if not for sure."""
    covariance = np.zeros((1 + PIECES, 1 + PIECES))
    covariance[0, 0] = horizon.standard_deviation**2
    covariance[1:, 1:] = _CURVED_SHARE * sag_covariance()
    straight = np.zeros(PIECES)
    return RoadCourse(
        column=camera.principal_point[0],
        row=horizon.row,
        sag=straight,
        bend=straight,
        covariance=covariance,
        bend_covariance=np.zeros((PIECES, PIECES)),
        lines=0,
        ahead=unseen_sags(horizon.row, horizon.standard_deviation),
    )


def road_course(seen: SeenLines, image: LinearPixels, camera: Camera, horizon: Horizon) -> RoadCourse | None:
    """Fit bends, sags and crests to the lines along the road, followed from near to far.

    A lane is as wide there as here, so the distance between its lines gives the distance of every row, whatever the
    road's profile.

    Returns None if too few lines show one that is to be believed.
    """
    points = _points(seen, image, camera, horizon)
    fit = _fitted(points, 0.0, camera, horizon)
    if fit is None:
        bent = [_fitted(points, curvature, camera, horizon) for curvature in (_BENT, -_BENT)]
        found = [one for one in bent if one is not None]
        if not found:
            return None
        fit = max(found, key=lambda one: (one.points, -one.scatter))
    return _course(fit, camera, horizon)


def _fitted(points: Points, curvature: float, camera: Camera, horizon: Horizon) -> CourseFit | None:
    """Fit a course to lines that are found as straight ones once a bend has been taken off."""
    focal, unit, deviation = camera.focal_length, camera.row_distance, horizon.standard_deviation
    cells, precision = cells_of(camera, horizon), _precision(camera, deviation)
    fit = _fitted_to(points, 0.5 * curvature * focal * unit, cells, precision, unit, camera.mount_height, focal)
    believed = fit.span >= LEAST_TURN and fit.points >= _LEAST_POINTS and fit.scatter <= _MOST_SCATTER
    return fit if believed and abs(fit.unknown[ROW]) <= AGREES * deviation else None


@kernel
def _fitted_to(
    points: Points, bend: float, cells: Cells, precision: Floats, unit: float, height: float, focal: float
) -> CourseFit:
    """`_fitted` with a bend taken off [px²]; of no points where too few marks are found."""
    ahead = points.below > LIMITS[-1] * focal
    below = points.below[ahead]
    lines = straight_lines(Points(points.across[ahead] - bend / below, below, points.kind[ahead]), cells)
    lines = chosen_lines(lines, (lines.kind == RIDGE) & (np.abs(lines.slope) * height < _FARTHEST_MARK))
    if lines.slope.size > 0:
        lines = chosen_lines(lines, np.abs(lines.offset - _middle(lines)) <= _SPREAD * focal)
    if lines.slope.size < 2 or lines.slope.max() - lines.slope.min() < LEAST_TURN:
        return CourseFit(np.zeros(SLOPE), np.zeros((SLOPE, SLOPE)), 0, 0.0, 0, 0.0)
    return fit_course(points, lines, bend, precision, unit, height, focal)


@kernel
def _middle(lines: RoadLines) -> float:
    """Median of the lines' columns at the horizon, of as many as they have points [px]."""
    order = np.argsort(lines.offset, kind="mergesort")
    until = np.cumsum(lines.points[order])
    low, high = np.searchsorted(until, 0.5 * until[-1]), np.searchsorted(until, 0.5 * until[-1], "right")
    return 0.5 * float(lines.offset[order[low]] + lines.offset[order[high]])


def _course(fit: CourseFit, camera: Camera, horizon: Horizon) -> RoadCourse:
    """Weigh a curved road with a straight one."""
    bends = _curvature_covariance(_BEND_DEVIATION, _BEND_LENGTH)
    found = _weighed(fit.unknown, fit.covariance, horizon.row, bends, sag_covariance())
    return RoadCourse(
        column=camera.principal_point[0] + float(found.unknown[COLUMN]),
        row=horizon.row + float(found.unknown[ROW]),
        sag=found.unknown[SAG:BEND],
        bend=found.unknown[BEND:],
        covariance=found.covariance,
        bend_covariance=found.bend_covariance,
        lines=fit.lines,
        ahead=found.ahead,
    )


class _Weighed(NamedTuple):
    """A course, straight where it is more likely so, with covariances of `RoadCourse`."""

    unknown: Floats  # See `CourseFit`
    covariance: Floats
    bend_covariance: Floats
    ahead: SagsAhead


@kernel
def _weighed(unknown: Floats, covariance: Floats, row: float, bends: Floats, sags: Floats) -> _Weighed:
    """Bends, then sags and crests, weighed with none, by what is known of them beforehand (pieces, pieces)."""
    if _share(unknown, covariance, BEND, bends) < _SHOWN:
        unknown, covariance = _without(unknown, covariance, BEND)
    own = covariance[ROW:BEND, ROW:BEND].copy()
    mean = unknown[ROW:BEND].copy()
    mean[0] += row
    sagging = _share(unknown, covariance, SAG, sags)
    flat, flat_covariance = _without(unknown, covariance, SAG)
    apart = (unknown - flat)[ROW:BEND]
    within = sagging * own + (1.0 - sagging) * flat_covariance[ROW:BEND, ROW:BEND]
    share = 1.0 - sagging
    if sagging < _SHOWN:
        unknown, share = flat, sagging
    within += share * apart.reshape(-1, 1) * apart
    return _Weighed(unknown.copy(), within, covariance[BEND:, BEND:].copy(), SagsAhead(mean, own))


@kernel
def _share(unknown: Floats, covariance: Floats, first: int, prior: Floats) -> float:
    """Probability that curvatures, from an unknown on, are not all 0 (Savage and Dickey's ratio)."""
    mean, own = unknown[first : first + PIECES], covariance[first : first + PIECES, first : first + PIECES].copy()
    exponent = 0.5 * _square(mean, inverse_of(own))
    logarithm = min(exponent + 0.5 * (_log_determinant(own) - _log_determinant(prior)), 50.0)
    odds = _CURVED_SHARE / (1.0 - _CURVED_SHARE) * math.exp(logarithm)
    return odds / (1.0 + odds)


@kernel
def _log_determinant(matrix: Floats) -> float:
    """Logarithm of the determinant of a positive definite matrix, by elimination."""
    left, total = matrix.copy(), 0.0
    for i in range(len(left)):
        total += math.log(max(left[i, i], 1e-300))
        for a in range(i + 1, len(left)):
            for b in range(i + 1, len(left)):
                left[a, b] -= left[a, i] * (left[i, b] / left[i, i])
    return total


@kernel
def _without(unknown: Floats, covariance: Floats, first: int) -> tuple[Floats, Floats]:
    """Condition a normal distribution on curvatures' being 0, from an unknown on."""
    end = first + PIECES
    inverse = inverse_of(covariance[first:end, first:end].copy())
    rest, spread = unknown.copy(), covariance.copy()
    for a in range(unknown.size):
        for k in range(PIECES):
            gain = 0.0
            for j in range(PIECES):
                gain += covariance[a, first + j] * inverse[j, k]
            rest[a] -= gain * unknown[first + k]
            for b in range(unknown.size):
                spread[a, b] -= gain * covariance[first + k, b]
    rest[first:end], spread[first:end], spread[:, first:end] = 0.0, 0.0, 0.0
    return rest, spread


def _points(seen: SeenLines, image: LinearPixels, camera: Camera, horizon: Horizon) -> Points:
    """Points of every far row and of those below it, with the middles of stripes."""
    top = max(math.ceil(horizon.row + LIMITS[-1] * camera.focal_length) - 2, 0)
    bottom = min(math.ceil(horizon.row + _FAR_ROWS * camera.focal_length), camera.height - 1)
    column, widest = camera.principal_point[0], _WIDEST / camera.mount_height
    return _joined(seen.points, image, top, bottom, column, horizon.row, widest)


@kernel
def _joined(
    seen: Points, image: LinearPixels, top: int, bottom: int, column: float, row: float, widest: float
) -> Points:
    """`_points` from a place [px] on, of rows from the top to before the bottom."""
    far, near = lying_points(image, np.arange(top, bottom), 1, column, row), seen.below >= bottom - row
    points = Points(
        np.concatenate((far.across, seen.across[near])),
        np.concatenate((far.below, seen.below[near])),
        np.concatenate((far.kind, seen.kind[near])),
    )
    return stripe_middles(points, widest)


@functools.lru_cache(maxsize=8)
def _precision(camera: Camera, row_deviation: float) -> Floats:
    """Inverse covariance of the fit's unknowns before the lines are seen; it belongs to all who ask."""
    out = np.zeros((SLOPE, SLOPE))
    out[COLUMN, COLUMN], out[ROW, ROW] = (_TANGENT * camera.focal_length) ** -2, row_deviation**-2
    out[SAG:BEND, SAG:BEND] = sag_precision()
    out[BEND:, BEND:] = inverse_of(_curvature_covariance(_BEND_DEVIATION, _BEND_LENGTH))
    return out
