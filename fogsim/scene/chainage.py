"""Distances along lanes that neighbours share, so that a line painted half in each of two lanes meets itself."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.polyline import arc_length, cleaned, project
from fogsim.values.road import Lane


class Chainage:
    """Distance along the carriageway of any point of a lane.

    All lanes of an edge are measured along the same one of them, and an edge goes on counting where the edge that
    leads into it has ended.

    Parameters
    ----------
    lanes : sequence of Lane
        Lanes with at least two distinct points each.
    """

    def __init__(self, lanes: Sequence[Lane]) -> None:
        self._reference: dict[str, NDArray[np.float64]] = {}
        for lane in lanes:
            if lane.outermost or lane.edge_id not in self._reference:
                self._reference[lane.edge_id] = cleaned(lane.centreline)
        self._offset = _offsets(self._reference, _predecessors(lanes, self._reference))

    def along(self, lane: Lane, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance along the lane's carriageway of points (n, 3) on it [m]."""
        return self._offset[lane.edge_id] + project(points, self._reference[lane.edge_id])


def _key(point: NDArray[np.float64]) -> tuple[int, int, int]:
    column, row, level = np.round(np.asarray(point) / (0.5, 0.5, 2.0)).astype(int).tolist()
    return column, row, level


def _predecessors(lanes: Sequence[Lane], reference: Mapping[str, NDArray[np.float64]]) -> dict[str, str]:
    ends = {_key(lane.centreline[-1]): lane.edge_id for lane in lanes}
    found = {edge: ends.get(_key(line[0])) for edge, line in reference.items()}
    return {edge: before for edge, before in found.items() if before is not None and before != edge}


def _offsets(reference: Mapping[str, NDArray[np.float64]], before: Mapping[str, str]) -> dict[str, float]:
    offsets: dict[str, float] = {}
    for edge in reference:
        chain = [edge]
        while chain[-1] not in offsets and before.get(chain[-1]) not in (None, *chain):
            chain.append(before[chain[-1]])
        for member in reversed(chain):
            previous = before.get(member)
            if member not in offsets:
                known = previous is not None and previous in offsets
                offsets[member] = (
                    offsets[previous] + float(arc_length(reference[previous])[-1]) if known and previous else 0.0
                )
    return offsets
