"""Distances along lanes that neighbours share, so that a line painted half in each of two lanes meets itself."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.scene.polyline import all_cleaned, arc_length, project
from fogsim.values.road import Lane

_BESIDE = 9.0  # ends of the two directions of a road lie nearer to each other than this [m]
_DASH = 6.0  # length of a dash; dashes start at multiples of their period [m]


class Chainage:
    """Distance along the carriageway of any point of a lane.

    All lanes of an edge are measured along the same one of them, and an edge goes on counting where the edge that leads
    into it has ended. Where an edge runs next to one in the other direction, both are measured so that dashes of the
    line between them coincide.
    """

    def __init__(self, lanes: Sequence[Lane]) -> None:
        along: dict[str, NDArray[np.float64]] = {}
        for lane in lanes:
            if lane.outermost or lane.edge_id not in along:
                along[lane.edge_id] = lane.centreline
        self._reference = dict(zip(along, all_cleaned(list(along.values())), strict=True))
        opposites = _opposites(self._reference)
        self._offset = _offsets(self._reference, _predecessors(lanes, self._reference), opposites)
        # Of the two directions of a road, one is measured along the other.
        self._other = {edge: other for edge, other in opposites.items() if edge > other}

    def along(self, lane: Lane, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance along the lane's carriageway of points on it (n,) [m] (`points` (n, 3) [m])."""
        other = self._other.get(lane.edge_id)
        if other is not None:
            # Distances of both directions add up to the length of a dash, so that their dashes coincide.
            return np.asarray(_DASH - self._offset[other] - project(points, self._reference[other]))
        return self._offset[lane.edge_id] + project(points, self._reference[lane.edge_id])

    def follows(self, lane: Lane) -> bool:
        """Whether the lane is measured along the other direction of its road."""
        return lane.edge_id in self._other


def _keys(points: Sequence[NDArray[np.float64]]) -> list[tuple[int, int, int]]:
    """Where points are, alike for those that are at the same place but for rounding."""
    rounded = np.round(np.array(points).reshape(-1, 3) / (0.5, 0.5, 2.0)).astype(int)
    return [(column, row, level) for column, row, level in rounded.tolist()]


def _predecessors(lanes: Sequence[Lane], reference: Mapping[str, NDArray[np.float64]]) -> dict[str, str]:
    ends = dict(zip(_keys([lane.centreline[-1] for lane in lanes]), (lane.edge_id for lane in lanes), strict=True))
    starts = _keys([line[0] for line in reference.values()])
    found = {edge: ends.get(start) for edge, start in zip(reference, starts, strict=True)}
    return {edge: before for edge, before in found.items() if before is not None and before != edge}


def _opposites(reference: Mapping[str, NDArray[np.float64]]) -> dict[str, str]:
    """Edges that run the other way along an edge: its end near the edge's start, and its start near the edge's end."""
    edges = list(reference)
    ends = np.array([line[[0, -1]] for line in reference.values()]).reshape(-1, 2, 3)
    order = np.argsort(ends[:, 1, 0], kind="stable")
    found = _opposite_places(ends, order, ends[order, 1, 0])
    return {edges[place]: edges[other] for place, other in enumerate(found.tolist()) if other >= 0}


@kernel
def _opposite_places(
    ends: NDArray[np.float64], order: NDArray[np.int64], east: NDArray[np.float64]
) -> NDArray[np.int64]:
    """For each line with ends (n, 2, 3) the last of those that run the other way next to it, −1 if there is none.

    `order` sorts the lines by the x of their last points, which are `east`.
    """
    result = np.full(len(ends), -1)
    for mine in range(len(ends)):
        x = ends[mine, 0, 0]
        first, end = np.searchsorted(east, x - _BESIDE), np.searchsorted(east, x + _BESIDE, "right")
        for place in range(first, end):
            other = order[place]
            apart = max(_apart(ends[other, 1], ends[mine, 0]), _apart(ends[other, 0], ends[mine, 1]))
            if other > result[mine] and other != mine and apart < _BESIDE:
                result[mine] = other
    return result


@kernel
def _apart(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    x, y, z = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    return float(np.sqrt(x * x + y * y + z * z))


def _offsets(
    reference: Mapping[str, NDArray[np.float64]], before: Mapping[str, str], opposites: Mapping[str, str]
) -> dict[str, float]:
    offsets: dict[str, float] = {}
    for edge in reference:
        chain = [edge]
        while chain[-1] not in offsets and before.get(chain[-1]) not in (None, *chain):
            chain.append(before[chain[-1]])
        for member in reversed(chain):
            if member not in offsets:
                offsets[member] = _offset(member, reference, offsets, opposites.get(member), before.get(member))
    return offsets


def _offset(
    edge: str,
    reference: Mapping[str, NDArray[np.float64]],
    offsets: Mapping[str, float],
    opposite: str | None,
    before: str | None,
) -> float:
    if opposite in offsets and opposite is not None:
        # Distances of both directions then add up to the length of a dash, so that their dashes coincide.
        start = float(project(reference[edge][:1], reference[opposite])[0])
        return _DASH - offsets[opposite] - start
    if before in offsets and before is not None:
        return offsets[before] + float(arc_length(reference[before])[-1])
    return 0.0
