"""Even fog over a road that may sag or crest where its lines do not show it: there it fades as in uneven fog."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.lines.road_course import (
    SAG_DEVIATION,
    RoadCourse,
    SagsAhead,
    beginning_cost,
    cost_given,
    row_given,
    sag_from,
    sag_precision,
)
from fogsim.vision.lines.road_course_kernels import PIECES
from fogsim.vision.strips.albedo_filter import Albedo
from fogsim.vision.strips.course_geometry import Bend, lay_along
from fogsim.vision.strips.joint_fit import ALBEDOS, JointFit
from fogsim.vision.strips.joint_kernels import JointPrior, with_horizon
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import SIDES, RoadView, StripGeometry, view_of
from fogsim.vision.uneven.fog_evidence import CHANCES_OF_EVEN, EvenFog, even_fog_over, thinned_bins

Floats = NDArray[np.float64]

_TRIED = np.array([-2.0, -1.0, -0.5, 0.5, 1.0, 2.0])
"""Curvatures that are tried first, over their standard deviation [-]."""

_MOST, _STEPS = 3.0, 3
"""Most curvature, over its standard deviation [-], and how often a parabola through the best three is followed."""

_LEAST_VARIANCE = 1e-4
"""Least variance of the horizon's row where the road's curvature is given [px²]."""

_RIVAL = 20.0
"""By how much a cost may lie above the best for a course to be tried at all, and over other albedos [-]."""


_EVERY, _CHANCES = np.array([one[:6] for one in ALBEDOS]), np.array(CHANCES_OF_EVEN)
"""All albedos, and how likely even fog over each is beforehand [-]."""


class _Road(NamedTuple):
    """Road that bends, and may sag or crest."""

    straight: StripGeometry
    seen_from: RoadView
    bend: Bend
    sides: Floats
    ahead: SagsAhead
    before: Floats  # See `sag_precision`


@dataclass(frozen=True, slots=True)
class HiddenCourse:
    """Sags and crests ahead that lines would not show."""

    straight: StripGeometry  # Strips of a straight road
    camera: Camera  # The assumed calibration
    course: RoadCourse  # Course as the lines show it

    @property
    def is_bent(self) -> bool:
        """Whether strips follow a road that bends, and may leave it far away."""
        return bool(self.course.bend.any())

    def even_fogs(
        self, curves: StripCurves, prior: JointPrior, start: JointFit, albedo: int, gain: float
    ) -> list[EvenFog]:
        """Even fog over roads that sag or crest from one of their pieces on, each with the likeliest curvature."""
        course, found, begun = self.course, [], []
        bend = Bend(course.column, course.bend, course.bend_covariance)
        sides = SIDES[: len(curves.variance)]
        road = _Road(self.straight, view_of(self.camera), bend, sides, course.ahead, sag_precision())
        first = (start.extinction, start.airlight)

        def along(*tries: tuple[int, float, int]) -> list[EvenFog]:
            seen = _along(curves, road, prior, first, np.array(tries, np.float64).reshape(-1, 3)).tolist()
            return [EvenFog(cost, k, variance, int(left)) for cost, k, variance, left in seen]

        def at_curvature(piece: int, curvature: float) -> EvenFog:
            return along((piece, curvature, albedo))[0]

        costs = _costs(course.ahead, road.before, _TRIED)
        places = np.argwhere(costs[1:] < gain + _RIVAL).tolist()
        tries = [(1 + piece, float(_TRIED[place]), albedo) for piece, place in places]
        looks = list(zip(tries, along(*tries), strict=True))
        for piece in range(1, PIECES):
            tried = {curvature: one for (on, curvature, _), one in looks if on == piece}
            if len(tried) < 3:
                continue
            curvature, one, width = _likeliest(functools.partial(at_curvature, piece), tried)
            found.append(EvenFog(one.cost + width, *one[1:]))
            begun.append((found[-1].cost, piece, curvature, width))
        least = min((one.cost for one in found), default=math.inf)
        rivals = [(*one, other) for one in begun if one[0] < least + _RIVAL for other in range(len(ALBEDOS))]
        rivals = [one for one in rivals if one[-1] != albedo]
        others = along(*((piece, curvature, other) for _, piece, curvature, _, other in rivals))
        found += [EvenFog(one.cost + rival[3], *one[1:]) for one, rival in zip(others, rivals, strict=True)]
        return found


@kernel
def _along(curves: StripCurves, road: _Road, prior: JointPrior, start: tuple[float, float], tries: Floats) -> Floats:
    """(n, 4): values of `EvenFog` by piece, curvature over its standard deviation and albedo (n, 3)."""
    out = np.empty((len(tries), 4))
    for i in range(len(tries)):
        piece, curvature, over = int(tries[i, 0]), tries[i, 1], int(tries[i, 2])
        # Tries of one course follow one another.
        if i == 0 or piece != int(tries[i - 1, 0]) or curvature != tries[i - 1, 1]:
            around, sag, cost = _around(road.ahead, road.before, prior, piece, curvature)
            shift = road.seen_from.horizon + around.shift - road.seen_from.horizon
            along = lay_along(road.straight, road.seen_from, shift, sag, road.bend, road.sides)
            bins = thinned_bins(curves, along, around)
        one = _EVERY[over]
        albedo = Albedo(one[0], one[1], one[2], one[3], one[4], one[5], 0.0)
        fog = even_fog_over(bins, albedo, around, (start[0], start[1], around.shift), _CHANCES[over])
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = fog.cost + cost, fog.extinction, fog.variance, fog.left_out
    return out


@kernel
def _cost(ahead: SagsAhead, before: Floats, sag: Floats, curvature: float) -> float:
    """Minus twice the logarithm of how likely a course is, beforehand and by the lines."""
    return cost_given(ahead, sag, before) + beginning_cost(curvature)


@kernel
def _costs(ahead: SagsAhead, before: Floats, curvatures: Floats) -> Floats:
    """(pieces, n): `_cost` of courses that begin at each piece, by curvatures over their standard deviation [-]."""
    out = np.empty((PIECES, curvatures.size))
    for piece in range(PIECES):
        for i in range(curvatures.size):
            curvature = curvatures[i] * SAG_DEVIATION
            out[piece, i] = _cost(ahead, before, sag_from(piece, curvature), curvature)
    return out


@kernel
def _around(
    ahead: SagsAhead, before: Floats, prior: JointPrior, piece: int, curvature: float
) -> tuple[JointPrior, Floats, float]:
    """Prior where the road sags or crests from a piece on, its curvatures by piece, and the cost of that."""
    sag = sag_from(piece, curvature * SAG_DEVIATION)
    row, variance = row_given(ahead, sag)
    level, _ = row_given(ahead, np.zeros(PIECES))
    deviation = min(prior.shift_deviation, math.sqrt(max(variance, _LEAST_VARIANCE)))
    around = with_horizon(prior, prior.shift + (row - level), deviation)
    return around, sag, _cost(ahead, before, sag, curvature * SAG_DEVIATION)


def _likeliest(fog: Callable[[float], EvenFog], tried: dict[float, EvenFog]) -> tuple[float, EvenFog, float]:
    """Likeliest curvature over its standard deviation, its fog, and what its width adds to the cost (Laplace)."""
    curve = 1.0
    for _ in range(_STEPS):
        at = sorted(tried)
        costs = [tried[value].cost for value in at]
        middle = min(max(costs.index(min(costs)), 1), len(at) - 2)
        vertex, curve = _parabola(at[middle - 1 : middle + 2], costs[middle - 1 : middle + 2])
        if curve <= 0.0 or vertex in tried:
            break
        tried[vertex] = fog(vertex)
    costs = [one.cost for one in tried.values()]
    best = list(tried)[costs.index(min(costs))]
    return best, tried[best], math.log(max(curve, 1.0))


def _parabola(at: list[float], costs: list[float]) -> tuple[float, float]:
    """Vertex of the parabola through three points, within what is likely, and its factor of the square."""
    (a, b, c), (f, g, h) = at, costs
    left, right = (g - f) / (b - a), (h - g) / (c - b)
    curve = (right - left) / (c - a)
    if curve <= 0.0:
        return b, curve
    vertex = 0.5 * (a + b - left / curve)
    return round(min(max(vertex, -_MOST), _MOST), 3), curve
