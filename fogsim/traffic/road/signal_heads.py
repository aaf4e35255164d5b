"""Positions of traffic light heads, which networks lack: as in Europe, next to and above the stop lines."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.values import SignalHead
from fogsim.values.light import SIGNAL_DIAMETER

LARGE_DIAMETER = 0.3
"""Diameter of the lenses above roads and next to fast ones [m]."""

FAST = 16.7
"""Speed limit above which the lenses next to a road are large, too [m/s]."""

POST_HEIGHT, ARM_HEIGHT = 2.75, 5.5
"""Height of the middle lens next to and above the road [m]: footways are clear to 2.1 m, roads to 4.5 m."""

ON_FOOT_HEIGHT = 2.4
"""Height of the middle of heads for pedestrians [m]."""

_BEYOND, _BESIDE_CROSSING = 0.5, 0.4  # of posts of such heads, from the end and the border of their crossing [m]
_BESIDE = 0.6  # of posts, beyond the edge of the outermost lane [m]


def signal_heads(lanes: Sequence[Any], side: float) -> Iterator[SignalHead]:
    """Heads at the end of an edge: one on a post for the outermost lane, one on its arm for each other lane.

    `lanes` (sumolib) are those for vehicles, from the side that they keep to: left (1) or right (−1). A lane whose
    points coincide, which SUMO reads as any other, has no direction to stand across, and no head.
    """
    lanes = [lane for lane in lanes if _steps(np.array(lane.getShape3D(), np.float64)).size]
    heads = [(lane, signal, links) for lane in lanes for signal, links in _signals(lane)]
    if not heads:
        return
    outer = np.array(lanes[0].getShape3D(), np.float64)
    half, heading = 0.5 * float(lanes[0].getWidth()), _heading(outer)
    across = side * np.array([-math.sin(heading), math.cos(heading), 0.0])
    post = outer[-1] + (half + _BESIDE) * across
    for number, (lane, signal, links) in enumerate(heads):
        end = np.array(lane.getShape3D()[-1], np.float64)
        # Lanes of an edge end on a line across it, and arms extend along that line.
        place = post if number == 0 else post + across * float(matrix_product(end - post, across))
        height = ARM_HEIGHT if number else POST_HEIGHT
        is_large = number > 0 or float(lane.getSpeed()) > FAST
        yield SignalHead(
            signal_id=signal,
            lane_id=lane.getID(),
            links=links,
            position=_tuple(place + np.array([0.0, 0.0, height])),
            heading=heading,
            diameter=LARGE_DIAMETER if is_large else SIGNAL_DIAMETER,
            post=_tuple(post),
        )


def crossing_heads(crossing: Any, side: float) -> Iterator[SignalHead]:
    """Heads for pedestrians at both ends of a crossing lane (sumolib).

    `side` is the side that vehicles keep to: left (1) or right (−1).
    """
    edge = crossing.getEdge()
    ways = [way for source in edge.getIncoming() for way in source.getConnections(edge) if way.getTLSID()]
    line = np.array(crossing.getShape3D(), np.float64)
    if not ways or not _steps(line).size:
        return
    for name, there in ((crossing.getID(), line), (edge.getID(), line[::-1])):
        heading = _heading(there)
        ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
        across = side * np.array([-ahead[1], ahead[0], 0.0])
        post = there[-1] + _BEYOND * ahead + (0.5 * float(crossing.getWidth()) + _BESIDE_CROSSING) * across
        yield SignalHead(
            signal_id=ways[0].getTLSID(),
            lane_id=name,
            links=(ways[0].getTLLinkIndex(),),
            position=_tuple(post + np.array([0.0, 0.0, ON_FOOT_HEIGHT])),
            heading=heading,
            diameter=SIGNAL_DIAMETER,
            post=_tuple(post),
            on_foot=True,
        )


def _signals(lane: Any) -> list[tuple[str, tuple[int, ...]]]:
    """The traffic light at the end of a lane with the links of the lane; none without a light."""
    # A link with the index −1 is not controlled, as that of a track across a level crossing.
    outgoing = lane.getOutgoing()
    ways = [(w.getTLSID(), w.getTLLinkIndex()) for w in outgoing if w.getTLSID() and w.getTLLinkIndex() >= 0]
    return [(ways[0][0], tuple(sorted(link for signal, link in ways if signal == ways[0][0])))] if ways else []


def _steps(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Horizontal steps (n, 2) [m] along a polyline between points that do not coincide."""
    steps = np.diff(line.reshape(-1, 3)[:, :2], axis=0)
    return steps[np.hypot(steps[:, 0], steps[:, 1]) > 1e-3]


def _heading(line: NDArray[np.float64]) -> float:
    x, y = _steps(line)[-1].tolist()
    return math.atan2(y, x)


def _tuple(place: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z
