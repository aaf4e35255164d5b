"""Signs of a SUMO network: changes of the limit, marked shapes in additional files, OpenDRIVE signals."""

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import sumolib

from fogsim.core.files.readers import FARTHEST, number_in_text
from fogsim.traffic.road.map_cache import RoadMap
from fogsim.traffic.road.opendrive import FASTEST, is_opendrive, opendrive_signs
from fogsim.traffic.road.structures import MarkedShape, marked_shapes
from fogsim.units import KMH_PER_MPS
from fogsim.values import Sign, SignMap

SPEED_LIMIT = "speed_limit"
"""Type of the signs."""
SIGN_CLEARANCE = 3.9
"""Lateral distance from the edge of the outermost lane to the middle of a sign [m]: behind shoulder and rail."""
_OTHER_CLEARANCES = (2.0, 1.0, 6.0, 8.0, 12.0, 18.0, 24.0)
"""Alternative distances where the usual one is on another road; the first free one is used [m]."""
_SIGN_HEIGHT = 2.6
"""Height of the middle of a sign's face above the road [m]."""
_SIGN_DIAMETER = 0.9
"""Diameter of a round sign outside towns [m]; 0.75–0.9 m for speeds above 80 km/h (German VzKat size 3)."""


def limit_sign(edge: Any, side: float) -> Sign | None:
    """Sign at an edge whose limit differs from all edges' before it, on the side driven on: left (1), right (−1)."""
    limit = _limit(edge)
    if any(abs(_limit(incoming) - limit) < 0.1 for incoming in edge.getIncoming()):
        return None
    lane = edge.getLanes()[0]
    points = np.array(lane.getShape3D(), dtype=np.float64).reshape(-1, 3)
    ahead = points[np.linalg.norm(points[:, :2] - points[:1, :2], axis=1) > 0.01]
    if not len(ahead):
        return None  # A lane of zero length, as in some networks written by hand, has no direction to face.
    along = ahead[0] - points[0]
    heading = math.atan2(along[1], along[0])
    # Ten metres into the edge, so that the sign is on the stretch that it applies to.
    x, y, z = points[0] + along / math.hypot(*along) * min(10.0, 0.5 * lane.getLength())
    places = [
        (float(x) - left * math.sin(heading), float(y) + left * math.cos(heading))
        for left in (side * (lane.getWidth() / 2 + away) for away in (SIGN_CLEARANCE, *_OTHER_CLEARANCES))
    ]
    # Another road may be next to it, where roads part or meet.
    x, y = next((place for place in places if _is_beside_roads(place, edge)), places[0])
    return Sign(
        f"limit.{edge.getID()}",
        SPEED_LIMIT,
        limit,
        (x, y, float(z) + _SIGN_HEIGHT),
        heading,
        _SIGN_DIAMETER,
    )


def _limit(edge: Any) -> float:
    """Highest limit of an edge's lanes [m/s]; the first lane may be a sidewalk, or for lorries."""
    return max(float(lane.getSpeed()) for lane in edge.getLanes())


def _is_beside_roads(place: tuple[float, float], edge: Any) -> bool:
    """Whether a point is on no lane of the edges that meet this one."""
    nodes = edge.getFromNode(), edge.getToNode()
    edges = {other.getID(): other for node in nodes for other in (*node.getOutgoing(), *node.getIncoming())}
    return all(
        sumolib.geomhelper.distancePointToPolygon(place, lane.getShape()) > 0.5 * lane.getWidth() + 0.5
        for other in edges.values()
        for lane in other.getLanes()
    )


SIGN_TYPE = "fogsim.sign."
"""POIs and polygons of type ``fogsim.sign.KIND`` in an additional file are signs."""

_LIMITS = frozenset((SPEED_LIMIT, "end_of_speed_limit", "variable_speed_limit"))
"""Types whose value is a speed, in km/h in additional files."""
_GANTRY_HEIGHT = 6.2
"""Height of the middle of a face above a lane [m]: vehicles up to 4.5 m pass below."""

_DIAMETERS, _HEIGHTS = (0.05, 20.0), (0.0, 50.0)
"""Sizes of signs, and heights of their middle above the road [m]."""

