"""Whether a camera's frame is new, and what was measured when it was taken, from what a vehicle can know."""

import math
from collections import deque
from typing import Any

from numpy.typing import NDArray

from fogsim.camera import Pixels
from fogsim.values import Frame, LeadMeasurement

MOVING = 1.0
"""Speed from which on the picture of the road must change from frame to frame [m/s]."""

_LATEST = 0.5
"""How late a frame may be [s]: 18 m at 130 km/h."""

_LEAST_CONTRAST = 0.01
"""Span of the grey levels of a frame below which it shows nothing, as a share of full scale [-]: in fog of 10 m by day
the road before the bonnet still differs by more from the airlight."""

_APART = 16
"""Rows and columns between the pixels whose levels are ordered."""


class FrameWatch:
    """Watches the frames of one camera; estimators are asked only about those that are news.

    A frame is none if it bears the time of the one before. Nor is it if it has the very same pixels while the vehicle
    moves: noise and the road never repeat to the last bit.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._time = -math.inf
        self._pixels: Pixels | None = None

    def stale_reason(self, frame: Frame, speed: float) -> str:
        """Say why a frame is no news; empty if it is (`speed` [m/s])."""
        before, earlier = self._pixels, self._time
        self._time, self._pixels = max(frame.time, earlier), frame.image
        if frame.time <= earlier:
            return f"no new frame: the last one is of {earlier:.2f} s"
        if speed > MOVING and before is not None and _are_same(before, frame.image):
            return "the picture stands still while the vehicle moves"
        return ""


def why_useless(frame: Frame, time: float) -> str:
    """Say why a frame, news or not, does not show the road of now; empty if it may (`time` [s])."""
    if time - frame.time > _LATEST:
        return f"the frame is {time - frame.time:.2f} s late"
    levels = frame.image[::_APART, ::_APART].flatten()
    levels.sort()
    dark, bright = _quantile(levels, 0.01), _quantile(levels, 0.99)
    if bright - dark < _LEAST_CONTRAST * (2**frame.camera.bits - 1):
        return f"the picture shows nothing: {dark:.0f} … {bright:.0f} grey levels"
    return ""


def _quantile(ordered: NDArray[Any], share: float) -> float:
    """Quantile of ascending numbers, as `numpy.quantile` interpolates."""
    place = share * (ordered.size - 1)
    below = int(place)
    low, high = float(ordered[below]), float(ordered[min(below + 1, ordered.size - 1)])
    return low + (place - below) * (high - low)


class LeadHistory:
    """What the radar measured, until the frame of that time has arrived."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all measurements."""
        self._measured: deque[tuple[float, LeadMeasurement | None]] = deque()

    def add(self, time: float, measured: LeadMeasurement | None) -> None:
        """Keep a measurement (`time` [s])."""
        self._measured.append((time, measured))

    def at(self, time: float) -> LeadMeasurement | None:
        """The last measurement until the time of a frame; earlier ones are forgotten (`time` [s])."""
        while len(self._measured) > 1 and self._measured[1][0] <= time:
            self._measured.popleft()
        return self._measured[0][1] if self._measured else None


def _are_same(one: Pixels, other: Pixels) -> bool:
    # Mostly the first row differs already.
    return one[0].tobytes() == other[0].tobytes() and bool((one == other).all())
