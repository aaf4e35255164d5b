"""Whether a curve of luminance over a road's rows is one of fog, of clear air, or of neither."""

import math

import numpy as np

from fogsim.core.linear_algebra import straight_line
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.vision.region.law import law_fit
from fogsim.vision.region.profile import RoadCurve
from fogsim.vision.region.road_image import MIN_CONTRAST, MIN_ROWS, SATURATED, CannotTellError, RoadImage

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
    seen = (curve.weight > 0.0) & (curve.below_horizon > 0.0)
    if int(seen.sum()) >= MIN_ROWS:
        rows, light = curve.below_horizon[seen], curve.luminance[seen]
        slope, start = straight_line(rows, light)
        rise = abs(slope) * float(np.ptp(rows))
        left = float(np.sqrt(np.mean((light - start - slope * rows) ** 2)))
        by_law = float(np.sqrt(np.mean((light - fit.model[seen]) ** 2)))
        if slope < 0.0 and left < max(_STRAIGHT * rise, _AS_STRAIGHT * by_law):
            raise CannotTellError("it brightens evenly from row to row, as no fog does")
    return fit.airlight, fit.road


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
