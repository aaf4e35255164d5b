"""Pieces of a row of pixels that see one plane: what changes little along it is computed at their ends only."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

_ONE, _STEP, _EVEN = np.float32(1.0), np.uint64(1), np.uint8(0)
_BEND = np.float32(0.002)  # relative change of slope of 1 / distance from pixel to pixel, above which nothing is plane
_STEEPEST = np.float32(0.2)  # relative change of 1 / distance over a piece above which light is not linear


def piece_length(focal_length: float) -> int:
    """Pixels of a piece: 0.6°, over which beams and light change by little (`focal_length` [px])."""
    return min(max(int(math.radians(0.6) * focal_length), 1), 8)


@kernel
def choose_pixels(
    length: NDArray[np.float32],
    step: int,
    inverse: NDArray[np.float32],
    bent: NDArray[np.uint8],
    pixel: NDArray[np.float32],
    chosen: NDArray[np.float32],
    first: NDArray[np.uint64],
    even: NDArray[np.bool_],
) -> np.uint64:
    """Choose a row's pixels to compute: each `step`-th and the last, and all between where the surface is not plane.

    Over a plane 1 / distance is linear.

    Returns how many were chosen. Takes `length` (cols,) [m], `inverse`, `bent` (cols,), `pixel`, `chosen` (cols,),
    `first`, `even` (cols,) uint64.
    """
    # Unsigned, because indices that may be negative cost a comparison each.
    columns, size = np.uint64(length.shape[0]), np.uint64(step)
    if step == 1:
        for u in range(columns):
            pixel[u], chosen[u] = np.float32(np.int32(u)), length[u]
        return columns
    for u in range(columns):
        inverse[u] = _ONE / length[u]
    bent[0], bent[columns - _STEP] = _EVEN, _EVEN
    for u in range(columns - _STEP - _STEP):
        middle = inverse[u + _STEP]
        curve = abs(inverse[u] + inverse[u + _STEP + _STEP] - middle - middle)
        bent[u + _STEP] = np.uint8(curve > _BEND * middle)
    count, pieces = np.uint64(0), (columns - _STEP - _STEP) // size + _STEP
    for piece in range(pieces):
        a = piece * size
        b = min(a + size, columns - _STEP)
        flags = bent[b]
        for u in range(a, b):
            flags |= bent[u]
        whole = (flags == _EVEN) and (abs(inverse[b] - inverse[a]) < _STEEPEST * inverse[a])
        even[piece], first[piece] = whole, count
        pixel[count], chosen[count] = np.float32(np.int64(a)), length[a]
        count += _STEP
        if not whole:
            for u in range(a + _STEP, b):
                pixel[count], chosen[count] = np.float32(np.int64(u)), length[u]
                count += _STEP
    pixel[count], chosen[count] = np.float32(np.int64(columns - _STEP)), length[columns - _STEP]
    return count + _STEP


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
def spread_over_row(
    values: NDArray[np.float32],
    step: int,
    first: NDArray[np.uint64],
    even: NDArray[np.bool_],
    out: NDArray[np.float32],
) -> None:
    """Values of the chosen pixels, for every pixel of a row (`values` (cols,), `out` (cols,))."""
    if step == 1:
        for u in range(values.shape[0]):
            out[u] = values[u]
        return
    columns, size = np.uint64(out.shape[0]), np.uint64(step)
    pieces, n = (columns - _STEP - _STEP) // size + _STEP, np.uint64(0)
    for piece in range(pieces):
        a, n = piece * size, first[piece]
        b = min(a + size, columns - _STEP)
        value = values[n]
        out[a] = value
        if even[piece]:
            n += _STEP
            slope = (values[n] - value) / np.float32(np.int64(b - a))
            for u in range(a + _STEP, b):
                value += slope
                out[u] = value
        else:
            for u in range(a + _STEP, b):
                n += _STEP
                out[u] = values[n]
            n += _STEP
    out[columns - _STEP] = values[n]
