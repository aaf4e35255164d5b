"""Compiled fit of Koschmieder's law to strips of road whose albedo wanders: searches for a start, and Gauss–Newton.

The filter of `albedo_filter` turns residuals and derivatives alike into independent ones, and so gives the exact step
and the exact likelihood.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.linear_algebra import times
from fogsim.vision.strips.albedo_filter import (
    USED,
    Albedo,
    Residuals,
    Whitened,
    albedo_transitions,
    hide_behind_obstacles,
    whiten,
)

PARAMETERS = 4
"""Extinction, airlight, rows by which the horizon is lower, vignetting that is left."""

SHORT = 0.15
"""Height of a bin over its rows below the horizon up to which a series takes the place of Simpson's rule [-]."""

NEAR_BINS = 12
"""Nearest bins that the first guess of the road's luminance is made of."""

CONVERGED = 1e-3
"""Step of k, relative to it and to the least that shows, below which no other is made [-]."""

GRAINY = 0.01
"""Deviation of bins by the road's texture in the search with a constant albedo, relative to the airlight [-]."""


class Bins(NamedTuple):
    """Bins of rows of strips of road, nearest first, as the kernels take them.

    Attributes
    ----------
    luminance, noise : (strips, n) float64
        Luminance and its variance apart from the albedo's; see `fogsim.vision.strips.strip_curves.StripCurves`.
    path, off_axis : (strips, n) float64
        See `fogsim.vision.strips.strip_geometry.StripGeometry`.
    below, half, distance, extent, grazing : (n,) float64
        See there.
    """

    luminance: NDArray[np.float64]
    noise: NDArray[np.float64]
    path: NDArray[np.float64]
    off_axis: NDArray[np.float64]
    below: NDArray[np.float64]
    half: NDArray[np.float64]
    distance: NDArray[np.float64]
    extent: NDArray[np.float64]
    grazing: NDArray[np.float64]


class JointPrior(NamedTuple):
    """What is known before the road is looked at.

    Attributes
    ----------
    airlight : float
        Luminance of the sky [linear grey levels].
    below, above : float
        Deviation of the airlight from it, downward and upward; upward it is large where the sky is saturated.
    shift, shift_deviation : float
        Rows by which the horizon is lower than the calibration has it, and their standard deviation [px].
    vignetting, vignetting_deviation : float
        How much of what a simple lens takes from pixels off its axis (1 − cos⁴) this one takes, and the standard
        deviation of that [-].
    cloud : float
        Deviation of the airlight over the image, relative to it [-].
    """

    airlight: float
    below: float
    above: float
    shift: float
    shift_deviation: float
    vignetting: float
    vignetting_deviation: float
    cloud: float = 0.0


class Solution(NamedTuple):
    """Answer for one strength of patches and drift.

    Attributes
    ----------
    theta : (4,) float64
        k, airlight, shift and vignetting that is left.
    covariance : (4, 4) float64
        Theirs.
    cost : float
        Minus twice the log likelihood, with the parameters' priors and integrated over them.
    misfit : float
        Mean square of the innovations.
    road : float
        Luminance of the first strip without fog [linear grey levels].
    used : (strips, n) uint8
        Which bins took part, see `fogsim.vision.strips.albedo_filter.Whitened`.
    """

    theta: NDArray[np.float64]
    covariance: NDArray[np.float64]
    cost: float
    misfit: float
    road: float
    used: NDArray[np.uint8]


