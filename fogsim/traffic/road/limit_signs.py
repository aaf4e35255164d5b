"""Signs where the speed limit of a SUMO network changes."""

import math
from typing import Any

import numpy as np
import sumolib

from fogsim.values import Sign

SPEED_LIMIT = "speed_limit"
"""Type of the signs."""
_SIGN_CLEARANCE = 3.9
"""Lateral distance from the edge of the outermost lane to the middle of a sign [m]: behind shoulder and rail."""
_OTHER_CLEARANCES = (2.0, 1.0, 6.0, 8.0, 12.0, 18.0, 24.0)
"""Alternative distances where the usual one is on another road; the first free one is used [m]."""
SIGN_HEIGHT = 2.6
"""Height of the middle of a sign's face above the road [m]."""
SIGN_DIAMETER = 0.9
"""Diameter of a round sign outside towns [m]; 0.75–0.9 m for speeds above 80 km/h (German VzKat size 3)."""


def limit_sign(edge: Any, side: float) -> Sign | None:
    """Sign at the start of an edge whose limit differs from that of every edge leading to it.

    It stands on the side that vehicles keep to: left (1) or right (−1).
    """
    limit = edge.getSpeed()
    if any(abs(incoming.getSpeed() - limit) < 0.1 for incoming in edge.getIncoming()):
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
        for left in (side * (lane.getWidth() / 2 + away) for away in (_SIGN_CLEARANCE, *_OTHER_CLEARANCES))
    ]
    # Another road may be next to it, where roads part or meet.
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
    """Whether a point is on no lane of the edges that meet this one."""
    nodes = edge.getFromNode(), edge.getToNode()
    edges = {other.getID(): other for node in nodes for other in (*node.getOutgoing(), *node.getIncoming())}
    return all(
        sumolib.geomhelper.distancePointToPolygon(place, lane.getShape()) > 0.5 * lane.getWidth() + 0.5
        for other in edges.values()
        for lane in other.getLanes()
    )
