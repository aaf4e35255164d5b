"""From the pictures that a camera takes to the frames that come out of it, which faults hold up, lose or blacken."""

from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from fogsim.camera.exposure import Pixels
from fogsim.values.fault import Blackout, DroppedFrames, FrozenFrame, Latency, RunningFault, TimeStamp

_ROUNDING = 1e-9
"""Times that differ by no more than this are the same [s]."""


class Delivered(NamedTuple):
    """What comes out of a camera."""

    time: float  # The time that it bears [s]
    pixels: Pixels  # (rows, cols, 3) uint8: The picture


class FrameDelivery:
    """The way of pictures out of a camera: without a new one the last stays, with its time; before the first, black."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin a run: no picture is on its way."""
        self._under_way: deque[Delivered] = deque()
        self._last: Delivered | None = None

    def deliver(self, taken: Delivered, faults: Iterable[RunningFault]) -> Delivered:
        """Take in a picture and hand out what there is now."""
        self._under_way.append(taken)
        late, lost, stamp = 0.0, False, TimeStamp.EXPOSURE
        frozen: FrozenFrame | None = None
        black = False
        for fault in faults:
            match fault.kind:
                case Latency(delay, time_stamp):
                    late, stamp = late + delay, time_stamp
                case DroppedFrames(share):
                    lost |= bool(fault.rng.random() < share)
                case FrozenFrame() as kind:
                    frozen = kind
                case Blackout():
                    black = True
        arrived = self._arrived(taken.time, late)
        if self._last is None:
            self._last = Delivered(taken.time, np.zeros_like(taken.pixels))
        if frozen is not None:
            if frozen.time_stamp is TimeStamp.DELIVERY:
                self._last = Delivered(taken.time, self._last.pixels)
        elif arrived is not None and not lost:
            self._last = arrived if stamp is TimeStamp.EXPOSURE else Delivered(taken.time, arrived.pixels)
        return Delivered(taken.time, np.zeros_like(taken.pixels)) if black else self._last

    def _arrived(self, now: float, late: float) -> Delivered | None:
        """The newest picture that has arrived; older ones are overtaken."""
        arrived = None
        while self._under_way and self._under_way[0].time + late <= now + _ROUNDING:
            arrived = self._under_way.popleft()
        return arrived
