"""Deriche's smoothing and derivative (Deriche 1987), the gradient of the Canny–Deriche edge detector."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]

ALPHA = 1.0
"""Deriche's α: the smaller, the smoother; 0.5 for noisy and 1.5 for sharp images [1/px]."""

REACH = 7.0
"""Reach of the kernels in 1/α: beyond it less than a hundredth of their weight is left [-]."""


@lru_cache(maxsize=8)
def smoothing_kernel(alpha: float = ALPHA) -> NDArray[np.float64]:
    """Deriche's smoothing, h(n) = s (α|n| + 1) e^(−α|n|), of sum 1.

    Parameters
    ----------
    alpha : float
        α [1/px].

    Returns
    -------
    (2 n + 1,) float64
        Read-only; what the recursion of the same α converges to, cut off at `REACH`.
    """
    n = np.abs(_taps(alpha))
    e = math.exp(-alpha)
    kernel = (1.0 - e) ** 2 / (1.0 + 2.0 * alpha * e - e * e) * (alpha * n + 1.0) * np.exp(-alpha * n)
    kernel.flags.writeable = False
    return np.asarray(kernel)


@lru_cache(maxsize=8)
def derivative_kernel(alpha: float = ALPHA) -> NDArray[np.float64]:
    """Deriche's derivative, ∝ n e^(−α|n|), of response 1 to a slope of 1 per pixel.

    Parameters
    ----------
    alpha : float
        α [1/px].

    Returns
    -------
    (2 n + 1,) float64
        Read-only, to be correlated with an image; the slope's sum is Σ n² e^(−α|n|) = 2 e (1 + e) / (1 − e)³ with
        e = e^(−α).
    """
    n = _taps(alpha)
    e = math.exp(-alpha)
    kernel = n * np.exp(-alpha * np.abs(n)) * (1.0 - e) ** 3 / (2.0 * e * (1.0 + e))
    kernel.flags.writeable = False
    return np.asarray(kernel)


def _taps(alpha: float) -> NDArray[np.float64]:
    reach = math.ceil(REACH / alpha)
    return np.arange(-reach, reach + 1, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Gradient:
    """First derivatives of a smoothed image.

    Attributes
    ----------
    across, down : (rows, cols) float32
        Change a pixel to the right and downward [linear grey levels per px].
    """

    across: Image
    down: Image
