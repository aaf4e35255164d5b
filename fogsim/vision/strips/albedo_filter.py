"""Compiled Kalman filter along strips of road whose albedo wanders: correlated residuals become independent ones.

The albedo of a strip is R (1 + c + p(d) + b(d)): a constant, patches (an Ornstein–Uhlenbeck process along the road, for
each strip its own) and a slow drift that all strips share. To its light comes a part s A g(γ) of the sky's, its sheen:
asphalt reflects the more, the more grazing the angle γ at which it is looked at. Before it lies the airlight, A (1 +
c(γ)), which clouds may make uneven (an Ornstein–Uhlenbeck process over the angle). Seen through fog they leave
residuals that are correlated from row to row. A Kalman filter from the nearest row outward turns those into independent
ones ("innovations") in time linear in the rows, for the residual and for its derivatives alike, and so gives the exact
Gauss–Newton step and the exact likelihood of that model.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

CONSTANT_DEVIATION = 0.5
"""Deviation of a strip's albedo from its first guess, relative to it [-]: all but free."""

_OUTLIER = 4.0
"""Innovation beyond which a row shows something else than this road, in standard deviations [-]."""

LEFT_OUT_COST, HIDDEN_COST = 9.0, 3.5
"""Added to minus twice the log likelihood for a bin that is an outlier (expected to be rare, with any luminance up to
the airlight's equally likely), or that is behind an obstacle, compared to one in use [-]."""

_FIRST = 4
"""State of the first strip's constant: before it come drift, its slope, sheen and airlight."""

USED, HIDDEN = 1, 2
"""What `used` says of bins in use, and of those behind an obstacle; 0 of outliers and where there is no datum."""

_OUTLIERS_OF_OBSTACLE = 3
"""Fewest outliers that make an obstacle."""


GRAZING = 0.1
"""Angle at which a road's sheen is half of that at the horizon [rad]: 6°, between what CIE's table of dry asphalt (R2)
has under a sky of even luminance, 11°, and Fresnel's formula over facets that are tilted by some 10°, 3°."""

CLOUD_ANGLE = 0.03
"""Angle over which uneven airlight forgets itself [rad]."""


class Albedo(NamedTuple):
    """How the albedo of a road wanders, relative to it, and the airlight before it."""

    # patch_deviation, patch_length: standard deviation [-] and correlation length [m] of patches
    patch_deviation: float
    patch_length: float
    # drift_deviation, drift_length: the same of the drift
    drift_deviation: float
    drift_length: float
    # sheen, sheen_deviation: part of the sky's light that the road reflects at grazing angles, and its standard
    # deviation [-]
    sheen: float = 0.0
    sheen_deviation: float = 0.0
    cloud_deviation: float = 0.0  # Standard deviation of the airlight over the image, relative to it [-]


class Residuals(NamedTuple):
    """What the filter takes, bins from near to far."""

    columns: NDArray[np.float64]  # (strips, n, m): Residuals in column 0, and derivatives
    scale: NDArray[np.float64]  # (strips, n): R t: what a relative change of albedo changes
    veil: NDArray[np.float64]  # (strips, n): A (1 − t): what a relative change of airlight changes
    noise: NDArray[np.float64]  # (strips, n): Variance of each bin apart from the albedo's; 0 marks a bin without data


class Whitened(NamedTuple):
    """What the filter makes of them."""

    innovations: NDArray[np.float64]  # (strips, n, m): Of bins in use, over their standard deviations
    constants: NDArray[np.float64]  # (strips, m): What each column says of the strips' constants
    used: NDArray[np.uint8]  # (strips, n) uint8: `USED`, `HIDDEN` or 0


@kernel
def _averaged(ratio: float) -> float:
    """Deviation of an Ornstein–Uhlenbeck process's mean over an extent of `ratio` lengths, relative to its own."""
    return math.sqrt(2.0 * (ratio - 1.0 + math.exp(-ratio))) / ratio if ratio > 1e-3 else 1.0


@kernel
def albedo_transitions(
    distance: NDArray[np.float64], extent: NDArray[np.float64], grazing: NDArray[np.float64], albedo: Albedo
) -> NDArray[np.float64]:
    """How the albedo's states change from bin to bin, and what a bin shows of them.

    The drift is a Matérn process of smoothness 3/2: it has a slope, as wear and weathering have.

    Returns the four factors by which drift and its slope pass into themselves and each other, that by which patches
    keep, the shares of drift and of patches that a bin's mean shows, the factor by which uneven airlight keeps, and the
    sheen relative to that at the horizon (n, 9). Takes `distance`, `extent` (n,) [m], `grazing` (n,) [rad].
    """
    out = np.zeros((distance.size, 9))
    rate = math.sqrt(3.0) / albedo.drift_length
    for i in range(distance.size):
        step = abs(distance[i] - distance[i - 1]) if i else 0.0
        fade = math.exp(-rate * step)
        out[i, 0], out[i, 1] = fade * (1.0 + rate * step), fade * step
        out[i, 2], out[i, 3] = -fade * rate * rate * step, fade * (1.0 - rate * step)
        out[i, 4] = math.exp(-step / albedo.patch_length)
        out[i, 5] = _averaged(extent[i] / albedo.drift_length)
        out[i, 6] = _averaged(extent[i] / albedo.patch_length)
        out[i, 7] = math.exp(-abs(grazing[i] - grazing[i - 1]) / CLOUD_ANGLE) if i else 0.0
        out[i, 8] = 1.0 / (1.0 + grazing[i] / GRAZING)
    return out


