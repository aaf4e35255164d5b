"""Compiled fit of Koschmieder's law to strips of road whose albedo wanders, by Gauss–Newton.

The filter of `albedo_filter` turns residuals and derivatives alike into independent ones, and so gives the exact step
and the exact likelihood.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import times
from fogsim.vision.light.medians import median_among
from fogsim.vision.strips.albedo_filter import (
    USED,
    Albedo,
    Residuals,
    Whitened,
    hide_behind_obstacles,
    whiten,
)

PARAMETERS = 4
"""Extinction, airlight, rows by which the horizon is lower, vignetting that is left; and, where the airlight is not
even, by how much it darkens toward the road."""

FIRST_DEPTH, DEPTH_STEP = 0.002, math.log(200.0) / 11.0
"""First of the optical heights of an eye by which the airlight's darkening goes [-], and the step of their
logarithm."""

_NO_LEVELS: NDArray[np.float64] = np.zeros(0)

MOST_DARKER = 2.7
"""Most by which the airlight darkens toward the road, over black land with the eye on the ground [-]."""

_SHORT = 0.15
"""Height of a bin over its rows below the horizon up to which a series takes the place of Simpson's rule [-]."""

_NEAR_BINS = 12
"""Nearest bins that the first guess of the road's luminance is made of."""

_CONVERGED = 1e-3
"""Step of k, relative to it and to the least that shows, below which no other is made [-]."""


class Bins(NamedTuple):
    """Bins of rows of strips of road, nearest first, as the kernels take them."""

    # luminance, noise (strips, n): luminance and its variance apart from the albedo's; see
    # `fogsim.vision.strips.strip_curves.StripCurves`
    luminance: NDArray[np.float64]
    noise: NDArray[np.float64]
    # path, off_axis (strips, n): see `fogsim.vision.strips.strip_geometry.StripGeometry`
    path: NDArray[np.float64]
    off_axis: NDArray[np.float64]
    # below, half, distance, extent, grazing (n,): see there
    below: NDArray[np.float64]
    half: NDArray[np.float64]
    distance: NDArray[np.float64]
    extent: NDArray[np.float64]
    grazing: NDArray[np.float64]
    # darker, darker_by_row (levels, n): how the airlight darkens toward the bins, by the optical height of the eye, and
    # its derivative by the horizon's row [1/px]; see `fogsim.vision.strips.airlight_slopes`. No levels where airlight
    # counts as even
    darker: NDArray[np.float64]
    darker_by_row: NDArray[np.float64]
    eye: float  # Height of the eye above the road [m]
    # (n, 9): How the albedo changes from bin to bin, see `fogsim.vision.strips.albedo_filter.albedo_transitions`
    changes: NDArray[np.float64]


class JointPrior(NamedTuple):
    """What is known before the road is looked at."""

    airlight: float  # Luminance of the sky [linear grey levels]
    # below, above: deviation of the airlight from it, downward and upward; upward it is large where the sky is
    # saturated
    below: float
    above: float
    # shift, shift_deviation: rows by which the horizon is below the calibrated one, and their deviation [px]
    shift: float
    shift_deviation: float
    # vignetting, vignetting_deviation: how much of what a simple lens takes from pixels off its axis (1 − cos⁴) this
    # one takes, and the standard deviation of that [-]
    vignetting: float
    vignetting_deviation: float
    cloud: float = 0.0  # Deviation of the airlight over the image, relative to it [-]
    # slope, slope_deviation: by how much the sky brightens upward, as a straight line has it, and the standard
    # deviation of that [linear grey levels per rad]
    slope: float = 0.0
    slope_deviation: float = 1.0
    # rise, level (levels,): slope [1/rad] of such a line over the airlight at the horizon, and by which part its level
    # there is above that, if the airlight darkens by 1 toward the road; by the optical height of the eye. None where it
    # counts as even
    rise: NDArray[np.float64] = _NO_LEVELS
    level: NDArray[np.float64] = _NO_LEVELS
    droplets: int = 0  # Which sizes of them the latter are of
    # Minus twice the logarithm of how likely it is among several, over what its deviations differ by [-]
    cost: float = 0.0


class Solution(NamedTuple):
    """Answer for one strength of patches and drift."""

    # (4 or 5,): k, airlight, shift, vignetting that is left, and by how much the airlight darkens toward the road
    theta: NDArray[np.float64]
    covariance: NDArray[np.float64]  # (4, 4): Theirs
    cost: float  # Minus twice the log likelihood, with the parameters' priors and integrated over them
    misfit: float  # Mean square of the innovations
    road: float  # Luminance of the first strip without fog [linear grey levels]
    # (strips, n) uint8: Which bins took part, see `fogsim.vision.strips.albedo_filter.Whitened`
    used: NDArray[np.uint8]