_LonLat = tuple[float, float]


def sign_map(roads: RoadMap, additional: Iterable[Path]) -> SignMap:
    """Signs of a network, of SUMO additional files and of OpenDRIVE files; possibly none."""
    signs, pieces = list(roads.limit_signs), _Roads(roads)
    for path in additional:
        if is_opendrive(path):
            signs += opendrive_signs(path, _net_offset(roads))
        else:
            signs += [_marked_sign(shape, pieces) for shape in marked_shapes(path, SIGN_TYPE)]
    return SignMap(tuple(signs))


def geographic_position(roads: RoadMap) -> Callable[[float, float], _LonLat] | None:
    """Conversion of a network's x, y [m] to longitude and latitude [deg]; None without projection or pyproj."""
    if roads.location is None:
        return None
    net = sumolib.net.Net()
    net.setLocation(roads.location[0], "", "", roads.location[1])
    try:
        projection = net.getGeoProj()
    except RuntimeError:
        return None
    x_offset, y_offset = _net_offset(roads)

    def convert(x: float, y: float) -> _LonLat:
        longitude, latitude = projection(x - x_offset, y - y_offset, inverse=True)
        return float(longitude), float(latitude)

    return convert


def _net_offset(roads: RoadMap) -> tuple[float, float]:
    """Offset from the source's coordinates to the network's [m]."""
    if roads.location is None:  # a network written by hand has no location
        return 0.0, 0.0
    x, y = map(float, roads.location[0].split(","))
    return x, y


class _Roads:
    """Straight pieces of all lanes for vehicles; where there are none, of all lanes."""

    def __init__(self, roads: RoadMap) -> None:
        lanes = [lane for lane, is_between in zip(roads.lanes, roads.between.tolist(), strict=True) if is_between]
        lanes = lanes or list(roads.lanes)
        lines = [lane.centreline for lane in lanes]
        self._start = np.concatenate([line[:-1] for line in lines])
        self._step = np.concatenate([np.diff(line, axis=0) for line in lines])
        self._half_width = np.repeat([0.5 * lane.width for lane in lanes], [max(len(li) - 1, 0) for li in lines])

    def below(self, x: float, y: float) -> tuple[float, bool]:
        """Height of the nearest lane [m], and whether the point is above it."""
        offset, step = np.array([x, y]) - self._start[:, :2], self._step
        square = np.maximum(np.sum(step[:, :2] ** 2, axis=1), 1e-12)
        share = np.clip(np.sum(offset * step[:, :2], axis=1) / square, 0.0, 1.0)
        gap = np.linalg.norm(offset - share[:, None] * step[:, :2], axis=1) - self._half_width
        nearest = int(np.argmin(gap))
        return float(self._start[nearest, 2] + share[nearest] * step[nearest, 2]), bool(gap[nearest] < 0)


def _marked_sign(shape: MarkedShape, roads: _Roads) -> Sign:
    x, y = _middle(shape)
    heading = math.radians(90.0 - number_in_text(shape.where, "angle", shape.attributes.get("angle", "")))
    if shape.kind in _LIMITS:
        value = shape.parameter("value", 0.0, FASTEST * KMH_PER_MPS) / KMH_PER_MPS
    else:
        value = shape.parameter("value", -FARTHEST, FARTHEST, 0.0)
    diameter = shape.parameter("diameter", *_DIAMETERS, _SIGN_DIAMETER)
    ground, over_lane = roads.below(x, y)
    above = shape.parameter("height", *_HEIGHTS, _GANTRY_HEIGHT if over_lane else _SIGN_HEIGHT)
    return Sign(shape.name, shape.kind, value, (x, y, ground + above), heading, diameter)


def _middle(shape: MarkedShape) -> tuple[float, float]:
    """Position of a POI, or the middle of a polygon's bounding box [m]."""
    if shape.tag == "poi":
        x, y = (number_in_text(shape.where, key, shape.attributes.get(key, "")) for key in "xy")
        return x, y
    corners = np.array([corner[:2] for corner in shape.corners()])
    x, y = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return float(x), float(y)
