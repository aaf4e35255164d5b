"""Polylines on the ground: _arc_length, directions, parallels, projection.

The work is compiled: networks have a hundred thousand of them, each too short for numpy to be fast.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Points = NDArray[np.float64]

_TIGHT = 1e-9  # pieces whose length times that of the line's piece is less than this have no direction [m²]


SHORTEST = 0.05
"""Length below which a segment is joined to the next [m]."""


def cleaned(points: Points, shortest: float = SHORTEST) -> Points:
    """Polyline without its shortest segments (`points` (n, 2 or 3) [m], `shortest` [m])."""
    array = np.ascontiguousarray(points, np.float64)
    kept = _kept_vertices(array, shortest)
    return array if len(kept) == len(array) else array[kept]


def arc_length(points: Points) -> NDArray[np.float64]:
    """Distance of each vertex from the first along the polyline in the plane [m] (`points` (n, 2 or 3) [m])."""
    return _arc_length(np.ascontiguousarray(points, np.float64))


def at_distance(points: Points, distance: NDArray[np.float64]) -> Points:
    """Points (k, 3) along a polyline (`points` (n, 3) [m], `distance` (k,) [m])."""
    return _at_distance(np.ascontiguousarray(points, np.float64), np.ascontiguousarray(distance, np.float64))


def refined(points: Points, longest: float) -> Points:
    """Polyline with all its vertices and more between them (`points` (n, 2 or 3) [m], `longest` [m])."""
    return _refined(np.ascontiguousarray(points, np.float64), longest)


def refined_lines(lines: Sequence[Points], longest: float) -> tuple[Points, NDArray[np.int64]]:
    """Points of many polylines, one after another, each `cleaned` and then `refined`, and how many each has.

    Takes `lines` (n, 3) [m], `longest` [m].
    """
    ends = np.cumsum([0, *map(len, lines)])
    points = np.concatenate(lines)
    counts = _refined_counts(points, ends, longest)
    return _refined_lines(points, ends, longest, int(counts.sum())), counts


def all_cleaned(lines: Sequence[Points]) -> list[Points]:
    """Each of many polylines `cleaned`, as parts of one array (`lines` (n, 3) [m])."""
    if not lines:
        return []
    points, counts = refined_lines(lines, np.inf)
    ends = np.cumsum(counts).tolist()
    return [points[end - count : end] for end, count in zip(ends, counts.tolist(), strict=True)]


def left_normals(points: Points) -> NDArray[np.float64]:
    """Vectors (n, 2) to the left at the vertices, mitred so that parallels keep their distance.

    A mitre is at most twice as long as the distance; sharper corners are cut.

    Takes `points` (n, 2 or 3) [m].
    """
    return _left_normals(np.ascontiguousarray(points, np.float64))


def parallel(points: Points, left: float | NDArray[np.float64], lift: float = 0.0) -> Points:
    """Polyline next to another.

    On the inside of a bend that is tighter than the distance it is cut short, so that it never runs backwards; it has a
    vertex for each of the line's all the same.

    Takes `points` (n, 3) [m], `left` (n,) [m], `lift` [m].
    """
    distance = np.empty(len(points))
    distance[:] = left
    return _parallel(np.ascontiguousarray(points, np.float64), distance, lift)


def project(points: NDArray[np.float64], line: Points) -> NDArray[np.float64]:
    """Distance along a polyline [m] of the place on it that is nearest to each point.

    Takes `points` (k, 2 or 3) [m], `line` (n, 2 or 3) [m].
    """
    return _project(np.ascontiguousarray(points, np.float64), np.ascontiguousarray(line, np.float64))


def true_spans(chosen: NDArray[np.bool_], *, least: int = 1) -> list[tuple[int, int]]:
    """First indices of spans of neighbours that are all true, and those after their last (`chosen` (n,) bool)."""
    return [(first, end) for first, end in _true_spans(np.ascontiguousarray(chosen), least).tolist()]


@kernel
def _true_spans(chosen: NDArray[np.bool_], least: int) -> NDArray[np.int64]:
    """First indices of spans that are all true, and those after their last (k, 2)."""
    spans = np.empty(((len(chosen) + 1) // 2, 2), np.int64)
    count, first = 0, 0
    for i in range(len(chosen) + 1):
        if i == len(chosen) or not chosen[i]:
            if i > first and i - first >= least:
                spans[count, 0], spans[count, 1] = first, i
                count += 1
            first = i + 1
    return spans[:count]


@kernel
def _kept_vertices(points: Points, shortest: float) -> NDArray[np.int64]:
    """Numbers of the vertices between which no segment is shorter than `shortest` [m]."""
    kept = np.empty(len(points), np.int64)
    kept[0], count = 0, 1
    for i in range(1, len(points)):
        last = kept[count - 1]
        if np.hypot(points[i, 0] - points[last, 0], points[i, 1] - points[last, 1]) >= shortest:
            kept[count] = i
            count += 1
    return kept[:count]


@kernel
def _arc_length(points: Points) -> NDArray[np.float64]:
    """Distance of each vertex from the first along the polyline [m]."""
    result = np.zeros(len(points))
    for i in range(1, len(points)):
        step = np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
        result[i] = result[i - 1] + step
    return result


@kernel
def _project(points: Points, line: Points) -> NDArray[np.float64]:
    """Distance along a line of its place nearest to each point (see `project`): on the first piece of several."""
    length, result = _arc_length(line), np.zeros(len(points))
    for k in range(len(points)):
        nearest = np.inf
        for i in range(len(line) - 1):
            dx, dy = line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1]
            u, v, piece = points[k, 0] - line[i, 0], points[k, 1] - line[i, 1], np.hypot(dx, dy)
            share = min(max((u * dx + v * dy) / (piece * piece), 0.0), 1.0)
            u, v = u - share * dx, v - share * dy
            gap = np.sqrt(u * u + v * v)
            if gap < nearest:
                nearest, result[k] = gap, length[i] + share * piece
    return result


@kernel
def _at_distance(points: Points, distance: NDArray[np.float64]) -> Points:
    """Points (k, 3) along a line (see `at_distance`)."""
    length, result = _arc_length(points), np.empty((len(distance), 3))
    for k in range(len(distance)):
        i = np.searchsorted(length, distance[k], "right") - 1
        if i < 0 or i >= len(length) - 1 or length[i] == distance[k]:
            result[k] = points[max(i, 0)]
            continue
        for axis in range(3):
            slope = (points[i + 1, axis] - points[i, axis]) / (length[i + 1] - length[i])
            result[k, axis] = slope * (distance[k] - length[i]) + points[i, axis]
    return result


@kernel
def _refined(points: Points, longest: float) -> Points:
    """Polyline with as many vertices more that no segment is longer than `longest` [m]."""
    count = 1
    pieces = np.empty(max(len(points) - 1, 0), np.int64)
    for i in range(len(points) - 1):
        step = np.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
        pieces[i] = max(int(np.ceil(step / longest)), 1)
        count += pieces[i]
    result = np.empty((count, points.shape[1]))
    k = 0
    for i in range(len(points) - 1):
        for j in range(pieces[i]):
            share = j / pieces[i]
            for axis in range(points.shape[1]):
                result[k, axis] = points[i, axis] + share * (points[i + 1, axis] - points[i, axis])
            k += 1
    result[k] = points[-1]
    return result


@kernel
def _refined_counts(points: Points, ends: NDArray[np.int64], longest: float) -> NDArray[np.int64]:
    """How many points each line has when it is cleaned and refined; lines lie between `ends`."""
    counts = np.empty(len(ends) - 1, np.int64)
    for i in range(len(counts)):
        line = points[ends[i] : ends[i + 1]]
        counts[i] = len(_refined(line[_kept_vertices(line, SHORTEST)], longest))
    return counts


@kernel
def _refined_lines(points: Points, ends: NDArray[np.int64], longest: float, count: int) -> Points:
    result = np.empty((count, points.shape[1]))
    k = 0
    for i in range(len(ends) - 1):
        line = points[ends[i] : ends[i + 1]]
        fine = _refined(line[_kept_vertices(line, SHORTEST)], longest)
        result[k : k + len(fine)] = fine
        k += len(fine)
    return result


@kernel
def _left_normals(points: Points) -> NDArray[np.float64]:
    """Vectors (n, 2) to the left at the vertices, mitred (see `left_normals`)."""
    last = len(points) - 1
    normal = np.empty((last, 2))
    for i in range(last):
        dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        length = np.hypot(dx, dy)
        normal[i, 0], normal[i, 1] = -dy / length, dx / length
    result = np.empty((last + 1, 2))
    for i in range(last + 1):
        before, after = max(i - 1, 0), min(i, last - 1)
        x, y = normal[before, 0] + normal[after, 0], normal[before, 1] + normal[after, 1]
        scale = 2 / max(x * x + y * y, 1.0)
        result[i, 0], result[i, 1] = scale * x, scale * y
    return result


@kernel
def _parallel(points: Points, left: NDArray[np.float64], lift: float) -> Points:
    """Polyline at distances `left` to the left [m], raised by `lift` [m], that never runs backwards."""
    normal, result = _left_normals(points), np.empty((len(points), 3))
    for i in range(len(points)):
        result[i, 0] = points[i, 0] + left[i] * normal[i, 0]
        result[i, 1] = points[i, 1] + left[i] * normal[i, 1]
        result[i, 2] = points[i, 2] + lift
    forward = np.empty(len(points) - 1)
    # Each round draws at least one more piece together.
    for _ in range(len(forward)):
        worst = 0.0
        for i in range(len(forward)):
            dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
            forward[i] = dx * (result[i + 1, 0] - result[i, 0]) + dy * (result[i + 1, 1] - result[i, 1])
            worst = min(worst, forward[i])
        if worst >= -_TIGHT:
            break
        _draw_together(result, forward)
    return result


@kernel
def _draw_together(line: Points, forward: NDArray[np.float64]) -> None:
    """Collapse all vertices of each span of pieces that do not lead forward, at least one backward, into one point."""
    first = 0
    while first < len(forward):
        end, backward = first, False
        while end < len(forward) and forward[end] <= _TIGHT:
            backward |= forward[end] < -_TIGHT
            end += 1
        if backward:
            x, y = _meeting(line, first, end)
            line[first : end + 1, 0], line[first : end + 1, 1] = x, y
        first = end + 1


@kernel
def _meeting(line: Points, first: int, last: int) -> tuple[float, float]:
    """Where what leads to one vertex meets what leads on from another; their middle where that is far off."""
    x, y = 0.5 * (line[first, 0] + line[last, 0]), 0.5 * (line[first, 1] + line[last, 1])
    if first == 0 or last == len(line) - 1:
        return x, y
    ax, ay = line[first, 0] - line[first - 1, 0], line[first, 1] - line[first - 1, 1]
    bx, by = line[last + 1, 0] - line[last, 0], line[last + 1, 1] - line[last, 1]
    cross = ax * by - ay * bx
    if abs(cross) < 1e-3 * np.hypot(ax, ay) * np.hypot(bx, by):
        return x, y
    gx, gy = line[last, 0] - line[first, 0], line[last, 1] - line[first, 1]
    share = (gx * by - gy * bx) / cross
    u, v = line[first, 0] + share * ax, line[first, 1] + share * ay
    near = np.hypot(u - x, v - y) <= np.hypot(gx, gy) + 1e-9
    return (u, v) if near else (x, y)
