"""Koschmieder's law on a flat road seen by a camera: its inflection point and what follows from it."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.exponential import exponential
from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import matrix_product
from fogsim.vision.region.law import SMALLEST, law_fit, moved, redrawn, slants, whole_deviation
from fogsim.vision.region.profile import RoadCurve, decreasing

Floats = NDArray[np.float64]
Parameters = Callable[[Floats, Floats, Floats, float], tuple[Floats, Floats, Floats]]


@dataclass(frozen=True, slots=True)
class FogModel:
    """The parameters of Koschmieder's law."""

    extinction: float  # Extinction coefficient k [1/m]
    road: float  # Luminance R of the road without fog [linear grey levels]
    airlight: float  # Luminance A of an infinite path through the fog [linear grey levels]
    standard_deviation: float  # Standard deviation of k [1/m], the horizon taken as known
    horizon_sensitivity: float  # dk/dv_h, the change of k where the horizon is one row lower [1/(m·px)]
    residual: float  # Root of the mean square of what the model leaves of the curve [linear grey levels]


def koschmieder(extinction: Floats | float, road: Floats | float, airlight: Floats | float, distance: Floats) -> Floats:
    """Luminance of a surface seen through fog, L = R e^(−kd) + A (1 − e^(−kd)) (negru2013 eq. 4).

    Takes `extinction`, `road`, `airlight` [1/m], `distance` [m].
    """
    transmission: Floats = np.exp(-extinction * distance)
    return airlight + (road - airlight) * transmission


def steepest_slope(below_horizon: Floats, airlight: float) -> Floats:
    """Steepest change from row to row that fog of any density can make of a road.

    |dI/dv| = (kλ / (v − v_h)²) (A − R) e^(−kλ/(v − v_h)) (negru2013 eq. 13) is greatest over k where kλ = v − v_h: (A −
    R) / (e (v − v_h)), and R is not negative.

    Returns greatest |dI/dv| [that unit per px]; one row nearer to the horizon than asked, for smoothing spreads it, and
    from there up as it is there. Takes `below_horizon` [px].
    """
    return np.asarray(airlight / (math.e * np.maximum(below_horizon - 1.0, 0.5)))


def inflection_parameters(
    below_horizon: Floats, luminance: Floats, gradient: Floats, row_distance: float
) -> tuple[Floats, Floats, Floats]:
    """Fog from the row at which the luminance of the road inflects.

    negru2013 eqs. 15, 17 and 18 with the signs set right: for rows that count downward dI/dv is negative in fog over a
    dark road, and with X = (v_i − v_h)/2 · dI/dv the equations hold as A = I_i − X and R = I_i + (e² − 1) X. (As
    printed they give A = 162 where the truth is 200.)

    Returns extinction k = 2 (v_i − v_h) / λ [1/m], luminance R of the road, airlight A. Takes `below_horizon` [px],
    `gradient` [1/px], `row_distance` [px·m].
    """
    change = 0.5 * below_horizon * gradient
    return 2.0 * below_horizon / row_distance, luminance + (math.e**2 - 1.0) * change, luminance - change


def _printed_parameters(
    below_horizon: Floats, luminance: Floats, gradient: Floats, row_distance: float
) -> tuple[Floats, Floats, Floats]:
    """Fog from the row of the inflection with negru2013's eqs. 17 and 18 as printed, whose signs are wrong.

    R = I_i − (1 − e²) e² (v_i − v_h)/2 · dI/dv and A = I_i + (v_i − v_h)/2 · dI/dv, for rows that count downward. Only
    for comparison with the paper: see `inflection_parameters`.

    Returns k [1/m], R, A.
    """
    change = 0.5 * below_horizon * gradient
    square = math.e**2
    return 2.0 * below_horizon / row_distance, luminance - (1.0 - square) * square * change, luminance + change


def printed_inflection(curve: RoadCurve) -> FogModel | None:
    """As `best_inflection`, with the equations as the paper prints them."""
    return best_inflection(curve, _printed_parameters)


