"""Compiled Kalman filter along strips of road whose albedo wanders: correlated residuals become independent ones.

The albedo of a strip is R (1 + c + p(d) + b(d)): a constant, patches (an Ornstein–Uhlenbeck process along the road, for
each strip its own) and a slow drift that all strips share. Seen through fog they leave residuals that are correlated
from row to row. A Kalman filter from the nearest row outward turns those into independent ones ("innovations") in time
linear in the rows, for the residual and for its derivatives alike, and so gives the exact Gauss–Newton step and the
exact likelihood of that model.
"""

import math
from typing import NamedTuple

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

OUTLIERS_OF_OBSTACLE = 3
"""Fewest outliers that make an obstacle."""


class Albedo(NamedTuple):
    """How the albedo of a road wanders, relative to it.

    Attributes
    ----------
    patch_deviation, patch_length : float
        Standard deviation [-] and correlation length [m] of patches.
    drift_deviation, drift_length : float
        The same of the drift.
    """

    patch_deviation: float
    patch_length: float
    drift_deviation: float
    drift_length: float


class Residuals(NamedTuple):
    """What the filter takes, bins from near to far.

    Attributes
    ----------
    columns : (strips, n, m) float64
        Residuals in column 0, and derivatives.
    scale : (strips, n) float64
        R t: what a relative change of albedo changes.
    noise : (strips, n) float64
        Variance of each bin apart from the albedo's; 0 marks a bin without data.
    """

    columns: NDArray[np.float64]
    scale: NDArray[np.float64]
    noise: NDArray[np.float64]


class Whitened(NamedTuple):
    """What the filter makes of them.

    Attributes
    ----------
    innovations : (strips, n, m) float64
        Over their standard deviations; 0 where a bin is not used.
    constants : (strips, m) float64
        What each column says of the strips' constants.
    used : (strips, n) uint8
        `USED`, `HIDDEN` or 0.
    """

    innovations: NDArray[np.float64]
    constants: NDArray[np.float64]
    used: NDArray[np.uint8]


@kernel
def _averaged(ratio: float) -> float:
    """Deviation of an Ornstein–Uhlenbeck process's mean over an extent of `ratio` lengths, relative to its own."""
    return math.sqrt(2.0 * (ratio - 1.0 + math.exp(-ratio))) / ratio if ratio > 1e-3 else 1.0


@kernel
def albedo_transitions(
    distance: NDArray[np.float64], extent: NDArray[np.float64], albedo: Albedo
) -> NDArray[np.float64]:
    """How the albedo's states change from bin to bin, and what a bin shows of them.

    The drift is a Matérn process of smoothness 3/2: it has a slope, as wear and weathering have.

    Parameters
    ----------
    distance, extent : (n,) float64
        Distance of each bin and how much road it covers [m].
    albedo : Albedo
        How it wanders.

    Returns
    -------
    (n, 7) float64
        The four factors by which drift and its slope pass into themselves and each other, that by which patches keep,
        and the shares of drift and of patches that a bin's mean shows.
    """
    out = np.zeros((distance.size, 7))
    rate = math.sqrt(3.0) / albedo.drift_length
    for i in range(distance.size):
        step = abs(distance[i] - distance[i - 1]) if i else 0.0
        fade = math.exp(-rate * step)
        out[i, 0], out[i, 1] = fade * (1.0 + rate * step), fade * step
        out[i, 2], out[i, 3] = -fade * rate * rate * step, fade * (1.0 - rate * step)
        out[i, 4] = math.exp(-step / albedo.patch_length)
        out[i, 5] = _averaged(extent[i] / albedo.drift_length)
        out[i, 6] = _averaged(extent[i] / albedo.patch_length)
    return out


