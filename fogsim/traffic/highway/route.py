"""The ego's way over highway-env's lanes, and how far along it the ego is.

Lanes need not begin where those of the road before end: some begin farther back, some run the other way (into a
junction, next to the way out of it). And ways cross themselves. So a way goes on where a lane is reached, not where it
begins, and a place on it is looked for where the ego can have come since the last time.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product

FASTEST_GAIN = 1.5
"""Way along the route for each metre driven, at most [-]: who cuts a bend gains on the middle of the route's lane."""

_WIDEST_BEND = 2.0 * math.pi / 3.0
"""A lane that turns off by more than this does not lead on [rad]."""


def planned_route(vehicle: Any) -> Any:
    """Lanes that a vehicle plans to drive; None if it has no plan, or is of a kind that makes none."""
    return getattr(vehicle, "route", None)


def lanes_ahead(network: Any, ego: Any) -> Iterator[tuple[str, str, int]]:
    """Lanes one after the other, from the ego's own; a route in circles is ended, and one that would turn back."""
    # The library takes what has been driven off the list that it is given.
    here, plan, passed = ego.lane_index, list(planned_route(ego) or ()), set()
    while here not in passed:
        yield here
        passed.add(here)
        lane = network.get_lane(here)
        if plan and all(step[:2] == here[:2] for step in plan):
            return
        here = network.next_lane(here, route=plan, position=lane.position(lane.length, 0.0))
        if not _leads_on(lane, network.get_lane(here)):
            return


def _leads_on(lane: Any, following: Any) -> bool:
    turn = following.heading_at(reached_at(lane, following)) - lane.heading_at(lane.length)
    return abs(math.remainder(turn, math.tau)) < _WIDEST_BEND


def reached_at(lane: Any, following: Any) -> float:
    """Station of a lane abreast of another's end [m]."""
    station, _ = following.local_coordinates(lane.position(lane.length, 0.0))
    return float(np.clip(station, 0.0, following.length))


class RouteProgress:
    """How far along a route a vehicle is that moves on from one look to the next.

    Parameters
    ----------
    line : (n, 3) float64
        Polyline along the route [m].
    """

    def __init__(self, line: NDArray[np.float64]) -> None:
        self._line = line
        steps = np.diff(line, axis=0)
        self._starts = np.concatenate(([0.0], np.cumsum([math.hypot(*step) for step in steps])))
        self._last: tuple[float, NDArray[np.float64]] | None = None

    @property
    def length(self) -> float:
        """Length of the route [m]."""
        return float(self._starts[-1])

    def update(self, here: NDArray[np.float64], backwards: bool = False) -> float:
        """Station of the place of the route that is nearest, among those that can have been reached [m].

        Parameters
        ----------
        here : (3,) float64
            Where the vehicle is now [m].
        backwards : bool
            Whether it drives backwards; else its station does not decrease.
        """
        if self._last is None:
            station = self._nearest(here, 0.0, self.length)
        else:
            before, there = self._last
            reach = FASTEST_GAIN * math.dist(here, there)
            ahead, behind = (0.0, reach) if backwards else (reach, 0.0)
            station = self._nearest(here, before - behind, before + ahead)
        self._last = station, here
        return station

    def _nearest(self, here: NDArray[np.float64], start: float, end: float) -> float:
        """Nearest place between two stations."""
        start, end = max(start, 0.0), min(end, self.length)
        first = int(np.searchsorted(self._starts, start, side="right")) - 1
        behind = min(int(np.searchsorted(self._starts, end)), len(self._line) - 1)
        best, nearest = math.inf, start
        for index in range(max(first, 0), behind):
            begins, ends = float(self._starts[index]), float(self._starts[index + 1])
            point, along = self._line[index], self._line[index + 1] - self._line[index]
            foot = begins + float(matrix_product(here - point, along)) / (ends - begins)
            station = min(max(foot, begins, start), ends, end)
            distance = math.dist(point + (station - begins) / (ends - begins) * along, here)
            if distance < best:
                best, nearest = distance, station
        return nearest