def best_inflection(curve: RoadCurve, parameters: Parameters = inflection_parameters) -> FogModel | None:
    """Row of steepest change whose model fits the curve best (negru2013 section IV.B.c).

    Candidates are the local maxima of |dI/dv| of the monotone curve below the horizon. The standard deviation is that
    of a row known to within the rows where the slope exceeds 90 % of its peak ("measurement bandwidth", Hautière 2006).

    Returns None if the curve has no slope with a row on either side.
    """
    smooth = decreasing(curve.luminance)
    slope = -np.gradient(smooth)
    peaks = _local_maxima(slope) & (curve.below_horizon > 0)
    rows = np.flatnonzero(peaks)
    if rows.size == 0:
        return None
    k, road, airlight = parameters(curve.below_horizon[rows], smooth[rows], -slope[rows], curve.row_distance)
    model = koschmieder(k[:, None], road[:, None], airlight[:, None], curve.distance)
    errors = matrix_product((model - curve.luminance) ** 2, curve.weight)
    best = int(np.argmin(errors))
    half_width = 0.5 * _bandwidth(slope, int(rows[best]))
    per_row = 2.0 / curve.row_distance
    return FogModel(
        extinction=float(k[best]),
        road=float(road[best]),
        airlight=float(airlight[best]),
        standard_deviation=per_row * half_width,
        horizon_sensitivity=-per_row,
        residual=math.sqrt(float(errors[best]) / max(float(curve.weight.sum()), 1.0)),
    )


def _local_maxima(slope: Floats) -> NDArray[np.bool_]:
    inner = (slope[1:-1] >= slope[:-2]) & (slope[1:-1] > slope[2:]) & (slope[1:-1] > 0)
    return np.concatenate([[False], inner, [False]])


def _bandwidth(slope: Floats, row: int) -> int:
    """Count the neighbouring rows whose slope is within 90 % of that of a given row."""
    steep = slope >= 0.9 * slope[row]
    first, last = row, row
    while first > 0 and steep[first - 1]:
        first -= 1
    while last + 1 < slope.size and steep[last + 1]:
        last += 1
    return last - first + 1


_CANDIDATES, _HIGHEST = 120, 0.7
"""Candidates between rows, evenly in ln(v − v_h), and the first of them below the horizon [px]."""

_ABOUT = 3.5
"""Ratio of v − v_h, either way, to the candidate's, of the rows that its level and slope are taken from [-]."""

_FEWEST_ROWS = 4.0
"""Rows that a level and a slope need at least."""


@kernel
def inflection_with_deviation(
    curve: RoadCurve, signs: Floats, horizon_deviation: float, printed: bool
) -> tuple[float, float, float]:
    """Extinction of a curve's inflection to a fraction of a row, its deviation [1/m], and the mean square that is left.

    0 where there is none. Takes `signs` of `block_signs`, `horizon_deviation` [px].
    """
    own, shapes = curve.luminance.copy().reshape(-1, 1), candidate_shapes(curve)
    rows, square = subpixel_inflections(curve, shapes, own, printed)
    per_row = 2.0 / curve.row_distance
    k = per_row * rows[0]
    if not k > 0.0:
        return 0.0, np.inf, 0.0
    found = per_row * subpixel_inflections(curve, shapes, redrawn(curve, law_fit(curve, k).model, signs), printed)[0]
    ends = np.empty(2)
    for side in range(2):
        other = moved(curve, horizon_deviation if side == 0 else -horizon_deviation)
        ends[side] = per_row * subpixel_inflections(other, candidate_shapes(other), own, printed)[0][0]
    return k, whole_deviation(k, found, ends[0], ends[1]), square[0]


@kernel
def _candidates(curve: RoadCurve) -> Floats:
    """Rows below the horizon at which an inflection is looked for [px] (n,)."""
    step = math.log(max(curve.below_horizon[-1], 2.0 * _HIGHEST) / _HIGHEST) / (_CANDIDATES - 1)
    at: Floats = _HIGHEST * np.exp(step * np.arange(_CANDIDATES))
    return at


@kernel
def candidate_shapes(curve: RoadCurve) -> Floats:
    """Share of the road's light that reaches the camera, by candidate and row in use (n, m) [-]."""
    at, used = _candidates(curve), np.flatnonzero(curve.weight > 0.0)
    rates, shapes = _rates(curve.below_horizon[used], slants(curve)[used]), np.empty((at.size, used.size))
    for candidate in range(at.size):
        if at[candidate] <= curve.below_horizon[-1] / 1.2:
            for i in range(used.size):
                ends = exponential(at[candidate] * rates[0, i]) + exponential(at[candidate] * rates[2, i])
                shapes[candidate, i] = (ends + 4.0 * exponential(at[candidate] * rates[1, i])) / 6.0
    return shapes


