"""What an estimate by the road's brightness alone needs from the rest of its image before it counts."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate
from fogsim.vision.day.day_fit import fit_free_road
from fogsim.vision.day.far_objects import STANDS_OUT, stands_out
from fogsim.vision.day.recent_change import RecentChange
from fogsim.vision.day.row_data import near_horizon
from fogsim.vision.day.second_opinion import (
    CLEAR,
    DISAGREE,
    GLARES,
    MODEL_DEVIATION,
    WIDEST,
    DayVerdict,
    agree,
    refused,
    verdict_of,
)
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.pixel_kernels import sun_in_sky
from fogsim.vision.lines.horizon import Horizon, levelled

PERIOD, SOON = 10.0, 1.0
"""Times after which an image is compared again: one that confirmed an estimate, and one that did not [s]."""

_MOST_CHANGE = 0.3
"""Largest relative deviation of k by how it changed over the last images: these methods take fog for even [-]."""

_CONTRAST = 300.0
"""Lower end of the day model's visibility from which on its road keeps enough contrast for the air to be clear [m]."""

_SUN_HEIGHT = 0.2
"""Height above the horizon up to which the sun is searched [rad]."""

_THINNEST = extinction_from_visibility(CLEAR)
"""Extinction up to which fog counts as thin [1/m]."""

UNCONFIRMED = "the rest of the image does not confirm the fog that the road's brightness shows"
NOT_CLEAR = "nothing that fog would hide is seen far away: the air may be clear or not"


@dataclass(frozen=True, slots=True)
class _Outcome:
    """How the estimate of an image compares."""

    time: float = -math.inf  # Of the image [s]
    seen: tuple[float, float] = (0.0, math.inf)  # (float, float): Interval of the estimate [m]
    reason: str = ""  # Why it does not count; empty if it does
    # relative, absolute: what the day model leaves open besides: of k over k [-], and of k where the air is clear [1/m]
    relative: float = 0.0
    absolute: float = 0.0
    reach: float = math.inf  # Distance up to which clear air was seen [m]


