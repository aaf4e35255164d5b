"""Compiled generalised least squares of Koschmieder's law over strips of road whose albedo wanders.

The albedo of a strip is R (1 + c + p(d) + b(d)): a constant, patches (an Ornstein–Uhlenbeck process along the road, for
each strip its own) and a slow drift that all strips share. Seen through fog they leave residuals that are correlated
from row to row. A Kalman filter from the nearest row outward turns those into independent ones ("innovations") in time
linear in the rows, for the residual and for its derivatives alike, and so gives the exact Gauss–Newton step and the
exact likelihood of that model.
"""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

CONSTANT_DEVIATION = 0.5
"""Deviation of a strip's albedo from its first guess, relative to it [-]: all but free."""

OUTLIER = 4.0
"""Innovation beyond which a row shows something else than this road, in standard deviations [-]."""

LEFT_OUT_COST, HIDDEN_COST = 9.0, 3.5
"""What a bin adds to minus twice the log likelihood that is an outlier, of which any luminance up to the airlight's is
equally likely and few are expected, or that is behind an obstacle, compared to one in use [-]."""

USED, HIDDEN = 1, 2
"""What `used` says of bins in use, and of those behind an obstacle; 0 of outliers and where there is no datum."""

GRAINY = 0.01
"""Deviation of bins by the road's texture in the simple search, relative to the airlight [-]."""

OUTLIERS_OF_OBSTACLE = 3
"""Fewest outliers that make an obstacle."""


