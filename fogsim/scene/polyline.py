"""Polylines on the ground: lengths, directions, parallels, projection."""

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.polyline_kernels import kept_vertices, lengths, normals_to_the_left, parallel_line, refined_line

Points = NDArray[np.float64]


def cleaned(points: Points, shortest: float = 0.05) -> Points:
    """Polyline (n, 3) without segments shorter than `shortest` [m]."""
    array = np.ascontiguousarray(points, np.float64)
    kept = kept_vertices(array, shortest)
    return array if len(kept) == len(array) else array[kept]


def arc_length(points: Points) -> NDArray[np.float64]:
    """Distance of each vertex from the first along the polyline in the plane [m]."""
    return lengths(np.ascontiguousarray(points, np.float64))


def at_distance(points: Points, distance: NDArray[np.float64]) -> Points:
    """Points (k, 3) at distances along a polyline [m]."""
    length = arc_length(points)
    return np.stack([np.interp(distance, length, points[:, axis]) for axis in range(3)], axis=1)


def refined(points: Points, longest: float) -> Points:
    """Polyline with all its vertices and so many more that no segment is longer than `longest` [m]."""
    return refined_line(np.ascontiguousarray(points, np.float64), longest)


def left_normals(points: Points) -> NDArray[np.float64]:
    """Vectors (n, 2) to the left at the vertices, mitred so that parallels keep their distance.

    A mitre is at most twice as long as the distance; sharper corners are cut.
    """
    return normals_to_the_left(np.ascontiguousarray(points, np.float64))


def parallel(points: Points, left: float | NDArray[np.float64], lift: float = 0.0) -> Points:
    """Polyline at a distance `left` to the left [m], raised by `lift` [m].

    On the inside of a bend that is tighter than the distance it is cut short, so that it never runs backwards; it has a
    vertex for each of the line's all the same.
    """
    distance = np.empty(len(points))
    distance[:] = left
    return parallel_line(np.ascontiguousarray(points, np.float64), distance, lift)


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
