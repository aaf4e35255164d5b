"""Koschmieder's law over the rows of a flat road, and whether a curve of luminance follows it."""

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.vision.lines.horizon import CannotTellError
from fogsim.vision.region.profile import RoadCurve
from fogsim.vision.region.road_image import MIN_CONTRAST, MIN_ROWS, SATURATED, RoadImage

Floats = NDArray[np.float64]

_BLOCKS = 10
"""Stretches of road, each in the same ratio of distances, whose residuals are taken to be independent."""

_PATTERNS = 24
"""Curves that are drawn again from one."""

_ALBEDO_DEVIATION = 0.03
"""Relative deviation of k by slow changes of a road's reflectance, which look like fog [-]."""

_ABSORBED = 1.3
"""By how much more a road's texture moves an estimate than its residuals say: the fit has taken some of it up [-]."""

SMALLEST = 0.05
"""Part of a row below the horizon that counts as its least [px]."""


class LawFit(NamedTuple):
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
    ends = [np.maximum(below_horizon + part, SMALLEST) for part in (-0.5, 0.0, 0.5)]
    top, middle, bottom = (np.exp(-optical / end) * (end > SMALLEST) for end in ends)
    return np.asarray((top + 4.0 * middle + bottom) / 6.0)


@kernel
def slants(curve: RoadCurve) -> Floats:
    """Length of the path to each row's road over the depth along the axis, 1 above the horizon [-]."""
    out = np.ones(curve.below_horizon.size)
    for i in range(out.size):
        if curve.below_horizon[i] > 0.0 and curve.distance[i] < np.inf:
            out[i] = curve.distance[i] * curve.below_horizon[i] / curve.row_distance
    return out


@kernel
def law_fit(curve: RoadCurve, extinction: float) -> LawFit:
    """Fit road and airlight of an extinction to a curve (`extinction` [1/m])."""
    below, weight, luminance, slant = curve.below_horizon, curve.weight, curve.luminance, slants(curve)
    shape, total = np.empty(below.size), max(weight.sum(), 1e-9)
    mean, mean_shape = 0.0, 0.0
    for i in range(below.size):
        shape[i] = row_transmittance(extinction * curve.row_distance * slant[i], below[i])
        mean_shape += weight[i] * shape[i] / total
        mean += weight[i] * luminance[i] / total
    square, both = 0.0, 0.0
    for i in range(below.size):
        centred = shape[i] - mean_shape
        square += weight[i] * centred * centred
        both += weight[i] * centred * luminance[i]
    drop = -both / max(square, 1e-12)
    airlight = mean + drop * mean_shape
    model, left = airlight - drop * shape, 0.0
    for i in range(below.size):
        left += weight[i] * (luminance[i] - model[i]) ** 2
    misfit = math.sqrt(left / total) / drop if drop > 0.0 else np.inf
    return LawFit(airlight, airlight - drop, model, misfit)


@kernel
def row_transmittance(optical: float, below: float) -> float:
    """`transmittance` of one row."""
    total = 0.0
    for j in range(3):
        end = below + 0.5 * (j - 1)
        if end > SMALLEST:
            total += (4.0 if j == 1 else 1.0) * math.exp(-optical / end)
    return total / 6.0


@kernel
def redrawn(curve: RoadCurve, model: Floats, signs: Floats) -> Floats:
    """Curves as the same fog over other road would make: a model, and its residuals with their signs changed at random.

    Residuals of neighbouring rows belong together, for patches of a road spread over several, so they change in blocks
    (wild block bootstrap: Shao 2010, J. Am. Stat. Assoc. 105, 218–235): of rows of equal ratios of distances, because
    patches farther away fill fewer rows.

    Returns luminance [linear grey levels]. Takes `model` (n,), `signs` of `block_signs`.
    """
    out = np.empty((model.size, signs.shape[1]))
    first = max(curve.below_horizon[0], 1.0)
    whole = max(math.log(max(curve.below_horizon[-1], 1.0) / first), 1e-9)
    for i in range(model.size):
        block = int(_BLOCKS * math.log(max(curve.below_horizon[i], 1.0) / first) / whole)
        residual = curve.luminance[i] - model[i] if curve.weight[i] > 0.0 else 0.0
        for m in range(out.shape[1]):
            out[i, m] = model[i] + residual * signs[min(block, _BLOCKS - 1), m]
    return out