class Confirmation:
    """Confirms estimates of a method by the day model, in a drive from time to time.

    Fog must show in the day model as well, and nothing may stand out at the horizon that it would hide. Clear air needs
    a road that keeps its contrast, or something that stands out. The interval then spans those of both, so that it has
    what height, focal length, response, sky and surface leave open.
    """

    def __init__(self, camera: Camera, horizon: Horizon, scale_deviation: float) -> None:
        self._camera, self._horizon, self._scale = camera, horizon, scale_deviation
        self._change = RecentChange(_MOST_CHANGE)
        self._last = _Outcome()

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._change.reset()
        self._last = _Outcome()

    def of(self, own: Estimate, image: NDArray[Any], free: float, time: float) -> Estimate:
        """Return an estimate with a wider interval, or why it does not count.

        Takes `image` (rows, cols), `free` [m], `time` [s].
        """
        if not own.valid:
            return own
        common = math.hypot(own.common_deviation, self._scale)
        own = replace(own, standard_deviation=math.hypot(own.standard_deviation, self._scale * own.extinction))
        last = self._last
        is_recent = 0.0 < time - last.time < (SOON if last.reason else PERIOD)
        if not is_recent or not agree(last.seen, own.visibility_interval):
            last = self._last = self._compared(own, levelled(image, self._camera), free, time)
        if last.reason:
            return refused(own, last.reason)
        relative = math.hypot(last.relative, self._change.of(time, own.extinction))
        deviation = math.hypot(own.standard_deviation, relative * own.extinction, last.absolute)
        common, reach = math.hypot(common, relative), min(own.reach, last.reach)
        return replace(own, standard_deviation=deviation, common_deviation=common, reach=reach)

    def _compared(self, own: Estimate, level: NDArray[Any], free: float, time: float) -> _Outcome:
        fit = fit_free_road(np.ascontiguousarray(level), self._camera, self._horizon, free)
        day = verdict_of(fit, self._scale)
        is_open = not day.shows_fog and _is_thin(own, day)
        reason = self._rejection_reason(own, level, day, is_open=is_open)
        more = _added_deviation(own, day, is_open=is_open, is_behind=math.isfinite(min(free, day.free)))
        relative, absolute = (more / own.extinction, 0.0) if own.extinction > 0.0 else (0.0, more)
        # A bank of fog farther away would only raise the horizon by less than the doubt of it.
        doubtful = near_horizon(self._horizon.standard_deviation)
        reach = self._camera.row_distance / doubtful if is_open else math.inf
        return _Outcome(time, own.visibility_interval, reason, relative, absolute, reach)

    def _rejection_reason(self, own: Estimate, level: NDArray[Any], day: DayVerdict, *, is_open: bool) -> str:
        """Say why an estimate does not count; empty if it does."""
        if day.reason and self._has_sun(level):
            return GLARES
        if day.shows_fog:
            least = own.extinction - NORMAL_90_PERCENT * own.standard_deviation
            return STANDS_OUT if self._stands_out(level, least) else _contradiction(own, day)
        if not is_open:
            return UNCONFIRMED
        shows_clear = _has_contrast(day) or self._stands_out(level, _THINNEST)
        return "" if shows_clear else NOT_CLEAR

    def _has_sun(self, level: NDArray[Any]) -> bool:
        camera, last = self._camera, math.floor(self._horizon.row)
        rows = np.arange(max(last - math.floor(_SUN_HEIGHT * camera.focal_length), 0), last)
        return rows.size > 0 and sun_in_sky(linear_pixels(level, camera), rows, camera.width // 6)

    def _stands_out(self, level: NDArray[Any], extinction: float) -> bool:
        return stands_out(level, self._camera, self._horizon, extinction)


def without_far_objects(own: Estimate, image: NDArray[Any], camera: Camera, horizon: Horizon) -> Estimate:
    """Return an estimate by the vehicle ahead, or why it does not count."""
    least = own.extinction - NORMAL_90_PERCENT * own.standard_deviation
    if not own.valid or not least > 0.0 or not stands_out(levelled(image, camera), camera, horizon, least):
        return own
    return refused(own, STANDS_OUT)


def _has_contrast(day: DayVerdict) -> bool:
    return day.is_clear or (day.is_road and day.interval[0] > _CONTRAST)


def _is_thin(own: Estimate, day: DayVerdict) -> bool:
    """Whether the fog of an estimate is thin, and may be none where clear air shows."""
    half = NORMAL_90_PERCENT * own.standard_deviation
    is_thin = own.extinction <= half or own.extinction + half <= _THINNEST
    return is_thin or (_has_contrast(day) and agree(own.visibility_interval, day.interval))


def _added_deviation(own: Estimate, day: DayVerdict, *, is_open: bool, is_behind: bool) -> float:
    """Deviation to add to an estimate's, so that its interval has what the day model leaves open [1/m].

    A road behind a vehicle is seen less far by the day model, which then is off by as much as it is unsure.
    """
    half, least, most = NORMAL_90_PERCENT * own.standard_deviation, day.least, day.most
    if is_open:
        least, most = 0.0, extinction_from_visibility(day.interval[0]) if _has_contrast(day) else _THINNEST
    more = _beyond(half, max(own.extinction - least, most - own.extinction))
    if not day.shows_fog:
        return more
    unsure = day.deviation if is_behind else 0.0
    off = math.sqrt(max((day.median - own.extinction) ** 2 - unsure**2, 0.0))
    return min(more, math.hypot(off, MODEL_DEVIATION * own.extinction))


def _beyond(half: float, wider: float) -> float:
    """Deviation that adds to that of an interval, of half a width, so that it is as wide as another one [1/m]."""
    return math.sqrt(max(wider**2 - half**2, 0.0)) / NORMAL_90_PERCENT


def _contradiction(own: Estimate, day: DayVerdict) -> str:
    """Say that the day model shows other fog; empty if it confirms an estimate."""
    half = NORMAL_90_PERCENT * own.standard_deviation
    thin, dense = min(own.extinction - half, day.least), max(own.extinction + half, day.most)
    spans = not day.reason and dense <= WIDEST * thin
    is_fog = own.extinction > 0.0
    return "" if is_fog and (spans or agree(own.visibility_interval, day.interval)) else DISAGREE
