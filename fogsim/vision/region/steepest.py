"""The row at which a road's luminance changes most, to a fraction of a row: zhu2015's and huang2015's inflection."""

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.region.law import slants, transmittance
from fogsim.vision.region.profile import RoadCurve

Floats = NDArray[np.float64]

_LEAST_REACH = 1.5
"""Rows to either side over which a slope is taken at least [px]."""

_PLACES, _HIGHEST = 96, 0.6
"""Places at which the slope is looked at, evenly in ln(v − v_h), and the first of them below the horizon [px]."""

_SEEN = 0.7
"""Share of the rows of a window that must be seen [-]."""

_PEAK = 0.85
"""Share of the steepest slope from which on places count for that of the peak [-]."""

_NEAREST_OF_RISE, _FARTHEST_OF_RISE = 1.2, 0.2
"""Rows between which the steepest is sought, over the row about which the luminance changes most in ln(v − v_h), which
by Koschmieder's law is twice the inflection's [-]."""

_STEPS = 4
"""How often the law's own steepest row is compared with the one that is seen."""


def places(curve: RoadCurve) -> Floats:
    """Heights below the horizon at which slopes are looked at.

    Returns v − v_h, ascending [px].
    """
    return np.asarray(np.geomspace(_HIGHEST, max(float(curve.below_horizon[-1]), 2.0 * _HIGHEST), _PLACES))


def slopes(curve: RoadCurve, luminance: Floats, reach: float) -> Floats:
    """Brightening upward about `places`, the slope of least squares over rows in proportion to their height.

    In the logarithm of v − v_h all fogs have one curve, shifted; a window in proportion to v − v_h keeps that.

    Returns slopes, positive where it brightens upward [linear grey levels per px]; −inf where too little is seen. Takes
    `luminance` (n, m).
    """
    at, rows = places(curve), curve.below_horizon[:, None]
    half = np.maximum(reach * at, _LEAST_REACH)
    weight = curve.weight[:, None]
    columns = np.concatenate(
        (weight, weight * rows, weight * rows**2, weight * luminance, weight * rows * luminance), axis=1
    )
    sums = np.concatenate((np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)))
    within = _sums_up_to(sums, at + half - rows[0, 0] + 0.5) - _sums_up_to(sums, at - half - rows[0, 0] + 0.5)
    count, by_row, by_square = within[:, :1], within[:, 1:2], within[:, 2:3]
    by_light, by_both = np.split(within[:, 3:], 2, axis=1)
    spread = count * by_square - by_row**2
    seen = (count[:, 0] >= _SEEN * 2.0 * half) & (at + half <= rows[-1, 0] + 0.5)
    slope = -(count * by_both - by_row * by_light) / np.maximum(spread, 1e-9)
    return np.asarray(np.where(seen[:, None], slope, -np.inf))


def _sums_up_to(sums: Floats, place: Floats) -> Floats:
    """Sums up to places between rows; a part of the row after each place counts."""
    place = np.clip(place, 0.0, len(sums) - 1.0)
    row = np.minimum(place.astype(np.int64), len(sums) - 2)
    part = (place - row)[:, None]
    return np.asarray(sums[row] * (1.0 - part) + sums[row + 1] * part)


def steepest_rows(curve: RoadCurve, luminance: Floats, reach: float) -> Floats:
    """Steepest row of each of some curves, by a parabola over the logarithm of v − v_h about the peak.

    Returns v − v_h [px]; NaN where it never brightens upward (m,).
    """
    at = places(curve)
    slope = slopes(curve, luminance, reach)
    # A step of noise near the horizon may be steeper than dense fog, but is no large one.
    rise = at[np.argmax(slope * at[:, None], axis=0)]
    near = (at[:, None] <= _NEAREST_OF_RISE * rise) & (at[:, None] >= _FARTHEST_OF_RISE * rise)
    return _peaks(at, np.ascontiguousarray(np.where(near, slope, -np.inf)))


@kernel
def _peaks(at: NDArray[np.float64], slope: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places of the greatest slopes: `at` (p,) even in its logarithm, `slope` (p, m); NaN where none is positive."""
    count, step = at.size, np.log(at[1] / at[0])
    out = np.full(slope.shape[1], np.nan)
    for column in range(slope.shape[1]):
        best = 0
        for place in range(1, count):
            if slope[place, column] > slope[best, column]:
                best = place
        most = slope[best, column]
        if not most > 0.0:
            continue
        first, last = best, best
        while first > 0 and slope[first - 1, column] >= _PEAK * most:
            first -= 1
        while last + 1 < count and slope[last + 1, column] >= _PEAK * most:
            last += 1
        middle, reach = 0.5 * (first + last), 0.5 * (last - first)
        # A parabola of least squares: x and x² − mean are independent over places evenly about the middle.
        tilt, bend, squares, fourths = 0.0, 0.0, 0.0, 0.0
        mean = reach * (reach + 1.0) / 3.0
        for place in range(first, last + 1):
            x = place - middle
            curved = x * x - mean
            tilt += x * slope[place, column]
            bend += curved * slope[place, column]
            squares += x * x
            fourths += curved * curved
        offset = best - middle
        if last - first >= 2 and bend < 0.0:
            offset = min(max(-0.5 * (tilt / squares) / (bend / fourths), -reach), reach)
        out[column] = at[0] * np.exp(step * (middle + offset))
    return out


def highest_place(curve: RoadCurve, reach: float) -> float:
    """Place nearest to the horizon about which enough rows are seen for a slope [px below it]; infinite without any."""
    seen = np.isfinite(slopes(curve, curve.luminance[:, None], reach)[:, 0])
    return float(places(curve)[seen][0]) if seen.any() else np.inf


def fog_of_steepest_rows(curve: RoadCurve, luminance: Floats, reach: float) -> Floats:
    """Extinctions whose laws are steepest, over the same rows and windows, where some curves are.

    At the inflection itself that is k = 2 (v_i − v_h) / λ (zhu2015 eq. 21); a window of some width, and rows of one,
    shift the steepest row by a share of v − v_h that follows from the law itself.

    Returns k [1/m]; NaN where a curve never brightens upward (m,).
    """
    seen = steepest_rows(curve, luminance, reach)
    optical = 2.0 * seen
    for _ in range(_STEPS):
        law = -transmittance(optical * slants(curve)[:, None], curve.below_horizon[:, None])
        optical = optical * np.clip(seen / steepest_rows(curve, law, reach), 0.5, 2.0)
    return np.asarray(optical / curve.row_distance)