@functools.cache
def block_signs() -> Floats:
    """(blocks, patterns); it is shared."""
    return np.random.default_rng(2015).choice([-1.0, 1.0], (_BLOCKS, _PATTERNS))


Read = Callable[[RoadCurve, Floats], Floats]
"""Extinctions (m,) [1/m], or NaN, that a method finds in m curves (n, m) over a curve's rows."""


def extinction_deviation(curve: RoadCurve, extinction: float, read: Read, horizon_deviation: float) -> float:
    """Standard deviation of what a method reads off a curve, by the road's texture, the noise, and the horizon.

    Returns [1/m]; infinite where curves like this one give nothing. Takes `extinction` [1/m], `horizon_deviation` [px].
    """
    found = read(curve, redrawn(curve, law_fit(curve, extinction).model, block_signs()))
    lower, higher = (moved(curve, side * horizon_deviation) for side in (1.0, -1.0))
    ends = [float(read(one, one.luminance[:, None])[0]) for one in (lower, higher)]
    return whole_deviation(extinction, found, ends[0], ends[1])


@kernel
def whole_deviation(extinction: float, found: Floats, lower: float, higher: float) -> float:
    """Deviation by what curves drawn again gave (m,), and the curve with its horizon lower and higher [1/m]."""
    by_road, by_horizon = _ABSORBED * spread(found, extinction), -1.0
    for end in (lower, higher):
        if np.isfinite(end):
            by_horizon = max(by_horizon, abs(end - extinction))
    by_horizon = by_horizon if by_horizon >= 0.0 else np.inf
    return math.sqrt(by_road**2 + by_horizon**2 + (_ALBEDO_DEVIATION * extinction) ** 2)


@kernel
def moved(curve: RoadCurve, shift: float) -> RoadCurve:
    """A curve whose horizon lies lower [px]."""
    below, slant, distance = curve.below_horizon - shift, slants(curve), np.full(curve.weight.size, np.inf)
    for i in range(below.size):
        if below[i] > 0.0:
            distance[i] = curve.row_distance * slant[i] / below[i]
    return RoadCurve(below, curve.luminance, distance, curve.weight, curve.row_distance)


