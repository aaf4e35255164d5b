"""Even fog over a road that may sag or crest where its lines do not show it: there it fades as in uneven fog."""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fogsim.values.camera import Camera
from fogsim.vision.lines.road_course import SAG_DEVIATION, RoadCourse, beginning_cost, sag_from
from fogsim.vision.lines.road_course_kernels import PIECES
from fogsim.vision.strips import joint_fit
from fogsim.vision.strips.course_geometry import course_geometry
from fogsim.vision.strips.joint_fit import ALBEDOS, JointFit
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import StripGeometry
from fogsim.vision.uneven.fog_evidence import EvenFog, even_fog_over, thinned_bins

_TRIED = (-2.0, -1.0, -0.5, 0.5, 1.0, 2.0)
"""Curvatures that are tried first, over their standard deviation [-]."""

_MOST, _STEPS = 3.0, 3
"""Most curvature, over its standard deviation [-], and how often a parabola through the best three is followed."""

_LEAST_VARIANCE = 1e-4
"""Least variance of the horizon's row where the road's curvature is given [px²]."""

_RIVAL = 20.0
"""By how much a cost may lie above the best for a course to be tried at all, and over other albedos [-]."""

_AlongCourse = Callable[[int, float], EvenFog]
"""Even fog by albedo and curvature."""


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
        found: list[EvenFog] = []
        begun: list[tuple[float, _AlongCourse, float, float]] = []
        for piece in range(1, PIECES):
            tried = [value for value in _TRIED if self._cost(piece, value) < gain + _RIVAL]
            if len(tried) < 3:
                continue
            along: _AlongCourse = functools.partial(self._even_fog, curves, prior, start, piece)
            curvature, one, width = _likeliest(functools.partial(along, albedo), tried)
            found.append(replace(one, cost=one.cost + width))
            begun.append((found[-1].cost, along, curvature, width))
        least = min((one.cost for one in found), default=math.inf)
        for cost, along, curvature, width in begun:
            if cost < least + _RIVAL:
                others = (along(other, curvature) for other in range(len(ALBEDOS)) if other != albedo)
                found += [replace(one, cost=one.cost + width) for one in others]
        return found

    def _cost(self, piece: int, curvature: float) -> float:
        """Minus twice the logarithm of how likely a course is, beforehand and by the lines."""
        sag = sag_from(piece, curvature * SAG_DEVIATION)
        return self.course.ahead.cost(sag) + beginning_cost(curvature * SAG_DEVIATION)

    def _even_fog(
        self, curves: StripCurves, prior: JointPrior, start: JointFit, piece: int, albedo: int, curvature: float
    ) -> EvenFog:
        """Even fog over a road that sags or crests from a piece on, with how likely that is beforehand and by lines."""
        ahead, sag = self.course.ahead, sag_from(piece, curvature * SAG_DEVIATION)
        row, variance = ahead.row(sag)
        moved = row - ahead.row(np.zeros(PIECES))[0]
        deviation = min(prior.shift_deviation, math.sqrt(max(variance, _LEAST_VARIANCE)))
        around = prior._replace(shift=prior.shift + moved, shift_deviation=deviation)
        course = replace(self.course, row=self.camera.horizon_row + around.shift, sag=sag)
        geometry = course_geometry(self.straight, self.camera, course).only(list(range(len(curves.variance))))
        bins = thinned_bins(joint_fit.strip_bins(curves, geometry, around))
        found = even_fog_over(bins, albedo, around, replace(start, shift=around.shift))
        return replace(found, cost=found.cost + self._cost(piece, curvature))


def _likeliest(fog: Callable[[float], EvenFog], first: Sequence[float]) -> tuple[float, EvenFog, float]:
    """Likeliest curvature over its standard deviation, its fog, and what its width adds to the cost (Laplace)."""
    tried = {value: fog(value) for value in first}
    curve = 1.0
    for _ in range(_STEPS):
        at = sorted(tried)
        middle = min(max(at.index(min(at, key=lambda value: tried[value].cost)), 1), len(at) - 2)
        around = at[middle - 1 : middle + 2]
        vertex, curve = _parabola(around, [tried[value].cost for value in around])
        if curve <= 0.0 or vertex in tried:
            break
        tried[vertex] = fog(vertex)
    best = min(tried, key=lambda value: tried[value].cost)
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
