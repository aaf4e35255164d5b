"""Signs of a SUMO network: where limits change, marked places in additional files, OpenDRIVE signals."""

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import sumolib

from fogsim.errors import InputError
from fogsim.traffic.road.opendrive import is_opendrive, opendrive_signs
from fogsim.units import KMH_PER_MPS
from fogsim.values import Sign, SignMap

SIGN_TYPE = "fogsim.sign."
"""POIs and polygons of type ``fogsim.sign.KIND`` in an additional file are signs."""

SPEED_LIMIT = "speed_limit"
LIMITS = frozenset((SPEED_LIMIT, "end_of_speed_limit", "variable_speed_limit"))
"""Kinds whose value is a speed, in km/h in additional files."""
SIGN_CLEARANCE = 3.9
"""Lateral distance from the edge of the outermost lane to the middle of a sign [m]: behind shoulder and rail."""
_OTHER_CLEARANCES = (2.0, 1.0, 6.0, 8.0, 12.0, 18.0, 24.0)
"""Where a sign stands if that is on another road, the first that is not [m]."""
SIGN_HEIGHT = 2.6
"""Height of the middle of a sign's face above the road [m]."""
GANTRY_HEIGHT = 6.2
"""Height of the middle of a face that hangs over a lane, above the road [m]: vehicles up to 4.5 m pass below."""
SIGN_DIAMETER = 0.9
"""Diameter of a round sign outside towns [m]; 0.75–0.9 m for speeds above 80 km/h (German VzKat size 3)."""

LonLat = tuple[float, float]


def sign_map(net: Any, additional: Iterable[Path]) -> SignMap:
    """Signs of a network; none at all make an empty map.

    Parameters
    ----------
    net : sumolib.net.Net
        The network.
    additional : iterable of Path
        SUMO additional files, and OpenDRIVE files (``.xodr``) that the network was made from.

    Raises
    ------
    InputError
        If a sign cannot be placed or has no usable value.
    """
    side = 1.0 if getattr(net, "lefthand", False) else -1.0
    signs = [sign for edge in net.getEdges(withInternal=False) if (sign := _limit_sign(edge, side)) is not None]
    roads = _Roads(net)
    for path in additional:
        signs += opendrive_signs(path, _net_offset(net)) if is_opendrive(path) else _marked_signs(path, roads)
    return SignMap(tuple(signs))


def geographic_position(net: Any) -> Callable[[float, float], LonLat] | None:
    """Conversion of a network's x, y [m] to longitude and latitude [deg].

    Parameters
    ----------
    net : sumolib.net.Net
        The network.

    Returns
    -------
    callable or None
        None where the network has no projection or pyproj is not installed.
    """
    try:
        projection = net.getGeoProj()
    except (KeyError, RuntimeError):
        return None
    x_offset, y_offset = _net_offset(net)

    def convert(x: float, y: float) -> LonLat:
        longitude, latitude = projection(x - x_offset, y - y_offset, inverse=True)
        return float(longitude), float(latitude)

    return convert


def _net_offset(net: Any) -> tuple[float, float]:
    """What was added to the source's coordinates to get the network's [m]."""
    try:
        x, y = net.getLocationOffset()
    except KeyError:  # a network written by hand says nothing about where it is
        return 0.0, 0.0
    return x, y


def _limit_sign(edge: Any, side: float) -> Sign | None:
    """Sign at the start of an edge whose limit differs from that of every edge leading to it.

    It stands on the left (side 1) or right (side −1) of the road, on that to which vehicles keep.
    """
    limit = edge.getSpeed()
    if any(abs(incoming.getSpeed() - limit) < 0.1 for incoming in edge.getIncoming()):
        return None
    lane = edge.getLanes()[0]
    points = np.array(lane.getShape3D(), dtype=np.float64)
    ahead = points[np.linalg.norm(points[:, :2] - points[0, :2], axis=1) > 0.01]
    if not len(ahead):
        return None  # a lane of no length, as networks written by hand may have, has no direction to face
    along = ahead[0] - points[0]
    heading = math.atan2(along[1], along[0])
    # Ten metres into the edge, so that the sign stands on the stretch that it speaks for.
    x, y, z = points[0] + along / math.hypot(*along) * min(10.0, 0.5 * lane.getLength())
    places = [
        (float(x) - left * math.sin(heading), float(y) + left * math.cos(heading))
        for left in (side * (lane.getWidth() / 2 + away) for away in (SIGN_CLEARANCE, *_OTHER_CLEARANCES))
    ]
    # Beside it may be another road, where roads part or meet.
    x, y = next((place for place in places if _is_beside_roads(place, edge)), places[0])
    return Sign(
        f"limit.{edge.getID()}",
        SPEED_LIMIT,
        float(limit),
        (x, y, float(z) + SIGN_HEIGHT),
        heading,
        SIGN_DIAMETER,
    )