@kernel
def spread(values: Floats, about: float) -> float:
    """Robust standard deviation of what curves drawn again gave about what the curve itself gave (`values` (n,))."""
    apart = np.sort(np.abs(values[np.isfinite(values)] - about))
    if apart.size < 2:
        return np.inf
    place = 0.9 * (apart.size - 1)
    below = min(int(place), apart.size - 2)
    upper = apart[below] + (place - below) * (apart[below + 1] - apart[below])
    middle = 0.5 * (apart[(apart.size - 1) // 2] + apart[apart.size // 2])
    return float(max(1.4826 * middle, 0.6 * upper))


_NEAR_HORIZON = 4.0
"""A region that ends this close below the horizon has seen the whole road [px]."""

_RISE = 0.5
"""Share of the contrast of road and airlight that a road in clear air does not brighten by [-]."""

_MAX_MISFIT = 0.12
"""What Koschmieder's law may leave of a curve, over the contrast of road and airlight [-]."""

_AIRLIGHT_OFF = 0.3
"""By how much the law's airlight may differ from the sky, over their contrast to the road [-]."""

_STRAIGHT = 0.018
"""Deviation from a straight line, over its rise, below which a curve is a painted ramp [-]; fog leaves 0.028."""

_AS_STRAIGHT = 1.05
"""Deviation from a straight line, over that from the law, up to which a curve may as well be a ramp [-]."""

_SURE_OF_FOG = 1.0
"""Least k in its standard deviations that is reported as fog [-]."""

_CLEAR = OPTICAL_DEPTH_AT_VISIBILITY / 300.0
"""Extinction that an estimate which may as well be none must surely be below to say "little fog" [1/m]."""


def seen_up_to(curve: RoadCurve) -> float:
    """Topmost row that is seen, below the horizon [px]."""
    seen = np.flatnonzero((curve.weight > 0.0) | (curve.luminance >= SATURATED))
    if seen.size < MIN_ROWS // 2:
        raise CannotTellError("no road is seen")
    top = float(curve.below_horizon[seen[0]])
    if top > _NEAR_HORIZON:
        raise CannotTellError("the road's region ends below the horizon, and no inflection lies in it")
    return top


def is_clear(curve: RoadCurve, road: RoadImage) -> bool:
    """Whether a road hardly brightens as far as it is seen."""
    seen = curve.luminance[(curve.weight > 0.0) & (curve.below_horizon >= 1.0)]
    return seen.size >= MIN_ROWS // 2 and bool(np.median(seen[:3]) <= road.road + _RISE * road.contrast)


def check_law(curve: RoadCurve, extinction: float, road: RoadImage) -> tuple[float, float]:
    """Airlight and luminance of the road that an extinction makes of a curve, if Koschmieder's law is what it follows.

    Returns A and R [linear grey levels] (float, float). Takes `extinction` [1/m].
    """
    fit = law_fit(curve, extinction)
    if fit.airlight - fit.road < max(MIN_CONTRAST, 0.05 * fit.airlight):
        raise CannotTellError("the road is nearly as bright as the airlight, or brighter")
    excess = fit.airlight - road.airlight
    bright = excess > _AIRLIGHT_OFF * road.contrast and road.airlight < SATURATED
    if fit.misfit > _MAX_MISFIT or excess < -_AIRLIGHT_OFF * road.contrast or bright:
        raise CannotTellError("the road fades into the airlight, but not as Koschmieder's law has it")
    if _is_even(curve, fit.model):
        raise CannotTellError("it brightens evenly from row to row, as no fog does")
    return fit.airlight, fit.road


@kernel
def _is_even(curve: RoadCurve, model: Floats) -> bool:
    """Whether a curve brightens upward along a straight line, about as well as it follows the law."""
    seen = (curve.weight > 0.0) & (curve.below_horizon > 0.0)
    if seen.sum() < MIN_ROWS:
        return False
    rows, light = curve.below_horizon[seen], curve.luminance[seen]
    apart, level = rows - rows.mean(), light.mean()
    slope = (apart * (light - level)).sum() / (apart * apart).sum()
    left = math.sqrt(((light - level - slope * apart) ** 2).mean())
    by_law = math.sqrt(((light - model[seen]) ** 2).mean())
    rise = abs(slope) * (rows.max() - rows.min())
    return bool(slope < 0.0 and left < max(_STRAIGHT * rise, _AS_STRAIGHT * by_law))


def fog_or_clear(extinction: float, deviation: float) -> tuple[float, float]:
    """Extinction and standard deviation [1/m], 0 where it may be clear air; CannotTellError if that may also be fog."""
    if extinction >= _SURE_OF_FOG * deviation:
        return extinction, deviation
    if extinction + _SURE_OF_FOG * deviation > _CLEAR:
        raise CannotTellError("the extinction is not observable: too little road is seen")
    return 0.0, math.hypot(extinction, deviation)


def detection_limit(top: float, horizon_deviation: float, row_distance: float) -> float:
    """Standard deviation of "no fog" where no inflection was seen: one needs a row on either side [1/m].

    Takes `top` [px], `horizon_deviation` [px], `row_distance` [px·m].
    """
    return 2.0 / row_distance * math.hypot(max(top, 1.0) + 1.0, horizon_deviation)
