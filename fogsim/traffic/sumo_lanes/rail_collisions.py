"""Collisions with vehicles on rails, which SUMO looks for along the straight line behind their fronts."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fogsim.values import Collision, TrafficState

_CARRIAGE = "carriage"


def rail_collisions(state: TrafficState) -> Iterator[Collision]:
    """Road vehicles whose rectangles overlap with those of pieces of a train or tram, in every step while they do."""
    pieces = state.pieces
    if _CARRIAGE not in pieces.kind:
        return
    # A bus is a bus and a carriage; a body of carriages alone is on rails.
    bent = set(pieces.row.tolist())
    on_rails = bent.difference(r for r, kind in zip(pieces.row.tolist(), pieces.kind, strict=True) if kind != _CARRIAGE)
    road = np.array([row for row in range(len(state.ids)) if row not in on_rails], np.intp)
    middle = _middles(state.position[road], state.heading[road], state.length[road])
    carriages = _middles(pieces.position, pieces.heading, pieces.length)
    struck = dict[tuple[int, int], int]()
    for piece, train in enumerate(pieces.row.tolist()):
        if train not in on_rails:
            continue
        reach = 0.5 * (pieces.length[piece] + state.length[road]) + state.width[train] + state.width[road]
        near = np.flatnonzero(np.hypot(*(middle - carriages[piece]).T) < reach)
        own = (carriages[piece], float(pieces.heading[piece]), float(pieces.length[piece]), float(state.width[train]))
        for number in near.tolist():
            row = int(road[number])
            size = float(state.length[row]), float(state.width[row])
            if _overlap(own, (middle[number], float(state.heading[row]), *size)):
                struck.setdefault((row, train), piece)
    for (row, train), piece in sorted(struck.items()):
        turn = float(state.heading[row] - pieces.heading[piece])
        one, other = float(state.speed[row]), float(state.speed[train])
        impact = math.hypot(one - other * math.cos(turn), other * math.sin(turn))
        yield Collision(state.time, state.ids[row], state.ids[train], impact)


def _middles(
    front: NDArray[np.float64], heading: NDArray[np.float64], length: NDArray[np.float64]
) -> NDArray[np.float64]:
    ahead = np.stack((np.cos(heading), np.sin(heading)), axis=1)
    return np.asarray(front[:, :2] - 0.5 * length[:, None] * ahead)


_Rectangle = tuple[NDArray[np.float64], float, float, float]
"""Middle [m], heading [rad], length and width [m]."""


def _overlap(one: _Rectangle, other: _Rectangle) -> bool:
    """Whether two rectangles overlap: no axis of either lies between them."""
    away = other[0] - one[0]
    for heading in (one[1], one[1] + 0.5 * math.pi, other[1], other[1] + 0.5 * math.pi):
        apart = abs(away[0] * math.cos(heading) + away[1] * math.sin(heading))
        reach = sum(_extent(rectangle, heading) for rectangle in (one, other))
        if apart >= 0.5 * reach:
            return False
    return True


def _extent(rectangle: _Rectangle, heading: float) -> float:
    """How long a rectangle is along a direction [m]."""
    _, own, length, width = rectangle
    return abs(length * math.cos(own - heading)) + abs(width * math.sin(own - heading))