@kernel
def subpixel_inflections(curve: RoadCurve, shapes: Floats, luminance: Floats, printed: bool) -> tuple[Floats, Floats]:
    """Inflections of some curves to a fraction of a row.

    As negru2013 section IV.B.c, but for candidates between rows as well: for each of them level and slope are those of
    least squares of Koschmieder's law over the rows about it, R and A follow by eqs. 17 and 18 (`printed`: as printed),
    and the candidate whose model leaves the least of the whole curve is the inflection.

    Returns v_i − v_h [px], and the mean square that the model leaves [squares of grey levels]; NaN where there is none
    (m,). Takes `shapes` of `candidate_shapes`, `luminance` (n, m) [linear grey levels].
    """
    below, weight = curve.below_horizon, curve.weight
    at, error = _candidates(curve), np.full((_CANDIDATES, luminance.shape[1]), np.inf)
    used = np.flatnonzero(weight > 0.0)
    rows, weights, light = below[used], weight[used], luminance[used]
    sums = np.zeros((2, luminance.shape[1]))
    for i in range(used.size):
        for m in range(sums.shape[1]):
            sums[0, m] += weights[i] * light[i, m]
            sums[1, m] += weights[i] * light[i, m] ** 2
    for candidate in range(_CANDIDATES):
        if at[candidate] <= below[-1] / 1.2:
            _add_errors(rows, weights, shapes[candidate], light, sums, at[candidate], printed, error[candidate])
    return _least(at, error, weight.sum())


@kernel
def _rates(below: Floats, slant: Floats) -> Floats:
    """Change of the optical depth of each row's top, middle and bottom with the inflection's row [1/px] (3, n)."""
    rates = np.empty((3, below.size))
    for i in range(below.size):
        for j in range(3):
            end = below[i] + 0.5 * (j - 1)
            rates[j, i] = -2.0 * slant[i] / end if end > SMALLEST else -np.inf
    return rates


@kernel
def _add_errors(
    below: Floats,
    weight: Floats,
    shape: Floats,
    luminance: Floats,
    sums: Floats,
    at: float,
    printed: bool,
    error: Floats,
) -> None:
    """What the models of one candidate leave of each curve; infinite where they cannot be fog's."""
    curves = luminance.shape[1]
    near, both = np.zeros((2, curves)), np.zeros(curves)
    count, by_shape, by_square, total, shapes, shape_squares = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(below.size):
        by_weight = shape[i] * weight[i]
        total, shapes, shape_squares = total + weight[i], shapes + by_weight, shape_squares + shape[i] * by_weight
        for m in range(curves):
            both[m] += by_weight * luminance[i, m]
        if at / _ABOUT - 1.0 <= below[i] <= _ABOUT * at + 1.0:
            count, by_shape, by_square = count + weight[i], by_shape + by_weight, by_square + shape[i] * by_weight
            for m in range(curves):
                near[0, m] += weight[i] * luminance[i, m]
                near[1, m] += by_weight * luminance[i, m]
    turn = count * by_square - by_shape**2
    for m in range(curves):
        rise = (count * near[1, m] - by_shape * near[0, m]) / max(turn, 1e-12)
        start = (near[0, m] - by_shape * rise) / max(count, 1.0)
        # At the inflection itself kd = 2: the level is A + (R − A) e⁻², the slope (R − A) e⁻² 2 / (v_i − v_h).
        part = math.exp(-2.0) * rise
        road, airlight = _road_and_airlight(start + part, part, printed)
        drop = airlight - road
        left = sums[1, m] - 2.0 * airlight * sums[0, m] + 2.0 * drop * both[m]
        left += airlight**2 * total - 2.0 * airlight * drop * shapes + drop**2 * shape_squares
        error[m] = left if count >= _FEWEST_ROWS and turn > 1e-9 and drop > 0.0 else np.inf


@kernel
def _road_and_airlight(level: float, change: float, printed: bool) -> tuple[float, float]:
    """R and A of `inflection_parameters`, or of `_printed_parameters`, for a change X."""
    square = math.e**2
    if printed:
        return level - (1.0 - square) * square * change, level + change
    return level + (square - 1.0) * change, level - change


@kernel
def _least(at: Floats, error: Floats, total: float) -> tuple[Floats, Floats]:
    """Places of the least errors, by a parabola through three candidates."""
    place, square = np.full(error.shape[1], np.nan), np.full(error.shape[1], np.nan)
    for m in range(error.shape[1]):
        best, offset = int(np.argmin(error[:, m])), 0.0
        if not np.isfinite(error[best, m]):
            continue
        if 0 < best < at.size - 1:
            before, here, behind = error[best - 1, m], error[best, m], error[best + 1, m]
            bend = before - 2.0 * here + behind
            if np.isfinite(before) and np.isfinite(behind) and bend > 0.0:
                offset = 0.5 * (before - behind) / bend
        place[m] = at[best] * (at[1] / at[0]) ** min(max(offset, -0.5), 0.5)
        square[m] = max(error[best, m], 0.0) / max(total, 1.0)
    return place, square
