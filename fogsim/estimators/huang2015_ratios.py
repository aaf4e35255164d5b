"""Extinction from how the contrast of a vehicle falls with its range, and the confidence in images that follows."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import inverse_of, matrix_product, straight_line

Floats = NDArray[np.float64]

_KEPT = 0.5
"""Ratios farther than this share from their row's median are dropped (section 4.3.3) [-]."""

_LARGEST_EXTINCTION = 0.09
"""Upper end of the published search [1/m]: visibilities below 33 m cannot come out."""

GRID = 1801
"""Extinctions that the published search tries."""

_RATIO_DEVIATION = 0.03
"""Least standard deviation of a ratio of variances, be there one or many [-]."""

_SLOPE_SHARE = 0.045
"""Standard deviation of a ratio of contrasts that pixels do not show, relative: registration, detail too small [-]."""

_MEAN_SHARE, _MEAN_CONTRAST_SHARE = 0.0015, 0.006
"""The same of a mean luminance, relative to the sky's and to its contrast to the sky [-]."""

_SKY_SHARE = 0.01
"""Standard deviation of the airlight ahead relative to the sky's luminance above it [-]."""

_DETAIL_SHARE = 0.3
"""Standard deviation of the share of its detail that only the reference shows: fine detail, another noise [-]."""

_DRIFT = 0.009
"""Standard deviation of the relative change of a mean contrast as a picture becomes smaller by a factor e [-]."""

_SIZE_SHARE = 0.01
"""Standard deviation of the relative change of a contrast from the nearest to the farthest picture by size and place,
which all pictures between share [-]."""

_HUBER = 2.0
"""Residuals beyond this many standard deviations count linearly, not squared [-]."""

_STEPS = 30
"""Most Gauss–Newton steps of the fit."""

RANGE_DEVIATION = 0.3
"""Standard deviation of a range [m]."""


_LARGEST_STEP = np.array([0.02, 0.2, 0.1, 0.2, 0.05])  # of k, B, e, f and g in one of the steps


def image_confidence(extinction: float, distance: Floats | float, reference: float = 0.0) -> Floats:
    """Image confidence curve (huang2015 section 4.3.2): variance that is left of a thing's picture at a range.

    e^(−2k (d − d₀)), of the thing's variance at the reference; the thesis shows it in per cent.

    Returns confidence [-]; more than 1 nearer than the reference. Takes `extinction` [1/m], `distance` [m], `reference`
    [m].
    """
    return np.asarray(np.exp(-2.0 * extinction * (np.asarray(distance, np.float64) - reference)))


@dataclass(frozen=True, slots=True)
class _RatioTable:
    """Mean ratios of variances by difference of range (huang2015 table 4.2, after the ± 50 % rule)."""

    difference: Floats  # (n,): Far less near range [m], ascending: means of rows that are a spacing apart
    ratio: Floats  # (n,): Far over near variance [-]
    count: NDArray[np.int64]  # (n,) int64: Ratios in each mean


def ratio_table(distances: Floats, variances: Floats, spacing: float) -> _RatioTable:
    """Ratios of every two variances, by their difference of range.

    Takes `distances` (n,) [m], `variances` (n,), `spacing` [m].
    """
    apart = distances[None, :] - distances[:, None]
    ratio = variances[None, :] / variances[:, None]
    row = np.rint(apart / spacing).astype(np.int64)
    found = []
    for step in np.unique(row[row > 0]):
        ratios = ratio[row == step]
        kept = ratios[np.abs(ratios - np.median(ratios)) <= _KEPT * np.median(ratios)]
        if kept.size:
            found.append((float(apart[row == step].mean()), float(kept.mean()), kept.size))
    difference, mean, count = (np.array(column) for column in zip(*found, strict=True)) if found else (np.zeros(0),) * 3
    return _RatioTable(difference.astype(np.float64), mean.astype(np.float64), count.astype(np.int64))


def published_extinction(table: _RatioTable) -> tuple[float, float]:
    """Extinction of least squared error between mean and theoretical ratios, of k from 0 to 0.09 (section 4.3.3).

    Returns k and the standard deviation that the ratios' misfit makes of it [1/m].
    """
    tried = np.linspace(0.0, _LARGEST_EXTINCTION, GRID)
    model = image_confidence(1.0, tried[:, None] * table.difference)
    best = int(np.argmin(((model - table.ratio) ** 2).sum(axis=1)))
    slope = -2.0 * table.difference * model[best]
    misfit = float(((model[best] - table.ratio) ** 2).sum()) / max(table.ratio.size - 1, 1)
    misfit = max(misfit, _RATIO_DEVIATION**2)
    return float(tried[best]), math.sqrt(misfit / max(float(matrix_product(slope, slope)), 1e-12))


@dataclass(frozen=True, slots=True)
class Regressions:
    """Regressions of n pictures of a vehicle on the nearest of them; luminances in that of the sky."""

    distance: Floats  # (n,): Ranges [m]
    # slope, slope_deviation (n,): contrast over that of the reference, and its deviation by pixel noise [-]
    slope: Floats
    slope_deviation: Floats
    # mean, mean_deviation (n,): mean luminance of each picture and its deviation; ``inf`` where the sky is saturated
    # [-]
    mean: Floats
    mean_deviation: Floats
    near_mean: Floats  # (n,): Mean luminance of the same pixels of the reference [-]
    range_deviation: Floats | float = RANGE_DEVIATION  # (n,): Standard deviation of the ranges [m]


