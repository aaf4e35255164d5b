"""Exponential decay of a contrast with range."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class DecayFit:
    """Decay c = C e^(−kd) + o.

    Attributes
    ----------
    extinction, deviation : float
        k and its standard deviation [1/m].
    contrast : float
        C [-].
    misfit : float
        Mean square of the standardised residuals [-].
    """

    extinction: float
    deviation: float
    contrast: float
    misfit: float


def fit_decay(distance: Floats, contrast: Floats, noise: Floats, relative: float, offset: float) -> DecayFit | None:
    """Fit Duntley's law to contrasts at several ranges (Gauss–Newton, weights by the model's own values).

    Fitted in the contrasts themselves and not in their logarithms, which noise would bias and make undefined.

    Parameters
    ----------
    distance, contrast, noise : (n,) float64
        Range [m], contrast to the airlight and its noise [-].
    relative : float
        Relative deviation of each contrast beside the noise [-].
    offset : float
        Deviation of an error o that all contrasts share, as a wrong airlight makes it [-].

    Returns
    -------
    DecayFit or None
        None if there are fewer than three ranges or no contrast.
    """
    if distance.size < 3 or float(np.abs(contrast).max()) <= 0:
        return None
    near = float(distance.mean())
    size, k, o = _first_guess(distance - near, contrast, noise)
    normal, residual, weight = np.eye(3), contrast, np.ones_like(contrast)
    for _ in range(12):
        fall = np.exp(-k * (distance - near))
        residual = contrast - size * fall - o
        weight = 1.0 / (noise**2 + (relative * size * fall) ** 2)
        # Ranges at which something else was seen count less (Huber).
        weight *= np.minimum(1.0, 2.5 / np.maximum(np.abs(residual) * np.sqrt(weight), 1e-9))
        jacobian = np.stack([fall, -size * (distance - near) * fall, np.ones_like(fall)], axis=1)
        normal = jacobian.T @ (weight[:, None] * jacobian) + np.diag([1e-9, 1e-3, 1.0 / offset**2])
        step = np.linalg.solve(normal, jacobian.T @ (weight * residual) - np.array([0.0, 0.0, o / offset**2]))
        size, o = size + float(step[0]), o + float(step[2])
        k += float(np.clip(step[1], -0.5 * abs(k) - 2e-3, 0.5 * abs(k) + 2e-3))
    covariance = np.linalg.inv(normal)
    misfit = float((weight * residual**2).sum()) / max(distance.size - 2, 1)
    deviation = math.sqrt(max(float(covariance[1, 1]), 0.0) * max(misfit, 1.0))
    return DecayFit(k, deviation, size * math.exp(min(k * near, 50.0)), misfit)


def _first_guess(distance: Floats, contrast: Floats, noise: Floats) -> tuple[float, float, float]:
    """Straight line through the logarithms of what stands out of the noise."""
    sign = 1.0 if float(contrast[int(np.argmax(np.abs(contrast)))]) > 0 else -1.0
    clear = sign * contrast > 3.0 * noise
    if clear.sum() < 2 or float(np.ptp(distance[clear])) <= 0:
        return float(contrast.mean()), 0.0, 0.0
    slope, height = np.polyfit(distance[clear], np.log(sign * contrast[clear]), 1)
    return sign * math.exp(min(float(height), 5.0)), -float(slope), 0.0
