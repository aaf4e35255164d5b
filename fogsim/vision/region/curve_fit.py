"""Least squares of Koschmieder's law over the whole luminance curve of a road."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.linear_algebra import inverse_of, matrix_product
from fogsim.vision.region.inflection import FogModel, koschmieder
from fogsim.vision.region.profile import RoadCurve

Floats = NDArray[np.float64]

MIN_INFLECTION = 0.1
"""Smallest k λ that is looked for, twice the rows of the inflection below the horizon [px]."""

FIRST_COUNT = 40  # extinctions in the first search, evenly spaced in ln k

HUBER = 2.0
"""Residuals beyond this many standard deviations count linearly, not squared [-]."""


@dataclass(frozen=True, slots=True)
class _Line:
    """Luminance as a line in transmission, A + B t, by weighted least squares for each of several k."""

    airlight: Floats
    drop: Floats
    error: Floats


def _line(extinctions: Floats, curve: RoadCurve, weight: Floats) -> _Line:
    transmission = np.exp(-extinctions[:, None] * curve.distance)
    share = weight / weight.sum()
    mean_t, mean_y = matrix_product(transmission, share), float(matrix_product(curve.luminance, share))
    centred = curve.luminance - mean_y
    spread = np.maximum(matrix_product(transmission**2, share) - mean_t**2, 1e-12)
    covariance = matrix_product(transmission, share * centred)
    drop = covariance / spread
    error = float(matrix_product(centred**2, share)) - covariance * drop
    return _Line(airlight=mean_y - drop * mean_t, drop=drop, error=error)


def _minimum(curve: RoadCurve, weight: Floats, low: float, high: float, count: int) -> float | None:
    """Extinction of least error between two bounds, or None if the error still falls at one of them."""
    grid = np.linspace(math.log(low), math.log(high), count)
    best = int(np.argmin(_line(np.exp(grid), curve, weight).error))
    if best in {0, count - 1}:
        return None
    centre, step = float(grid[best]), float(grid[1] - grid[0])
    for _ in range(5):
        grid = np.linspace(centre - step, centre + step, 7)
        centre = float(grid[int(np.argmin(_line(np.exp(grid), curve, weight).error))])
        step *= 0.3
    return math.exp(centre)


def fit_curve(curve: RoadCurve) -> FogModel | None:
    """Fit k, R and A to the whole curve.

    A correction of negru2013, which reads k off one row: a row is 7 % of V at 100 m and 30 % at 400 m with λ = 900
    px·m, and the steepest row of a noisy curve is easily the wrong one. R and A follow from k by linear least squares,
    so only k is searched, over all inflections that the curve's rows could show; gross residuals (marks, vehicles) are
    weighted down (Huber). The covariance counts neighbouring residuals as one where they agree, as road texture does.

    Parameters
    ----------
    curve : RoadCurve
        Luminance of the road by row.

    Returns
    -------
    FogModel or None
        None if no inflection within the curve's rows fits best.
    """
    weight = curve.weight
    low, high = MIN_INFLECTION / curve.row_distance, 2.0 * float(curve.below_horizon[-1]) / curve.row_distance
    count = FIRST_COUNT
    for _ in range(3):
        found = _minimum(curve, weight, low, high, count)
        if found is None:
            return None
        extinction, low, high, count = found, 0.7 * found, 1.4 * found, 9
        line = _line(np.array([extinction]), curve, weight)
        airlight, drop = float(line.airlight[0]), float(line.drop[0])
        residual = curve.luminance - koschmieder(extinction, airlight + drop, airlight, curve.distance)
        weight = curve.weight * _huber_weight(residual, curve.weight)
    return _model(curve, weight, residual, extinction, airlight, drop)


def _huber_weight(residual: Floats, counted: Floats) -> Floats:
    scale = 1.4826 * float(np.median(np.abs(residual[counted > 0])))
    return np.minimum(1.0, HUBER * scale / np.maximum(np.abs(residual), 1e-9)) if scale > 0 else np.ones_like(residual)


def _model(
    curve: RoadCurve, weight: Floats, residual: Floats, extinction: float, airlight: float, drop: float
) -> FogModel:
    below = np.maximum(curve.below_horizon, 1e-9)
    distance = np.where(np.isfinite(curve.distance), curve.distance, 0.0)
    transmission = np.where(np.isfinite(curve.distance), np.exp(-extinction * curve.distance), 0.0)
    by_k = -drop * distance * transmission
    by_horizon = extinction * by_k / below
    jacobian = np.stack([by_k, transmission, np.ones_like(transmission)], axis=1)
    inverse = inverse_of(matrix_product(jacobian.T, weight[:, None] * jacobian))
    mean_square = float(matrix_product(weight, residual**2)) / max(float(weight.sum()) - 3.0, 1.0)
    inflation = _correlation_inflation(residual[curve.weight > 0])
    gain = matrix_product(inverse, matrix_product(jacobian.T, weight * by_horizon))
    return FogModel(
        extinction=extinction,
        road=airlight + drop,
        airlight=airlight,
        standard_deviation=math.sqrt(max(mean_square * inflation * float(inverse[0, 0]), 0.0)),
        horizon_sensitivity=-float(gain[0]),
        residual=math.sqrt(mean_square),
    )


def _correlation_inflation(residual: Floats) -> float:
    """Variance of a mean of residuals over that of independent ones, from their lag-one correlation."""
    power = float(matrix_product(residual, residual))
    if power <= 0 or residual.size < 4:
        return 1.0
    correlation = min(max(float(matrix_product(residual[1:], residual[:-1])) / power, 0.0), 0.95)
    return (1.0 + correlation) / (1.0 - correlation)
