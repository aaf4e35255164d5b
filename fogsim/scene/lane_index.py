"""How far a point is from any lane."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.scene.polyline import Points, cleaned, refined
from fogsim.values.road import Lane

FARTHEST = 30.0
"""Distances beyond this are not told apart [m]."""

_CELL = 20.0  # side of the square cells in which pieces of lanes are looked up [m]
_LONGEST = 20.0  # piece of a lane [m]
_AROUND = 2  # cells on each side that a piece as near as `FARTHEST` may lie in: (30 + 20 / 2) / 20


class LaneIndex:
    """Distances from points to the paved lanes of a network, by a grid of square cells.

    Parameters
    ----------
    lanes : sequence of Lane
        The lanes, each with a length.
    """

    def __init__(self, lanes: Sequence[Lane]) -> None:
        lines = [refined(cleaned(lane.centreline), _LONGEST) for lane in lanes]
        counts = [len(line) - 1 for line in lines]
        start = np.concatenate([line[:-1] for line in lines])
        step = np.concatenate([np.diff(line, axis=0) for line in lines])
        half = np.repeat([0.5 * lane.width for lane in lanes], counts)
        cells = np.floor((start[:, :2] + 0.5 * step[:, :2]) / _CELL).astype(np.int64)
        self._corner = cells.min(axis=0)
        cells -= self._corner
        # Cells of a column follow one another, so that neighbours in it are one stretch of pieces.
        self._rows = int(cells[:, 1].max()) + 1
        key = cells[:, 0] * self._rows + cells[:, 1]
        order = np.argsort(key, kind="stable")
        self._key = key[order]
        self._pieces = np.column_stack((start, step, half))[order]

    def clearance(self, points: Points, same_level: float | None = None) -> NDArray[np.float64]:
        """Distance from points (n, 3) to the nearest lane's edge [m], negative on a lane, at most `FARTHEST`.

        Parameters
        ----------
        points : (n, 3) float64
            Points [m].
        same_level : float, optional
            Lanes higher or lower than the point by more than this [m] are left out.
        """
        places = np.ascontiguousarray(points, np.float64)
        level = np.inf if same_level is None else same_level
        cells = np.floor(places[:, :2] / _CELL).astype(np.int64) - self._corner
        return _clearances(places, cells, level, self._key, self._rows, self._pieces)


@kernel
def _clearances(
    points: NDArray[np.float64],
    cells: NDArray[np.int64],
    same_level: float,
    key: NDArray[np.int64],
    rows: int,
    pieces: NDArray[np.float64],
) -> NDArray[np.float64]:
    result = np.empty(len(points))
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        nearest = FARTHEST
        low, high = max(cells[i, 1] - _AROUND, 0), min(cells[i, 1] + _AROUND, rows - 1)
        if low <= high:
            for column in range(cells[i, 0] - _AROUND, cells[i, 0] + _AROUND + 1):
                for k in range(
                    np.searchsorted(key, column * rows + low), np.searchsorted(key, column * rows + high + 1)
                ):
                    dx, dy = pieces[k, 3], pieces[k, 4]
                    u, v = x - pieces[k, 0], y - pieces[k, 1]
                    share = min(max((u * dx + v * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
                    if abs(z - pieces[k, 2] - share * pieces[k, 5]) <= same_level:
                        u, v = u - share * dx, v - share * dy
                        nearest = min(nearest, np.sqrt(u * u + v * v) - pieces[k, 6])
        result[i] = nearest
    return result
