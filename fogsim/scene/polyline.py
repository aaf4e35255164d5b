"""Polylines on the ground: _arc_length, directions, parallels, projection.

The work is compiled: networks have a hundred thousand of them, each too short for numpy to be fast.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.road import Lane

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
