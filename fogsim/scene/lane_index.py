"""How far a point is from any lane."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.scene.polyline import Points, refined_lines
from fogsim.values.road import Lane

FARTHEST = 30.0
"""Distances beyond this are not distinguished [m]."""

_CELL = 10.0  # side of the square cells in which pieces of lanes are looked up [m]
_LONGEST = 20.0  # piece of a lane [m]
_STEP = 0.1  # shortest step in the search for room [m]


class _Pieces(NamedTuple):
    """Straight pieces of lanes by the cells that their middles lie in."""

    corner: NDArray[np.int64]  # (2,) int64: Column and row of the first cell
    rows: int  # Number of rows
    key: NDArray[np.int64]  # (n,) int64: Cell of each piece, in order: its column times the number of rows, and its row
    columns: NDArray[np.int64]  # (m + 1,) int64: Where the pieces of each column begin, and their number
    pieces: NDArray[np.float64]  # (n, 7): Start (x, y, z), step to the end (x, y, z) and half the width [m] of each


class LaneIndex:
    """Distances from points to the paved lanes of a network, by a grid of square cells."""

    def __init__(self, lanes: Sequence[Lane]) -> None:
        points, counts = refined_lines([lane.centreline for lane in lanes], _LONGEST)
        # From the last point of a line to the first of the next there is no piece.
        within = np.ones(len(points) - 1, np.bool_)
        within[np.cumsum(counts)[:-1] - 1] = False
        start, step = points[:-1][within], np.diff(points, axis=0)[within]
        half = np.repeat([0.5 * lane.width for lane in lanes], counts - 1)
        cells = np.floor((start[:, :2] + 0.5 * step[:, :2]) / _CELL).astype(np.int64)
        corner = cells.min(axis=0)
        cells -= corner
        # Cells of a column follow one another, so that neighbours in it are one stretch of pieces.
        rows = int(cells[:, 1].max()) + 1
        key = cells[:, 0] * rows + cells[:, 1]
        order = np.argsort(key, kind="stable")
        key = key[order]
        columns = np.searchsorted(key, np.arange(int(cells[:, 0].max()) + 2) * rows)
        self._widest = float(half.max())
        self._pieces = _Pieces(corner, rows, key, columns, np.column_stack((start, step, half))[order])

    def clearance(
        self, points: Points, same_level: float | None = None, within: float = FARTHEST
    ) -> NDArray[np.float64]:
        """Distance from points (n, 3) to the nearest lane's edge [m], negative on a lane, at most `within`.

        Takes `points` (n, 3) [m], `same_level` [m], `within` [m].
        """
        places = np.ascontiguousarray(points, np.float64)
        level = np.inf if same_level is None else same_level
        return _clearances(places, level, within, self._reach(within), self._pieces)

    def room(self, points: Points, normal: NDArray[np.float64], most: float, same_level: float) -> NDArray[np.float64]:
        """How far one gets from points (n, 3) along their normals (n, 2) before a lane begins [m].

        Takes `points` (n, 3) [m], `normal` (n, 2), `most` [m], `same_level` [m].
        """
        places, directions = np.ascontiguousarray(points, np.float64), np.ascontiguousarray(normal, np.float64)
        return _rooms(places, directions, most, same_level, self._reach(most), self._pieces)

    def _reach(self, within: float) -> float:
        """How far off the middles of pieces of lanes may be whose edges are so near [m]."""
        return within + self._widest + 0.5 * _LONGEST


@kernel
def _rooms(
    points: NDArray[np.float64],
    normal: NDArray[np.float64],
    most: float,
    same_level: float,
    reach: float,
    lanes: _Pieces,
) -> NDArray[np.float64]:
    result = np.full(len(points), most)
    for i in range(len(points)):
        away = _STEP
        while away < most:
            x, y = points[i, 0] + away * normal[i, 0], points[i, 1] + away * normal[i, 1]
            clear = _clearance((x, y, points[i, 2]), same_level, most, reach, lanes)
            if clear <= 0.0:
                result[i] = max(away + clear, 0.0)
                break
            away += max(clear, _STEP)
    return result


@kernel
def _clearances(
    points: NDArray[np.float64],
    same_level: float,
    within: float,
    reach: float,
    lanes: _Pieces,
) -> NDArray[np.float64]:
    result = np.empty(len(points))
    for i in range(len(points)):
        place = (points[i, 0], points[i, 1], points[i, 2])
        result[i] = _clearance(place, same_level, within, reach, lanes)
    return result


@kernel
def _clearance(
    place: tuple[float, float, float], same_level: float, within: float, reach: float, lanes: _Pieces
) -> float:
    x, y, z = place
    nearest, pieces, key, columns, rows = within, lanes.pieces, lanes.key, lanes.columns, lanes.rows
    low, high = max(_cell(y - reach) - lanes.corner[1], 0), min(_cell(y + reach) - lanes.corner[1], rows - 1)
    if low > high:
        return nearest
    first, last_column = _cell(x - reach) - lanes.corner[0], _cell(x + reach) - lanes.corner[0]
    for column in range(max(first, 0), min(last_column + 1, len(columns) - 1)):
        k, end, last = columns[column], columns[column + 1], column * rows + high
        k += np.searchsorted(key[k:end], column * rows + low)
        while k < end and key[k] <= last:
            dx, dy = pieces[k, 3], pieces[k, 4]
            u, v = x - pieces[k, 0], y - pieces[k, 1]
            share = min(max((u * dx + v * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
            if abs(z - pieces[k, 2] - share * pieces[k, 5]) <= same_level:
                u, v = u - share * dx, v - share * dy
                nearest = min(nearest, np.sqrt(u * u + v * v) - pieces[k, 6])
            k += 1
    return nearest


@kernel
def _cell(place: float) -> int:
    """Column or row of a place."""
    return int(np.floor(place / _CELL))
