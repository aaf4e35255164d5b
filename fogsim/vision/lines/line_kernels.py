"""Compiled search for straight edges that run toward a vanishing point."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

ANGLES, OFFSET_STEP = 360, 2.0
"""Bins of the accumulator: directions of the gradient round the circle, and px between offsets."""

MOST_POINTS = 8000
"""Edge pixels that are looked at."""


@kernel
def edge_points(
    across: NDArray[np.float32], down: NDArray[np.float32], edges: NDArray[np.uint8], col: float, row: float
) -> NDArray[np.float64]:
    """Edges below a point, placed within the pixel along the gradient.

    Returns
    -------
    (n, 5) float64
        Column and row from the point [px], direction of the gradient [rad], its cosine and sine.
    """
    rows, cols = edges.shape
    out = np.empty((MOST_POINTS, 5))
    count = 0
    for v in range(max(int(row) + 8, 1), rows - 1):
        line = edges[v]
        for u in range(1, cols - 1):
            if line[u] == 0 or count == MOST_POINTS:
                continue
            gx, gy = float(across[v, u]), float(down[v, u])
            size = math.hypot(gx, gy)
            # Level edges are bumpers, shadows and the fog's own gradient.
            if abs(gx) < 0.2 * size or size <= 0.0:
                continue
            if abs(gx) >= abs(gy):
                before = math.hypot(across[v, u - 1], down[v, u - 1])
                behind = math.hypot(across[v, u + 1], down[v, u + 1])
            else:
                before = math.hypot(across[v - 1, u], down[v - 1, u])
                behind = math.hypot(across[v + 1, u], down[v + 1, u])
            bend = before - 2.0 * size + behind
            shift = 0.5 * (before - behind) / bend if bend < 0.0 else 0.0
            shift = min(max(shift, -0.5), 0.5)
            sideways = abs(gx) >= abs(gy)
            out[count, 0] = u - col + (shift if sideways else 0.0)
            out[count, 1] = v - row + (0.0 if sideways else shift)
            out[count, 2] = math.atan2(gy, gx)
            out[count, 3], out[count, 4] = gx / size, gy / size
            count += 1
    return out[:count].copy()


@kernel
def hough_lines(
    points: NDArray[np.float64], reach: float, most: int, least: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Highest peaks of Hough's transform of edge points, each voting near the direction of its gradient.

    Returns
    -------
    tuple of (n, 2) and (n,) float64
        Direction θ of each line's normal [rad] and offset ρ [px] of u cos θ + v sin θ = ρ; votes.
    """
    offsets = int(2.0 * reach / OFFSET_STEP) + 1
    cells = np.zeros((ANGLES, offsets), np.int32)
    unit = 2.0 * math.pi / ANGLES
    cosine, sine = np.cos(np.arange(ANGLES) * unit), np.sin(np.arange(ANGLES) * unit)
    for i in range(points.shape[0]):
        nearest = math.floor(points[i, 2] / unit + 0.5)
        for turn in range(-3, 4):
            angle = (nearest + turn) % ANGLES
            rho = points[i, 0] * cosine[angle] + points[i, 1] * sine[angle]
            place = math.floor((rho + reach) / OFFSET_STEP + 0.5)
            if 0 <= place < offsets:
                cells[angle, place] += 1
    lines, votes = np.empty((most, 2)), np.empty(most)
    count = 0
    for _ in range(most):
        best = np.argmax(cells)
        angle, place = best // offsets, best % offsets
        if cells[angle, place] < least:
            break
        lines[count, 0], lines[count, 1] = angle * unit, place * OFFSET_STEP - reach
        votes[count] = cells[angle, place]
        count += 1
        for turn in range(-4, 5):
            for near in range(max(int(place) - 4, 0), min(int(place) + 5, offsets)):
                cells[(angle + turn) % ANGLES, near] = 0
    return lines[:count].copy(), votes[:count].copy()
