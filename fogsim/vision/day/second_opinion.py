"""The day model as a second opinion on an estimate: its verdict, and which of the two counts, if any."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate, OpticalDepths
from fogsim.vision.day.day_fit import DayFit, fit_day
from fogsim.vision.day.far_objects import STANDS_OUT, stands_out
from fogsim.vision.day.row_data import STRETCHED
from fogsim.vision.day.row_kernels import LIGHTS
from fogsim.vision.lines.horizon import Horizon

MODEL_DEVIATION = 0.15
"""Relative deviation of k by what is none of the hypotheses; chosen on pool 0 of `benchmarks/camera_kinds.py` [-]."""

_FOG, _LEAST_FOG, CLEAR = 2000.0, 0.95, 1000.0
"""Visibility below which there is fog [m], least probability of that for an answer with two ends [-], and least lower
end of an answer with one [m]."""

_SLACK, _THIN = 1.15, 400.0
"""Ratio of ends up to which intervals that have nothing in common do not contradict one another [-], and lower end of
those that what stands across the way does not change much, chosen as `RoadEnd`'s constants [m]."""

WIDEST = 4.0
"""Most ratio of the ends of an answer [-]."""

_A_ROAD, _LIKELY_A_ROAD = math.log(10.0), 10.0
"""Logarithms of the evidence of a road over that of none from which on there is one, and it counts against another
method [-]."""

_EVEN_SURFACES, _USUAL_SURFACES, _MOSTLY = 2, 3, 0.5
"""How many of the surfaces, from the first on, are even roads, and roads that nothing hides or shades; the next lies in
shade, and one is hidden; and the probability from which on something is likelier than not [-]."""

_DENSEST = 13.5
"""Least lower end of an interval that is believed [m]: what is no road at all looks like denser fog."""

_LANE = 4
"""Lines that meet where the road vanishes from which on it is one although shade lies on it, whose patches follow no
law; chosen on pool 0 of `benchmarks/camera_kinds.py` [-]."""

_SUSPECTED = 0.2
"""Probability from which on a road may be wet, or its image mapped locally: about twice that before it is seen [-]."""

_HARDLY_STATED = 0.03
"""Probability of the stated response below which the camera has another one [-]."""

_LEAST_CONTRAST, _CONTRAST_ALONE, _DARK = 0.08, 0.2, 6.0 / 255.0
"""Least contrast of far road to near road over the sky for fog to show, and for it to be read by the day model alone
[-]; and light of the brightest rows below which it is no day, over full scale [-]."""

FAR_ROAD = "far road is hardly brighter: there is little fog, a road as bright as it, or something before the near road"
CONTRAST = "contrast shows where the fog of the road's brightness would leave none, or something hangs before the road"
GLARES = "the sun or a lamp shines into the camera, and its glare veils the road"
DISAGREE = "how the road fades and how its image brightens disagree"
WALLED = "something across the way hides road and sky, as a wall does, or the stated pitch is wrong"


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
    is_even: bool  # Whether the road is as even as roads mostly are, and the response may be the stated one
    # Probability that the image shows what the joint fit does not know, a wet road or local tone mapping; 0 where the
    # road is not sure [-]
    outside: float
    # doubt, response_deviation, response_shift: see `DayFit`; no shift where the road is uneven
    doubt: float
    response_deviation: float
    response_shift: float = 0.0
    is_stated: bool = True  # Whether the response may be the stated one; also where the road is not sure, or uneven
    airlight_deviation: float = 0.0  # Relative deviation of k where the sky is clipped, and the airlight not known [-]
    is_road: bool = True  # Whether a road is likelier than none
    is_walled: bool = False  # Whether something hides the road that hides its sky too, which then is no airlight
    free: float = math.inf  # Depth up to which the road was read, before what stands in the own lane [m]
    farthest: float = math.inf  # Depth of the farthest rows that were read [m]

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
        middle = math.exp(0.5 * (math.log(self.interval[0]) + math.log(min(self.interval[1], _FOG))))
        return min(middle, self.farthest)