@kernel
def mean_transmittance(below: float, half: float, path: float, k: float) -> tuple[float, float, float]:
    """Mean transmittance over a bin's height, with its derivatives by extinction and by the horizon's row.

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
def near_road(bins: Bins, strip: int, k: float, airlight: float, shift: float) -> float:
    """Luminance of a strip without fog: median of what its nearest bins say, given the fog."""
    found = np.empty(NEAR_BINS)
    count = 0
    for i in range(bins.below.size):
        if bins.noise[strip, i] > 0.0 and count < NEAR_BINS:
            value, _, _ = mean_transmittance(bins.below[i] - shift, bins.half[i], bins.path[strip, i], k)
            found[count] = airlight + (bins.luminance[strip, i] - airlight) / max(value, 1e-6)
            count += 1
    return float(np.median(found[:count])) if count else 0.0


@kernel
def _linearise(bins: Bins, strip: int, theta: NDArray[np.float64], road: float, out: Residuals) -> None:
    """Residual and derivatives by the parameters of one strip, and the scale of its albedo."""
    drop = road - theta[1]
    columns, scale, veil = out.columns[strip], out.scale[strip], out.veil[strip]
    for i in range(bins.below.size):
        value, by_k, by_shift = mean_transmittance(
            bins.below[i] - theta[2], bins.half[i], bins.path[strip, i], theta[0]
        )
        off_axis = bins.off_axis[strip, i]
        bright, open_part = theta[1] + drop * value, 1.0 - theta[3] * off_axis
        columns[i, 0] = bins.luminance[strip, i] - bright * open_part
        columns[i, 1] = drop * by_k * open_part
        columns[i, 2] = (1.0 - value) * open_part
        columns[i, 3] = drop * by_shift * open_part
        columns[i, 4] = -bright * off_axis
        scale[i], veil[i] = road * value, theta[1] * (1.0 - value)


@kernel
def add_bins(whitened: Whitened, normal: NDArray[np.float64], gradient: NDArray[np.float64]) -> tuple[float, int]:
    """Add what the bins in use say to the normal equations; returns their squares and their number."""
    out, used = whitened.innovations, whitened.used
    squares, number, size = 0.0, 0, gradient.size
    for strip in range(used.shape[0]):
        for i in range(used.shape[1]):
            if used[strip, i] != USED:
                continue
            number += 1
            rest = out[strip, i, 0]
            squares += rest * rest
            for a in range(size):
                first = out[strip, i, a + 1]
                gradient[a] += first * rest
                for b in range(a + 1):
                    normal[a, b] += first * out[strip, i, b + 1]
    for a in range(size):
        for b in range(a):
            normal[b, a] = normal[a, b]
    return squares, number


@kernel
def _add_prior(
    theta: NDArray[np.float64], prior: JointPrior, normal: NDArray[np.float64], gradient: NDArray[np.float64]
) -> float:
    """Add what is known beforehand to the normal equations; returns what it adds to the cost."""
    off, lower = theta[1] - prior.airlight, theta[2] - prior.shift
    airlight = 1.0 / (prior.below if off < 0.0 else prior.above) ** 2
    shift, vignetting = 1.0 / prior.shift_deviation**2, 1.0 / prior.vignetting_deviation**2
    # A weak hold on k keeps the matrix regular where there is nothing to see.
    normal[0, 0] += 1.0
    normal[1, 1] += airlight
    normal[2, 2] += shift
    normal[3, 3] += vignetting
    gradient[1] -= airlight * off
    gradient[2] -= shift * lower
    gradient[3] -= vignetting * theta[3]
    return float(airlight * off * off + shift * lower * lower + vignetting * theta[3] * theta[3])


@kernel
def invert(matrix: NDArray[np.float64], inverse: NDArray[np.float64]) -> float:
    """Invert a positive definite matrix by Cholesky's factors; returns the logarithm of its determinant."""
    size = matrix.shape[0]
    factor, logarithm = np.zeros((size, size)), 0.0
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for m in range(j):
                total -= factor[i, m] * factor[j, m]
            factor[i, j] = math.sqrt(max(total, 1e-300)) if i == j else total / factor[j, j]
        logarithm += 2.0 * math.log(factor[i, i])
    for column in range(size):
        for i in range(size):
            total = 1.0 if i == column else 0.0
            for m in range(i):
                total -= factor[i, m] * inverse[m, column]
            inverse[i, column] = total / factor[i, i]
        for i in range(size - 1, -1, -1):
            total = inverse[i, column]
            for m in range(i + 1, size):
                total -= factor[m, i] * inverse[m, column]
            inverse[i, column] = total / factor[i, i]
    return logarithm


