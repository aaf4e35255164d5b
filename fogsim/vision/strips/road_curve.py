"""Compiled transmission of fog along bins of rows of a flat road."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

SHORT = 0.15
"""Height of a bin over its rows below the horizon up to which a series takes the place of Simpson's rule [-]."""


@kernel
def transmission(below: float, half: float, path: float, k: float) -> tuple[float, float, float]:
    """Mean transmission over a bin's height, with its derivatives by extinction and by the horizon's row.

    Near the horizon a row spans hundreds of metres: Simpson's rule there, farther down e^(−x) with x = k path / below
    and the second term of its Taylor series, which is what Simpson's rule makes of short bins.

    Parameters
    ----------
    below, half : float
        Middle of the bin below the horizon, and half its height [px].
    path : float
        λ times the slant: over the rows below the horizon, the length of the ray [px·m].
    k : float
        Extinction [1/m].
    """
    value, by_k, by_shift = 0.0, 0.0, 0.0
    if half < SHORT * below:
        distance = path / below
        x, share, middle = k * distance, (half / below) ** 2 / 6.0, math.exp(-k * distance)
        curve, bend = x * x - 2.0 * x, 2.0 * x - 2.0
        value = middle * (1.0 + share * curve)
        by_k = distance * (middle * share * bend - value)
        by_shift = middle / below * (share * (2.0 * curve + x * bend) - x * (1.0 + share * curve))
        return value, by_k, by_shift
    for j in range(3):
        rows = below + (j - 1) * half
        if rows <= 0.0:
            continue
        distance = path / rows
        part = (4.0 if j == 1 else 1.0) / 6.0 * math.exp(-k * distance)
        value += part
        by_k -= distance * part
        by_shift -= k * distance / rows * part
    return value, by_k, by_shift


@kernel
def near_road(
    luminance: NDArray[np.float64],
    noise: NDArray[np.float64],
    below: NDArray[np.float64],
    half: NDArray[np.float64],
    path: NDArray[np.float64],
    k: float,
    airlight: float,
    shift: float,
    bins: int,
) -> float:
    """Luminance of a strip without fog: median of what its nearest bins say, given the fog."""
    found = np.empty(bins)
    count = 0
    for i in range(below.size):
        if noise[i] > 0.0 and count < bins:
            value, _, _ = transmission(below[i] - shift, half[i], path[i], k)
            found[count] = airlight + (luminance[i] - airlight) / max(value, 1e-6)
            count += 1
    return float(np.median(found[:count])) if count else 0.0
