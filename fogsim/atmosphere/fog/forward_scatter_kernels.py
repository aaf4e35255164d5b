"""The per-pixel loop of forward scattering by day."""

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

_NONE, _HALF = np.float32(0.0), np.float32(0.5)


@kernel
def blur_rows(image: NDArray[np.float32], weights: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Convolve each row of an image (rows, cols, 3); what the weights miss at the edges is shared among the rest."""
    columns, reach = image.shape[1], weights.shape[0] // 2
    for u in range(columns):
        first, last = max(0, u - reach), min(columns, u + reach + 1)
        whole = np.float32(0.0)
        for n in range(first, last):
            whole += weights[n - u + reach]
        for v in range(image.shape[0]):
            for c in range(3):
                total = np.float32(0.0)
                for n in range(first, last):
                    total += weights[n - u + reach] * image[v, n, c]
                out[v, u, c] = total / whole


@kernel
def exchange(
    radiance: NDArray[np.float32],
    difference: NDArray[np.float32],
    transmission: NDArray[np.float32],
    blurred: NDArray[np.float32],
    block: int,
    weight: np.float32,
) -> None:
    """Exchange a share w (1 − T) of a difference for its blur, of which each block (rows, cols, 3) has a value."""
    rows, columns = blurred.shape[0], blurred.shape[1]
    part = np.float32(1.0) / np.float32(block)
    for v in range(transmission.shape[0]):
        down = min(max((np.float32(v) + _HALF) * part - _HALF, _NONE), np.float32(rows - 1))
        upper = min(int(down), max(rows - 2, 0))
        lower = min(upper + 1, rows - 1)
        b = down - np.float32(upper)
        for u in range(transmission.shape[1]):
            across = min(max((np.float32(u) + _HALF) * part - _HALF, _NONE), np.float32(columns - 1))
            left = min(int(across), max(columns - 2, 0))
            right = min(left + 1, columns - 1)
            a = across - np.float32(left)
            share = weight * (np.float32(1.0) - transmission[v, u])
            for c in range(3):
                above = blurred[upper, left, c] + (blurred[upper, right, c] - blurred[upper, left, c]) * a
                below = blurred[lower, left, c] + (blurred[lower, right, c] - blurred[lower, left, c]) * a
                radiance[v, u, c] += share * (above + (below - above) * b - difference[v, u, c])
