"""negru2013's inflection between rows: level and slope by regression, the candidate whose model fits the curve best."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.vision.region.inflection import Parameters, inflection_parameters
from fogsim.vision.region.law import slants, transmittance
from fogsim.vision.region.profile import RoadCurve

Floats = NDArray[np.float64]

_CANDIDATES, _HIGHEST = 120, 0.7
"""Candidates between rows, evenly in ln(v − v_h), and the first of them below the horizon [px]."""

_ABOUT = 3.5
"""Ratio of v − v_h, either way, to the candidate's, of the rows that its level and slope are taken from [-]."""

_FEWEST_ROWS = 4.0
"""Rows that a level and a slope need at least."""


def subpixel_inflections(
    curve: RoadCurve, luminance: Floats, parameters: Parameters = inflection_parameters
) -> tuple[Floats, Floats]:
    """Inflections of some curves to a fraction of a row.

    As negru2013 section IV.B.c, but for candidates between rows as well: for each of them level and slope are those of
    least squares of Koschmieder's law over the rows about it, R and A follow by eqs. 17 and 18, and the candidate whose
    model leaves the least of the whole curve is the inflection.

    Returns v_i − v_h [px], and the mean square that the model leaves [squares of grey levels]; NaN where there is none
    (m,). Takes `luminance` (n, m) [linear grey levels].
    """
    below, weight = curve.below_horizon, curve.weight
    at = np.geomspace(_HIGHEST, max(float(below[-1]), 2.0 * _HIGHEST), _CANDIDATES)
    shape = transmittance(2.0 * at[:, None] * slants(curve), below)
    about = weight * (below <= _ABOUT * at[:, None] + 1.0) * (below >= at[:, None] / _ABOUT - 1.0)
    count, by_shape, by_square = about.sum(axis=1), (about * shape).sum(axis=1), (about * shape**2).sum(axis=1)
    light, both = matrix_product(about, luminance), matrix_product(about * shape, luminance)
    turn = (count * by_square - by_shape**2)[:, None]
    rise = (count[:, None] * both - by_shape[:, None] * light) / np.maximum(turn, 1e-12)
    start = (light - by_shape[:, None] * rise) / np.maximum(count[:, None], 1.0)
    # At the inflection itself kd = 2: the level is A + (R − A) e⁻², the slope (R − A) e⁻² 2 / (v_i − v_h).
    part = math.exp(-2.0) * rise
    _, road, airlight = parameters(at[:, None], start + part, 2.0 * part / at[:, None], curve.row_distance)
    drop = airlight - road
    squares = (weight[:, None] * luminance**2).sum(axis=0)
    total, shapes, shape_squares = weight.sum(), matrix_product(shape, weight), matrix_product(shape**2, weight)
    all_light, all_both = (weight[:, None] * luminance).sum(axis=0), matrix_product(shape * weight, luminance)
    error = squares - 2.0 * airlight * all_light + 2.0 * drop * all_both
    error += airlight**2 * total - 2.0 * airlight * drop * shapes[:, None] + drop**2 * shape_squares[:, None]
    sure = (count >= _FEWEST_ROWS) & (turn[:, 0] > 1e-9) & (at <= below[-1] / 1.2)
    error = np.where(sure[:, None] & (drop > 0.0), error, np.inf)
    return _least(at, error, float(total))


def _least(at: Floats, error: Floats, total: float) -> tuple[Floats, Floats]:
    """Places of the least errors, by a parabola through three candidates."""
    best = np.argmin(error, axis=0)
    inner, column = np.clip(best, 1, at.size - 2), np.arange(error.shape[1])
    before, here, behind = (error[inner + side, column] for side in (-1, 0, 1))
    known = np.isfinite(before) & np.isfinite(here) & np.isfinite(behind) & (inner == best)
    before, here, behind = (np.where(known, one, 0.0) for one in (before, here, behind))
    bend = before - 2.0 * here + behind
    offset = np.where(bend > 0.0, 0.5 * (before - behind) / np.where(bend > 0.0, bend, 1.0), 0.0)
    least = error[best, column]
    found = np.isfinite(least)
    place = at[best] * (at[1] / at[0]) ** np.clip(offset, -0.5, 0.5)
    return np.where(found, place, math.nan), np.where(found, np.maximum(least, 0.0) / max(total, 1.0), math.nan)