def verdict_of(fit: DayFit, scale_deviation: float, lines: int | None = 0) -> DayVerdict:
    """Judge a posterior, of an image in which so many lines meet where the road vanishes; None if it bends or sags."""
    low, middle, high = (fit.quantile(share) for share in (0.05, 0.5, 0.95))
    calibration = NORMAL_90_PERCENT * scale_deviation
    low = middle / math.exp(math.hypot(math.log(middle / low), calibration))
    high = middle * math.exp(math.hypot(math.log(high / middle), calibration))
    is_clear = low > CLEAR
    dense, thin = extinction_from_visibility(low), 0.0 if is_clear else extinction_from_visibility(high)
    usual = float(fit.surfaces[:_USUAL_SURFACES].sum())
    is_fog = fit.below(_FOG) > _LEAST_FOG
    shows = is_fog and fit.contrast > _LEAST_CONTRAST
    is_stated = fit.responses[0] > _HARDLY_STATED
    unusual = float(fit.lights[LIGHTS.is_unusual].sum())
    is_known = is_stated or unusual < _MOSTLY or float(fit.responses[STRETCHED].sum()) > _MOSTLY
    answers = is_clear or (shows and high < WIDEST * low and is_known and fit.contrast > _CONTRAST_ALONE)
    is_lane = (lines or 0) >= _LANE and float(fit.surfaces[_USUAL_SURFACES]) > _MOSTLY and is_stated
    is_road = fit.fog_over_none > _A_ROAD or is_lane
    sky = float(fit.lights[LIGHTS.sky == 1].sum())
    is_sky = sky > _MOSTLY or fit.clipped > 0.0
    is_sure = is_sky and low > _DENSEST and ((fit.fog_over_none > _LIKELY_A_ROAD and usual > _MOSTLY) or is_lane)
    half = 0.5 * (dense - thin) / NORMAL_90_PERCENT
    is_even = float(fit.surfaces[:_EVEN_SURFACES].sum()) > _MOSTLY
    is_hidden = float(fit.surfaces[_USUAL_SURFACES + 1]) > _MOSTLY
    is_walled = math.isinf(fit.free) and (fit.end.is_sharp or (is_hidden and fit.end.is_sky_even))
    # What crosses an uneven road, as a wiper does, is no tone curve, nor is the course of one that sags.
    shows_response = is_even and is_sure and lines is not None
    shift = fit.response_shift if is_fog and shows_response and is_stated else 0.0
    return DayVerdict(
        extinction=0.5 * (dense + thin),
        deviation=half,
        median=extinction_from_visibility(middle),
        interval=(low, math.inf if is_clear else high),
        reason=WALLED if is_walled else "" if answers and is_road else _reason(fit, is_road, sky),
        shows_fog=shows and is_road,
        is_sure=is_sure,
        is_even=is_even and is_stated,
        outside=unusual if is_sure and is_even and is_stated else 0.0,
        doubt=fit.doubt,
        response_deviation=fit.response_deviation(shift) if is_fog else 0.0,
        response_shift=shift,
        is_stated=is_stated or not shows_response,
        airlight_deviation=2.0 * half / (dense + thin) if is_road and is_fog and fit.clipped > _MOSTLY else 0.0,
        is_road=is_road,
        is_walled=is_walled,
        free=fit.free,
        farthest=fit.farthest,
    )


def _reason(fit: DayFit, is_road: bool, sky: float) -> str:
    """Why a posterior is no answer."""
    hidden = sky < _MOSTLY or float(fit.surfaces[_USUAL_SURFACES + 1 :].sum()) > _MOSTLY
    wet = float(fit.lights[LIGHTS.is_wet].sum()) > _SUSPECTED
    reasons = (
        (fit.brightest < _DARK, "too dark: this is a daytime method"),
        (fit.clipped > _MOSTLY, "the sky is clipped, and the airlight not known: expose for the sky"),
        (fit.contrast < _CONTRAST_ALONE, FAR_ROAD),
        (not is_road, "what is ahead does not look like a road: no lane, or something covers it"),
        (hidden, "the sky above the road is hidden"),
        (wet, "the road may be wet: it mirrors the sky as fog would veil it"),
        (fit.responses[0] < _HARDLY_STATED, "the camera does not have the response that its description states"),
    )
    return next((why for holds, why in reasons if holds), "the extinction is not observable: too little road is seen")


