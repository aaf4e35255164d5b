"""Where the heads of traffic lights stand, as networks do not tell: as in Europe, beside and above the stop lines."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.linear_algebra import matrix_product
from fogsim.values import SignalHead
from fogsim.values.light import SIGNAL_DIAMETER

LARGE_DIAMETER = 0.3
"""Diameter of the lenses above roads and beside fast ones [m]."""

FAST = 16.7
"""Speed limit above which the lenses beside a road are large, too [m/s]."""

POST_HEIGHT, ARM_HEIGHT = 2.75, 5.5
"""Height of the middle lens beside and above the road [m]: footways are clear to 2.1 m, roads to 4.5 m."""

_BESIDE = 0.6  # of posts, beyond the edge of the outermost lane [m]


def signal_heads(lanes: Sequence[Any], side: float) -> Iterator[SignalHead]:
    """Heads at the end of an edge: one on a post for the outermost lane, one on its arm for each other lane.

    Parameters
    ----------
    lanes : sequence of sumolib.net.lane.Lane
        Lanes of the edge for vehicles, from the side that these keep to.
    side : float
        That side: 1 for the left, −1 for the right.
    """
    heads = [(lane, signal, links) for lane in lanes for signal, links in _signals(lane)]
    if not heads:
        return
    outer = np.array(lanes[0].getShape3D(), np.float64)
    half, heading = 0.5 * float(lanes[0].getWidth()), _heading(outer)
    across = side * np.array([-math.sin(heading), math.cos(heading), 0.0])
    post = outer[-1] + (half + _BESIDE) * across
    for number, (lane, signal, links) in enumerate(heads):
        end = np.array(lane.getShape3D()[-1], np.float64)
        # Lanes of an edge end on a line across it, and arms reach along that.
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


def _signals(lane: Any) -> list[tuple[str, tuple[int, ...]]]:
    """The traffic light at the end of a lane with the links of the lane; none where there is none."""
    ways = [(way.getTLSID(), way.getTLLinkIndex()) for way in lane.getOutgoing() if way.getTLSID()]
    return [(ways[0][0], tuple(sorted(link for signal, link in ways if signal == ways[0][0])))] if ways else []


def _heading(line: NDArray[np.float64]) -> float:
    steps = np.diff(line[:, :2], axis=0)
    x, y = steps[np.hypot(steps[:, 0], steps[:, 1]) > 1e-3][-1].tolist()
    return math.atan2(y, x)


def _tuple(place: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z
