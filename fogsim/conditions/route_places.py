"""Vehicles along a route: positions, extents, gaps and times between them."""

import bisect
import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values import TrafficState

FARTHEST_ASIDE = 30.0
"""Largest lateral distance of a position on a route [m]; it includes the other carriageway."""

_AS_NEAR = 1.0
"""Where a route passes a point twice, its parts there are at most this far apart [m]."""

_HALF_ARC = 25.0
"""Half of the part of a route whose curvature is measured [m]: maps draw curves with corners 5 to 20 m apart."""


@dataclass(frozen=True, slots=True)
class RoutePlace:
    """Position of a vehicle's front bumper along a route [m], and the cosine of its heading to the route."""

    front: float
    along: float


class Route:
    """A polyline (n, 3) [m] along which positions count."""

    def __init__(self, points: NDArray[np.float64]) -> None:
        self.points, self._corners = points, np.array(points, np.float64)
        steps = np.diff(points, axis=0)
        self._length = np.linalg.norm(steps, axis=1)
        self._start = np.concatenate(([0.0], np.cumsum(self._length)[:-1]))
        self._direction = steps / np.maximum(self._length, 1e-9)[:, None]
        self._at, self._aside = np.empty(len(steps)), np.empty(len(steps))

    def locate(self, position: NDArray[np.float64], heading: float, near: float | None = None) -> RoutePlace | None:
        """Nearest place on the route, None beyond `FARTHEST_ASIDE`; of equally near ones, the closest to `near` [m]."""
        at, aside = self._at, self._aside
        nearest = nearest_piece(position, self._corners, self._direction, self._length, at, aside)
        if aside[nearest] > FARTHEST_ASIDE:
            return None
        if near is not None:
            nearest = segment_near(float(near), self._start, at, aside, nearest)
        x, y, _ = self._direction[nearest].tolist()
        along = x * math.cos(heading) + y * math.sin(heading)
        return RoutePlace(float(self._start[nearest] + at[nearest]), along)

    @functools.cached_property
    def _pieces(self) -> tuple[list[float], list[list[float]]]:
        """Beginning of each piece [m], and x, y of its beginning [m] and of its direction: quick to look up singly."""
        return self._start.tolist(), np.hstack((self.points[:-1, :2], self._direction[:, :2])).tolist()

    def curvature(self, at: float) -> float:
        """Curvature about a position [1/m]: that of the circle through the points 25 m before it, there and after."""
        last = float(self._start[-1] + self._length[-1])
        if last < 2.0 * _HALF_ARC:
            return 0.0
        middle = min(max(at, _HALF_ARC), last - _HALF_ARC)
        a, b, c = (self._point(middle + ahead) for ahead in (-_HALF_ARC, 0.0, _HALF_ARC))
        doubled = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        return 2.0 * abs(doubled) / max(math.dist(a, b) * math.dist(b, c) * math.dist(a, c), 1e-9)

    def _point(self, at: float) -> tuple[float, float]:
        """Point at a position along the route [m]."""
        starts, pieces = self._pieces
        piece = max(bisect.bisect_right(starts, at) - 1, 0)
        (x, y, east, north), further = pieces[piece], at - starts[piece]
        return x + further * east, y + further * north


@kernel
def nearest_piece(
    place: NDArray[np.float64],
    points: NDArray[np.float64],
    direction: NDArray[np.float64],
    length: NDArray[np.float64],
    at: NDArray[np.float64],
    aside: NDArray[np.float64],
) -> int:
    """Index of the first polyline piece nearest to a place (3,) [m].

    For pieces with unit vectors `direction` (n, 3) and lengths (n,) [m], writes the nearest point's position on each
    piece to `at` and its distance from the place to `aside` [m].
    """
    nearest = 0
    for i in range(len(length)):
        x, y, z = place[0] - points[i, 0], place[1] - points[i, 1], place[2] - points[i, 2]
        along = x * direction[i, 0] + y * direction[i, 1] + z * direction[i, 2]
        along = min(max(along, 0.0), length[i])
        x, y, z = x - along * direction[i, 0], y - along * direction[i, 1], z - along * direction[i, 2]
        at[i], aside[i] = along, math.sqrt(x * x + y * y + z * z)
        if aside[i] < aside[nearest]:
            nearest = i
    return nearest


@kernel
def segment_near(
    near: float, start: NDArray[np.float64], at: NDArray[np.float64], aside: NDArray[np.float64], nearest: int
) -> int:
    """Of the pieces about as near as `nearest`, the index of the one closest to position `near` [m] along the polyline.

    `start` is where each piece begins [m]; `at` and `aside` are from `nearest_piece`.
    """
    farthest, here, least = aside[nearest] + _AS_NEAR, -1, math.inf
    for i in range(len(start)):
        apart = abs(start[i] + at[i] - near)
        if aside[i] <= farthest and (here < 0 or apart < least):
            here, least = i, apart
    # Points of one piece are about as near: the nearest of those around this one is meant.
    found = here
    for i in range(len(start)):
        is_near = aside[i] <= farthest and abs(start[i] - start[here]) <= 2.0 * FARTHEST_ASIDE
        if is_near and (aside[i] < aside[found] or (aside[i] == aside[found] and i < found)):
            found = i
    return found


@dataclass(frozen=True, slots=True)
class Extent:
    """The interval of a route between a vehicle's bumpers [m], and its velocity along it [m/s]."""

    begin: float
    end: float
    velocity: float


def extent_of(place: RoutePlace, traffic: TrafficState, row: int) -> Extent:
    """The part of a route that the vehicle in a row covers."""
    rear = place.front - float(traffic.length[row]) * place.along
    return Extent(min(rear, place.front), max(rear, place.front), float(traffic.speed[row]) * place.along)


def gap_between(one: Extent, other: Extent) -> float:
    """Gap from one vehicle to another along the route, bumper to bumper [m]: negative behind, 0 if they overlap."""
    return max(other.begin - one.end, 0.0) or min(other.end - one.begin, 0.0)


def time_to_meet(one: Extent, other: Extent) -> float:
    """Time until two vehicles overlap at constant speeds [s]: 0 while they do, ``inf`` if they do not approach."""
    gap = gap_between(one, other)
    approach = math.copysign(1.0, gap) * (one.velocity - other.velocity)
    return 0.0 if gap == 0.0 else abs(gap) / approach if approach > 0.0 else math.inf


def headway_between(one: Extent, other: Extent) -> float:
    """Time that the vehicle behind needs for the gap at its speed [s]; ``inf`` if it stops or moves away."""
    gap = gap_between(one, other)
    speed = one.velocity if gap >= 0.0 else other.velocity
    return abs(gap) / speed if speed > 0.0 else math.inf