@kernel
def transmissions(
    below: NDArray[np.float64], half: NDArray[np.float64], path: NDArray[np.float64], k: float, shift: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Transmission of each bin of with its derivatives by extinction and by the horizon's row.

    Mean over the bin's height by Simpson's rule, since near the horizon a row spans hundreds of metres. `path` is
    λ times the slant: path / (v − v_h) is the length of the ray.
    """
    count = below.size
    value, by_k, by_shift = np.zeros(count), np.zeros(count), np.zeros(count)
    for i in range(count):
        for j in range(3):
            rows = below[i] - shift + (j - 1) * half[i]
            if rows <= 0.0:
                continue
            share = 4.0 / 6.0 if j == 1 else 1.0 / 6.0
            distance = path[i] / rows
            part = share * math.exp(-k * distance)
            value[i] += part
            by_k[i] -= distance * part
            by_shift[i] -= k * distance / rows * part
    return value, by_k, by_shift


@kernel
def _averaged(ratio: float) -> float:
    """Deviation of an Ornstein–Uhlenbeck process's mean over an extent of `ratio` lengths, relative to its own."""
    return math.sqrt(2.0 * (ratio - 1.0 + math.exp(-ratio))) / ratio if ratio > 1e-3 else 1.0


@kernel
def _age(covariance: NDArray[np.float64], state: NDArray[np.float64], step: float, albedo: NDArray[np.float64]) -> None:
    """Let drift (states 0 and 1, value and slope) and patches (states 3, 5, …) forget over a step along the road.

    The drift is a Matérn process of smoothness 3/2: it has a slope, as wear and weathering have.
    """
    size, width = state.shape
    rate = math.sqrt(3.0) / albedo[3]
    fade = math.exp(-rate * step)
    f00, f01 = fade * (1.0 + rate * step), fade * step
    f10, f11 = -fade * rate * rate * step, fade * (1.0 - rate * step)
    keep = math.exp(-step / albedo[1])
    value, slope = albedo[2] ** 2, (rate * albedo[2]) ** 2
    for j in range(width):
        first, second = state[0, j], state[1, j]
        state[0, j], state[1, j] = f00 * first + f01 * second, f10 * first + f11 * second
        for a in range(3, size, 2):
            state[a, j] *= keep
    for j in range(size):
        first, second = covariance[0, j], covariance[1, j]
        covariance[0, j], covariance[1, j] = f00 * first + f01 * second, f10 * first + f11 * second
        for a in range(3, size, 2):
            covariance[a, j] *= keep
    for j in range(size):
        first, second = covariance[j, 0], covariance[j, 1]
        covariance[j, 0], covariance[j, 1] = f00 * first + f01 * second, f10 * first + f11 * second
        for a in range(3, size, 2):
            covariance[j, a] *= keep
    covariance[0, 0] += value - f00 * f00 * value - f01 * f01 * slope
    covariance[1, 1] += slope - f10 * f10 * value - f11 * f11 * slope
    cross = f00 * f10 * value + f01 * f11 * slope
    covariance[0, 1] -= cross
    covariance[1, 0] -= cross
    for a in range(3, size, 2):
        covariance[a, a] += (1.0 - keep * keep) * albedo[0] ** 2


@kernel
def whiten(  # noqa: C901, PLR0912 - one pass of a filter: its state would be most arguments of any part
    columns: NDArray[np.float64],
    scale: NDArray[np.float64],
    noise: NDArray[np.float64],
    distance: NDArray[np.float64],
    extent: NDArray[np.float64],
    albedo: NDArray[np.float64],
    airlight: float,
    reject: bool,
    used: NDArray[np.uint8],
    out: NDArray[np.float64],
    constant: NDArray[np.float64],
) -> float:
    """Innovations of residual and derivatives of all strips, near to far; returns the logarithm of the determinant.

    Parameters
    ----------
    columns : (strips, n, m) float64
        Residuals in column 0 and derivatives.
    scale : (strips, n) float64
        R t: what a relative change of albedo changes.
    noise : (strips, n) float64
        Variance of each bin apart from the albedo's; 0 marks a bin without data.
    distance, extent : (n,) float64
        Distance of each bin and how much road it covers [m].
    albedo : (4,) float64
        Deviation and length [m] of patches, of drift.
    airlight : float
        Luminance that no bin much exceeds [linear grey levels].
    reject : bool
        Look for outliers and note in `used` (strips, n) what is left; else go by `used`.
    out : (strips, n, m) float64
        The innovations over their deviations; 0 where a bin is not used.
    constant : (strips, m) float64
        What each column says of the strips' constants.
    """
    strips, count, width = columns.shape
    size = 2 + 2 * strips
    state, covariance, gain = np.zeros((size, width)), np.zeros((size, size)), np.empty(size)
    covariance[0, 0] = albedo[2] ** 2
    covariance[1, 1] = 3.0 * (albedo[2] / albedo[3]) ** 2
    for strip in range(strips):
        covariance[2 + 2 * strip, 2 + 2 * strip] = CONSTANT_DEVIATION**2
        covariance[3 + 2 * strip, 3 + 2 * strip] = albedo[0] ** 2
    log_determinant, left_out = 0.0, LEFT_OUT_COST + math.log(airlight**2 / (2.0 * math.pi))
    innovation = np.empty(width)
    for i in range(count):
        if i:
            _age(covariance, state, abs(distance[i] - distance[i - 1]), albedo)
        patched, drifted = _averaged(extent[i] / albedo[1]), _averaged(extent[i] / albedo[3])
        for strip in range(strips):
            out[strip, i, :] = 0.0
            if noise[strip, i] <= 0.0:
                used[strip, i] = 0
                continue
            c, p = 2 + 2 * strip, 3 + 2 * strip
            h0, h1, h2 = scale[strip, i] * drifted, scale[strip, i], scale[strip, i] * patched
            for a in range(size):
                gain[a] = covariance[a, 0] * h0 + covariance[a, c] * h1 + covariance[a, p] * h2
            total = h0 * gain[0] + h1 * gain[c] + h2 * gain[p] + noise[strip, i]
            for j in range(width):
                innovation[j] = columns[strip, i, j] - h0 * state[0, j] - h1 * state[c, j] - h2 * state[p, j]
            if reject:
                used[strip, i] = USED if abs(innovation[0]) <= OUTLIER * math.sqrt(total) else 0
            if used[strip, i] != USED:
                hidden = used[strip, i] == HIDDEN
                log_determinant += HIDDEN_COST + math.log(noise[strip, i]) if hidden else left_out
                continue
            log_determinant += math.log(total)
            for a in range(size):
                gain[a] /= total
                for j in range(width):
                    state[a, j] += gain[a] * innovation[j]
            for a in range(size):
                for b in range(size):
                    covariance[a, b] -= gain[a] * gain[b] * total
            deviation = math.sqrt(total)
            for j in range(width):
                out[strip, i, j] = innovation[j] / deviation
    for strip in range(strips):
        constant[strip] = state[2 + 2 * strip]
    return log_determinant


@kernel
def hide_behind_obstacle(noise: NDArray[np.float64], used: NDArray[np.uint8]) -> None:
    """Drop what lies behind the nearest outlier from which on most is outliers: it stands on the road and hides it."""
    seen, outliers, foot = 0, 0, noise.size
    for i in range(noise.size - 1, -1, -1):
        if noise[i] <= 0.0:
            continue
        seen += 1
        if used[i] != USED:
            outliers += 1
            if outliers >= OUTLIERS_OF_OBSTACLE and 2 * outliers > seen:
                foot = i
    used[foot:] = HIDDEN


@kernel
def _linearise(
    luminance: NDArray[np.float64],
    below: NDArray[np.float64],
    half: NDArray[np.float64],
    path: NDArray[np.float64],
    theta: NDArray[np.float64],
    road: float,
    columns: NDArray[np.float64],
    scale: NDArray[np.float64],
) -> None:
    """Residual and derivatives by k, airlight and horizon of one strip, and the scale of its albedo."""
    value, by_k, by_shift = transmissions(below, half, path, theta[0], theta[2])
    drop = road - theta[1]
    for i in range(below.size):
        columns[i, 0] = luminance[i] - theta[1] - drop * value[i]
        columns[i, 1] = drop * by_k[i]
        columns[i, 2] = 1.0 - value[i]
        columns[i, 3] = drop * by_shift[i]
        scale[i] = road * value[i]


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
    value, _, _ = transmissions(below, half, path, k, shift)
    found = np.empty(bins)
    count = 0
    for i in range(below.size):
        if noise[i] > 0.0 and count < bins:
            found[count] = airlight + (luminance[i] - airlight) / max(value[i], 1e-6)
            count += 1
    return float(np.median(found[:count])) if count else 0.0


@kernel
def search(
    luminance: NDArray[np.float64],
    noise: NDArray[np.float64],
    below: NDArray[np.float64],
    half: NDArray[np.float64],
    path: NDArray[np.float64],
    distance: NDArray[np.float64],
    extent: NDArray[np.float64],
    albedo: NDArray[np.float64],
    extinctions: NDArray[np.float64],
    airlight: float,
    shift: float,
) -> NDArray[np.float64]:
    """Minus twice the log likelihood of each of several extinctions, the rest at their first guesses; inf for none."""
    strips, count = luminance.shape
    cost = np.empty(extinctions.size)
    columns, scale = np.empty((strips, count, 1)), np.empty((strips, count))
    out, constant, used = np.empty((strips, count, 1)), np.empty((strips, 1)), np.zeros((strips, count), np.uint8)
    for j in range(extinctions.size):
        k, possible = extinctions[j], True
        for strip in range(strips):
            road = near_road(luminance[strip], noise[strip], below, half, path[strip], k, airlight, shift, 12)
            possible = possible and 0.0 < road < 1.5 * airlight
            value, _, _ = transmissions(below, half, path[strip], k, shift)
            columns[strip, :, 0] = luminance[strip] - airlight - (road - airlight) * value
            scale[strip] = road * value
        cost[j] = np.inf
        if possible:
            cost[j] = whiten(columns, scale, noise, distance, extent, albedo, airlight, True, used, out, constant)
            cost[j] += (out**2).sum()
    return cost


@kernel
def simple_search(
    luminance: NDArray[np.float64],
    noise: NDArray[np.float64],
    below: NDArray[np.float64],
    half: NDArray[np.float64],
    path: NDArray[np.float64],
    extinctions: NDArray[np.float64],
    prior: NDArray[np.float64],
) -> tuple[float, float]:
    """Extinction and airlight that best fit all strips as one road of constant albedo, in Cauchy's norm.

    A smooth broad search, where `search` has narrow minima: what does not fit weighs little, and nothing is explained
    by an albedo that wanders.
    """
    strips, count = luminance.shape
    best, best_k, best_airlight = np.inf, extinctions[0], prior[0]
    scale = (GRAINY * prior[0]) ** 2
    stride = max(count // 36, 1)
    for k in extinctions:
        value, _, _ = transmissions(below[::stride], half[::stride], path[0, ::stride], k, prior[3])
        airlight, drop, total = prior[0], 0.0, 0.0
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
                    y = luminance[strip, i] - prior[0]
                    s0, s1, s2 = s0 + weight, s1 + weight * t, s2 + weight * t * t
                    r0, r1 = r0 + weight * y, r1 + weight * t * y
            off = airlight - prior[0]
            known = 1.0 / (prior[1] if off < 0.0 else prior[2]) ** 2
            total += known * off * off
            s0 += known
            determinant = max(s0 * s2 - s1 * s1, 1e-12)
            airlight = prior[0] + (s2 * r0 - s1 * r1) / determinant
            drop = min((s0 * r1 - s1 * r0) / determinant, 0.0)
            drop = max(drop, -airlight)
        if total < best:
            best, best_k, best_airlight = total, k, airlight
    return best_k, best_airlight


@kernel
def refine(  # noqa: C901, PLR0912 - one iteration of a solver, which shares all its arrays
    luminance: NDArray[np.float64],
    noise: NDArray[np.float64],
    below: NDArray[np.float64],
    half: NDArray[np.float64],
    path: NDArray[np.float64],
    distance: NDArray[np.float64],
    extent: NDArray[np.float64],
    albedo: NDArray[np.float64],
    prior: NDArray[np.float64],
    start: NDArray[np.float64],
    road: NDArray[np.float64],
    used: NDArray[np.uint8],
    iterations: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float, int]:
    """Gauss–Newton from a start (k, airlight, shift of the horizon).

    Parameters
    ----------
    luminance, noise, path : (strips, n) float64
        See `whiten` and `transmissions`.
    prior : (5,) float64
        Airlight by the sky, its deviation downward and upward, the horizon's row and its deviation.
    start : (3,) float64
        k, airlight, shift.
    road : (strips,) float64
        Luminance of each strip without fog; is refined.
    used : (strips, n) uint8
        Which bins took part; is written.
    iterations : int
        Most steps.

    Returns
    -------
    tuple
        Parameters (3,), their covariance (3, 3), minus twice the log likelihood (with the parameters' priors and
        integrated over them), sum of the squared innovations, and how many there are.
    """
    strips, count = luminance.shape
    theta = start.copy()
    columns, scale = np.empty((strips, count, 4)), np.empty((strips, count))
    out, constant = np.empty((strips, count, 4)), np.empty((strips, 4))
    covariance: NDArray[np.float64] = np.eye(3)
    unit = 1.0 / path[0, 0]
    cost, squares, number = 0.0, 0.0, 0
    for iteration in range(iterations + 1):
        final = iteration == iterations
        normal, gradient = np.zeros((3, 3)), np.zeros(3)
        squares, number = 0.0, 0
        for strip in range(strips):
            _linearise(
                luminance[strip],
                below,
                half,
                path[strip],
                theta,
                road[strip],
                columns[strip],
                scale[strip],
            )
        # What is an outlier is settled before the last steps, so that they converge.
        reject = iteration < max(iterations - 2, 1)
        cost = whiten(columns, scale, noise, distance, extent, albedo, prior[0], reject, used, out, constant)
        for strip in range(strips):
            if reject:
                hide_behind_obstacle(noise[strip], used[strip])
            for i in range(count):
                if used[strip, i] != USED:
                    continue
                number += 1
                squares += out[strip, i, 0] ** 2
                for a in range(3):
                    gradient[a] += out[strip, i, a + 1] * out[strip, i, 0]
                    for b in range(3):
                        normal[a, b] += out[strip, i, a + 1] * out[strip, i, b + 1]
        cost += squares
        off = theta[1] - prior[0]
        weight = 1.0 / (prior[1] if off < 0.0 else prior[2]) ** 2
        normal[1, 1] += weight
        gradient[1] -= weight * off
        lower = theta[2] - prior[3]
        normal[2, 2] += 1.0 / prior[4] ** 2
        gradient[2] -= lower / prior[4] ** 2
        cost += weight * off * off + (lower / prior[4]) ** 2
        # A weak hold on k keeps the matrix regular where there is nothing to see.
        normal[0, 0] += 1.0
        covariance = np.linalg.inv(normal).astype(np.float64)
        cost += math.log(max(np.linalg.det(normal), 1e-300))
        if final:
            break
        step = covariance @ gradient
        most = abs(theta[0]) + 0.3 * unit
        damped = min(1.0, most / max(abs(step[0]), 1e-12), 1.5 * prior[4] / max(abs(step[2]), 1e-12))
        if theta[0] + damped * step[0] < -2.0 * unit:
            damped = 0.5 * damped
        for a in range(3):
            theta[a] += damped * step[a]
        for strip in range(strips):
            change = constant[strip, 0]
            for a in range(3):
                change -= damped * step[a] * constant[strip, a + 1]
            road[strip] *= min(max(1.0 + change, 0.5), 1.5)
        if iteration >= 3 and abs(step[0]) < 1e-4 * abs(theta[0]) + 1e-4 * unit:
            iterations = min(iterations, iteration + 1)
    return theta, covariance, cost, squares, number