@kernel
def _move(
    theta: NDArray[np.float64],
    step: NDArray[np.float64],
    road: NDArray[np.float64],
    constant: NDArray[np.float64],
    unit: float,
    shift_deviation: float,
) -> None:
    """Take a step, damped where it is long, and let each strip's luminance follow."""
    most = abs(theta[0]) + 0.3 * unit
    damped = min(1.0, most / max(abs(step[0]), 1e-12), 1.5 * shift_deviation / max(abs(step[2]), 1e-12))
    if theta[0] + damped * step[0] < -2.0 * unit:
        damped = 0.5 * damped
    for strip in range(road.size):
        change = constant[strip, 0]
        for a in range(PARAMETERS):
            change -= damped * step[a] * constant[strip, a + 1]
        road[strip] *= min(max(1.0 + change, 0.5), 1.5)
    for a in range(PARAMETERS):
        theta[a] += damped * step[a]


@kernel
def allocated(strips: int, count: int, width: int, noise: NDArray[np.float64]) -> tuple[Residuals, Whitened]:
    """Room for residuals and innovations."""
    columns, scale, veil = np.empty((strips, count, width)), np.empty((strips, count)), np.empty((strips, count))
    out, constants, used = (
        np.empty((strips, count, width)),
        np.empty((strips, width)),
        np.zeros((strips, count), np.uint8),
    )
    return Residuals(columns, scale, veil, noise), Whitened(out, constants, used)


@kernel
def gauss_newton(
    bins: Bins, albedo: Albedo, prior: JointPrior, start: NDArray[np.float64], iterations: int
) -> Solution:
    """Gauss–Newton from a start.

    Parameters
    ----------
    bins : Bins
        What is seen where.
    albedo : Albedo
        How the albedo wanders.
    prior : JointPrior
        Sky, horizon and lens.
    start : (4,) float64
        k, airlight, shift, vignetting that is left.
    iterations : int
        Most steps.
    """
    strips, count = bins.luminance.shape
    theta, road = start.copy(), np.empty(strips)
    for s in range(strips):
        guess = near_road(bins, s, theta[0], theta[1], theta[2])
        road[s] = min(max(guess, 0.01 * theta[1]), theta[1])
    residuals, whitened = allocated(strips, count, PARAMETERS + 1, bins.noise)
    changes, unit = albedo_transitions(bins.distance, bins.extent, bins.grazing, albedo), 1.0 / bins.path[0, 0]
    covariance: NDArray[np.float64] = np.eye(PARAMETERS)
    cost, squares, number = 0.0, 0.0, 0
    for iteration in range(iterations + 1):
        for s in range(strips):
            _linearise(bins, s, theta, road[s], residuals)
        # What is an outlier is settled before the last steps, so that they converge.
        reject = iteration < max(iterations - 2, 1)
        cost = whiten(residuals, changes, albedo, prior.airlight, reject, whitened)
        if reject and hide_behind_obstacles(bins.noise, whitened.used):
            # Else what was seen of the bins that are now hidden would still count through the others.
            cost = whiten(residuals, changes, albedo, prior.airlight, False, whitened)
        normal, gradient = np.zeros((PARAMETERS, PARAMETERS)), np.zeros(PARAMETERS)
        squares, number = add_bins(whitened, normal, gradient)
        cost += squares + _add_prior(theta, prior, normal, gradient)
        cost += invert(normal, covariance)
        if iteration >= iterations:
            break
        step = times(covariance, gradient)
        _move(theta, step, road, whitened.constants, unit, prior.shift_deviation)
        if iteration >= 2 and abs(step[0]) < CONVERGED * (abs(theta[0]) + unit):
            iterations = min(iterations, iteration + 1)
    return Solution(theta, covariance, cost, squares / max(number, 1), road[0], whitened.used)


