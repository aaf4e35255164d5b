"""Compiled work on polylines: networks have a hundred thousand of them, each too short for numpy to be fast."""

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

Points = NDArray[np.float64]

_TIGHT = 1e-9  # pieces whose length times that of the line's piece is less than this have no direction [m²]


@kernel
def kept_vertices(points: Points, shortest: float) -> NDArray[np.int64]:
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
def lengths(points: Points) -> NDArray[np.float64]:
    """Distance of each vertex from the first along the polyline [m]."""
    result = np.zeros(len(points))
    for i in range(1, len(points)):
        step = np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
        result[i] = result[i - 1] + step
    return result


@kernel
def refined_line(points: Points, longest: float) -> Points:
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
def normals_to_the_left(points: Points) -> NDArray[np.float64]:
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
def parallel_line(points: Points, left: NDArray[np.float64], lift: float) -> Points:
    """Polyline at distances `left` to the left [m], raised by `lift` [m], that never runs backwards."""
    normal, result = normals_to_the_left(points), np.empty((len(points), 3))
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
    """Put all vertices of each run of pieces that do not lead forward, of which one leads backward, in one place."""
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


@kernel
def surface_normals(points: NDArray[np.float64], toward: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normals of a grid of points (n, m, 3) (see `grid_normals`)."""
    rows, columns = points.shape[0], points.shape[1]
    result, facing = np.empty(points.shape), 0.0
    for i in range(rows):
        up, down = max(i - 1, 0), min(i + 1, rows - 1)
        for j in range(columns):
            west, east = max(j - 1, 0), min(j + 1, columns - 1)
            ax, ay, az = points[down, j] - points[up, j]
            bx, by, bz = points[i, east] - points[i, west]
            x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            share = 1.0 / ((down - up) * (east - west))
            result[i, j, 0], result[i, j, 1], result[i, j, 2] = share * x, share * y, share * z
            facing += share * (x * toward[0] + y * toward[1] + z * toward[2])
    sign = 1.0 if facing >= 0 else -1.0
    for i in range(rows):
        for j in range(columns):
            normal = result[i, j]
            if max(abs(normal[0]), abs(normal[1]), abs(normal[2])) < 1e-9:
                result[i, j] = toward
            else:
                result[i, j] = sign * normal
    return result


@kernel
def crossed_oddly(points: NDArray[np.float64], outline: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell from which points (n, 2) a ray to the east crosses an outline (m, 2) an odd number of times."""
    result = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        for j in range(len(outline)):
            k = j + 1 if j + 1 < len(outline) else 0
            if (outline[j, 1] > y) != (outline[k, 1] > y):
                share = (y - outline[j, 1]) / (outline[k, 1] - outline[j, 1])
                if x < outline[j, 0] + share * (outline[k, 0] - outline[j, 0]):
                    result[i] = not result[i]
    return result
