"""Faults of an ego's sensors: what is wrong, from when on and for how long."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar


class TimeStamp(StrEnum):
    """The time that a camera says its frame is of: that of its exposure, or that at which it is handed on."""

    EXPOSURE = "exposure"
    DELIVERY = "delivery"


@dataclass(frozen=True, slots=True)
class Blackout:
    """Black frames, each with its own time: the image sensor gives no signal, the link goes on."""

    sensor: ClassVar[str] = "camera"
    name: ClassVar[str] = "blackout"


@dataclass(frozen=True, slots=True)
class FrozenFrame:
    """One frame again and again, the last before the fault.

    Attributes
    ----------
    time_stamp : TimeStamp
        Whether its time stays that of its exposure, or moves on as if each were new.
    """

    sensor: ClassVar[str] = "camera"
    name: ClassVar[str] = "frozen"
    time_stamp: TimeStamp = TimeStamp.DELIVERY


@dataclass(frozen=True, slots=True)
class DroppedFrames:
    """Frames that get lost, each by chance; until the next arrives, the last one is all there is.

    Attributes
    ----------
    share : float
        Share of frames that get lost, 0 … 1.
    """

    sensor: ClassVar[str] = "camera"
    name: ClassVar[str] = "dropped_frames"
    share: float = 1.0


@dataclass(frozen=True, slots=True)
class Latency:
    """Frames that come late.

    Attributes
    ----------
    delay : float
        From exposure to delivery [s].
    time_stamp : TimeStamp
        Which of both times the frames bear.
    """

    sensor: ClassVar[str] = "camera"
    name: ClassVar[str] = "latency"
    delay: float = 0.3
    time_stamp: TimeStamp = TimeStamp.EXPOSURE


FaultKind = Blackout | FrozenFrame | DroppedFrames | Latency
"""What can be wrong with a sensor."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault that is to begin.

    Attributes
    ----------
    kind : FaultKind
        What is wrong.
    delay : float
        Time from when it is ordered to when it begins [s].
    duration : float
        How long it lasts [s]; ``inf`` for the rest of the run.
    """

    kind: FaultKind
    delay: float = 0.0
    duration: float = math.inf

    @property
    def name(self) -> str:
        """Sensor and kind, as ``camera blackout``."""
        return f"{self.kind.sensor} {self.kind.name}"