@kernel
def extinction_costs(
    bins: Bins, albedo: Albedo, extinctions: NDArray[np.float64], airlight: float, shift: float
) -> NDArray[np.float64]:
    """Minus twice the log likelihood of each of several extinctions, the rest at their first guesses; inf for none.

    Parameters
    ----------
    bins : Bins
        What is seen where.
    albedo : Albedo
        How the albedo wanders.
    extinctions : (m,) float64
        The extinctions [1/m].
    airlight : float
        Airlight [linear grey levels].
    shift : float
        Rows by which the horizon is lower [px].
    """
    strips, count = bins.luminance.shape
    cost, changes = np.empty(extinctions.size), albedo_transitions(bins.distance, bins.extent, bins.grazing, albedo)
    residuals, whitened = allocated(strips, count, 1, bins.noise)
    for j in range(extinctions.size):
        k, possible = extinctions[j], True
        for strip in range(strips):
            road = near_road(bins, strip, k, airlight, shift)
            possible = possible and 0.0 < road < 1.5 * airlight
            for i in range(count):
                value, _, _ = mean_transmittance(bins.below[i] - shift, bins.half[i], bins.path[strip, i], k)
                rest = bins.luminance[strip, i] - airlight - (road - airlight) * value
                residuals.columns[strip, i, 0] = rest
                residuals.scale[strip, i], residuals.veil[strip, i] = road * value, airlight * (1.0 - value)
        cost[j] = np.inf
        if possible:
            cost[j] = whiten(residuals, changes, albedo, airlight, True, whitened)
            cost[j] += (whitened.innovations**2).sum()
    return cost


@kernel
def fit_constant_albedo(bins: Bins, extinctions: NDArray[np.float64], prior: JointPrior) -> tuple[float, float]:
    """Extinction and airlight that best fit all strips as one road of constant albedo, in Cauchy's norm.

    A smooth broad search, where `extinction_costs` has narrow minima: what does not fit weighs little, and nothing is
    explained by an albedo that wanders.

    Parameters
    ----------
    bins : Bins
        What is seen where.
    extinctions : (m,) float64
        The extinctions that are tried [1/m].
    prior : JointPrior
        Sky and horizon.
    """
    luminance, noise = bins.luminance, bins.noise
    strips, count = luminance.shape
    best, best_k, best_airlight = np.inf, extinctions[0], prior.airlight
    scale = (GRAINY * prior.airlight) ** 2
    stride = max(count // 36, 1)
    value = np.empty((count + stride - 1) // stride)
    for k in extinctions:
        for j in range(value.size):
            i = j * stride
            value[j], _, _ = mean_transmittance(bins.below[i] - prior.shift, bins.half[i], bins.path[0, i], k)
        airlight, drop, total = prior.airlight, 0.0, 0.0
        for iteration in range(4):
            s0, s1, s2, r0, r1 = 0.0, 0.0, 0.0, 0.0, 0.0
            total = 0.0
            for strip in range(strips):
                for j in range(value.size):
                    i = j * stride
                    if noise[strip, i] <= 0.0:
                        continue
                    t, spread = value[j], noise[strip, i] + scale * (value[j] ** 2 + 0.02)
                    rest = luminance[strip, i] - airlight - drop * t
                    weight = 1.0 / (spread + rest * rest) if iteration else 1.0 / spread
                    if iteration == 3:
                        total += math.log1p(rest * rest / spread)
                    y = luminance[strip, i] - prior.airlight
                    s0, s1, s2 = s0 + weight, s1 + weight * t, s2 + weight * t * t
                    r0, r1 = r0 + weight * y, r1 + weight * t * y
            off = airlight - prior.airlight
            known = 1.0 / (prior.below if off < 0.0 else prior.above) ** 2
            total += known * off * off
            s0 += known
            determinant = max(s0 * s2 - s1 * s1, 1e-12)
            airlight = prior.airlight + (s2 * r0 - s1 * r1) / determinant
            drop = min((s0 * r1 - s1 * r0) / determinant, 0.0)
            drop = max(drop, -airlight)
        if total < best:
            best, best_k, best_airlight = total, k, airlight
    return best_k, best_airlight
