"""Polylines on the ground: lengths, directions, parallels, projection."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]

_TIGHT = 1e-9  # pieces whose length times that of the line's piece is less than this have no direction [m²]


def cleaned(points: Points, shortest: float = 0.05) -> Points:
    """Polyline (n, 3) without segments shorter than `shortest` [m]."""
    array = np.asarray(points, np.float64)
    if np.all(np.hypot(*np.diff(array[:, :2], axis=0).T) >= shortest):
        return array
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
    if not np.any(np.diff(length) > longest):
        return points
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
    """Polyline at a distance `left` to the left [m], raised by `lift` [m].

    On the inside of a bend that is tighter than the distance it is cut short, so that it never runs backwards; it has a
    vertex for each of the line's all the same.
    """
    shift = left_normals(points) * np.reshape(left, (-1, 1))
    return np.column_stack((_unfolded(points[:, :2], points[:, :2] + shift), points[:, 2] + lift))


def _unfolded(line: NDArray[np.float64], beside: NDArray[np.float64]) -> NDArray[np.float64]:
    """A parallel (n, 2) of a line, whose pieces that run backwards are drawn together in one place."""
    direction = np.diff(line, axis=0)
    # Each round draws at least one more piece together.
    for _ in range(len(direction)):
        forward = np.einsum("ij,ij->i", np.diff(beside, axis=0), direction)
        if not np.any(forward < -_TIGHT):
            break
        beside = beside.copy()
        for first, last in _backward_runs(forward):
            beside[first : last + 1] = _meeting(beside, first, last)
    return beside


def _backward_runs(forward: NDArray[np.float64]) -> list[tuple[int, int]]:
    """First and last vertices of runs of pieces that do not lead forward, of which one leads backward."""
    changes = np.flatnonzero(np.diff(np.concatenate(([0], (forward <= _TIGHT).astype(int), [0]))))
    return [(a, b) for a, b in changes.reshape(-1, 2).tolist() if np.any(forward[a:b] < -_TIGHT)]


def _meeting(beside: NDArray[np.float64], first: int, last: int) -> NDArray[np.float64]:
    """Where what leads to one vertex meets what leads on from another; their middle where that is far off."""
    middle = 0.5 * (beside[first] + beside[last])
    if first == 0 or last == len(beside) - 1:
        return np.asarray(middle, np.float64)
    before, after = beside[first] - beside[first - 1], beside[last + 1] - beside[last]
    cross = before[0] * after[1] - before[1] * after[0]
    if abs(cross) < 1e-3 * np.hypot(*before) * np.hypot(*after):
        return np.asarray(middle, np.float64)
    gap = beside[last] - beside[first]
    share = (gap[0] * after[1] - gap[1] * after[0]) / cross
    place = beside[first] + share * before
    near = np.hypot(*(place - middle)) <= np.hypot(*gap) + 1e-9
    return np.asarray(place if near else middle, np.float64)


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
