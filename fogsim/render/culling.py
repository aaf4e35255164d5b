"""Culling and levels of detail: copies in view and large enough, small ones by simpler shapes."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.render.protocol import FARTHEST
from fogsim.render.vectors import Vector, dot, row

_LARGEST = 8.0  # about the radius of what is largest, but for the ground and woods [m]
_SMALLEST, _SMALLEST_PLAIN = 1.0, 3.0  # radius in the picture below which a copy is left out [px]
# Half a square's breadth over the root of its triangles, below which a simpler shape does [px]: in general, and for
# what has neither paint nor lamps nor signs' sheeting, such as trees, of which more is seen than of all else.
_DENSEST, _DENSEST_PLAIN = 1.15, 1.7
_BINS = 64  # of distance, to draw near copies first: four while it doubles
_NUMBERS = 17  # 32-bit numbers of a record

Array = NDArray[np.float32]
Wide = NDArray[np.float64]
Index = NDArray[np.int64]


class Shapes(NamedTuple):
    """Shapes by number."""

    # centre, half_extent (n, 3): middle and half the extents of each shape's bounding box
    centre: Wide
    half_extent: Wide
    coarser: Index  # (n,) int64: The simpler shape that is drawn for each where it is small, −1 if there is none
    detail: Wide  # (n,): Half the breadth in the picture below which it does [px]
    faces: Index  # (n,) int64: Number of triangles
    smallest: Wide  # (n,): Radius in the picture below which a copy is left out [px]


class Copies(NamedTuple):
    """Copies of shapes."""

    shape: Index  # (n,) int64: Number of each copy's shape
    place: Wide  # (n, 3): Last column of its transform: where its origin is [m]
    record: Array  # (n, 17): Its `RECORD`, as numbers
    middle: Wide  # (n, 3): Middle of its bounding sphere [m]
    radius: Wide  # (n,): Its radius [m]
    # (n,): Half of the second largest of its three extents [m], which says how much of it there is to see
    breadth: Wide


class Cells(NamedTuple):
    """Squares of the ground with the copies in them."""

    first: Index  # (k + 1,) int64: First copy of each square, and the number of all copies
    middle: Wide  # (k, 3): Middle of a sphere around all the copies of each square [m]
    radius: Wide  # (k,): Its radius [m]


class Selection(NamedTuple):
    """Memory for what is chosen: the arrays of a `Drawing`, and copies as found, their distance and their order."""

    mesh: Index
    record: Array
    first: Index
    copy: Index
    bin: Index
    order: Index


def shapes_of(
    numbers: Mapping[str, int], low: Wide, high: Wide, faces: Index, plain: NDArray[np.bool_], endings: tuple[str, ...]
) -> Shapes:
    """Measure shapes (`low`, `high` (n, 3), `faces` (n,) int64, `plain` (n,) bool)."""
    coarser = np.full(len(numbers), -1, np.int64)
    for name in numbers:
        if not name.endswith(endings):
            levels = [numbers[level] for level in (name, *(name + ending for ending in endings)) if level in numbers]
            coarser[levels[:-1]] = levels[1:]
    # Where a shape has too many triangles and the simpler one would have too few, the mean of both decides.
    mean = np.sqrt(faces * np.where(coarser < 0, faces, faces[coarser]))
    densest = np.where(plain, _DENSEST_PLAIN, _DENSEST)
    return Shapes(
        0.5 * (low + high),
        0.5 * (high - low),
        coarser,
        densest * np.sqrt(mean),
        faces,
        np.where(plain, _SMALLEST_PLAIN, _SMALLEST),
    )


def copies_of(shape: Index, record: Array, place: Wide, shapes: Shapes) -> Copies:
    """Measure copies."""
    count = len(shape)
    copies = Copies(shape, place, record, np.empty((count, 3)), np.empty(count), np.empty(count))
    measure(shapes, copies, 0, count)
    return copies


def with_room(copies: Copies, count: int) -> Copies:
    """Add room for so many more copies."""

    def longer(column: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate((column, np.zeros((count, *column.shape[1:]), column.dtype)))

    return Copies._make(longer(np.asarray(column)) for column in copies)


def cells_of(copies: Copies, side: float) -> tuple[Copies, Cells]:
    """Sort copies by squares of the ground with a side [m] (`side` [m])."""
    square = np.floor(copies.middle[:, :2] / side).astype(np.int64)
    _, number = np.unique(square, axis=0, return_inverse=True)
    order = np.argsort(number.ravel(), kind="stable")
    sorted_copies = Copies._make(np.ascontiguousarray(column[order]) for column in copies)
    first = np.concatenate(([0], np.cumsum(np.bincount(number.ravel())))).astype(np.int64)
    middle, radius = np.zeros((len(first) - 1, 3)), np.zeros(len(first) - 1)
    for cell, (start, end) in enumerate(pairwise(first.tolist())):
        inside = sorted_copies.middle[start:end]
        middle[cell] = 0.5 * (inside.min(axis=0) + inside.max(axis=0))
        reach = np.linalg.norm(inside - middle[cell], axis=1) + sorted_copies.radius[start:end]
        radius[cell] = reach.max()
    return sorted_copies, Cells(first, middle, radius)


@kernel
def measure(shapes: Shapes, copies: Copies, begin: int, end: int) -> None:
    """Set middle, radius and breadth of copies from `begin` to `end`."""
    shape, record, place = copies.shape, copies.record, copies.place
    centre, half_extent = shapes.centre, shapes.half_extent
    for copy in range(begin, end):
        number = shape[copy]
        for axis in range(3):
            total = place[copy, axis]
            for column in range(3):
                total += record[copy, 4 * axis + column] * centre[number, column]
            copies.middle[copy, axis] = total
        x, y, z = 0.0, 0.0, 0.0
        for axis in range(3):
            x += record[copy, 4 * axis] ** 2
            y += record[copy, 4 * axis + 1] ** 2
            z += record[copy, 4 * axis + 2] ** 2
        x, y, z = x * half_extent[number, 0] ** 2, y * half_extent[number, 1] ** 2, z * half_extent[number, 2] ** 2
        copies.radius[copy] = np.sqrt(x + y + z)
        copies.breadth[copy] = np.sqrt(x + y + z - min(x, y, z) - max(x, y, z))


@kernel
def select_copies(
    shapes: Shapes,
    copies: Copies,
    cells: Cells,
    end: int,
    planes: Wide,
    eye: Wide,
    focal: float,
    selection: Selection,
) -> int:
    """Choose the copies that a picture may show, near ones first.

    Returns number of copies selection. Takes `planes` (5, 3), `eye` (3,) [m], `focal` [px].
    """
    middle, radius, first, smallest = copies.middle, copies.radius, cells.first, shapes.smallest
    begin = first[len(first) - 1]
    measure(shapes, copies, begin, end)
    p, q, r, s, ahead = row(planes, 0), row(planes, 1), row(planes, 2), row(planes, 3), row(planes, 4)
    # Farther away nearly all is left out for its size, and the ground lies in a fraction of the row at the horizon.
    farthest = min(FARTHEST, _LARGEST * focal / _SMALLEST)
    count = 0
    for cell in range(len(cells.radius) + 1):
        low, high = begin, end
        if cell < len(cells.radius):
            low, high = first[cell], first[cell + 1]
            x, y, z = cells.middle[cell, 0] - eye[0], cells.middle[cell, 1] - eye[1], cells.middle[cell, 2] - eye[2]
            if _depth((x, y, z), cells.radius[cell], p, q, r, s, ahead) >= farthest:
                continue
        for copy in range(low, high):
            x, y, z = middle[copy, 0] - eye[0], middle[copy, 1] - eye[1], middle[copy, 2] - eye[2]
            # Most are too small, and that is the quickest to see.
            if focal * radius[copy] <= smallest[copies.shape[copy]] * max(dot(ahead, (x, y, z)), radius[copy]):
                continue
            depth = _depth((x, y, z), radius[copy], p, q, r, s, ahead)
            if depth < farthest:
                selection.copy[count] = copy
                selection.bin[count] = _bin(depth)
                count += 1
    _sort(selection, count)
    _write_records(shapes, copies, ahead, eye, focal, selection, count)
    return count


@kernel
def _depth(middle: Vector, radius: float, p: Vector, q: Vector, r: Vector, s: Vector, ahead: Vector) -> float:
    """Depth of the nearest point of a sphere [m], infinite if it is out of view."""
    if min(dot(p, middle), dot(q, middle), dot(r, middle), dot(s, middle)) < -radius:
        return np.inf
    depth = dot(ahead, middle)
    return max(depth - radius, 0.0) if depth > -radius else np.inf


@kernel
def _bin(depth: float) -> int:
    """Bin of a distance [m], from the exponent and the first two bits of the mantissa of a float."""
    bits = np.float32(1.0 + depth).view(np.int32) - np.float32(1.0).view(np.int32)
    return min(int(bits) >> 21, _BINS - 1)


@kernel
def _sort(selection: Selection, count: int) -> None:
    """Set the order in which copies are drawn: by bin of distance."""
    bins, copies, order = selection.bin, selection.copy, selection.order
    place = np.zeros(_BINS + 1, np.int64)
    for i in range(count):
        place[bins[i] + 1] += 1
    for i in range(_BINS):
        place[i + 1] += place[i]
    for i in range(count):
        order[place[bins[i]]] = copies[i]
        place[bins[i]] += 1


@kernel
def _write_records(
    shapes: Shapes, copies: Copies, ahead: Vector, eye: Wide, focal: float, selection: Selection, count: int
) -> None:
    """Write what is drawn of the chosen copies."""
    mesh, record, first, order = selection.mesh, selection.record, selection.first, selection.order
    first[0] = 0
    for i in range(count):
        copy = order[i]
        x, y, z = copies.middle[copy, 0] - eye[0], copies.middle[copy, 1] - eye[1], copies.middle[copy, 2] - eye[2]
        depth, shape = dot(ahead, (x, y, z)), copies.shape[copy]
        while shapes.coarser[shape] >= 0 and focal * copies.breadth[copy] < shapes.detail[shape] * depth:
            shape = shapes.coarser[shape]
        mesh[i] = shape
        first[i + 1] = first[i] + shapes.faces[shape]
        for number in range(_NUMBERS):
            record[i, number] = copies.record[copy, number]
        for axis in range(3):
            record[i, 4 * axis + 3] = copies.place[copy, axis] - eye[axis]
