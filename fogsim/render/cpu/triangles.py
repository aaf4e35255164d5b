"""Which triangles of the copies may cover a pixel, and where they are on the picture."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.render.vectors import Vector

_SLACK = 1e-3  # by which boxes are widened, since corners are projected with 32 bits [px]

Array = NDArray[np.float32]
Wide = NDArray[np.float64]
Index = NDArray[np.int64]


class Triangles(NamedTuple):
    """All meshes, as rasterising wants them."""

    positions: Array  # (3, n): x, y and z of all vertices [m]
    faces: NDArray[np.uint32]  # (m, 3) uint32: Vertices of each triangle, numbered within its mesh
    # first_vertex, first_face (k + 1,) int64: where those of each mesh begin
    first_vertex: Index
    first_face: Index
    in_solid: NDArray[np.bool_]  # (m,) bool: As in `MeshTable`
    # centre, half_extent (k, 3): middle and half the extents of the bounding box of each mesh [m]
    centre: Wide
    half_extent: Wide


class Work(NamedTuple):
    """Memory for some copies at a time, so few that it stays near the processor."""

    corners: Array  # (5, n): Vertices: x, y, z in camera axes [m], then column and row [px], NaN before the near plane
    points: Array  # (m, 9): Of each triangle that may cover a pixel, the corners in camera axes [m]
    box: NDArray[np.int32]  # (m, 4) int32: Its first and last row and column
    vertex: NDArray[np.uint32]  # (m, 3) uint32: Where its vertices are among the corners
    triangle_id: NDArray[np.int32]  # (m,) int32: Its id
    copy: Index  # (c,) int64: The copies that are worked on


class Drawn(NamedTuple):
    """A `Drawing` as plain numbers."""

    # mesh, first: as in `Drawing`
    mesh: Index
    record: Array  # (c, 17): The records; the first twelve numbers of each are the transform
    first: Index


class Pinhole(NamedTuple):
    """Where a camera looks."""

    axes: Wide  # (3, 3): Axes of the camera in the world as rows
    lens: Wide  # (3,): Focal length and principal point [px]
    near: float  # Depth before which nothing is seen [m]


@kernel
def project(triangles: Triangles, drawn: Drawn, copies: Index, pinhole: Pinhole, corners: Array) -> None:
    """Set the vertices of copies one after another.

    One loop for each number, since each alone runs in vector registers.

    Takes `copies` (n,) int64, `corners` (5, n).
    """
    mesh, record, axes, lens, near = drawn.mesh, drawn.record, pinhole.axes, pinhole.lens, pinhole.near
    positions, first_vertex = triangles.positions, triangles.first_vertex
    focal, nearest, nothing = np.float32(lens[0]), np.float32(near), np.float32(np.nan)
    base = 0
    for copy in copies:
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
def cull_triangles(triangles: Triangles, drawn: Drawn, copies: Index, size: tuple[int, int, int], work: Work) -> int:
    """Keep the triangles of copies whose boxes may hold the centre of any pixel, with vertices and ids.

    Every triangle is written down, and by the next one again unless it is kept: which are is hard to foresee, and so
    costs a processor that guesses more than to write.

    Returns number of triangles kept. Takes `copies` (n,) int64.
    """
    mesh, first = drawn.mesh, drawn.first
    faces, first_vertex, first_face = triangles.faces, triangles.first_vertex, triangles.first_face
    in_solid = triangles.in_solid
    corners, vertex, triangle_id = work.corners, work.vertex, work.triangle_id
    first_row, last_row, last_column = np.float32(size[0]), np.float32(size[1] - 1), np.float32(size[2] - 1)
    zero, slack = np.float32(0.0), np.float32(_SLACK)
    count, base = np.uint64(0), np.uint32(0)
    for copy in copies:
        start = np.uint64(first_face[mesh[copy]])
        for own in range(np.uint64(first_face[mesh[copy] + 1]) - start):
            face = start + own
            i, j, k = faces[face, 0] + base, faces[face, 1] + base, faces[face, 2] + base
            a, b, c = corners[3, i], corners[3, j], corners[3, k]
            left, right = np.ceil(_least(a, b, c) - slack), np.floor(_greatest(a, b, c) + slack)
            whole, p, q = a + b + c, b - a, c - a
            a, b, c = corners[4, i], corners[4, j], corners[4, k]
            top, bottom = np.ceil(_least(a, b, c) - slack), np.floor(_greatest(a, b, c) + slack)
            behind = in_solid[face] & (p * (c - a) - q * (b - a) > zero)
            empty = behind | (left > right) | (top > bottom) | (right < zero) | (left > last_column)
            empty |= (bottom < first_row) | (top > last_row)
            vertex[count, 0], vertex[count, 1], vertex[count, 2] = i, j, k
            triangle_id[count] = np.int32(first[copy]) + np.int32(own)
            # Where a corner lies before the near plane nothing is known yet.
            count += np.uint64(not (empty & (not np.isnan(whole))))
        base += np.uint32(first_vertex[mesh[copy] + 1] - first_vertex[mesh[copy]])
    return int(count)


@kernel
def _least(a: np.float32, b: np.float32, c: np.float32) -> np.float32:
    low = a if a < b else b
    return low if low < c else c


@kernel
def _greatest(a: np.float32, b: np.float32, c: np.float32) -> np.float32:
    high = a if a > b else b
    return high if high > c else c


@kernel
def set_up_boxes(kept: int, pinhole: Pinhole, size: tuple[int, int, int], work: Work) -> int:
    """Set boxes and corners of kept triangles, and leave out those before the near plane.

    Returns number of triangles left.
    """
    lens, near = pinhole.lens, pinhole.near
    corners, points, box, vertex, triangle_id = work.corners, work.points, work.box, work.vertex, work.triangle_id
    first_row, last_row, last_column = float(size[0]), size[1] - 1.0, size[2] - 1.0
    focal, u0, v0 = lens[0], lens[1], lens[2]
    count, slack = np.uint64(0), np.float32(_SLACK)
    for t in range(np.uint64(kept)):
        i, j, k = vertex[t, 0], vertex[t, 1], vertex[t, 2]
        a, b, c = corners[3, i], corners[3, j], corners[3, k]
        if np.isnan(a + b + c):
            z0, z1, z2 = np.float64(corners[2, i]), np.float64(corners[2, j]), np.float64(corners[2, k])
            if max(z0, z1, z2) <= near:
                continue
            depths = z0, z1, z2
            left, right = _extent((corners[0, i], corners[0, j], corners[0, k]), depths, focal, u0, near)
            top, bottom = _extent((corners[1, i], corners[1, j], corners[1, k]), depths, focal, v0, near)
            if top > bottom or right < 0 or bottom < first_row or left > last_column or top > last_row:
                continue
        else:
            left, right = np.ceil(_least(a, b, c) - slack), np.floor(_greatest(a, b, c) + slack)
            a, b, c = corners[4, i], corners[4, j], corners[4, k]
            top, bottom = np.ceil(_least(a, b, c) - slack), np.floor(_greatest(a, b, c) + slack)
        box[count, 0], box[count, 1] = np.int32(max(first_row, top)), np.int32(min(last_row, bottom))
        box[count, 2], box[count, 3] = np.int32(max(0.0, left)), np.int32(min(last_column, right))
        for row in range(3):
            points[count, row] = corners[row, i]
            points[count, 3 + row] = corners[row, j]
            points[count, 6 + row] = corners[row, k]
        triangle_id[count] = triangle_id[t]
        count += np.uint64(1)
    return int(count)


@kernel
def _extent(across: Vector, depths: Vector, focal: float, middle: float, near: float) -> tuple[float, float]:
    """First and last column or row of that part of a triangle which lies beyond the near plane."""
    x0, x1, x2 = across
    z0, z1, z2 = depths
    low, high = np.inf, -np.inf
    for here, there, z, other in ((x0, x1, z0, z1), (x1, x2, z1, z2), (x2, x0, z2, z0)):
        if z > near:
            low, high = min(low, here / z), max(high, here / z)
        if (z > near) != (other > near):
            at = (here + (near - z) / (other - z) * (there - here)) / near
            low, high = min(low, at), max(high, at)
    return np.ceil(focal * low + middle - _SLACK), np.floor(focal * high + middle + _SLACK)
