"""highway-env's lanes as FogSim's road network; its y axis points down, FogSim's up."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from highway_env.road.lane import LineType
from highway_env.vehicle.kinematics import Vehicle
from numpy.typing import ArrayLike, NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Lane, LaneMarking, RoadNetwork

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
    turn = following.heading_at(_reached_at(lane, following)) - lane.heading_at(lane.length)
    return abs(math.remainder(turn, math.tau)) < _WIDEST_BEND


def _reached_at(lane: Any, following: Any) -> float:
    """Station of a lane abreast of another's end [m]."""
    station, _ = following.local_coordinates(lane.position(lane.length, 0.0))
    return float(np.clip(station, 0.0, following.length))


class RouteProgress:
    """Position along a route (n, 3) [m] of a vehicle that moves on from one look to the next."""

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
        """Nearest position along the route to `here` that can have been reached; it falls only `backwards` [m]."""
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


_SAMPLING = 2.0
"""Longest piece of a curved centreline [m]; at 10 m radius it leaves the curve by 5 cm."""

_MARKINGS = {
    LineType.STRIPED: LaneMarking.DASHED,
    LineType.CONTINUOUS: LaneMarking.SOLID,
    LineType.CONTINUOUS_LINE: LaneMarking.SOLID,
}


def upright(points: ArrayLike) -> NDArray[np.float64]:
    """Points (..., 2) of highway-env as (..., 3) with y up, on the level road [m] (`points` (..., 2) [m])."""
    flat = np.asarray(points, dtype=np.float64)
    return np.stack((flat[..., 0], 0.0 - flat[..., 1], np.zeros(flat.shape[:-1])), axis=-1)


def road_network(road: Any, ego: Any) -> RoadNetwork:
    """Lanes of a road, and the ego's planned route, or straight on without one, to the end of the last lane."""
    lanes = [
        lane
        for start, ends in road.network.graph.items()
        for end, parallel in ends.items()
        for lane in _carriageway(edge_id(start, end), parallel)
    ]
    route, limits = _route(road.network, ego)
    return RoadNetwork(tuple(lanes), route, route_limits=limits)


def _carriageway(edge_id: str, parallel: Sequence[Any]) -> Iterator[Lane]:
    """Lanes side by side, the leftmost first."""
    marks = [[_MARKINGS.get(kind, LaneMarking.NONE) for kind in lane.line_types] for lane in parallel]
    for index, lane in enumerate(parallel):
        left, right = marks[index]
        # The line between two lanes is named by one of them.
        if index > 0 and left is LaneMarking.NONE:
            left = marks[index - 1][1]
        if index + 1 < len(parallel) and right is LaneMarking.NONE:
            right = marks[index + 1][0]
        yield Lane(
            lane_id=f"{edge_id}_{index}",
            edge_id=edge_id,
            centreline=_centreline(lane),
            width=float(lane.width_at(0.0)),
            speed_limit=speed_limit(lane),
            left=left,
            right=right,
            outermost=index + 1 == len(parallel),
        )


def speed_limit(lane: Any) -> float:
    """Speed limit of a lane [m/s]; where it has none, the highest speed of highway-env's vehicles."""
    return float(Vehicle.MAX_SPEED if lane.speed_limit is None else lane.speed_limit)


def lane_id(index: tuple[str, str, int]) -> str:
    """Id of a lane, as in the road network."""
    start, end, number = index
    return f"{edge_id(start, end)}_{number}"


def edge_id(start: str, end: str) -> str:
    """Id of an edge, as in the road network."""
    return f"{start}>{end}"


def _centreline(lane: Any, start: float = 0.0) -> NDArray[np.float64]:
    stations = np.linspace(start, lane.length, max(2, math.ceil((lane.length - start) / _SAMPLING) + 1))
    if np.ptp([lane.heading_at(s) for s in stations]) == 0:
        stations = stations[[0, -1]]
    return upright([lane.position(s, 0.0) for s in stations])


def _route(network: Any, ego: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points of the ego's route [m], and the speed limits on the way to them [m/s]."""
    lanes = [network.get_lane(index) for index in lanes_ahead(network, ego)]
    starts = [0.0, *(_reached_at(one, following) for one, following in itertools.pairwise(lanes))]
    lines = [_centreline(lane, start) for lane, start in zip(lanes, starts, strict=True)]
    points, limits = np.concatenate(lines), np.repeat([speed_limit(lane) for lane in lanes], list(map(len, lines)))
    apart = np.concatenate(([True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6))
    return points[apart], limits[apart]


def same_roads(one: RoadNetwork, other: RoadNetwork) -> bool:
    """Whether two networks have the same lanes, whatever the routes."""
    return len(one.lanes) == len(other.lanes) and all(
        np.array_equal(a.centreline, b.centreline)
        and (a.lane_id, a.width, a.speed_limit, a.left, a.right) == (b.lane_id, b.width, b.speed_limit, b.left, b.right)
        for a, b in zip(one.lanes, other.lanes, strict=True)
    )
