"""Koschmieder's law on a flat road seen by a camera: its inflection point and what follows from it."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
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


def printed_parameters(
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
    return best_inflection(curve, printed_parameters)


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