@dataclass(frozen=True, slots=True)
class _ContrastFit:
    """Koschmieder's law fitted to regressions."""

    # extinction, deviation: k, which may come out negative, and its standard deviation [1/m]
    extinction: float
    deviation: float
    misfit: float  # Mean square of the standardised residuals; about 1 where the model holds


def fitted_extinction(data: Regressions) -> _ContrastFit | None:
    """Fit slope = B (1 + f) t and mean = (1 + e) − (1 + e − near mean) B t (1 + g ln d/d₀), t = e^(−k d), robustly.

    Slopes need detail and no knowledge of the airlight; means need no detail, but the sky's luminance for the
    airlight's. What may be wrong is fitted along, as far from 0 as it can be: the difference e of airlight and sky, the
    share f of the reference's own detail that others do not show, and the drift g of the mean contrast as a thing
    becomes smaller in the picture.

    Returns None if there are fewer, of one range, or none of them shows the vehicle.
    """
    apart = data.distance - data.distance.min(initial=math.inf)
    first = _first_guess(data, apart)
    if first is None:
        return None
    priors = np.array([_SKY_SHARE, _DETAIL_SHARE, _DRIFT])
    values = np.concatenate([data.slope, data.mean, np.zeros(priors.size)])
    state = np.array([first, 1.0, 0.0, 0.0, 0.0])
    covariance: Floats = np.eye(state.size)
    standardised: Floats = np.zeros(values.size)
    spread: Floats = np.ones(values.size)
    for _ in range(_STEPS):
        model, jacobian, spread = _predicted(state, apart, data, priors)
        standardised = (values - model) / spread
        # The last values are priors, and no outliers.
        weight = np.minimum(1.0, _HUBER / np.maximum(np.abs(standardised), 1e-9)) / spread**2
        weight[-priors.size :] = priors**-2
        covariance = inverse_of(matrix_product(jacobian.T, weight[:, None] * jacobian))
        step = matrix_product(covariance, matrix_product(jacobian.T, weight * (values - model)))
        state = state + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
        state[0], state[1] = min(max(state[0], -0.01), 1.0), min(max(state[1], 0.3), 3.0)
        if abs(float(step[0])) < 1e-7:
            break
    finite = np.isfinite(spread)
    misfit = float(np.mean(standardised[finite] ** 2))
    deviation = math.hypot(math.sqrt(max(misfit, 1.0) * float(covariance[0, 0])), _SIZE_SHARE / float(np.ptp(apart)))
    return _ContrastFit(float(state[0]), deviation, misfit)


def _first_guess(data: Regressions, apart: Floats) -> float | None:
    """Extinction by the logarithms of what stands out of the noise: mean contrasts to the sky, or else of detail."""
    contrast = 1.0 - np.stack([data.mean, data.near_mean])
    for fallen, deviation in (
        (contrast[0] / np.maximum(contrast[1], 1e-6), data.mean_deviation / np.maximum(contrast[1], 1e-6)),
        (data.slope, np.hypot(data.slope_deviation, _SLOPE_SHARE * data.slope)),
    ):
        seen = (fallen > 3.0 * deviation) & (contrast[1] > 0.0)
        if data.distance.size >= 3 and int(seen.sum()) >= 2 and float(np.ptp(apart[seen])) > 0.0:
            return max(-straight_line(apart[seen], np.log(fallen[seen]))[0], 1e-4)
    return None


def _predicted(state: Floats, apart: Floats, data: Regressions, priors: Floats) -> tuple[Floats, Floats, Floats]:
    """Values, their derivatives by k, B, e, f and g, and their standard deviations; the last rows are the priors."""
    extinction, level, excess, detail, drift = state
    shape = np.exp(-extinction * apart)
    t = level * shape
    smaller = np.log(data.distance / data.distance.min())
    known, kept = 1.0 + excess - data.near_mean, 1.0 + drift * smaller
    zero, seen = np.zeros_like(t), known * t * kept
    slopes = (1.0 + detail) * np.stack([-apart * t, shape, zero, t / (1.0 + detail), zero], axis=1)
    means = np.stack([apart * seen, -seen / level, 1.0 - t * kept, zero, -known * t * smaller], axis=1)
    # A range that is off by δ changes either by k δ; near pixels are of a range, too.
    by_range = (data.range_deviation * extinction) ** 2
    slope_spread = np.sqrt(data.slope_deviation**2 + (_SLOPE_SHARE**2 + by_range) * t**2)
    mean_spread = np.sqrt(data.mean_deviation**2 + _MEAN_SHARE**2 + (_MEAN_CONTRAST_SHARE**2 + by_range) * seen**2)
    values = np.concatenate([(1.0 + detail) * t, 1.0 + excess - seen, [excess, detail, drift]])
    jacobian = np.concatenate([slopes, means, np.eye(5)[2:]])
    return values, jacobian, np.concatenate([slope_spread, mean_spread, priors])