@kernel
def _predict(
    covariance: NDArray[np.float64], state: NDArray[np.float64], change: NDArray[np.float64], albedo: Albedo
) -> None:
    """Predict drift (states 0 and 1, value and slope) and patches (states 3, 5, …) a step farther along the road."""
    size, width = state.shape
    f00, f01, f10, f11, keep = change[0], change[1], change[2], change[3], change[4]
    for j in range(width):
        first, second = state[0, j], state[1, j]
        state[0, j], state[1, j] = f00 * first + f01 * second, f10 * first + f11 * second
    for j in range(size):
        first, second = covariance[0, j], covariance[1, j]
        covariance[0, j], covariance[1, j] = f00 * first + f01 * second, f10 * first + f11 * second
    for a in range(3, size, 2):
        for j in range(width):
            state[a, j] *= keep
        for j in range(size):
            covariance[a, j] *= keep
    for j in range(size):
        first, second = covariance[j, 0], covariance[j, 1]
        covariance[j, 0], covariance[j, 1] = f00 * first + f01 * second, f10 * first + f11 * second
        for a in range(3, size, 2):
            covariance[j, a] *= keep
    value = albedo.drift_deviation**2
    slope = (math.sqrt(3.0) / albedo.drift_length * albedo.drift_deviation) ** 2
    covariance[0, 0] += value - f00 * f00 * value - f01 * f01 * slope
    covariance[1, 1] += slope - f10 * f10 * value - f11 * f11 * slope
    cross = f00 * f10 * value + f01 * f11 * slope
    covariance[0, 1] -= cross
    covariance[1, 0] -= cross
    for a in range(3, size, 2):
        covariance[a, a] += (1.0 - keep * keep) * albedo.patch_deviation**2


@kernel
def _initial_covariance(strips: int, albedo: Albedo) -> NDArray[np.float64]:
    """Covariance of drift, its slope, and each strip's constant and patches before anything is seen."""
    covariance = np.zeros((2 + 2 * strips, 2 + 2 * strips))
    covariance[0, 0] = albedo.drift_deviation**2
    covariance[1, 1] = 3.0 * (albedo.drift_deviation / albedo.drift_length) ** 2
    for strip in range(strips):
        covariance[2 + 2 * strip, 2 + 2 * strip] = CONSTANT_DEVIATION**2
        covariance[3 + 2 * strip, 3 + 2 * strip] = albedo.patch_deviation**2
    return covariance


@kernel
def _covariance_with_bin(
    covariance: NDArray[np.float64], h0: float, h1: float, h2: float, strip: int, out: NDArray[np.float64]
) -> None:
    """Covariance of all states with what a bin shows of the drift, and of its strip's constant and patches."""
    for a in range(covariance.shape[0]):
        out[a] = covariance[0, a] * h0 + covariance[strip, a] * h1 + covariance[strip + 1, a] * h2


@kernel
def _is_road(
    seen: tuple[float, float],
    h0: float,
    h1: float,
    h2: float,
    strip: int,
    p: NDArray[np.float64],
    state: NDArray[np.float64],
) -> bool:
    """Whether a bin, of which a residual and its variance are seen, is no outlier; see `_covariance_with_bin`."""
    c, d = strip, strip + 1
    total = h0 * h0 * p[0, 0] + h1 * h1 * p[c, c] + h2 * h2 * p[d, d]
    total += 2.0 * (h0 * h1 * p[0, c] + h0 * h2 * p[0, d] + h1 * h2 * p[c, d])
    innovation = seen[0] - h0 * state[0, 0] - h1 * state[c, 0] - h2 * state[d, 0]
    return bool(innovation * innovation <= OUTLIER**2 * (total + seen[1]))


@kernel
def _cost_without(used: int, noise: float, airlight: float) -> float:
    """What a bin adds to the cost that is not in use."""
    if used == HIDDEN:
        return HIDDEN_COST + math.log(noise)
    return LEFT_OUT_COST + math.log(airlight**2 / (2.0 * math.pi))


@kernel
def _update(
    covariance: NDArray[np.float64],
    state: NDArray[np.float64],
    gain: NDArray[np.float64],
    innovation: NDArray[np.float64],
    total: float,
) -> None:
    """Take a bin's innovations of a variance into state and covariance; `gain` holds the gains times that variance."""
    size, width = state.shape
    for a in range(size):
        share = gain[a] / total
        for j in range(width):
            state[a, j] += share * innovation[j]
        for b in range(size):
            covariance[a, b] -= share * gain[b]


