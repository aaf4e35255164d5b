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
def _seen(bins: Bins, stride: int) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Of every so many bins with data: which of these they are, luminance and noise, strip by strip."""
    strips, count = bins.luminance.shape
    luminance, noise = np.empty(strips * count), np.empty(strips * count)
    place, seen = np.empty(strips * count, np.int64), 0
    for strip in range(strips):
        for i in range(0, count, stride):
            if bins.noise[strip, i] > 0.0:
                place[seen], luminance[seen], noise[seen] = i // stride, bins.luminance[strip, i], bins.noise[strip, i]
                seen += 1
    return place[:seen], luminance[:seen], noise[:seen]


@kernel
def _cost(
    luminance: NDArray[np.float64],
    base: NDArray[np.float64],
    left: NDArray[np.float64],
    spread: NDArray[np.float64],
    airlight: float,
    drop: float,
) -> float:
    """Minus the logarithm of Cauchy's law of the residuals."""
    total, product = 0.0, 1.0
    for i in range(luminance.size):
        rest = luminance[i] - airlight * base[i] - drop * left[i]
        total, product = with_factor(total, product, 1.0 + rest * rest / spread[i])
    return total + math.log(product)


@kernel
def _weighted_line(
    luminance: NDArray[np.float64],
    base: NDArray[np.float64],
    left: NDArray[np.float64],
    weight: NDArray[np.float64],
    likely: float,
    known: float,
) -> tuple[float, float]:
    """Airlight and drop of least squares, the former known about a likely one."""
    s0, s1, s2, r0, r1 = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(luminance.size):
        y, one, t = luminance[i] - likely * base[i], base[i], left[i]
        s0, s1, s2 = s0 + weight[i] * one * one, s1 + weight[i] * one * t, s2 + weight[i] * t * t
        r0, r1 = r0 + weight[i] * one * y, r1 + weight[i] * t * y
    s0 += known
    determinant = max(s0 * s2 - s1 * s1, 1e-12)
    airlight = likely + (s2 * r0 - s1 * r1) / determinant
    return airlight, max(min((s0 * r1 - s1 * r0) / determinant, 0.0), -airlight)


@kernel
def fit_constant_albedo(bins: Bins, extinctions: NDArray[np.float64], prior: JointPrior) -> tuple[float, float]:
    """Extinction and airlight that best fit all strips as one road of constant albedo, in Cauchy's norm.

    A smooth broad search: what does not fit weighs little, and nothing is explained by an albedo that wanders.

    Takes `extinctions` (m,) [1/m].
    """
    best, best_k, best_airlight = np.inf, extinctions[0], prior.airlight
    scale = (_GRAINY * prior.airlight) ** 2
    stride = max(bins.below.size // 36, 1)
    place, luminance, noise = _seen(bins, stride)
    value = np.empty((bins.below.size + stride - 1) // stride)
    clear = np.ones(value.size)
    base, left, spread, weight = (
        np.empty(place.size),
        np.empty(place.size),
        np.empty(place.size),
        np.empty(place.size),
    )
    for k in extinctions:
        darker, likely = darkness_by_sky(prior, k, bins.eye)
        level, on = eye_level(k, bins.eye, bins.darker.shape[0]) if darker > 0.0 else (0, 0.0)
        for j in range(value.size):
            i = j * stride
            value[j], _, _ = mean_transmittance(bins.below[i] - prior.shift, bins.half[i], bins.path[0, i], k)
            if darker > 0.0:
                by_bin = darkening(bins.darker, bins.darker_by_row, i, level, on, prior.shift)
                clear[j] = 1.0 - darker * by_bin[0] * (1.0 - value[j])
        for i in range(place.size):
            base[i], left[i] = clear[place[i]], value[place[i]]
            spread[i] = noise[i] + scale * (left[i] ** 2 + 0.02)
        airlight, drop = likely, 0.0
        for iteration in range(4):
            off = airlight - likely
            known = 1.0 / (prior.below if off < 0.0 else prior.above) ** 2
            if iteration == 3:
                total = _cost(luminance, base, left, spread, airlight, drop) + known * off * off
                if not total < best:
                    break
                best, best_k = total, k
            # In a loop of its own, which is vectorised, for these are divisions.
            for i in range(place.size):
                rest = luminance[i] - airlight * base[i] - drop * left[i]
                weight[i] = 1.0 / (spread[i] + rest * rest) if iteration else 1.0 / spread[i]
            airlight, drop = _weighted_line(luminance, base, left, weight, likely, known)
            best_airlight = airlight if iteration == 3 else best_airlight
    return best_k, best_airlight
