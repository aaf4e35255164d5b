"""The Canny–Deriche edge detector (Canny 1986, Deriche 1987): Deriche's smoothing and derivative."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.lines.edges import EdgeDetector

Image = NDArray[np.float32]

_ALPHA = 1.0
"""Deriche's α: the smaller, the smoother; 0.5 for noisy and 1.5 for sharp images [1/px]."""

REACH = 7.0
"""Reach of the kernels in 1/α: beyond it less than a hundredth of their weight is left [-]."""


@lru_cache(maxsize=8)
def smoothing_kernel(alpha: float = _ALPHA) -> NDArray[np.float64]:
    """Deriche's smoothing, h(n) = s (α|n| + 1) e^(−α|n|), of sum 1.

    Returns read-only; what the recursion of the same α converges to, cut off at `REACH` (2 n + 1,). Takes `alpha`
    [1/px].
    """
    n = np.abs(_taps(alpha))
    e = math.exp(-alpha)
    kernel = (1.0 - e) ** 2 / (1.0 + 2.0 * alpha * e - e * e) * (alpha * n + 1.0) * np.exp(-alpha * n)
    kernel.flags.writeable = False
    return np.asarray(kernel)


@lru_cache(maxsize=8)
def derivative_kernel(alpha: float = _ALPHA) -> NDArray[np.float64]:
    """Deriche's derivative, ∝ n e^(−α|n|), of response 1 to a slope of 1 per pixel.

    Returns read-only, to be correlated with an image; the slope's sum is Σ n² e^(−α|n|) = 2 e (1 + e) / (1 − e)³ with e
    = e^(−α). Takes `alpha` [1/px].
    """
    n = _taps(alpha)
    e = math.exp(-alpha)
    kernel = n * np.exp(-alpha * np.abs(n)) * (1.0 - e) ** 3 / (2.0 * e * (1.0 + e))
    kernel.flags.writeable = False
    return np.asarray(kernel)


def _taps(alpha: float) -> NDArray[np.float64]:
    reach = math.ceil(REACH / alpha)
    return np.arange(-reach, reach + 1, dtype=np.float64)


_TAPS = math.ceil(REACH / _ALPHA)
"""Taps on either side of the middle one: known to the compiler, which then does without the loops over them."""


class CannyDeriche(EdgeDetector):
    """Edge detector by Deriche's derivatives."""

    def __init__(self) -> None:
        super().__init__(derivatives)


def derivatives(image: Image, across: Image, down: Image) -> None:
    """Derivatives of an image, each smoothed across its own direction.

    Takes `image` (rows, cols), `across`, `down` (rows, cols).
    """
    _derivatives(image, _half(smoothing_kernel()), _half(derivative_kernel()), across, down)


def _half(weights: NDArray[np.float64]) -> Image:
    """From the middle one on: the rest is its mirror image."""
    return weights[_TAPS:].astype(np.float32)


@kernel
def _derivatives(image: Image, smooth: Image, derivative: Image, across: Image, down: Image) -> None:
    """Down the columns first, which both share, then along the row, before the next row is begun.

    Pixels at equal distances are added first, so that a mirrored image gives the same to the last bit.
    """
    rows, cols = image.shape
    line = np.empty((2, cols + 2 * _TAPS), np.float32)
    for row in range(rows):
        for col in range(cols):
            mean, slope = smooth[0] * image[row, col], np.float32(0.0)
            for tap in range(1, _TAPS + 1):
                lower, upper = image[min(row + tap, rows - 1), col], image[max(row - tap, 0), col]
                mean += smooth[tap] * (lower + upper)
                slope += derivative[tap] * (lower - upper)
            line[0, _TAPS + col], line[1, _TAPS + col] = mean, slope
        line[:, :_TAPS], line[:, _TAPS + cols :] = line[:, _TAPS : _TAPS + 1], line[:, _TAPS + cols - 1 : _TAPS + cols]
        for col in range(cols):
            slope, mean = np.float32(0.0), smooth[0] * line[1, _TAPS + col]
            for tap in range(1, _TAPS + 1):
                slope += derivative[tap] * (line[0, _TAPS + col + tap] - line[0, _TAPS + col - tap])
                mean += smooth[tap] * (line[1, _TAPS + col + tap] + line[1, _TAPS + col - tap])
            across[row, col], down[row, col] = slope, mean