@kernel
def _mark_outliers(
    residuals: Residuals,
    i: int,
    change: NDArray[np.float64],
    covariance: NDArray[np.float64],
    state: NDArray[np.float64],
    used: NDArray[np.uint8],
) -> None:
    """Note which strips show road on one bin: all by what lies nearer, so that none comes before another."""
    for strip in range(used.shape[0]):
        h1 = residuals.scale[strip, i]
        h0, h2 = h1 * change[5], h1 * change[6]
        seen = (residuals.columns[strip, i, 0], residuals.noise[strip, i])
        used[strip, i] = USED if _is_road(seen, h0, h1, h2, 2 + 2 * strip, covariance, state) else 0


@kernel
def whiten(
    residuals: Residuals, changes: NDArray[np.float64], albedo: Albedo, airlight: float, reject: bool, out: Whitened
) -> float:
    """Innovations of residuals and derivatives of all strips, near to far; returns the logarithm of the determinant.

    Parameters
    ----------
    residuals : Residuals
        Residuals and derivatives.
    changes : (n, 7) float64
        See `albedo_transitions`.
    albedo : Albedo
        How the albedo wanders.
    airlight : float
        Luminance that no bin much exceeds [linear grey levels].
    reject : bool
        Look for outliers and note in `out.used` what is left; else go by that.
    out : Whitened
        The innovations; is written.
    """
    columns, scale, noise, used = residuals.columns, residuals.scale, residuals.noise, out.used
    strips, count, width = columns.shape
    covariance = _initial_covariance(strips, albedo)
    size = covariance.shape[0]
    state, gain, innovation = np.zeros((size, width)), np.empty(size), np.empty(width)
    log_determinant, product = 0.0, 1.0
    for i in range(count):
        if i:
            _predict(covariance, state, changes[i], albedo)
        if reject:
            _mark_outliers(residuals, i, changes[i], covariance, state, used)
        for strip in range(strips):
            out.innovations[strip, i, :] = 0.0
            if noise[strip, i] <= 0.0:
                used[strip, i] = 0
                continue
            c, h1 = 2 + 2 * strip, scale[strip, i]
            h0, h2 = h1 * changes[i, 5], h1 * changes[i, 6]
            _covariance_with_bin(covariance, h0, h1, h2, c, gain)
            total = h0 * gain[0] + h1 * gain[c] + h2 * gain[c + 1] + noise[strip, i]
            for j in range(width):
                innovation[j] = columns[strip, i, j] - h0 * state[0, j] - h1 * state[c, j] - h2 * state[c + 1, j]
            if used[strip, i] != USED:
                log_determinant += _cost_without(used[strip, i], noise[strip, i], airlight)
                continue
            # One logarithm for several factors.
            product *= total
            if not 1e-100 < product < 1e100:
                log_determinant, product = log_determinant + math.log(product), 1.0
            _update(covariance, state, gain, innovation, total)
            weight = 1.0 / math.sqrt(total)
            for j in range(width):
                out.innovations[strip, i, j] = innovation[j] * weight
    out.constants[:] = state[2::2]
    return log_determinant + math.log(product)


@kernel
def hide_behind_obstacles(noise: NDArray[np.float64], used: NDArray[np.uint8]) -> bool:
    """Drop what lies behind each strip's nearest outlier from which on most is outliers: it stands there and hides it.

    Parameters
    ----------
    noise : (strips, n) float64
        Variance of each bin; 0 marks a bin without data.
    used : (strips, n) uint8
        See `Whitened`; is written.

    Returns
    -------
    bool
        Whether any bin was in use that now is not.
    """
    changed = False
    for strip in range(noise.shape[0]):
        seen, outliers, foot = 0, 0, noise.shape[1]
        for i in range(noise.shape[1] - 1, -1, -1):
            if noise[strip, i] <= 0.0:
                continue
            seen += 1
            if used[strip, i] != USED:
                outliers += 1
                if outliers >= OUTLIERS_OF_OBSTACLE and 2 * outliers > seen:
                    foot = i
        for i in range(foot, noise.shape[1]):
            changed = changed or used[strip, i] == USED
            used[strip, i] = HIDDEN
    return changed
