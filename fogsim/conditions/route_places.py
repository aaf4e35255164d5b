"""Where vehicles are along a route: places, extents, gaps and times between them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.values import TrafficState

FARTHEST_ASIDE = 30.0
"""Distance from the route up to which a vehicle has a place along it [m]: that of the other carriageway."""

_AS_NEAR = 1.0
"""Where a route passes a place twice, its ways there lie this near to one another [m]."""


@dataclass(frozen=True, slots=True)
class RoutePlace:
    """Where a vehicle is along a route.

    Attributes
    ----------
    front : float
        Position of its front bumper [m].
    along : float
        Cosine of its heading to the route: 1 with it, −1 against it.
    """

    front: float
    along: float


class Route:
    """A polyline along which places count.

    Parameters
    ----------
    points : (n, 3) float64
        Its points [m], at least two.
    """

    def __init__(self, points: NDArray[np.float64]) -> None:
        self.points, self._corners = points, np.array(points, np.float64)
        steps = np.diff(points, axis=0)
        self._length = np.linalg.norm(steps, axis=1)
        self._start = np.concatenate(([0.0], np.cumsum(self._length)[:-1]))
        self._direction = steps / np.maximum(self._length, 1e-9)[:, None]
        self._at, self._aside = np.empty(len(steps)), np.empty(len(steps))

    def locate(self, position: NDArray[np.float64], heading: float, near: float | None = None) -> RoutePlace | None:
        """Nearest place on the route; None if it is farther than `FARTHEST_ASIDE`.

        Parameters
        ----------
        position : (3,) float64
            Where it is [m].
        heading : float
            Direction of travel [rad].
        near : float or None
            A position along the route: of several places that are as near, the one nearest to it [m].
        """
        at, aside = self._at, self._aside
        nearest = nearest_piece(position, self._corners, self._direction, self._length, at, aside)
        if aside[nearest] > FARTHEST_ASIDE:
            return None
        if near is not None:
            nearest = piece_about(float(near), self._start, at, aside, nearest)
        x, y, _ = self._direction[nearest].tolist()
        along = x * math.cos(heading) + y * math.sin(heading)
        return RoutePlace(float(self._start[nearest] + at[nearest]), along)


@kernel
def nearest_piece(
    place: NDArray[np.float64],
    points: NDArray[np.float64],
    direction: NDArray[np.float64],
    length: NDArray[np.float64],
    at: NDArray[np.float64],
    aside: NDArray[np.float64],
) -> int:
    """Find the piece of a polyline that is nearest to a place, the first of several.

    Parameters
    ----------
    place : (3,) float64
        The place [m].
    points : (n + 1, 3) float64
        Points of the polyline [m].
    direction, length : (n, 3), (n,) float64
        Unit vectors along its pieces, and their lengths [m].
    at, aside : (n,) float64
        Where on each piece its nearest point is, and how far from the place [m]; written to.
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
def piece_about(
    near: float, start: NDArray[np.float64], at: NDArray[np.float64], aside: NDArray[np.float64], nearest: int
) -> int:
    """Find, of pieces that are about as near to a place as the nearest, the one that is nearest along the polyline.

    Parameters
    ----------
    near : float
        A position along the polyline [m].
    start : (n,) float64
        Where its pieces begin along it [m].
    at, aside : (n,) float64
        From `nearest_piece`.
    nearest : int
        The nearest piece.
    """
    farthest, here, least = aside[nearest] + _AS_NEAR, -1, math.inf
    for i in range(len(start)):
        apart = abs(start[i] + at[i] - near)
        if aside[i] <= farthest and (here < 0 or apart < least):
            here, least = i, apart
    # Points of one piece of the way are all as near: the nearest of those about this one is meant.
    found = here
    for i in range(len(start)):
        is_about = aside[i] <= farthest and abs(start[i] - start[here]) <= 2.0 * FARTHEST_ASIDE
        if is_about and (aside[i] < aside[found] or (aside[i] == aside[found] and i < found)):
            found = i
    return found


@dataclass(frozen=True, slots=True)
class Extent:
    """The piece of a route that a vehicle covers, and how it moves along it.

    Attributes
    ----------
    begin, end : float
        Positions of its two bumpers, in the direction of the route [m].
    velocity : float
        Along the route [m/s]; negative for oncoming vehicles.
    """

    begin: float
    end: float
    velocity: float


def extent_of(place: RoutePlace, traffic: TrafficState, row: int) -> Extent:
    """What a vehicle covers of a route.

    Parameters
    ----------
    place : RoutePlace
        Where its front bumper is.
    traffic : TrafficState
        The traffic.
    row : int
        Its row.
    """
    rear = place.front - float(traffic.length[row]) * place.along
    return Extent(min(rear, place.front), max(rear, place.front), float(traffic.speed[row]) * place.along)


def gap_between(one: Extent, other: Extent) -> float:
    """Gap from one vehicle to another along the route, bumper to bumper [m].

    Positive for another that is ahead in the direction of the route, negative for one behind, 0 for one beside.

    Parameters
    ----------
    one, other : Extent
        The two.
    """
    return max(other.begin - one.end, 0.0) or min(other.end - one.begin, 0.0)


def time_to_meet(one: Extent, other: Extent) -> float:
    """Time until one vehicle and another are beside one another at constant speeds [s].

    ``inf`` if they do not approach; 0 while they are beside one another.

    Parameters
    ----------
    one, other : Extent
        The two.
    """
    gap = gap_between(one, other)
    approach = math.copysign(1.0, gap) * (one.velocity - other.velocity)
    return 0.0 if gap == 0.0 else abs(gap) / approach if approach > 0.0 else math.inf


def headway_between(one: Extent, other: Extent) -> float:
    """Time that the one that is behind takes for the gap at its speed [s]; ``inf`` if it stands or drives away.

    Parameters
    ----------
    one, other : Extent
        The two.
    """
    gap = gap_between(one, other)
    speed = one.velocity if gap >= 0.0 else other.velocity
    return abs(gap) / speed if speed > 0.0 else math.inf
