"""Distances along lanes that neighbours share, so that a line painted half in each of two lanes meets itself."""

import math
from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.polyline import arc_length, cleaned, project
from fogsim.values.road import Lane

_BESIDE = 9.0  # ends of the two directions of a road lie nearer to each other than this [m]
_DASH = 6.0  # length of a dash; dashes start at multiples of their period [m]


class Chainage:
    """Distance along the carriageway of any point of a lane.

    All lanes of an edge are measured along the same one of them, and an edge goes on counting where the edge that
    leads into it has ended. Where an edge runs beside one in the other direction, both are measured so that dashes of
    the line between them coincide.

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
        opposites = _opposites(self._reference)
        self._offset = _offsets(self._reference, _predecessors(lanes, self._reference), opposites)
        # Of the two directions of a road, one is measured along the other.
        self._other = {edge: other for edge, other in opposites.items() if edge > other}

    def along(self, lane: Lane, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance along the lane's carriageway of points on it (n,) [m].

        Parameters
        ----------
        lane : Lane
            The lane.
        points : (n, 3) float64
            Points on it [m].
        """
        other = self._other.get(lane.edge_id)
        if other is not None:
            # Distances of both directions add up to the length of a dash, so that their dashes coincide.
            return np.asarray(_DASH - self._offset[other] - project(points, self._reference[other]))
        return self._offset[lane.edge_id] + project(points, self._reference[lane.edge_id])

    def follows(self, lane: Lane) -> bool:
        """Whether the lane is measured along the other direction of its road.

        Parameters
        ----------
        lane : Lane
            The lane.
        """
        return lane.edge_id in self._other


def _key(point: NDArray[np.float64]) -> tuple[int, int, int]:
    column, row, level = np.round(np.asarray(point) / (0.5, 0.5, 2.0)).astype(int).tolist()
    return column, row, level


def _predecessors(lanes: Sequence[Lane], reference: Mapping[str, NDArray[np.float64]]) -> dict[str, str]:
    ends = {_key(lane.centreline[-1]): lane.edge_id for lane in lanes}
    found = {edge: ends.get(_key(line[0])) for edge, line in reference.items()}
    return {edge: before for edge, before in found.items() if before is not None and before != edge}


def _opposites(reference: Mapping[str, NDArray[np.float64]]) -> dict[str, str]:
    """Edges that run the other way beside an edge: its end near the edge's start, and its start near the edge's end."""
    ends: dict[tuple[int, int], list[str]] = {}
    ends_of = {edge: line[[0, -1]].tolist() for edge, line in reference.items()}
    for edge, (_, last) in ends_of.items():
        column, row = (math.floor(x / _BESIDE) for x in last[:2])
        for cell in product((column - 1, column, column + 1), (row - 1, row, row + 1)):
            ends.setdefault(cell, []).append(edge)
    found = {}
    for edge, mine in ends_of.items():
        column, row = (math.floor(x / _BESIDE) for x in mine[0][:2])
        for other in ends.get((column, row), ()):
            theirs = ends_of[other]
            if other != edge and max(math.dist(theirs[1], mine[0]), math.dist(theirs[0], mine[1])) < _BESIDE:
                found[edge] = other
    return found


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
