"""Exponential decay of a contrast with range."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import straight_line

Floats = NDArray[np.float64]

_STEPS, _HUBER = 12, 2.5
"""Gauss–Newton steps, and residual beyond which a range counts linearly, in standard deviations [-]."""


@dataclass(frozen=True, slots=True)
class DecayFit:
    """Decay c = C e^(−kd) + o."""

    # extinction, deviation: k and its standard deviation [1/m]
    extinction: float
    deviation: float
    contrast: float  # C [-]
    misfit: float  # Mean square of the standardised residuals [-]


def fit_decay(distance: Floats, contrast: Floats, noise: Floats, relative: float, offset: float) -> DecayFit | None:
    """Fit Duntley's law to contrasts at several ranges (Gauss–Newton, weights by the model's own values).

    Fitted in the contrasts themselves and not in their logarithms, which noise would bias and make undefined.

    Returns None if there are fewer than three ranges or no contrast. Takes `distance`, `contrast`, `noise` (n,) [m].
    """
    if distance.size < 3 or float(np.abs(contrast).max()) <= 0:
        return None
    near = float(distance.mean())
    size, k = _first_guess(distance - near, contrast, noise)
    size, k, variance, misfit = _descended(distance - near, contrast, noise, relative, offset, size, k)
    misfit /= max(distance.size - 2, 1)
    deviation = math.sqrt(max(variance, 0.0) * max(misfit, 1.0))
    return DecayFit(k, deviation, size * math.exp(min(k * near, 50.0)), misfit)


@kernel
def _descended(
    distance: Floats, contrast: Floats, noise: Floats, relative: float, offset: float, size: float, k: float
) -> tuple[float, float, float, float]:
    """Size, extinction, the variance of the latter, and the sum of squared standardised residuals."""
    o, variance, misfit = 0.0, 0.0, 0.0
    for _ in range(_STEPS):
        # Normal equations in the order of size, offset and extinction; the diagonal keeps them regular.
        aa, ab, ac, bb, bc, cc = 1e-9, 0.0, 0.0, 1.0 / offset**2, 0.0, 1e-3
        ra, rb, rc, misfit = 0.0, -o / offset**2, 0.0, 0.0
        for i in range(distance.size):
            fall = math.exp(-k * distance[i])
            residual = contrast[i] - size * fall - o
            weight = 1.0 / (noise[i] ** 2 + (relative * size * fall) ** 2)
            # Ranges at which something else was seen count less (Huber).
            weight *= min(1.0, _HUBER / max(abs(residual) * math.sqrt(weight), 1e-9))
            slope = -size * distance[i] * fall
            aa, ab, ac = aa + weight * fall * fall, ab + weight * fall, ac + weight * fall * slope
            bb, bc, cc = bb + weight, bc + weight * slope, cc + weight * slope * slope
            ra, rb, rc = ra + weight * fall * residual, rb + weight * residual, rc + weight * slope * residual
            misfit += weight * residual * residual
        # Elimination in that order leaves what is known of the extinction last.
        by_a, by_c = ab / aa, ac / aa
        bb, bc, rb = bb - by_a * ab, bc - by_a * ac, rb - by_a * ra
        cc, rc = cc - by_c * ac - bc * bc / bb, rc - by_c * ra - bc * rb / bb
        variance = 1.0 / cc
        step = rc * variance
        lifted = (rb - bc * step) / bb
        size, o = size + (ra - ab * lifted - ac * step) / aa, o + lifted
        most = 0.5 * abs(k) + 2e-3
        k += min(max(step, -most), most)
    return size, k, variance, misfit


def _first_guess(distance: Floats, contrast: Floats, noise: Floats) -> tuple[float, float]:
    """Straight line through the logarithms of what stands out of the noise."""
    sign = 1.0 if float(contrast[int(np.argmax(np.abs(contrast)))]) > 0 else -1.0
    clear = sign * contrast > 3.0 * noise
    if clear.sum() < 2 or float(np.ptp(distance[clear])) <= 0:
        return float(contrast.mean()), 0.0
    slope, height = straight_line(distance[clear], np.log(sign * contrast[clear]))
    return sign * math.exp(min(height, 5.0)), -slope