@kernel
def with_horizon(prior: JointPrior, shift: float, deviation: float) -> JointPrior:
    """Prior with another horizon (`shift`, `deviation` [px])."""
    return JointPrior(
        prior.airlight,
        prior.below,
        prior.above,
        shift,
        deviation,
        prior.vignetting,
        prior.vignetting_deviation,
        prior.cloud,
        prior.slope,
        prior.slope_deviation,
        prior.rise,
        prior.level,
        prior.droplets,
        prior.cost,
    )


_MOST_GAIN = 100.0
"""Greatest exponent of a transmittance [-]: of a k below 0, which is none of nature's, those next to the horizon would
overflow."""


@kernel
def mean_transmittance(below: float, half: float, path: float, k: float) -> tuple[float, float, float]:
    """Mean transmittance over a bin's height, with its derivatives by extinction and by the horizon's row.

    Near the horizon a row spans hundreds of metres: Simpson's rule there, farther down e^(−x) with x = k path / below
    and the second term of its Taylor series, which is what Simpson's rule makes of short bins.

    Takes `below`, `half` [px], `path` [px·m], `k` [1/m].
    """
    value, by_k, by_shift = 0.0, 0.0, 0.0
    if half < _SHORT * below:
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
        part = (4.0 if j == 1 else 1.0) / 6.0 * math.exp(min(-k * distance, _MOST_GAIN))
        value += part
        by_k -= distance * part
        by_shift -= k * distance / rows * part
    return value, by_k, by_shift


@kernel
def eye_level(k: float, eye: float, levels: int) -> tuple[int, float]:
    """Level of the optical heights of an eye below that of an extinction, and how far the latter is on to the next."""
    at = math.log(max(FIRST_DEPTH, k * eye) / FIRST_DEPTH) / DEPTH_STEP
    at = min(levels - 1.001, at)
    return int(at), at - int(at)


@kernel
def darkening(
    darker: NDArray[np.float64], darker_by_row: NDArray[np.float64], i: int, level: int, on: float, shift: float
) -> tuple[float, float, float]:
    """How the airlight darkens toward a bin, with its derivatives by the logarithm of k and by the horizon's row."""
    low, high = darker[level, i], darker[level + 1, i]
    by_row = darker_by_row[level, i] * (1.0 - on) + darker_by_row[level + 1, i] * on
    return low + on * (high - low) + shift * by_row, (high - low) / DEPTH_STEP, by_row


@kernel
def near_road(bins: Bins, strip: int, k: float, airlight: float, shift: float, darker: float) -> float:
    """Luminance of a strip without fog: median of what its nearest bins say, given the fog."""
    found = np.empty(_NEAR_BINS)
    count, level, on = 0, 0, 0.0
    if darker > 0.0:
        level, on = eye_level(k, bins.eye, bins.darker.shape[0])
    for i in range(bins.below.size):
        if bins.noise[strip, i] > 0.0 and count < _NEAR_BINS:
            value, _, _ = mean_transmittance(bins.below[i] - shift, bins.half[i], bins.path[strip, i], k)
            before = airlight
            if darker > 0.0:
                before *= 1.0 - darker * darkening(bins.darker, bins.darker_by_row, i, level, on, shift)[0]
            found[count] = before + (bins.luminance[strip, i] - before) / max(value, 1e-6)
            count += 1
    return median_among(found[:count]) if count else 0.0


@kernel
def _linearise(bins: Bins, strip: int, theta: NDArray[np.float64], road: float, out: Residuals) -> None:
    """Residual and derivatives by the parameters of one strip, and the scale of its albedo."""
    drop, is_even = road - theta[1], theta.size == PARAMETERS
    columns, scale, veil = out.columns[strip], out.scale[strip], out.veil[strip]
    level, on = (0, 0.0) if is_even else eye_level(theta[0], bins.eye, bins.darker.shape[0])
    for i in range(bins.below.size):
        value, by_k, by_shift = mean_transmittance(
            bins.below[i] - theta[2], bins.half[i], bins.path[strip, i], theta[0]
        )
        off_axis = bins.off_axis[strip, i]
        bright, open_part = theta[1] + drop * value, 1.0 - theta[3] * off_axis
        columns[i, 1] = drop * by_k * open_part
        columns[i, 2] = (1.0 - value) * open_part
        columns[i, 3] = drop * by_shift * open_part
        if not is_even:
            darker, by_log, by_row = darkening(bins.darker, bins.darker_by_row, i, level, on, theta[2])
            lost, missing = 1.0 - value, theta[1] * theta[4] * open_part
            bright -= theta[1] * theta[4] * darker * lost
            columns[i, 1] -= missing * (by_log / max(theta[0], 1e-5) * lost - darker * by_k)
            columns[i, 2] -= theta[4] * darker * lost * open_part
            columns[i, 3] -= missing * (by_row * lost - darker * by_shift)
            columns[i, 5] = -theta[1] * darker * lost * open_part
        columns[i, 0] = bins.luminance[strip, i] - bright * open_part
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
def _add_datum(
    by: NDArray[np.float64], off: float, weight: float, normal: NDArray[np.float64], gradient: NDArray[np.float64]
) -> float:
    """Add a datum, with its derivatives, to the normal equations; returns what it adds to the cost."""
    for a in range(by.size):
        gradient[a] -= weight * off * by[a]
        for b in range(by.size):
            normal[a, b] += weight * by[a] * by[b]
    return weight * off * off


