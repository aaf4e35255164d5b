"""Compiled Gauss–Newton for Koschmieder's law over strips of road whose albedo wanders.

The filter of `albedo_filter` turns residuals and derivatives alike into independent ones, and so gives the exact step
and the exact likelihood.
"""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.linear_algebra import times
from fogsim.vision.strips.albedo_filter import USED, hide_behind_obstacles, wandering, whiten
from fogsim.vision.strips.road_curve import near_road, transmission

PARAMETERS = 4
"""Extinction, airlight, rows by which the horizon is lower, darkening of the lens that is left."""

NEAR_BINS = 12
"""Nearest bins that the first guess of the road's luminance is made of."""

CONVERGED = 1e-3
"""Step of k, relative to it and to the least that shows, below which no other is made [-]."""


@kernel
def _linearise(
    luminance: NDArray[np.float64],
    below: NDArray[np.float64],
    half: NDArray[np.float64],
    path: NDArray[np.float64],
    off_axis: NDArray[np.float64],
    theta: NDArray[np.float64],
    road: float,
    columns: NDArray[np.float64],
    scale: NDArray[np.float64],
) -> None:
    """Residual and derivatives by the parameters of one strip, and the scale of its albedo."""
    drop = road - theta[1]
    for i in range(below.size):
        value, by_k, by_shift = transmission(below[i] - theta[2], half[i], path[i], theta[0])
        bright, open_part = theta[1] + drop * value, 1.0 - theta[3] * off_axis[i]
        columns[i, 0] = luminance[i] - bright * open_part
        columns[i, 1] = drop * by_k * open_part
        columns[i, 2] = (1.0 - value) * open_part
        columns[i, 3] = drop * by_shift * open_part
        columns[i, 4] = -bright * off_axis[i]
        scale[i] = road * value


@kernel
def _add_bins(
    out: NDArray[np.float64], used: NDArray[np.uint8], normal: NDArray[np.float64], gradient: NDArray[np.float64]
) -> tuple[float, int]:
    """Add what the bins in use say to the normal equations; returns their squares and their number."""
    squares, number = 0.0, 0
    for strip in range(used.shape[0]):
        for i in range(used.shape[1]):
            if used[strip, i] != USED:
                continue
            number += 1
            rest = out[strip, i, 0]
            squares += rest * rest
            for a in range(PARAMETERS):
                first = out[strip, i, a + 1]
                gradient[a] += first * rest
                for b in range(a + 1):
                    normal[a, b] += first * out[strip, i, b + 1]
    for a in range(PARAMETERS):
        for b in range(a):
            normal[b, a] = normal[a, b]
    return squares, number


@kernel
def _add_prior(
    theta: NDArray[np.float64], prior: NDArray[np.float64], normal: NDArray[np.float64], gradient: NDArray[np.float64]
) -> float:
    """Add what is known beforehand to the normal equations; returns what it adds to the cost."""
    off, lower = theta[1] - prior[0], theta[2] - prior[3]
    airlight = 1.0 / (prior[1] if off < 0.0 else prior[2]) ** 2
    shift, darkening = 1.0 / prior[4] ** 2, 1.0 / prior[5] ** 2
    # A weak hold on k keeps the matrix regular where there is nothing to see.
    normal[0, 0] += 1.0
    normal[1, 1] += airlight
    normal[2, 2] += shift
    normal[3, 3] += darkening
    gradient[1] -= airlight * off
    gradient[2] -= shift * lower
    gradient[3] -= darkening * theta[3]
    return float(airlight * off * off + shift * lower * lower + darkening * theta[3] * theta[3])


@kernel
def _invert(matrix: NDArray[np.float64], inverse: NDArray[np.float64]) -> float:
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
def refine(
    luminance: NDArray[np.float64],
    noise: NDArray[np.float64],
    below: NDArray[np.float64],
    half: NDArray[np.float64],
    path: NDArray[np.float64],
    distance: NDArray[np.float64],
    extent: NDArray[np.float64],
    off_axis: NDArray[np.float64],
    albedo: NDArray[np.float64],
    prior: NDArray[np.float64],
    start: NDArray[np.float64],
    used: NDArray[np.uint8],
    iterations: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float, float, int]:
    """Gauss–Newton from a start.

    Parameters
    ----------
    luminance, noise, path, off_axis : (strips, n) float64
        See `fogsim.vision.strips.strip_curves.StripCurves` and `fogsim.vision.strips.strip_geometry.StripGeometry`.
    below, half, distance, extent : (n,) float64
        See there.
    albedo : (4,) float64
        See `fogsim.vision.strips.albedo_filter.wandering`.
    prior : (6,) float64
        Airlight by the sky, its deviation downward and upward, the horizon's row and its deviation, the deviation of
        the lens's darkening.
    start : (4,) float64
        k, airlight, shift, darkening that is left.
    used : (strips, n) uint8
        Which bins took part; is written.
    iterations : int
        Most steps.

    Returns
    -------
    tuple
        Parameters (4,), their covariance (4, 4), luminance of the first strip without fog, minus twice the log
        likelihood (with the parameters' priors and integrated over them), sum of the squared innovations, and how many
        there are.
    """
    strips, count = luminance.shape
    theta, road = start.copy(), np.empty(strips)
    for s in range(strips):
        guess = near_road(luminance[s], noise[s], below, half, path[s], theta[0], theta[1], theta[2], NEAR_BINS)
        road[s] = min(max(guess, 0.01 * theta[1]), theta[1])
    columns, scale = np.empty((strips, count, PARAMETERS + 1)), np.empty((strips, count))
    out, constant = np.empty((strips, count, PARAMETERS + 1)), np.empty((strips, PARAMETERS + 1))
    changes, unit = wandering(distance, extent, albedo), 1.0 / path[0, 0]
    covariance: NDArray[np.float64] = np.eye(PARAMETERS)
    cost, squares, number = 0.0, 0.0, 0
    for iteration in range(iterations + 1):
        for s in range(strips):
            _linearise(luminance[s], below, half, path[s], off_axis[s], theta, road[s], columns[s], scale[s])
        # What is an outlier is settled before the last steps, so that they converge.
        reject = iteration < max(iterations - 2, 1)
        cost = whiten(columns, scale, noise, changes, albedo, prior[0], reject, used, out, constant)
        if reject and hide_behind_obstacles(noise, used):
            # Else what was seen of the bins that are now hidden would still count through the others.
            cost = whiten(columns, scale, noise, changes, albedo, prior[0], False, used, out, constant)
        normal, gradient = np.zeros((PARAMETERS, PARAMETERS)), np.zeros(PARAMETERS)
        squares, number = _add_bins(out, used, normal, gradient)
        cost += squares + _add_prior(theta, prior, normal, gradient)
        cost += _invert(normal, covariance)
        if iteration >= iterations:
            break
        step = times(covariance, gradient)
        _move(theta, step, road, constant, unit, prior[4])
        if iteration >= 2 and abs(step[0]) < CONVERGED * (abs(theta[0]) + unit):
            iterations = min(iterations, iteration + 1)
    return theta, covariance, road[0], cost, squares, number
