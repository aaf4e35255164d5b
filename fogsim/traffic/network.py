"""Roads and signs of a SUMO network as plain geometry."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sumolib
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.units import KMH_PER_MPS
from fogsim.values import Lane, LaneMarking, RoadNetwork, Sign, SignMap

SIGN_POI_TYPE = "fogsim.sign."
"""POIs of type ``fogsim.sign.KIND`` with ``<param key="value" …/>`` in an additional file are signs."""

SPEED_LIMIT = "speed_limit"
SIGN_CLEARANCE = 3.9
"""Lateral distance from the edge of the outermost lane to the middle of a sign [m]: behind shoulder and rail."""
SIGN_HEIGHT = 2.6
"""Height of the middle of a sign's face above the road [m]."""
SIGN_DIAMETER = 0.9
"""Diameter of a round sign outside towns [m]; 0.75–0.9 m for speeds above 80 km/h (German VzKat size 3)."""


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


def sign_map(net: Any, additional: Iterable[Path]) -> SignMap:
    """Signs of a network: where the speed limit changes, and POIs of the documented kind.

    Parameters
    ----------
    net : sumolib.net.Net
        The network.
    additional : iterable of Path
        SUMO additional files.

    Raises
    ------
    InputError
        If a sign's POI has no usable value.
    """
    signs = [sign for edge in net.getEdges(withInternal=False) if (sign := _limit_sign(edge)) is not None]
    for path in additional:
        signs += _poi_signs(path)
    return SignMap(tuple(signs))


def _limit_sign(edge: Any) -> Sign | None:
    """Sign at the start of an edge whose limit differs from that of every edge leading to it."""
    limit = edge.getSpeed()
    if any(abs(incoming.getSpeed() - limit) < 0.1 for incoming in edge.getIncoming()):
        return None
    lane = edge.getLanes()[0]
    points = np.array(lane.getShape3D(), dtype=np.float64)
    along = points[1] - points[0]
    heading = math.atan2(along[1], along[0])
    offset = lane.getWidth() / 2 + SIGN_CLEARANCE
    # Ten metres into the edge, so that the sign stands on the stretch that it speaks for.
    x, y, z = points[0] + along / np.linalg.norm(along) * min(10.0, 0.5 * lane.getLength())
    x, y = float(x) + offset * math.sin(heading), float(y) - offset * math.cos(heading)
    return Sign(
        f"limit.{edge.getID()}",
        SPEED_LIMIT,
        float(limit),
        (x, y, float(z) + SIGN_HEIGHT),
        heading,
        SIGN_DIAMETER,
    )


def _poi_signs(path: Path) -> list[Sign]:
    signs = []
    for poi in sumolib.xml.parse(str(path), ["poi"]):
        kind = str(poi.getAttributeSecure("type", ""))
        if not kind.startswith(SIGN_POI_TYPE):
            continue
        parameters = {p.key: p.value for p in (poi.param or [])}
        signs.append(_poi_sign(path, poi, kind.removeprefix(SIGN_POI_TYPE), parameters))
    return signs


def _poi_sign(path: Path, poi: Any, kind: str, parameters: dict[str, str]) -> Sign:
    where = f"{path}: poi {poi.id!r}"
    try:
        value = float(parameters["value"])
        heading = math.radians(90.0 - float(poi.getAttributeSecure("angle", "")))
        position = (float(poi.x), float(poi.y), SIGN_HEIGHT)
    except KeyError:
        raise InputError(f'{where}: a sign needs <param key="value" value="…"/>') from None
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}: a sign needs numbers for x, y, angle and its value: {error}") from None
    if kind == SPEED_LIMIT:
        value /= KMH_PER_MPS
    return Sign(str(poi.id), kind, value, position, heading, float(parameters.get("diameter", SIGN_DIAMETER)))