def agree(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two intervals of visibility have something in common, or almost (`one`, `other` (float, float) [m])."""
    return one[0] <= _SLACK * other[1] and other[0] <= _SLACK * one[1]


_ALIKE = 0.1
"""Difference of ln k up to which two answers are the same [-]."""

MOST_DOUBT = 18.0
"""Doubt by contrast across the road from which on an estimate is given up [-]."""

PERIOD = 10.0
"""Time after which an estimate that has been agreed with is looked at again [s]."""


class SecondOpinion:
    """Weighs estimates of a method by the day model, in a drive from time to time."""

    def __init__(self, camera: Camera, scale_deviation: float) -> None:
        self._camera, self._scale = camera, scale_deviation
        self.reset()

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._agreed, self._looked, self._response, self._shift = -math.inf, -math.inf, 0.0, 0.0
        self._fit: DayFit | None = None
        self._clear: tuple[float, float] | None = None

    def on(
        self, own: Estimate, level: NDArray[Any], horizon: Horizon, free: float, time: float, lines: int | None
    ) -> Estimate:
        """Return an estimate, what the day model has instead, or neither.

        Takes `level` (rows, cols), `free` [m], `time` [s], and how many lines meet where the road vanishes; None if it
        bends.
        """
        is_recent = self._agreed < time < self._agreed + PERIOD
        shifted = _shifted(own, self._shift) if self._shift else own
        if own.valid and is_recent and (self._clear is None or agree(shifted.visibility_interval, self._clear)):
            return self._kept(shifted)
        verdict = self._verdict(own, level, horizon, free, time, lines)
        own = _shifted(own, self._shift)
        chosen = self._weighed(own, verdict, free, lines)
        if chosen.valid and stands_out(level, self._camera, horizon, _ends(chosen)[0]):
            chosen = refused(own, STANDS_OUT)
        if chosen is not own or not own.valid:
            self._agreed = -math.inf
            return chosen
        self._agreed = time
        return self._kept(own)

    def _kept(self, own: Estimate) -> Estimate:
        """Return an estimate with what height, focal length and response leave open; open upward if no fog shows."""
        if self._clear is not None:
            own = replace(own, standard_deviation=max(own.standard_deviation, own.extinction / NORMAL_90_PERCENT))
        return _with_calibration(own, self._scale, self._response)

    def _verdict(
        self, own: Estimate, level: NDArray[Any], horizon: Horizon, free: float, time: float, lines: int | None
    ) -> DayVerdict:
        earlier = self._fit if self._looked < time < self._looked + 2.0 * PERIOD else None
        fit = fit_day(np.ascontiguousarray(level), self._camera, horizon, free, max(_ends(own)[0], 0.0), earlier)
        self._fit, self._looked = fit, time
        verdict, self._clear = verdict_of(fit, self._scale, lines), None
        self._shift = verdict.response_shift if own.valid else 0.0
        # Before what stands in the lane too little road is seen for faint doubts of the response.
        is_seen = verdict.is_sure and (self._shift != 0.0 or math.isinf(min(free, verdict.free)))
        self._response = max(verdict.response_deviation if is_seen else 0.0, verdict.airlight_deviation)
        return verdict

    def _weighed(self, own: Estimate, verdict: DayVerdict, free: float, lines: int | None) -> Estimate:
        if own.valid and lines is not None and verdict.is_walled and own.visibility_interval[0] < _THIN:
            return refused(own, WALLED)
        if own.valid and verdict.is_stated and verdict.doubt <= MOST_DOUBT and math.isfinite(min(free, verdict.free)):
            # Before what stands in the lane it sees less, but too little of a road that may be wet for either.
            return own if verdict.outside <= _SUSPECTED else _of_day(own, verdict)
        if own.valid and lines is None:
            # It follows no bend: there it shows what responses change, not how dense the fog is.
            return own
        shows_none = math.isinf(verdict.interval[1]) and agree(own.visibility_interval, verdict.interval)
        self._clear = verdict.interval if shows_none else None
        chosen = _chosen(own, verdict)
        if chosen is own or not chosen.valid:
            return chosen
        return replace(chosen, common_deviation=max(chosen.common_deviation, self._scale))


def _chosen(own: Estimate, verdict: DayVerdict) -> Estimate:
    if not own.valid:
        return _of_day(own, verdict)
    if verdict.doubt > MOST_DOUBT:
        return refused(own, CONTRAST)
    agreed = agree(own.visibility_interval, verdict.interval)
    if not verdict.is_stated and not (agreed and verdict.reason):
        return (_spanning(own, verdict.extinction, verdict) if agreed else None) or _of_day(own, verdict)
    if verdict.reason and verdict.outside > _MOSTLY:
        return _of_day(own, verdict)
    if verdict.is_sure and not verdict.reason:
        return _weighed(own, verdict)
    return own if agreed or (verdict.reason and own.visibility_interval[1] > _FOG) else refused(own, DISAGREE)


def _weighed(own: Estimate, verdict: DayVerdict) -> Estimate:
    """Weigh two answers: where they are not alike, the interval has both."""
    agreed = agree(own.visibility_interval, verdict.interval)
    if agreed and (math.isinf(verdict.interval[1]) or _are_alike(own, verdict)):
        return own
    keeps = agreed or not verdict.is_even
    middle = own.extinction if keeps else 0.5 * (own.extinction + verdict.extinction)
    if (spanning := _spanning(own, middle, verdict)) is not None:
        return spanning
    # A vehicle that no sensor reports darkens far road as a wet one that mirrors the sky does: neither answer counts.
    return own if keeps else refused(own, DISAGREE)


def _are_alike(own: Estimate, verdict: DayVerdict) -> bool:
    return own.extinction > 0.0 and abs(math.log(own.extinction / verdict.extinction)) < _ALIKE


def _spanning(own: Estimate, middle: float, verdict: DayVerdict) -> Estimate | None:
    """Return an estimate whose interval holds those of both, or None if that says too little."""
    thin, dense = _ends(own)
    thin, dense = max(min(thin, verdict.least), 0.0), max(dense, verdict.most)
    if dense > WIDEST * thin:
        return None
    half = max(dense - middle, middle - thin) / NORMAL_90_PERCENT
    return replace(own, extinction=middle, standard_deviation=half, optical_depths=None, denser=None)


def _ends(own: Estimate) -> tuple[float, float]:
    half = NORMAL_90_PERCENT * own.standard_deviation if own.valid else 0.0
    return own.extinction - half, own.extinction + half


def _of_day(own: Estimate, verdict: DayVerdict) -> Estimate:
    """Return the day model's answer, or why there is none."""
    if verdict.reason or not verdict.is_sure:
        return refused(own, verdict.reason or str(own.diagnostics.get("reason", "")))
    deviation = math.hypot(verdict.deviation, MODEL_DEVIATION * verdict.extinction)
    answer = Estimate(own.method, verdict.extinction, deviation, diagnostics=_found(own), reach=verdict.reach)
    return replace(answer, common_deviation=MODEL_DEVIATION)


def refused(own: Estimate, reason: str) -> Estimate:
    """Return the statement that an estimate does not count, and why."""
    return Estimate.invalid(own.method, reason, **_found(own))


def _found(own: Estimate) -> dict[str, object]:
    return {name: value for name, value in own.diagnostics.items() if name != "reason"}


def _shifted(own: Estimate, shift: float) -> Estimate:
    """Return an estimate with all extinctions changed by a factor's logarithm; one that is not changed itself."""
    if shift == 0.0 or not own.valid:
        return own
    factor, depths, denser = math.exp(shift), own.optical_depths, own.denser
    if depths is not None:
        curves = ((factor * value for value in part) for part in (depths.depth, depths.standard_deviation))
        depths = OpticalDepths(depths.distance, *map(tuple, curves))
    return replace(
        own,
        extinction=factor * own.extinction,
        standard_deviation=factor * own.standard_deviation,
        optical_depths=depths,
        denser=None if denser is None else replace(denser, extinction=factor * denser.extinction),
    )


def _with_calibration(own: Estimate, scale: float, response: float) -> Estimate:
    """Add to an interval what height, focal length and response leave open, the same in all images of a drive."""
    if own.extinction <= 0.0:
        return own
    unknown = math.hypot(scale, response)
    return replace(
        own,
        standard_deviation=math.hypot(own.standard_deviation, unknown * own.extinction),
        common_deviation=math.hypot(own.common_deviation, unknown),
    )
