"""Visibility of triangles in homogeneous coordinates, without clipping.

With the corners of a triangle in camera axes as the columns of M, the rows of M⁻¹ times the viewing ray (x, y, 1) of a
pixel give three numbers eᵢ that are linear in the pixel's coordinates: all are positive where the triangle covers the
pixel, their sum is 1/z, and corners may lie behind the camera (Olano & Greer, "Triangle Scan Conversion using 2D
Homogeneous Coordinates", 1997).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

_SMALL = 64  # boxes of no more pixels are looked at before their triangle is drawn
_LANES = 8
_EMPTY = 0xFFFFFFFF  # nothing, infinitely far away
_SLACK = 1e-3  # by which boxes are widened, since corners are projected with 32 bits [px]

Array = NDArray[np.float32]
Wide = NDArray[np.float64]
Index = NDArray[np.int64]


class Triangles(NamedTuple):
    """All meshes, as rasterising wants them.

    Attributes
    ----------
    positions : (3, n) float32
        x, y and z of all vertices [m].
    faces : (m, 3) uint32
        Vertices of each triangle, numbered within its mesh.
    first_vertex, first_face : (k + 1,) int64
        Where those of each mesh begin.
    """

    positions: Array
    faces: NDArray[np.uint32]
    first_vertex: Index
    first_face: Index


class Work(NamedTuple):
    """Memory for some copies at a time, so few that it stays near the processor.

    Attributes
    ----------
    corners : (5, n) float32
        Vertices: x, y, z in camera axes [m], then column and row [px], NaN before the near plane.
    points : (m, 9) float32
        Of each triangle that may cover a pixel, the corners in camera axes [m].
    box : (m, 4) int32
        Its first and last row and column.
    vertex : (m, 3) uint32
        Where its vertices are among the corners.
    slot : (m,) int32
        Its slot.
    """

    corners: Array
    points: Array
    box: NDArray[np.int32]
    vertex: NDArray[np.uint32]
    slot: NDArray[np.int32]


Point = tuple[float, float, float]
Edges = tuple[float, float, float, float, float, float, float, float, float, float, float, float]
"""Coefficients over column, row and 1 of the three eᵢ, positive inside, and of 1/z [1/m]."""


@kernel
def rasterise(
    triangles: Triangles,
    mesh: Index,
    record: Array,
    first: Index,
    axes: Wide,
    lens: Wide,
    near: float,
    picture: Index,
    columns: int,
    top: int,
    bottom: int,
    work: Work,
) -> None:
    """Find the nearest triangle of each pixel of some rows.

    Parameters
    ----------
    triangles : Triangles
        All meshes.
    mesh, first
        As in `Drawing`.
    record : (c, 17) float32
        The records of a `Drawing`; the first twelve numbers are the transform.
    axes : (3, 3) float64
        Axes of the camera in the world as rows.
    lens : (3,) float64
        Focal length and principal point [px].
    near : float
        Depth before which nothing is seen [m].
    picture : (rows, columns + at least 7) int64
        Is set to what is seen: in the lower half its slot, −1 for nothing, in the upper half the bits of its 1/z as a
        32-bit float, which sort like the float. Of two surfaces the greater number is the nearer one.
    columns : int
        Width of the picture [px]; what lies behind it is not set.
    top, bottom : int
        First row, and the one after the last.
    work : Work
        Memory to work in, with room for the largest mesh.
    """
    picture[top:bottom] = _EMPTY
    # Handing an array to a function costs as much as drawing a triangle, so the functions below take many copies each.
    begin = 0
    while begin < len(mesh):
        end, vertices, faces = begin, 0, 0
        while end < len(mesh):
            vertices += triangles.first_vertex[mesh[end] + 1] - triangles.first_vertex[mesh[end]]
            faces += triangles.first_face[mesh[end] + 1] - triangles.first_face[mesh[end]]
            if vertices > work.corners.shape[1] or faces > len(work.points):
                break
            end += 1
        _project(triangles, mesh, record, begin, end, axes, lens, near, work.corners)
        count = _sift(triangles, mesh, first, begin, end, (top, bottom, columns), work)
        count = _set_up(count, lens, near, (top, bottom, columns), work)
        _fill(work, count, lens, near, picture)
        begin = end


@kernel
def _project(
    triangles: Triangles,
    mesh: Index,
    record: Array,
    begin: int,
    end: int,
    axes: Wide,
    lens: Wide,
    near: float,
    corners: Array,
) -> None:
    """Vertices of copies one after another; one loop for each number, since each alone runs in vector registers."""
    positions, first_vertex = triangles.positions, triangles.first_vertex
    focal, nearest, nothing = np.float32(lens[0]), np.float32(near), np.float32(np.nan)
    base = 0
    for copy in range(begin, end):
        start = first_vertex[mesh[copy]]
        count = first_vertex[mesh[copy] + 1] - start
        for row in range(3):
            x, y, z = axes[row, 0], axes[row, 1], axes[row, 2]
            a = np.float32(x * record[copy, 0] + y * record[copy, 4] + z * record[copy, 8])
            b = np.float32(x * record[copy, 1] + y * record[copy, 5] + z * record[copy, 9])
            c = np.float32(x * record[copy, 2] + y * record[copy, 6] + z * record[copy, 10])
            d = np.float32(x * record[copy, 3] + y * record[copy, 7] + z * record[copy, 11])
            for i in range(np.uint64(count)):
                k = np.uint64(start) + i
                corners[row, np.uint64(base) + i] = a * positions[0, k] + b * positions[1, k] + c * positions[2, k] + d
        for row in range(2):
            middle = np.float32(lens[1 + row])
            for i in range(np.uint64(base), np.uint64(base + count)):
                z = corners[2, i]
                place = focal * corners[row, i] / z + middle
                corners[3 + row, i] = place if z > nearest else nothing
        base += count


@kernel
def _sift(
    triangles: Triangles, mesh: Index, first: Index, begin: int, end: int, size: tuple[int, int, int], work: Work
) -> int:
    """Triangles of copies whose boxes may hold the centre of any pixel, with vertices and slots; their count.

    Every triangle is written down, and by the next one again unless it is kept: which are is hard to foresee, and so
    costs a processor that guesses more than to write.
    """
    faces, first_vertex, first_face = triangles.faces, triangles.first_vertex, triangles.first_face
    corners, vertex, slot = work.corners, work.vertex, work.slot
    first_row, last_row, last_column = np.float32(size[0]), np.float32(size[1] - 1), np.float32(size[2] - 1)
    zero, slack = np.float32(0.0), np.float32(_SLACK)
    count, base = np.uint64(0), np.uint32(0)
    for copy in range(begin, end):
        start = np.uint64(first_face[mesh[copy]])
        for own in range(np.uint64(first_face[mesh[copy] + 1]) - start):
            face = start + own
            i, j, k = faces[face, 0] + base, faces[face, 1] + base, faces[face, 2] + base
            a, b, c = corners[3, i], corners[3, j], corners[3, k]
            left, right = np.ceil(_least(a, b, c) - slack), np.floor(_greatest(a, b, c) + slack)
            whole = a + b + c
            a, b, c = corners[4, i], corners[4, j], corners[4, k]
            top, bottom = np.ceil(_least(a, b, c) - slack), np.floor(_greatest(a, b, c) + slack)
            empty = (left > right) | (top > bottom) | (right < zero) | (left > last_column)
            empty |= (bottom < first_row) | (top > last_row)
            vertex[count, 0], vertex[count, 1], vertex[count, 2] = i, j, k
            slot[count] = np.int32(first[copy]) + np.int32(own)
            # Where a corner lies before the near plane nothing is known yet.
            count += np.uint64(not (empty & (not np.isnan(whole))))
        base += np.uint32(first_vertex[mesh[copy] + 1] - first_vertex[mesh[copy]])
    return np.int64(count)


@kernel
def _least(a: np.float32, b: np.float32, c: np.float32) -> np.float32:
    low = a if a < b else b
    return low if low < c else c


@kernel
def _greatest(a: np.float32, b: np.float32, c: np.float32) -> np.float32:
    high = a if a > b else b
    return high if high > c else c


@kernel
def _set_up(sifted: int, lens: Wide, near: float, size: tuple[int, int, int], work: Work) -> int:
    """Boxes and corners of sifted triangles, less those before the near plane; their count."""
    corners, points, box, vertex, slot = work.corners, work.points, work.box, work.vertex, work.slot
    first_row, last_row, last_column = float(size[0]), size[1] - 1.0, size[2] - 1.0
    focal, u0, v0 = lens[0], lens[1], lens[2]
    count, slack = np.uint64(0), np.float32(_SLACK)
    for t in range(np.uint64(sifted)):
        i, j, k = vertex[t, 0], vertex[t, 1], vertex[t, 2]
        a, b, c = corners[3, i], corners[3, j], corners[3, k]
        if np.isnan(a + b + c):
            z0, z1, z2 = np.float64(corners[2, i]), np.float64(corners[2, j]), np.float64(corners[2, k])
            if max(z0, z1, z2) <= near:
                continue
            left, right = _extent(corners[0, i], corners[0, j], corners[0, k], z0, z1, z2, focal, u0, near)
            top, bottom = _extent(corners[1, i], corners[1, j], corners[1, k], z0, z1, z2, focal, v0, near)
            if top > bottom or right < 0 or bottom < first_row or left > last_column or top > last_row:
                continue
        else:
            left, right = np.ceil(_least(a, b, c) - slack), np.floor(_greatest(a, b, c) + slack)
            a, b, c = corners[4, i], corners[4, j], corners[4, k]
            top, bottom = np.ceil(_least(a, b, c) - slack), np.floor(_greatest(a, b, c) + slack)
        box[count, 0], box[count, 1] = np.int32(max(top, first_row)), np.int32(min(bottom, last_row))
        box[count, 2], box[count, 3] = np.int32(max(left, 0.0)), np.int32(min(right, last_column))
        for row in range(3):
            points[count, row] = corners[row, i]
            points[count, 3 + row] = corners[row, j]
            points[count, 6 + row] = corners[row, k]
        slot[count] = slot[t]
        count += np.uint64(1)
    return np.int64(count)


@kernel
def _extent(
    x0: float, x1: float, x2: float, z0: float, z1: float, z2: float, focal: float, middle: float, near: float
) -> tuple[float, float]:
    """First and last column or row of that part of a triangle which lies beyond the near plane."""
    low, high = np.inf, -np.inf
    for here, there, z, other in ((x0, x1, z0, z1), (x1, x2, z1, z2), (x2, x0, z2, z0)):
        if z > near:
            low, high = min(low, here / z), max(high, here / z)
        if (z > near) != (other > near):
            at = (here + (near - z) / (other - z) * (there - here)) / near
            low, high = min(low, at), max(high, at)
    return np.ceil(focal * low + middle - _SLACK), np.floor(focal * high + middle + _SLACK)


@kernel
def _edges(p: Point, q: Point, r: Point, focal: float, u0: float, v0: float) -> Edges:
    """Set up a triangle; of one that is seen edge on, nothing is inside.

    What two triangles that share an edge find for it is the same but for the sign, to the last bit, so that no pixel
    falls between them.
    """
    ax, ay, az = q[1] * r[2] - q[2] * r[1], q[2] * r[0] - q[0] * r[2], q[0] * r[1] - q[1] * r[0]
    bx, by, bz = r[1] * p[2] - r[2] * p[1], r[2] * p[0] - r[0] * p[2], r[0] * p[1] - r[1] * p[0]
    cx, cy, cz = p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
    determinant = p[0] * ax + p[1] * ay + p[2] * az
    if determinant == 0.0:
        return (0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0)
    sign = 1.0 if determinant > 0.0 else -1.0
    per_focal = sign / focal
    ax, ay, bx, by, cx, cy = (
        ax * per_focal,
        ay * per_focal,
        bx * per_focal,
        by * per_focal,
        cx * per_focal,
        cy * per_focal,
    )
    az, bz, cz = sign * az - ax * u0 - ay * v0, sign * bz - bx * u0 - by * v0, sign * cz - cx * u0 - cy * v0
    scale = 1.0 / abs(determinant)
    zx, zy, zz = (ax + bx + cx) * scale, (ay + by + cy) * scale, (az + bz + cz) * scale
    return (ax, ay, az, bx, by, bz, cx, cy, cz, zx, zy, zz)


@kernel
def _fill(work: Work, count: int, lens: Wide, near: float, picture: Index) -> None:
    """Draw the pixels of triangles, row by row between their edges."""
    points, box, slots, focal, u0, v0 = work.points, work.box, work.slot, lens[0], lens[1], lens[2]
    for t in range(count):
        top, bottom, left, right = int(box[t, 0]), int(box[t, 1]), int(box[t, 2]), int(box[t, 3])
        least = min(points[t, 2], points[t, 5], points[t, 8])
        crossing = least <= near
        if not crossing and (bottom - top) * (right - left) < _SMALL:
            # Most small triangles are hidden by what has been drawn already, and to see that is cheap.
            limit, hidden = _key(np.float32(1.0001) / least, 0), True
            for v in range(np.uint64(top), np.uint64(bottom + 1)):
                for u in range(np.uint64(left), np.uint64(right + 1)):
                    hidden &= picture[v, u] > limit
                if not hidden:
                    break
            if hidden:
                continue
        p = (np.float64(points[t, 0]), np.float64(points[t, 1]), np.float64(points[t, 2]))
        q = (np.float64(points[t, 3]), np.float64(points[t, 4]), np.float64(points[t, 5]))
        r = (np.float64(points[t, 6]), np.float64(points[t, 7]), np.float64(points[t, 8]))
        ax, ay, az, bx, by, bz, cx, cy, cz, zx, zy, zz = _edges(p, q, r, focal, u0, v0)
        # Of two triangles that share an edge, one begins where the other ends: both find the same place for it.
        a1, a0, a3, a2 = _bounds(ax, ay, az)
        b1, b0, b3, b2 = _bounds(bx, by, bz)
        c1, c0, c3, c2 = _bounds(cx, cy, cz)
        d1, d0, d3, d2 = _bounds(-zx, -zy, 1.0 / near - zz) if crossing else (0.0, -np.inf, 0.0, np.inf)
        if ax == 0.0 or bx == 0.0 or cx == 0.0:
            top, bottom = _rows(top, bottom, ax, ay, az)
            top, bottom = _rows(top, bottom, bx, by, bz)
            top, bottom = _rows(top, bottom, cx, cy, cz)
        first, last, number, step = float(left), float(right), slots[t], np.float32(zx)
        for v in range(np.uint64(top), np.uint64(bottom + 1)):
            row = float(v)
            low = max(a1 * row + a0, b1 * row + b0, c1 * row + c0, d1 * row + d0)
            high = min(a3 * row + a2, b3 * row + b2, c3 * row + c2, d3 * row + d2)
            low, high = np.ceil(max(low, first)), np.floor(min(high, last))
            # A row of few pixels is drawn as one of eight, some of them masked, and so is an empty one: to guess how
            # often a short loop turns costs the processor more. Comparisons are such that NaN makes a row empty.
            span = high - low if high >= low else -1.0
            low = low if low < last else last
            begin, end = np.uint64(low), np.int64(span)
            lanes: Any = max(end + 1, _LANES)
            start = np.float32(zx * low + zy * row + zz)
            # Unsigned numbers tell the compiler that no index counts from the end.
            for i in range(np.uint64(lanes)):
                key = _key(start + step * np.float32(np.int32(i)), number)
                key = key if np.int64(i) <= end else 0
                before = picture[v, begin + i]
                picture[v, begin + i] = key if key > before else before


@kernel
def _key(inverse_depth: float | np.float32, slot: int) -> Any:
    return np.int64(np.float32(inverse_depth).view(np.int32)) << 32 | np.int64(slot)


@kernel
def _bounds(x: float, y: float, rest: float) -> tuple[float, float, float, float]:
    """Where x · u + y · v + rest is not negative: least u as slope over v and value at 0, and greatest u likewise."""
    inverse = -1.0 / x
    if x > 0.0:
        return y * inverse, rest * inverse, 0.0, np.inf
    if x < 0.0:
        return 0.0, -np.inf, y * inverse, rest * inverse
    return 0.0, -np.inf, 0.0, np.inf


@kernel
def _rows(top: int, bottom: int, x: float, y: float, rest: float) -> tuple[int, int]:
    """Rows from top to bottom in which x · u + y · v + rest is not negative, if it does not depend on the column."""
    if x != 0.0:
        return top, bottom
    if y > 0.0:
        return int(min(max(top, np.ceil(-rest / y)), bottom + 1.0)), bottom
    if y < 0.0:
        return top, int(max(min(bottom, np.floor(-rest / y)), top - 1.0))
    return (top, bottom) if rest >= 0.0 else (top, top - 1)
