"""Rows of an image that are computed at some of their pixels: where surfaces are plane, light is linear between two."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

_ONE, _STEP, _EVEN = np.float32(1.0), np.uint64(1), np.uint8(0)
_BEND = np.float32(0.002)  # relative change of slope of 1 / distance from pixel to pixel, above which nothing is plane
_STEEPEST = np.float32(0.2)  # relative change of 1 / distance over a piece above which light is not linear
_LONGEST = 8
_EIGHT, _NEXT = np.uint64(_LONGEST), np.uint32(1)


def piece_length(focal_length: float) -> int:
    """Pixels of a piece: 0.6°, over which beams and light change by little (`focal_length` [px])."""
    return min(max(int(math.radians(0.6) * focal_length), 1), _LONGEST)


class Pieces(NamedTuple):
    """A row's chosen pixels, and memory for choosing them."""

    step: int  # Pixels of a piece; with 1, every pixel is chosen
    pixel: NDArray[np.float32]  # (n,): Columns of the chosen pixels
    length: NDArray[np.float32]  # (n,): Their distances [m]
    first: NDArray[np.uint64]  # (pieces,): Number of the chosen pixel at which each piece begins
    even: NDArray[np.bool_]  # (pieces,): Whether nothing between its ends was chosen
    inverse: NDArray[np.float32]
    bent: NDArray[np.uint8]


@kernel
def row_pieces(columns: int, step: int) -> Pieces:
    """Memory for rows of so many pixels."""
    room = columns + _LONGEST
    return Pieces(
        step,
        np.arange(columns).astype(np.float32),
        np.empty(columns, np.float32),
        np.empty(columns, np.uint64),
        np.empty(columns, np.bool_),
        np.empty(columns, np.float32),
        np.zeros((3, room + 1), np.uint8),
    )


@kernel
def values_of_row(columns: int) -> NDArray[np.float32]:
    """Memory for a value of each pixel of a row, or of each chosen one: pieces are written and read eight at a time."""
    return np.zeros(columns + _LONGEST, np.float32)


@kernel
def cut_lengths(distance: NDArray[np.float32], farthest: np.float32, length: NDArray[np.float32]) -> bool:
    """Cut distances of a row to a length; whether any is shorter. Bitwise, so that compilers vectorise it."""
    near = np.int32(0)
    for u in range(length.shape[0]):
        near |= np.int32(distance[u] < farthest)
        length[u] = min(distance[u], farthest)
    return bool(near != 0)


