"""Compiled searches for a start of the fit of `joint_kernels`."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.strips.albedo_filter import with_factor
from fogsim.vision.strips.joint_kernels import (
    MOST_DARKER,
    Bins,
    JointPrior,
    darkening,
    eye_level,
    mean_transmittance,
)

_GRAINY = 0.01
"""Deviation of bins by the road's texture in the search with a constant albedo, relative to the airlight [-]."""


@kernel
def darkness_of_slope(slope: float, rise: float, above: float) -> float:
    """By how much the airlight darkens toward the road below a sky of some slope (`slope` [1/rad])."""
    share = min(max(slope, 0.0) / rise, 5.0)
    return min(share / max(1.0 - share * above, 0.2), MOST_DARKER)


@kernel
def darkness_by_sky(prior: JointPrior, k: float, eye: float) -> tuple[float, float]:
    """By how much the airlight darkens toward the road, estimated from the sky, and its level at the horizon."""
    if prior.rise.size == 0:
        return 0.0, prior.airlight
    level, on = eye_level(k, eye, prior.rise.size)
    rise = prior.rise[level] + on * (prior.rise[level + 1] - prior.rise[level])
    above = prior.level[level] + on * (prior.level[level + 1] - prior.level[level])
    darker = darkness_of_slope(prior.slope / prior.airlight, rise, above)
    return darker, prior.airlight / (1.0 + darker * above)


@kernel
def fit_constant_albedo(bins: Bins, extinctions: NDArray[np.float64], prior: JointPrior) -> tuple[float, float]:
    """Extinction and airlight that best fit all strips as one road of constant albedo, in Cauchy's norm.

    A smooth broad search: what does not fit weighs little, and nothing is explained by an albedo that wanders.

    Takes `extinctions` (m,) [1/m].
    """
    luminance, noise = bins.luminance, bins.noise
    strips, count = luminance.shape
    best, best_k, best_airlight = np.inf, extinctions[0], prior.airlight
    scale = (_GRAINY * prior.airlight) ** 2
    stride = max(count // 36, 1)
    value = np.empty((count + stride - 1) // stride)
    base = np.ones(value.size)
    for k in extinctions:
        darker, likely = darkness_by_sky(prior, k, bins.eye)
        level, on = eye_level(k, bins.eye, bins.darker.shape[0]) if darker > 0.0 else (0, 0.0)
        for j in range(value.size):
            i = j * stride
            value[j], _, _ = mean_transmittance(bins.below[i] - prior.shift, bins.half[i], bins.path[0, i], k)
            if darker > 0.0:
                base[j] = 1.0 - darker * darkening(bins, i, level, on, prior.shift)[0] * (1.0 - value[j])
        airlight, drop, total, product, apart = likely, 0.0, 0.0, 1.0, 0.0
        for iteration in range(4):
            s0, s1, s2, r0, r1 = 0.0, 0.0, 0.0, 0.0, 0.0
            for strip in range(strips):
                for j in range(value.size):
                    i = j * stride
                    if noise[strip, i] <= 0.0:
                        continue
                    t, spread = value[j], noise[strip, i] + scale * (value[j] ** 2 + 0.02)
                    rest = luminance[strip, i] - airlight * base[j] - drop * t
                    weight = 1.0 / (spread + rest * rest) if iteration else 1.0 / spread
                    if iteration == 3:
                        total, product = with_factor(total, product, 1.0 + rest * rest / spread)
                    y, one = luminance[strip, i] - likely * base[j], base[j]
                    s0, s1, s2 = s0 + weight * one * one, s1 + weight * one * t, s2 + weight * t * t
                    r0, r1 = r0 + weight * one * y, r1 + weight * t * y
            off = airlight - likely
            known = 1.0 / (prior.below if off < 0.0 else prior.above) ** 2
            apart, s0 = known * off * off, s0 + known
            determinant = max(s0 * s2 - s1 * s1, 1e-12)
            airlight = likely + (s2 * r0 - s1 * r1) / determinant
            drop = min((s0 * r1 - s1 * r0) / determinant, 0.0)
            drop = max(drop, -airlight)
        total += math.log(product) + apart
        if total < best:
            best, best_k, best_airlight = total, k, airlight
    return best_k, best_airlight
