"""The day model as a second opinion on an estimate: which of the two counts, or that neither does."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate
from fogsim.vision.day.day_fit import DayFit, fit_day
from fogsim.vision.day.far_objects import STANDS_OUT, stands_out
from fogsim.vision.day.verdict import DISAGREE, WIDEST, DayVerdict, agree, verdict_of
from fogsim.vision.lines.horizon import Horizon

_ALIKE = 0.1
"""Difference of ln k up to which two answers are the same [-]."""

_POSSIBLY, _MOSTLY = 0.35, 0.6
"""Probabilities of a wet road, local tone mapping or a clipped sky from which on an estimate that knows none of them
does not count against the day model's answer, and against its silence [-]."""

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
        self._agreed, self._response = -math.inf, 0.0
        self._fit: DayFit | None = None
        self._clear: tuple[float, float] | None = None

    def on(
        self, own: Estimate, level: NDArray[Any], horizon: Horizon, free: float, time: float, is_straight: bool
    ) -> Estimate:
        """Return an estimate, what the day model has instead, or neither.

        Takes `level` (rows, cols), `free` [m], `time` [s].
        """
        is_recent = self._agreed < time < self._agreed + PERIOD
        if own.valid and is_recent and (self._clear is None or agree(own.visibility_interval, self._clear)):
            return self._kept(own)
        self._response, self._clear = 0.0, None
        is_asked = not own.valid or is_straight
        chosen = self._with_day_model(own, level, horizon, free, time) if is_asked else own
        if chosen.valid and stands_out(level, self._camera, horizon, _ends(chosen)[0]):
            chosen = refused(own, STANDS_OUT)
        if chosen is not own or not own.valid:
            self._agreed, self._fit = -math.inf, None
            return chosen
        self._agreed = time
        return self._kept(own)

    def _kept(self, own: Estimate) -> Estimate:
        """Return an estimate with what height, focal length and response leave open; open upward if no fog shows."""
        if self._clear is not None:
            own = replace(own, standard_deviation=max(own.standard_deviation, own.extinction / NORMAL_90_PERCENT))
        return _with_calibration(own, self._scale, self._response)

    def _with_day_model(
        self, own: Estimate, level: NDArray[Any], horizon: Horizon, free: float, time: float
    ) -> Estimate:
        if not self._agreed < time < self._agreed + 2.0 * PERIOD:
            self._fit = None
        fit = fit_day(np.ascontiguousarray(level), self._camera, horizon, free, max(_ends(own)[0], 0.0), self._fit)
        self._fit = self._fit or fit
        verdict = verdict_of(fit, self._scale)
        if own.valid and math.isfinite(free) and verdict.doubt <= MOST_DOUBT:
            # Before what stands in the lane it sees less.
            return own
        shows_none = math.isinf(verdict.interval[1]) and agree(own.visibility_interval, verdict.interval)
        self._clear = verdict.interval if shows_none else None
        self._response = verdict.response_deviation if verdict.is_sure and verdict.is_even else 0.0
        chosen = _chosen(own, verdict)
        if chosen is own or not chosen.valid:
            return chosen
        return replace(chosen, common_deviation=max(chosen.common_deviation, self._scale))


def _chosen(own: Estimate, verdict: DayVerdict) -> Estimate:
    if not own.valid:
        return _of_day(own, verdict)
    if verdict.doubt > MOST_DOUBT:
        return refused(own, "contrast survives where the fog that the road's brightness shows would leave none")
    if verdict.reason:
        return _of_day(own, verdict) if verdict.outside > _MOSTLY else own
    return _weighed(own, verdict) if verdict.is_sure else own


def _weighed(own: Estimate, verdict: DayVerdict) -> Estimate:
    """Weigh two answers: where they are not alike, the interval has both."""
    agreed = agree(own.visibility_interval, verdict.interval)
    if agreed and (math.isinf(verdict.interval[1]) or _are_alike(own, verdict)):
        return own
    keeps = agreed or not verdict.is_even
    middle = own.extinction if keeps else 0.5 * (own.extinction + verdict.extinction)
    if (spanning := _spanning(own, middle, verdict)) is not None:
        return spanning
    if verdict.outside > _POSSIBLY and not verdict.interval[0] < own.visibility < verdict.interval[1]:
        return _of_day(own, verdict)
    if keeps:
        return own
    return refused(own, DISAGREE)


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
        reason = verdict.reason or str(own.diagnostics.get("reason", ""))
        return refused(own, reason)
    return Estimate(
        own.method,
        verdict.extinction,
        verdict.deviation,
        diagnostics=_found(own),
        reach=verdict.reach,
    )


def refused(own: Estimate, reason: str) -> Estimate:
    """Return the statement that an estimate does not count, and why."""
    return Estimate.invalid(own.method, reason, **_found(own))


def _found(own: Estimate) -> dict[str, object]:
    return {name: value for name, value in own.diagnostics.items() if name != "reason"}


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