@kernel
def _add_prior(
    theta: NDArray[np.float64],
    prior: JointPrior,
    eye: float,
    normal: NDArray[np.float64],
    gradient: NDArray[np.float64],
) -> float:
    """Add what is known beforehand to the normal equations; returns what it adds to the cost."""
    # A weak hold on k keeps the matrix regular where there is nothing to see.
    normal[0, 0] += 1.0
    off, by, cost = theta[1] - prior.airlight, np.zeros(theta.size), 0.0
    by[1] = 1.0
    if theta.size > PARAMETERS:
        level, on = eye_level(theta[0], eye, prior.rise.size)
        per_k = 1.0 / (DEPTH_STEP * max(theta[0], 1e-5))
        steeper, higher = prior.rise[level + 1] - prior.rise[level], prior.level[level + 1] - prior.level[level]
        rise, above = prior.rise[level] + on * steeper, prior.level[level] + on * higher
        by[0], by[1], by[4] = theta[1] * theta[4] * steeper * per_k, theta[4] * rise, theta[1] * rise
        cost += _add_datum(by, theta[1] * theta[4] * rise - prior.slope, prior.slope_deviation**-2, normal, gradient)
        off += theta[1] * theta[4] * above
        by[0], by[1], by[4] = theta[1] * theta[4] * higher * per_k, 1.0 + theta[4] * above, theta[1] * above
        normal[4, 4] += 1.0
        gradient[4] -= theta[4] - 1.0
        cost += (theta[4] - 1.0) ** 2
    cost += _add_datum(by, off, 1.0 / (prior.below if off < 0.0 else prior.above) ** 2, normal, gradient)
    lower, vignetting = theta[2] - prior.shift, 1.0 / prior.vignetting_deviation**2
    shift = 1.0 / prior.shift_deviation**2
    normal[2, 2] += shift
    normal[3, 3] += vignetting
    gradient[2] -= shift * lower
    gradient[3] -= vignetting * theta[3]
    return float(cost + shift * lower * lower + vignetting * theta[3] * theta[3])


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
        for a in range(theta.size):
            change -= damped * step[a] * constant[strip, a + 1]
        road[strip] *= min(max(1.0 + change, 0.5), 1.5)
    theta += damped * step
    if theta.size > PARAMETERS:
        theta[4] = min(max(theta[4], 0.0), MOST_DARKER)


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
def under_sky(albedo: Albedo, prior: JointPrior) -> Albedo:
    """Albedo seen through an airlight that is as uneven as is known beforehand."""
    patches, drift = (albedo.patch_deviation, albedo.patch_length), (albedo.drift_deviation, albedo.drift_length)
    return Albedo(*patches, *drift, albedo.sheen, albedo.sheen_deviation, prior.cloud)


@kernel
def gauss_newton(
    bins: Bins, on_road: Albedo, prior: JointPrior, start: NDArray[np.float64], iterations: int
) -> Solution:
    """Gauss–Newton from a start (`start` (4 or 5,))."""
    albedo = under_sky(on_road, prior)
    strips, count = bins.luminance.shape
    theta, road, size = start.copy(), np.empty(strips), start.size
    darker = theta[4] if size > PARAMETERS else 0.0
    for s in range(strips):
        guess = near_road(bins, s, theta[0], theta[1], theta[2], darker)
        road[s] = min(max(guess, 0.01 * theta[1]), theta[1])
    residuals, whitened = allocated(strips, count, size + 1, bins.noise)
    unit = 1.0 / bins.path[0, 0]
    covariance: NDArray[np.float64] = np.eye(size)
    cost, squares, number = 0.0, 0.0, 0
    for iteration in range(iterations + 1):
        for s in range(strips):
            _linearise(bins, s, theta, road[s], residuals)
        # What is an outlier is settled before the last steps, so that they converge.
        reject = iteration < max(iterations - 2, 1)
        cost = whiten(residuals, bins.changes, albedo, prior.airlight, reject, whitened)
        if reject and hide_behind_obstacles(bins.noise, whitened.used):
            # Else what was seen of the bins that are now hidden would still count through the others.
            cost = whiten(residuals, bins.changes, albedo, prior.airlight, False, whitened)
        normal, gradient = np.zeros((size, size)), np.zeros(size)
        squares, number = add_bins(whitened, normal, gradient)
        cost += squares + _add_prior(theta, prior, bins.eye, normal, gradient)
        cost += invert(normal, covariance)
        if iteration >= iterations:
            break
        step = times(covariance, gradient)
        _move(theta, step, road, whitened.constants, unit, prior.shift_deviation)
        if iteration >= 2 and abs(step[0]) < _CONVERGED * (abs(theta[0]) + unit):
            iterations = min(iterations, iteration + 1)
    return Solution(theta, covariance, cost, squares / max(number, 1), road[0], whitened.used)