def _is_beside_roads(place: tuple[float, float], edge: Any) -> bool:
    """Whether a place lies on no lane of the edges that meet this one."""
    nodes = edge.getFromNode(), edge.getToNode()
    edges = {other.getID(): other for node in nodes for other in (*node.getOutgoing(), *node.getIncoming())}
    return all(
        sumolib.geomhelper.distancePointToPolygon(place, lane.getShape()) > 0.5 * lane.getWidth() + 0.5
        for other in edges.values()
        for lane in other.getLanes()
    )


class _Roads:
    """Straight pieces of all lanes that vehicles drive on."""

    def __init__(self, net: Any) -> None:
        lanes = [lane for edge in net.getEdges(withInternal=False) for lane in edge.getLanes()]
        lanes = [lane for lane in lanes if set(lane.getPermissions()) != {"pedestrian"}]
        lines = [np.array(lane.getShape3D(), dtype=np.float64).reshape(-1, 3) for lane in lanes]
        self._start = np.concatenate([line[:-1] for line in lines])
        self._step = np.concatenate([np.diff(line, axis=0) for line in lines])
        self._half_width = np.repeat([0.5 * lane.getWidth() for lane in lanes], [max(len(li) - 1, 0) for li in lines])

    def below(self, x: float, y: float) -> tuple[float, bool]:
        """Height of the nearest lane [m], and whether the place lies over it."""
        offset, step = np.array([x, y]) - self._start[:, :2], self._step
        square = np.maximum(np.sum(step[:, :2] ** 2, axis=1), 1e-12)
        share = np.clip(np.sum(offset * step[:, :2], axis=1) / square, 0.0, 1.0)
        gap = np.linalg.norm(offset - share[:, None] * step[:, :2], axis=1) - self._half_width
        nearest = int(np.argmin(gap))
        return float(self._start[nearest, 2] + share[nearest] * step[nearest, 2]), bool(gap[nearest] < 0)


def _marked_signs(path: Path, roads: _Roads) -> list[Sign]:
    """Signs that POIs and polygons of an additional file stand for."""
    try:
        shapes = list(sumolib.xml.parse(str(path), ["poi", "poly"]))
    except Exception as error:  # whatever its parser makes of a file that is none
        raise InputError(f"{path}: not a SUMO additional file: {error}") from error
    return [_marked_sign(path, s, roads) for s in shapes if str(s.getAttributeSecure("type", "")).startswith(SIGN_TYPE)]


def _marked_sign(path: Path, shape: Any, roads: _Roads) -> Sign:
    where = f"{path}: {shape.name} {shape.id!r}"
    kind = str(shape.type).removeprefix(SIGN_TYPE)
    parameters = {p.key: p.value for p in (shape.param or [])}
    try:
        value = float(parameters["value"] if kind in LIMITS else parameters.get("value", 0.0))
        heading = math.radians(90.0 - float(shape.getAttributeSecure("angle", "")))
        x, y = _middle(shape)
        diameter = float(parameters.get("diameter", SIGN_DIAMETER))
        ground, over_lane = roads.below(x, y)
        above = float(parameters.get("height", GANTRY_HEIGHT if over_lane else SIGN_HEIGHT))
    except KeyError:
        raise InputError(f'{where}: a sign needs <param key="value" value="…"/>') from None
    except (TypeError, ValueError) as error:
        place = "shape" if shape.name == "poly" else "x, y"
        raise InputError(f"{where}: a sign needs numbers for {place}, angle and its value: {error}") from None
    if kind in LIMITS:
        value /= KMH_PER_MPS
    return Sign(str(shape.id), kind, value, (x, y, ground + above), heading, diameter)


def _middle(shape: Any) -> tuple[float, float]:
    """Where a POI is, or the middle of a polygon's bounding box [m]."""
    if shape.name == "poi":
        return float(shape.getAttributeSecure("x", "")), float(shape.getAttributeSecure("y", ""))
    corners = np.array([[float(v) for v in corner.split(",")[:2]] for corner in str(shape.shape).split()])
    if not len(corners):
        raise ValueError("the shape has no corners")
    x, y = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return float(x), float(y)
