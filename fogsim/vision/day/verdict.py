"""What the day model says of an image, and when it is to be believed."""

import math
from dataclasses import dataclass

from fogsim.units import extinction_from_visibility
from fogsim.values.estimate import NORMAL_90_PERCENT
from fogsim.vision.day.day_fit import DayFit
from fogsim.vision.day.hypotheses import LIGHTS

_FOG, _LEAST_FOG, CLEAR = 2000.0, 0.95, 1000.0
"""Visibility below which there is fog [m], least probability of that for an answer with two ends [-], and least lower
end of an answer with one [m]."""

_SLACK = 1.15
"""Ratio of ends up to which intervals that have nothing in common do not contradict one another [-]."""

WIDEST = 4.0
"""Most ratio of the ends of an answer [-]."""

_A_ROAD, _LIKELY_A_ROAD, _SURELY_A_ROAD = math.log(10.0), 10.0, 20.0
"""Logarithms of the evidence of a road over that of none from which on there is one, it is believed where another
method has no answer, and against another one's [-]."""

_EVEN_SURFACES, _USUAL_SURFACES, _LEAST_USUAL, _LEAST_SKY = 2, 3, 0.8, 0.5
"""How many of the surfaces, from the first on, are even roads, and roads that nothing hides or shades; least
probability of those, and of a sky that is the airlight's, for a posterior to be believed [-]."""

_CLIPPING = 0.4
"""Probability that the airlight is not even, where a clipped sky does not show it [-]."""

_DENSEST = 13.5
"""Least lower end of an interval that is believed [m]: what is no road at all looks like denser fog."""

_HARDLY_STATED = 0.03
"""Probability of the stated response below which the camera has another one [-]."""

_LEAST_CONTRAST = 0.08
"""Least contrast of far road to near road over the sky for fog to show [-]."""

_DARK = 6.0 / 255.0
"""Light of the brightest rows below which it is no day, over full scale [-]."""

_MOSTLY_CLIPPED = 0.5
"""Share of the sky's bins beyond which clipping is a reason [-]."""

DISAGREE = "how the road fades and how its image brightens disagree"


@dataclass(frozen=True, slots=True)
class DayVerdict:
    """An answer of the day model."""

    # extinction, deviation: k and half the width of its 90 % interval over 1.645 [1/m]
    extinction: float
    deviation: float
    median: float  # Of the posterior of k [1/m]
    interval: tuple[float, float]  # (float, float): Ends of the visibility [m]
    reason: str  # Why it is no answer; empty if it is
    shows_fog: bool  # Whether there surely is fog on a road, however dense
    is_sure: bool  # Whether it counts against another method: a road under a sky, neither hidden nor in shade
    is_even: bool  # Whether the road is surely one, as even as roads mostly are, and the response may be the stated one
    # Probability that the image shows what the joint fit does not know, a wet road, local tone mapping or clipped
    # airlight that is not even; 0 where the road is not sure [-]
    outside: float
    # doubt, response_deviation: see `DayFit`
    doubt: float
    response_deviation: float
    is_road: bool = True  # Whether a road is likelier than none

    @property
    def is_clear(self) -> bool:
        """Whether it says that the air is clear."""
        return not self.reason and math.isinf(self.interval[1])

    @property
    def most(self) -> float:
        """Greatest k of the interval [1/m]."""
        return self.extinction + NORMAL_90_PERCENT * self.deviation

    @property
    def least(self) -> float:
        """Least k of the interval [1/m]."""
        return self.extinction - NORMAL_90_PERCENT * self.deviation

    @property
    def reach(self) -> float:
        """Distance up to which it speaks of the fog [m]."""
        return math.exp(0.5 * (math.log(self.interval[0]) + math.log(min(self.interval[1], _FOG))))


def verdict_of(fit: DayFit, scale_deviation: float) -> DayVerdict:
    """Judge a posterior."""
    low, middle, high = (fit.quantile(share) for share in (0.05, 0.5, 0.95))
    calibration = NORMAL_90_PERCENT * scale_deviation
    low = middle / math.exp(math.hypot(math.log(middle / low), calibration))
    high = middle * math.exp(math.hypot(math.log(high / middle), calibration))
    is_clear = low > CLEAR
    dense, thin = extinction_from_visibility(low), 0.0 if is_clear else extinction_from_visibility(high)
    by_light = fit.lights
    usual = float(fit.surfaces[:_USUAL_SURFACES].sum())
    outside = max(float(by_light[LIGHTS.is_unusual].sum()), _CLIPPING if fit.clipped > 0.0 else 0.0)
    shows = fit.below(_FOG) > _LEAST_FOG and fit.contrast > _LEAST_CONTRAST
    answers = is_clear or (shows and high < WIDEST * low)
    is_road = fit.fog_over_none > _A_ROAD
    sky = float(by_light[LIGHTS.sky == 1].sum())
    is_sky = sky > _LEAST_SKY or fit.clipped > 0.0
    is_sure = fit.fog_over_none > _LIKELY_A_ROAD and usual > _LEAST_USUAL and is_sky
    is_sure = is_sure and low > _DENSEST
    even = float(fit.surfaces[:_EVEN_SURFACES].sum())
    is_even = fit.fog_over_none > _SURELY_A_ROAD and even > _LEAST_USUAL and fit.responses[0] > _HARDLY_STATED
    return DayVerdict(
        extinction=0.5 * (dense + thin),
        deviation=0.5 * (dense - thin) / NORMAL_90_PERCENT,
        median=extinction_from_visibility(middle),
        interval=(low, math.inf if is_clear else high),
        reason="" if answers and is_road else _reason(fit, is_road, sky),
        shows_fog=shows and is_road,
        is_sure=is_sure,
        is_even=is_even,
        outside=outside if is_sure and is_even else 0.0,
        doubt=fit.doubt,
        response_deviation=fit.response_deviation if fit.below(_FOG) > _LEAST_FOG else 0.0,
        is_road=is_road,
    )


def _reason(fit: DayFit, is_road: bool, sky: float) -> str:
    """Why a posterior is no answer."""
    hidden = sky < _LEAST_SKY or float(fit.surfaces[_USUAL_SURFACES + 1 :].sum()) > _LEAST_SKY
    wet = float(fit.lights[LIGHTS.is_wet].sum()) > _LEAST_SKY
    reasons = (
        (fit.brightest < _DARK, "too dark: this is a daytime method"),
        (fit.clipped > _MOSTLY_CLIPPED, "the sky is clipped, and the airlight not known: expose for the sky"),
        (fit.contrast < _LEAST_CONTRAST, "the road is nearly as bright as the airlight, or brighter"),
        (not is_road, "what is ahead does not look like a road: no lane, or something covers it"),
        (hidden, "the sky above the road is hidden"),
        (wet, "the road may be wet: it mirrors the sky as fog would veil it"),
        (fit.responses[0] < _HARDLY_STATED, "the camera does not have the response that its description states"),
    )
    said = (reason for holds, reason in reasons if holds)
    return next(said, "the extinction is not observable: too little road is seen")


def agree(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two intervals of visibility have something in common, or almost (`one`, `other` (float, float) [m])."""
    return one[0] <= _SLACK * other[1] and other[0] <= _SLACK * one[1]