@kernel
def choose_pixels(length: NDArray[np.float32], pieces: Pieces) -> np.uint64:
    """Choose a row's pixels to compute: each `step`-th and the last, and all between where the surface is not plane.

    Over a plane 1 / distance is linear.

    Returns how many were chosen. Takes `length` (cols,) [m].
    """
    # Unsigned, because indices that may be negative cost a comparison each.
    columns, size = np.uint64(length.shape[0]), np.uint64(pieces.step)
    pixel, chosen, first, even = pieces.pixel, pieces.length, pieces.first, pieces.even
    if pieces.step == 1:
        for u in range(columns):
            chosen[u] = length[u]
        return columns
    inverse, last = pieces.inverse, columns - _STEP
    bent = _bent_within(length, size + _STEP, inverse, pieces.bent)
    count = np.uint64(0)
    for piece in range((last - _STEP) // size + _STEP):
        a = piece * size
        b = min(a + size, last)
        whole = (bent[a] == _EVEN) and (abs(inverse[b] - inverse[a]) < _STEEPEST * inverse[a])
        even[piece], first[piece] = whole, count
        pixel[count], chosen[count] = np.float32(np.int32(a)), length[a]
        count += _STEP
        if not whole:
            for u in range(a + _STEP, b):
                pixel[count], chosen[count] = np.float32(np.int32(u)), length[u]
                count += _STEP
    pixel[count], chosen[count] = np.float32(np.int32(last)), length[last]
    return count + _STEP


@kernel
def _bent_within(
    length: NDArray[np.float32], size: np.uint64, inverse: NDArray[np.float32], memory: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Whether a row is bent at any of the `size` pixels from each on."""
    columns = np.uint64(length.shape[0])
    for u in range(columns):
        inverse[u] = _ONE / length[u]
    bent = memory[0]
    for u in range(columns - _STEP - _STEP):
        middle = inverse[u + _STEP]
        curve = abs(inverse[u] + inverse[u + _STEP + _STEP] - middle - middle)
        bent[u + _STEP] = np.uint8(curve > _BEND * middle)
    # Twice as many with each loop, which become vector instructions; beyond the row nothing is bent.
    source, span = 0, _STEP
    while span < size:
        target, further = 2 if source == 1 else 1, min(span, size - span)
        here, out = memory[source], memory[target]
        for u in range(columns):
            out[u] = here[u] | here[u + further]
        source, span = target, span + further
    found: NDArray[np.uint8] = memory[source]
    return found


@kernel
def row_points(
    count: np.uint64,
    ray_map: NDArray[np.float32],
    v: int,
    pixel: NDArray[np.float32],
    length: NDArray[np.float32],
    points: NDArray[np.float32],
) -> None:
    """Where the things are that chosen pixels of a row see.

    Takes `ray_map` (3, 3), `pixel`, `length` (cols,) [m], `points` (3, cols) [m].
    """
    first_x = ray_map[0, 1] * np.float32(v) + ray_map[0, 2]
    first_y = ray_map[1, 1] * np.float32(v) + ray_map[1, 2]
    first_z = ray_map[2, 1] * np.float32(v) + ray_map[2, 2]
    to_x, to_y, to_z = points[0], points[1], points[2]
    for n in range(count):
        x = first_x + ray_map[0, 0] * pixel[n]
        y = first_y + ray_map[1, 0] * pixel[n]
        z = first_z + ray_map[2, 0] * pixel[n]
        scale = length[n] / np.sqrt(x * x + y * y + z * z)
        to_x[n], to_y[n], to_z[n] = x * scale, y * scale, z * scale


@kernel
def spread_over_row(values: NDArray[np.float32], pieces: Pieces, out: NDArray[np.float32]) -> None:
    """Values of the chosen pixels, for every pixel of a row (`values`, `out` as by `values_of_row`)."""
    columns, size, first, even = np.uint64(out.shape[0]) - _EIGHT, np.uint64(pieces.step), pieces.first, pieces.even
    last, n = columns - _STEP, np.uint64(0)
    # What is written beyond a piece, the next ones write again.
    for piece in range((last - _STEP) // size + _STEP):
        a, n = piece * size, first[piece]
        if even[piece]:
            value, after = values[n], values[n + _STEP]
            slope = (after - value) / np.float32(np.int32(min(size, last - a)))
            for i in range(_EIGHT):
                out[a + i] = value + slope * np.float32(np.int32(i))
            n += _STEP
        else:
            for i in range(_EIGHT):
                out[a + i] = values[n + i]
            n += min(size, last - a)
    out[last] = values[n]


@kernel
def split_places(
    count: np.uint64, places: NDArray[np.float32], stride: int, cell: NDArray[np.int32], share: NDArray[np.float32]
) -> None:
    """Cells of a table, `stride` values apart, in which places along an axis lie, and how far on in them they are."""
    size = np.int32(stride)
    for n in range(count):
        whole = np.int32(places[n])
        cell[n], share[n] = whole * size, places[n] - np.float32(whole)


@kernel
def read_between(
    count: np.uint64,
    table: NDArray[np.float32],
    stride: int,
    cell: NDArray[np.int32],
    down: NDArray[np.float32],
    aside: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Values of a table (flat, rows `stride` apart) between the four about a place: see `split_places`.

    In a loop of its own, since the places are found by vector instructions and values are not.
    """
    row = np.uint32(stride)
    for n in range(count):
        a = np.uint32(cell[n])
        b = a + row
        low = table[a] + (table[a + _NEXT] - table[a]) * aside[n]
        high = table[b] + (table[b + _NEXT] - table[b]) * aside[n]
        out[n] = low + (high - low) * down[n]
