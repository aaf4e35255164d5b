"""How Koschmieder's law looks over the rows of a flat road, and how far a curve of luminance is from it."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.vision.region.profile import RoadCurve, path_lengths

Floats = NDArray[np.float64]

_BLOCKS = 10
"""Stretches of road, each in the same ratio of distances, whose residuals are taken to be independent."""

_PATTERNS = 24
"""Curves that are drawn again from one."""

_ALBEDO_DEVIATION = 0.03
"""Relative deviation of k by slow changes of a road's reflectance, which look like fog [-]."""

_ABSORBED = 1.3
"""By how much more a road's texture moves an estimate than its residuals say: the fit has taken some of it up [-]."""

_SMALLEST = 0.05
"""Part of a row below the horizon that counts as its least [px]."""


@dataclass(frozen=True, slots=True)
class LawFit:
    """Road and airlight of an extinction, by least squares over a curve."""

    # airlight, road: A and R [linear grey levels]
    airlight: float
    road: float
    model: Floats  # (n,): The law at the curve's rows [linear grey levels]
    misfit: float  # Root of the mean square of what it leaves, over A − R [-]; infinite where R is not below A


def transmittance(optical: Floats | float, below_horizon: Floats) -> Floats:
    """Mean of e^(−K / (v − v_h)) over each row's height (Simpson's rule); 0 above the horizon.

    Takes `optical` [px], `below_horizon` [px].
    """
    ends = [np.maximum(below_horizon + part, _SMALLEST) for part in (-0.5, 0.0, 0.5)]
    top, middle, bottom = (np.exp(-optical / end) * (end > _SMALLEST) for end in ends)
    return np.asarray((top + 4.0 * middle + bottom) / 6.0)


def slants(curve: RoadCurve) -> Floats:
    """Length of the path to each row's road over the depth along the axis, 1 above the horizon [-]."""
    lies = (curve.below_horizon > 0.0) & np.isfinite(curve.distance)
    distance, below = np.where(lies, curve.distance, curve.row_distance), np.where(lies, curve.below_horizon, 1.0)
    return np.asarray(distance * below / curve.row_distance)


def law_fit(curve: RoadCurve, extinction: float) -> LawFit:
    """Fit road and airlight of an extinction to a curve (`extinction` [1/m])."""
    optical = extinction * curve.row_distance * slants(curve)
    shape, weight = transmittance(optical, curve.below_horizon), curve.weight
    total = max(float(weight.sum()), 1e-9)
    mean_shape = float(matrix_product(weight, shape)) / total
    mean = float(matrix_product(weight, curve.luminance)) / total
    centred = shape - mean_shape
    square = float(matrix_product(weight, centred**2))
    drop = -float(matrix_product(weight * centred, curve.luminance)) / max(square, 1e-12)
    airlight = mean + drop * mean_shape
    model = airlight - drop * shape
    left = math.sqrt(float(matrix_product(weight, (curve.luminance - model) ** 2)) / total)
    return LawFit(airlight, airlight - drop, model, left / drop if drop > 0.0 else math.inf)


def _redrawn(curve: RoadCurve, model: Floats) -> Floats:
    """Curves as the same fog over other road would make: a model, and its residuals with their signs changed at random.

    Residuals of neighbouring rows belong together, for patches of a road spread over several, so they change in blocks
    (wild block bootstrap: Shao 2010, J. Am. Stat. Assoc. 105, 218–235): of rows of equal ratios of distances, because
    patches farther away fill fewer rows.

    Returns luminance [linear grey levels]. Takes `model` (n,).
    """
    below = np.maximum(curve.below_horizon, 1.0)
    log = np.log(below / below[0]) if below[0] > 0.0 else np.zeros(below.size)
    block = np.minimum((_BLOCKS * log / max(float(log[-1]), 1e-9)).astype(np.int64), _BLOCKS - 1)
    residual = np.where(curve.weight > 0.0, curve.luminance - model, 0.0)
    return np.asarray(model[:, None] + residual[:, None] * _signs()[block])


def _signs() -> Floats:
    return np.random.default_rng(2015).choice([-1.0, 1.0], (_BLOCKS, _PATTERNS))


Read = Callable[[RoadCurve, Floats], Floats]
"""Extinctions (m,) [1/m], or NaN, that a method finds in m curves (n, m) over a curve's rows."""


def extinction_deviation(curve: RoadCurve, extinction: float, read: Read, horizon_deviation: float) -> float:
    """Standard deviation of what a method reads off a curve, by the road's texture, the noise, and the horizon.

    Returns [1/m]; infinite where curves like this one give nothing. Takes `extinction` [1/m], `horizon_deviation` [px].
    """
    by_road = _ABSORBED * spread(read(curve, _redrawn(curve, law_fit(curve, extinction).model)), extinction)
    moved = [_read_below(curve, side * horizon_deviation, read) for side in (1.0, -1.0)]
    by_horizon = max((abs(k - extinction) for k in moved if math.isfinite(k)), default=math.inf)
    return math.hypot(by_road, by_horizon, _ALBEDO_DEVIATION * extinction)


def _read_below(curve: RoadCurve, shift: float, read: Read) -> float:
    below = curve.below_horizon - shift
    distance = path_lengths(below, curve.row_distance, slants(curve))
    moved = replace(curve, below_horizon=below, distance=distance)
    return float(read(moved, curve.luminance[:, None])[0])


def spread(values: Floats, about: float) -> float:
    """Robust standard deviation of what curves drawn again gave about what the curve itself gave (`values` (n,))."""
    apart = np.abs(values[np.isfinite(values)] - about)
    if apart.size < 2:
        return math.inf
    return float(max(1.4826 * np.median(apart), 0.6 * np.quantile(apart, 0.9)))