_WHOLE = 8
"""Numbers that a vector register holds: rows of a filter's matrix have a multiple of it."""


@kernel
def _predict(
    joint: NDArray[np.float64], kept: NDArray[np.float64], changes: NDArray[np.float64], i: int, albedo: Albedo
) -> None:
    """Predict drift (states 0, 1: value, slope), uneven airlight (3) and patches (5, 7, …) a step farther.

    What of each column stays is written down; of others than these it is 1.
    """
    f00, f01, f10, f11 = changes[i, 0], changes[i, 1], changes[i, 2], changes[i, 3]
    keep, cloud = changes[i, 4], changes[i, 7]
    size = joint.shape[0]
    kept[_FIRST - 1] = cloud
    for a in range(_FIRST + 1, size, 2):
        kept[a] = keep
    for j in range(joint.shape[1]):
        first, second = joint[0, j], joint[1, j]
        joint[0, j], joint[1, j] = f00 * first + f01 * second, f10 * first + f11 * second
    for a in range(size):
        for j in range(joint.shape[1]):
            joint[a, j] = joint[a, j] * kept[a] * kept[j]
        first, second = joint[a, 0], joint[a, 1]
        joint[a, 0], joint[a, 1] = f00 * first + f01 * second, f10 * first + f11 * second
    value = albedo.drift_deviation**2
    slope = (math.sqrt(3.0) / albedo.drift_length * albedo.drift_deviation) ** 2
    joint[0, 0] += value - f00 * f00 * value - f01 * f01 * slope
    joint[1, 1] += slope - f10 * f10 * value - f11 * f11 * slope
    cross = f00 * f10 * value + f01 * f11 * slope
    joint[0, 1] -= cross
    joint[1, 0] -= cross
    joint[_FIRST - 1, _FIRST - 1] += (1.0 - cloud * cloud) * albedo.cloud_deviation**2
    for a in range(_FIRST + 1, size, 2):
        joint[a, a] += (1.0 - keep * keep) * albedo.patch_deviation**2


