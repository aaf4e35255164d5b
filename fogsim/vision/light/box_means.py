"""Means of a picture's pixels over boxes on a grid: the picture as coarser pixels show it."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float64]


@kernel
def box_means(picture: Floats, rows: Floats, cols: Floats, box: float) -> tuple[Floats, float]:
    """Means over square boxes about the crossings of rows and columns.

    Takes `picture` (n, m), `rows`, `cols` (l,), `box` [px].
    """
    down, top, down_power = _shares(picture.shape[0], rows, box)
    across, left, across_power = _shares(picture.shape[1], cols, box)
    first, last = picture.shape[1], 0
    for j in range(cols.size):
        first, last = min(first, left[j]), max(last, left[j] + across.shape[1])
    last = min(last, picture.shape[1])
    means = np.zeros((rows.size, cols.size))
    line = np.zeros(picture.shape[1])
    for i in range(rows.size):
        line[first:last] = 0.0
        for r in range(min(down.shape[1], picture.shape[0] - top[i])):
            share = down[i, r]
            if share > 0.0:
                for c in range(first, last):
                    line[c] += share * picture[top[i] + r, c]
        for j in range(cols.size):
            total = 0.0
            for c in range(min(across.shape[1], picture.shape[1] - left[j])):
                total += across[j, c] * line[left[j] + c]
            means[i, j] = total
    return means, down_power * across_power


@kernel
def _shares(size: int, centres: Floats, box: float) -> tuple[Floats, NDArray[np.int64], float]:
    """Shares of pixels in boxes along one axis, the first pixel of each, and the mean of their sums of squares."""
    shares = np.zeros((centres.size, math.ceil(box) + 2))
    first = np.zeros(centres.size, np.int64)
    power = 0.0
    for i in range(centres.size):
        low, high = centres[i] - 0.5 * box, centres[i] + 0.5 * box
        first[i] = min(max(math.floor(low + 0.5), 0), size - 1)
        total = 0.0
        for p in range(min(shares.shape[1], size - first[i])):
            pixel = first[i] + p
            shares[i, p] = max(min(high, pixel + 0.5) - max(low, pixel - 0.5), 0.0)
            total += shares[i, p]
        for p in range(shares.shape[1]):
            shares[i, p] /= max(total, 1e-9)
            power += shares[i, p] ** 2
    return shares, first, power / max(centres.size, 1)
