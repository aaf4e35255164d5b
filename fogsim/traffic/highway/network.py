"""highway-env's lanes as FogSim's road network; its y axis points down, FogSim's up."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from highway_env.road.lane import LineType
from highway_env.vehicle.kinematics import Vehicle
from numpy.typing import ArrayLike, NDArray

from fogsim.traffic.highway.route import lanes_ahead, reached_at
from fogsim.values import Lane, LaneMarking, RoadNetwork

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
    """Lanes of a road and the route of the ego.

    Parameters
    ----------
    road : highway_env.road.road.Road
        The road.
    ego : highway_env.vehicle.kinematics.Vehicle
        The ego.

    Returns
    -------
    RoadNetwork
        The route leads along the planned route of the ego, or without one straight on, to the end of the last lane.
    """
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
    starts = [0.0, *(reached_at(one, following) for one, following in itertools.pairwise(lanes))]
    lines = [_centreline(lane, start) for lane, start in zip(lanes, starts, strict=True)]
    points, limits = np.concatenate(lines), np.repeat([speed_limit(lane) for lane in lanes], list(map(len, lines)))
    apart = np.concatenate(([True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6))
    return points[apart], limits[apart]


def same_roads(one: RoadNetwork, other: RoadNetwork) -> bool:
    """Whether two networks have the same lanes, whatever the routes.

    Parameters
    ----------
    one, other : RoadNetwork
        The networks.
    """
    return len(one.lanes) == len(other.lanes) and all(
        np.array_equal(a.centreline, b.centreline)
        and (a.lane_id, a.width, a.speed_limit, a.left, a.right) == (b.lane_id, b.width, b.speed_limit, b.left, b.right)
        for a, b in zip(one.lanes, other.lanes, strict=True)
    )