@kernel
def _begun(strips: int, columns: int, albedo: Albedo) -> NDArray[np.float64]:
    """Covariance of drift, its slope, sheen, airlight, and each strip's constant and patches before all is seen.

    Behind it, in each state's row, its mean under each of the columns, and room up to whole registers.
    """
    size = _FIRST + 2 * strips
    joint = np.zeros((size, -(-(size + columns) // _WHOLE) * _WHOLE))
    joint[0, 0] = albedo.drift_deviation**2
    joint[1, 1] = 3.0 * (albedo.drift_deviation / albedo.drift_length) ** 2
    joint[2, 2] = albedo.sheen_deviation**2
    joint[_FIRST - 1, _FIRST - 1] = albedo.cloud_deviation**2
    for strip in range(strips):
        first = _FIRST + 2 * strip
        joint[first, first] = CONSTANT_DEVIATION**2
        joint[first + 1, first + 1] = albedo.patch_deviation**2
    joint[2, size] = albedo.sheen
    return joint


class Shares(NamedTuple):
    """What a bin shows of drift, sheen and uneven airlight, and of its strip's constant and patches."""

    drift: float
    sheen: float
    cloud: float
    constant: float
    patches: float


@kernel
def _shares(scale: float, veil: float, airlight: float, changes: NDArray[np.float64], i: int) -> Shares:
    return Shares(scale * changes[i, 5], (airlight - veil) * changes[i, 8], veil, scale, scale * changes[i, 6])


@kernel
def _shown(joint: NDArray[np.float64], shares: Shares, strip: int, j: int) -> float:
    """What a bin shows of states: its covariance with one, or its mean under a column."""
    total = joint[0, j] * shares.drift + joint[2, j] * shares.sheen + joint[3, j] * shares.cloud
    return float(total + joint[strip, j] * shares.constant + joint[strip + 1, j] * shares.patches)


@kernel
def _variance(line: NDArray[np.float64], shares: Shares, strip: int) -> float:
    """Variance of what a bin shows of states, from its covariances with them."""
    total = line[0] * shares.drift + line[2] * shares.sheen + line[3] * shares.cloud
    return float(total + line[strip] * shares.constant + line[strip + 1] * shares.patches)


@kernel
def _cost_without(used: int, noise: float, airlight: float) -> float:
    """What a bin adds to the cost that is not in use."""
    if used == HIDDEN:
        return HIDDEN_COST + math.log(noise)
    return LEFT_OUT_COST + math.log(airlight**2 / (2.0 * math.pi))


@kernel
def with_factor(logarithm: float, product: float, factor: float) -> tuple[float, float]:
    """Multiply by a factor whose logarithm counts: one logarithm for several of them."""
    product *= factor
    return (logarithm, product) if 1e-100 < product < 1e100 else (logarithm + math.log(product), 1.0)


@kernel
def _mark_outliers(
    columns: NDArray[np.float64],
    scale: NDArray[np.float64],
    veil: NDArray[np.float64],
    noise: NDArray[np.float64],
    changes: NDArray[np.float64],
    i: int,
    airlight: float,
    joint: NDArray[np.float64],
    line: NDArray[np.float64],
    used: NDArray[np.uint8],
) -> None:
    """Note which strips show road on one bin: all by what lies nearer, so that none comes before another."""
    size = joint.shape[0]
    for strip in range(used.shape[0]):
        first, shares = _FIRST + 2 * strip, _shares(scale[strip, i], veil[strip, i], airlight, changes, i)
        for j in (0, 2, 3, first, first + 1, size):
            line[j] = _shown(joint, shares, first, j)
        innovation, total = columns[strip, i, 0] - line[size], _variance(line, shares, first) + noise[strip, i]
        used[strip, i] = USED if innovation * innovation <= _OUTLIER**2 * total else 0


@kernel
def _learn(joint: NDArray[np.float64], line: NDArray[np.float64], total: float, gain: NDArray[np.float64]) -> None:
    """Condition states on a bin, from its covariance with them and its variance; `gain` is room."""
    # Named tuples of arrays would be counted by reference, bin by bin; and divisions apart are vectorised.
    for a in range(gain.size):
        gain[a] = line[a] / total
    for a in range(gain.size):
        for j in range(joint.shape[1]):
            joint[a, j] -= gain[a] * line[j]


@kernel
def whiten(
    residuals: Residuals, changes: NDArray[np.float64], albedo: Albedo, airlight: float, reject: bool, out: Whitened
) -> float:
    """Innovations of residuals and derivatives of all strips, near to far; returns the logarithm of the determinant.

    Takes `changes` (n, 9), `airlight` [linear grey levels].
    """
    columns, scale, veil, noise = residuals.columns, residuals.scale, residuals.veil, residuals.noise
    strips, count, width = columns.shape
    joint, used = _begun(strips, width, albedo), out.used
    size, line, kept = joint.shape[0], np.empty(joint.shape[1]), np.ones(joint.shape[1])
    gain = np.empty(size)
    log_determinant, product = 0.0, 1.0
    for i in range(count):
        if i:
            _predict(joint, kept, changes, i, albedo)
        if reject:
            _mark_outliers(columns, scale, veil, noise, changes, i, airlight, joint, line, used)
        for strip in range(strips):
            if noise[strip, i] <= 0.0:
                used[strip, i] = 0
                continue
            if used[strip, i] != USED:
                log_determinant += _cost_without(used[strip, i], noise[strip, i], airlight)
                continue
            first, shares = _FIRST + 2 * strip, _shares(scale[strip, i], veil[strip, i], airlight, changes, i)
            for j in range(line.size):
                line[j] = _shown(joint, shares, first, j)
            total = _variance(line, shares, first) + noise[strip, i]
            log_determinant, product = with_factor(log_determinant, product, total)
            weight = 1.0 / math.sqrt(total)
            for j in range(width):
                line[size + j] -= columns[strip, i, j]
                out.innovations[strip, i, j] = -line[size + j] * weight
            _learn(joint, line, total, gain)
    out.constants[:] = joint[_FIRST::2, size : size + width]
    return log_determinant + math.log(product)


@kernel
def hide_behind_obstacles(noise: NDArray[np.float64], used: NDArray[np.uint8]) -> bool:
    """Drop what lies behind each strip's nearest outlier from which on most is outliers: it stands there and hides it.

    Returns whether any bin was in use that now is not. Takes `noise` (strips, n), `used` (strips, n) uint8.
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
                if outliers >= _OUTLIERS_OF_OBSTACLE and 2 * outliers > seen:
                    foot = i
        for i in range(foot, noise.shape[1]):
            changed = changed or used[strip, i] == USED
            used[strip, i] = HIDDEN
    return changed
