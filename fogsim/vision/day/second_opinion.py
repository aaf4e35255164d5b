"""The day model beside another method's estimate: which of both counts, or that neither does."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate
from fogsim.vision.day.day_fit import fit_day
from fogsim.vision.day.verdict import CALIBRATION_DEVIATION, WIDEST, DayVerdict, agree, verdict_of
from fogsim.vision.lines.horizon import Horizon

POSSIBLY, MOSTLY = 0.35, 0.6
"""Probabilities of a wet road or local tone mapping from which on an estimate that knows neither is widened, and given
up where the day model has no answer [-]."""

MOST_DOUBT = 15.0
"""Doubt by contrast across the road from which on an estimate is given up [-]."""

PERIOD = 5.0
"""Time after which an estimate that has been agreed with is looked at again [s]."""


class SecondOpinion:
    """Weighs estimates of a method by the day model, in a drive from time to time.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    """

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self._agreed = -math.inf

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._agreed = -math.inf

    def on(
        self, own: Estimate, level: NDArray[Any], horizon: Horizon, free: float, time: float, is_straight: bool
    ) -> Estimate:
        """Return an estimate, what the day model has instead, or neither.

        Parameters
        ----------
        own : Estimate
            Of the other method, valid or not.
        level : (rows, cols) or (rows, cols, 3) uint8 or uint16
            A level image.
        horizon : Horizon
            What is known of the horizon.
        free : float
            Depth up to which the own lane is free [m].
        time : float
            Of the image [s].
        is_straight : bool
            Whether the road neither bends nor sags, as the day model has it.
        """
        if own.valid and (not is_straight or self._agreed < time < self._agreed + PERIOD):
            return _with_calibration(own)
        verdict = verdict_of(fit_day(np.ascontiguousarray(level), self._camera, horizon, free, max(_ends(own)[0], 0.0)))
        chosen = _chosen(own, verdict)
        self._agreed = time if chosen is own else -math.inf
        return _with_calibration(chosen) if chosen is own and own.valid else chosen


def _chosen(own: Estimate, verdict: DayVerdict) -> Estimate:
    if own.valid and verdict.doubt > MOST_DOUBT:
        reason = "contrast survives where the fog that the road's brightness shows would leave none"
        return Estimate.invalid(own.method, reason, **_found(own))
    if not own.valid or (verdict.outside > MOSTLY and verdict.reason):
        return _of_day(own, verdict)
    if not (verdict.is_sure and verdict.is_even) or verdict.reason:
        return own
    if verdict.outside > POSSIBLY:
        low, high = verdict.interval
        return _spanning(own, own.extinction, verdict) if low < own.visibility < high else _of_day(own, verdict)
    if agree(own.visibility_interval, verdict.interval):
        return own
    return _spanning(own, 0.5 * (own.extinction + verdict.extinction), verdict)


def _spanning(own: Estimate, middle: float, verdict: DayVerdict) -> Estimate:
    """Return an estimate whose interval holds those of both, or none if that says nothing."""
    thin, dense = _ends(own)
    thin, dense = max(min(thin, verdict.least), 0.0), max(dense, verdict.most)
    if dense > WIDEST * thin:
        return Estimate.invalid(own.method, "how the road fades and how its image brightens disagree", **_found(own))
    middle = min(max(middle, thin), dense)
    half = max(dense - middle, middle - thin) / NORMAL_90_PERCENT
    return replace(own, extinction=middle, standard_deviation=half, optical_depths=None, denser=None)


def _ends(own: Estimate) -> tuple[float, float]:
    half = NORMAL_90_PERCENT * own.standard_deviation if own.valid else 0.0
    return own.extinction - half, own.extinction + half


def _of_day(own: Estimate, verdict: DayVerdict) -> Estimate:
    """Return the day model's answer, or why there is none."""
    if verdict.reason or not verdict.is_sure:
        reason = verdict.reason or str(own.diagnostics.get("reason", ""))
        return Estimate.invalid(own.method, reason, **_found(own))
    return Estimate(
        own.method,
        verdict.extinction,
        verdict.deviation,
        diagnostics=_found(own),
        reach=verdict.reach,
        common_deviation=CALIBRATION_DEVIATION,
    )


def _found(own: Estimate) -> dict[str, object]:
    return {name: value for name, value in own.diagnostics.items() if name != "reason"}


def _with_calibration(own: Estimate) -> Estimate:
    """Add to an interval what height and focal length leave open, the same in all images of a drive."""
    if own.extinction <= 0.0:
        return own
    return replace(
        own,
        standard_deviation=math.hypot(own.standard_deviation, CALIBRATION_DEVIATION * own.extinction),
        common_deviation=math.hypot(own.common_deviation, CALIBRATION_DEVIATION),
    )
