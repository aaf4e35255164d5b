"""Polylines on the ground: lengths, directions, parallels, projection, and how far a point is from any lane."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fogsim.values.road import Lane

Points = NDArray[np.float64]


def cleaned(points: Points, shortest: float = 0.05) -> Points:
    """Polyline (n, 3) without segments shorter than `shortest` [m]."""
    array = np.asarray(points, np.float64)
    kept = [0]
    for index in range(1, len(array)):
        if np.hypot(*(array[index, :2] - array[kept[-1], :2])) >= shortest:
            kept.append(index)
    return array[kept]


def arc_length(points: Points) -> NDArray[np.float64]:
    """Distance of each vertex from the first along the polyline in the plane [m]."""
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    return np.concatenate(([0.0], np.cumsum(steps)))


def at_distance(points: Points, distance: NDArray[np.float64]) -> Points:
    """Points (k, 3) at distances along a polyline [m]."""
    length = arc_length(points)
    return np.stack([np.interp(distance, length, points[:, axis]) for axis in range(3)], axis=1)


def refined(points: Points, longest: float) -> Points:
    """Polyline with all its vertices and so many more that no segment is longer than `longest` [m]."""
    length = arc_length(points)
    pieces = [
        np.linspace(start, end, max(int(np.ceil((end - start) / longest)), 1), endpoint=False)
        for start, end in pairwise(length.tolist())
    ]
    return at_distance(points, np.concatenate((*pieces, length[-1:])))


def left_normals(points: Points) -> NDArray[np.float64]:
    """Vectors (n, 2) to the left at the vertices, mitred so that parallels keep their distance.

    A mitre is at most twice as long as the distance; sharper corners are cut.
    """
    direction = np.diff(points[:, :2], axis=0)
    direction /= np.hypot(*direction.T)[:, None]
    normal = np.stack((-direction[:, 1], direction[:, 0]), axis=1)
    before, after = np.vstack((normal[:1], normal)), np.vstack((normal, normal[-1:]))
    middle = before + after
    return np.asarray(2 * middle / np.maximum(np.sum(middle**2, axis=1), 1.0)[:, None], np.float64)


def parallel(points: Points, left: float | NDArray[np.float64], lift: float = 0.0) -> Points:
    """Polyline at a distance `left` to the left [m], raised by `lift` [m]."""
    shift = left_normals(points) * np.reshape(left, (-1, 1))
    return np.column_stack((points[:, :2] + shift, points[:, 2] + lift))


def project(points: NDArray[np.float64], line: Points) -> NDArray[np.float64]:
    """Distance along a polyline [m] of the place on it that is nearest to each point (k, 2 or 3)."""
    start, step = line[:-1, :2], np.diff(line[:, :2], axis=0)
    length = np.hypot(*step.T)
    offset = points[:, None, :2] - start
    share = np.clip(np.einsum("ijk,jk->ij", offset, step) / length**2, 0.0, 1.0)
    gap = np.linalg.norm(offset - share[..., None] * step, axis=2)
    nearest = np.argmin(gap, axis=1)
    along = share[np.arange(len(points)), nearest] * length[nearest]
    return np.asarray(arc_length(line)[nearest] + along, np.float64)


class LaneIndex:
    """Distances from points to the paved lanes of a network, by a grid of square cells.

    Parameters
    ----------
    lanes : sequence of Lane
        The lanes.
    cell : float
        Side of a cell [m]; distances beyond it are not told apart.
    """

    def __init__(self, lanes: Sequence[Lane], cell: float = 60.0) -> None:
        lines = [refined(cleaned(lane.centreline), 20.0) for lane in lanes if len(cleaned(lane.centreline)) > 1]
        widths = [lane.width for lane in lanes if len(cleaned(lane.centreline)) > 1]
        counts = [len(line) - 1 for line in lines]
        self._cell = cell
        self._start = np.concatenate([line[:-1] for line in lines])
        self._step = np.concatenate([np.diff(line, axis=0) for line in lines])
        self._half_width = np.repeat(np.asarray(widths) / 2, counts)
        self._members = self._group(self._start + 0.5 * self._step)

    def _group(self, middle: Points) -> dict[tuple[int, int], list[int]]:
        members: dict[tuple[int, int], list[int]] = {}
        for index, (column, row) in enumerate(np.floor(middle[:, :2] / self._cell).astype(int).tolist()):
            for dx in (-1, 0, 1):
                for dy in (-1, 0, 1):
                    members.setdefault((column + dx, row + dy), []).append(index)
        return members

    def clearance(self, points: Points, same_level: float | None = None) -> NDArray[np.float64]:
        """Distance from points (n, 3) to the nearest lane's edge [m], negative on a lane, at most the cell's side.

        Parameters
        ----------
        points : (n, 3) float64
            Points [m].
        same_level : float, optional
            Lanes higher or lower than the point by more than this [m] are left out.
        """
        result = np.full(len(points), self._cell / 2)
        cells = np.floor(points[:, :2] / self._cell).astype(int)
        _, group = np.unique(cells, axis=0, return_inverse=True)
        order = np.argsort(group.ravel(), kind="stable")
        for chunk in np.split(order, np.cumsum(np.bincount(group.ravel()))[:-1]):
            column, row = cells[chunk[0]]
            segments = self._members.get((int(column), int(row)))
            if segments:
                result[chunk] = np.minimum(result[chunk], self._nearest(points[chunk], segments, same_level))
        return result

    def _nearest(self, points: Points, segments: list[int], same_level: float | None) -> NDArray[np.float64]:
        start, step = self._start[segments], self._step[segments]
        offset = points[:, None, :] - start
        square = np.maximum(np.sum(step[:, :2] ** 2, axis=1), 1e-12)
        share = np.clip(np.einsum("ijk,jk->ij", offset[..., :2], step[:, :2]) / square, 0.0, 1.0)
        gap = offset - share[..., None] * step
        distance = np.hypot(gap[..., 0], gap[..., 1]) - self._half_width[segments]
        if same_level is not None:
            distance = np.where(np.abs(gap[..., 2]) <= same_level, distance, np.inf)
        return np.asarray(distance.min(axis=1), np.float64)
