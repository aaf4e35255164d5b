"""Roads of a SUMO network as plain geometry."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sumolib
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.values import Lane, LaneMarking, RoadNetwork


def read_net(path: Path) -> Any:
    """Read a SUMO network file.

    Raises
    ------
    InputError
        If the file is no SUMO network.
    """
    try:
        net = sumolib.net.readNet(str(path), withInternal=True)
    except Exception as error:
        raise InputError(f"{path}: not a SUMO network: {error}") from error
    if not net.getEdges():
        raise InputError(f"{path}: the SUMO network has no edges")
    return net


def road_network(net: Any, route: Sequence[str]) -> RoadNetwork:
    """Every lane of a network, and the axis of a route.

    Parameters
    ----------
    net : sumolib.net.Net
        The network.
    route : sequence of str
        Edge ids of the ego's route.
    """
    lanes = tuple(_lane(lane) for edge in net.getEdges() for lane in edge.getLanes())
    return RoadNetwork(lanes=lanes, route=_route_axis(net, route))


def _lane(lane: Any) -> Lane:
    edge = lane.getEdge()
    last = edge.getLaneNumber() - 1
    inside_junction = edge.getFunction() == "internal"

    def marking(at_border: bool) -> LaneMarking:
        if inside_junction:
            return LaneMarking.NONE
        return LaneMarking.SOLID if at_border else LaneMarking.DASHED

    return Lane(
        lane_id=lane.getID(),
        edge_id=edge.getID(),
        centreline=np.array(lane.getShape3D(), dtype=np.float64),
        width=float(lane.getWidth()),
        speed_limit=float(lane.getSpeed()),
        left=marking(lane.getIndex() == last),
        right=marking(lane.getIndex() == 0),
        outermost=lane.getIndex() == 0 and not inside_junction,
    )


def _route_axis(net: Any, route: Sequence[str]) -> NDArray[np.float64]:
    """Middle lanes of a route's edges, end to end, without repeated points."""
    parts = []
    for edge_id in route:
        lanes = net.getEdge(edge_id).getLanes()
        parts.append(np.array(lanes[len(lanes) // 2].getShape3D(), dtype=np.float64))
    points = np.concatenate(parts)
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-3
    return points[np.concatenate(([True], moved))]
