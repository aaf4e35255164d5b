"""Faults of an ego's sensors: what is wrong, from when on and for how long."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

import numpy as np


class TimeStamp(StrEnum):
    """The time that a camera says its frame is of: that of its exposure, or that at which it is handed on."""

    EXPOSURE = "exposure"
    DELIVERY = "delivery"


@dataclass(frozen=True, slots=True)
class Blackout:
    """Black frames, each with its own time: the image sensor gives no signal, the link goes on."""

    name: ClassVar[str] = "camera blackout"


@dataclass(frozen=True, slots=True)
class FrozenFrame:
    """One frame again and again, the last before the fault."""

    name: ClassVar[str] = "camera frozen"
    # Whether its time stays that of its exposure, or moves on as if each were new
    time_stamp: TimeStamp


@dataclass(frozen=True, slots=True)
class DroppedFrames:
    """Frames that get lost, each by chance; until the next arrives, the last one is all there is."""

    name: ClassVar[str] = "camera dropped_frames"
    share: float  # Share of frames that get lost, 0 … 1


@dataclass(frozen=True, slots=True)
class Latency:
    """Frames that come late."""

    name: ClassVar[str] = "camera latency"
    delay: float  # From exposure to delivery [s]
    time_stamp: TimeStamp  # Which of both times the frames bear


@dataclass(frozen=True, slots=True)
class Miscalibration:
    """A camera that is knocked out of place, or whose lens slips, unknown to the estimators."""

    name: ClassVar[str] = "camera calibration"
    # pitch, roll: what is added to the true angles [rad]
    pitch: float
    roll: float
    focal_length_ratio: float  # True focal length over that before [-]


@dataclass(frozen=True, slots=True)
class DirtyLens:
    """Dirt on the glass before the camera."""

    name: ClassVar[str] = "camera dirty_lens"
    coverage: float  # Sum of the areas of all blots over that of the glass [-]
    diameter: float  # Median of their diameters [m]
    albedo: float  # Luminance of a blot over the mean of the picture [-]


@dataclass(frozen=True, slots=True)
class WetLens:
    """Water on the glass before the camera."""

    name: ClassVar[str] = "camera wet_lens"
    coverage: float  # Sum of the areas of all drops over that of the glass [-]
    diameter: float  # Median of their diameters [m]
    blur: float  # Standard deviation of the blur by the film between them [rad]


@dataclass(frozen=True, slots=True)
class Glare:
    """A small source, such as a low sun, that shines into the camera."""

    name: ClassVar[str] = "camera glare"
    azimuth: float  # Its direction, counterclockwise from the vehicle's axis [rad]
    elevation: float  # Its height over the road's plane [rad]
    illuminance: float  # What it makes on a surface that faces it, at the camera [lx]
    haze: float  # What the windscreen scatters over what a clean one does [-]


@dataclass(frozen=True, slots=True)
class LeadDropout:
    """A radar that loses the vehicle ahead, in each measurement by chance."""

    name: ClassVar[str] = "lead dropout"
    share: float  # Share of measurements that get lost, 0 … 1


@dataclass(frozen=True, slots=True)
class LeadBias:
    """A radar that measures wrong."""

    name: ClassVar[str] = "lead bias"
    distance: float  # What is added to the distance [m]
    relative_speed: float  # What is added to the relative speed [m/s]


@dataclass(frozen=True, slots=True)
class LeadNoise:
    """A radar that is noisier than it should be."""

    name: ClassVar[str] = "lead noise"
    factor: float  # Its standard deviations over those that it should have [-]


@dataclass(frozen=True, slots=True)
class LeadNarrowView:
    """A radar whose field of view is narrowed, as by snow on its cover."""

    name: ClassVar[str] = "lead narrow_view"
    field_of_view: float  # Full angle within which it measures [rad]


@dataclass(frozen=True, slots=True)
class PositionBias:
    """A satellite position next to the true one, as reflections from walls make it."""

    name: ClassVar[str] = "gps position_bias"
    # east, north: what is added in the world [m]
    east: float
    north: float
    # along, left: what is added in the direction of travel, and to its left [m]
    along: float
    left: float


@dataclass(frozen=True, slots=True)
class HeadingBias:
    """A wrong heading."""

    name: ClassVar[str] = "gps heading_bias"
    angle: float  # What is added, counterclockwise [rad]


@dataclass(frozen=True, slots=True)
class Outage:
    """No position at all, as in a tunnel."""

    name: ClassVar[str] = "gps outage"


class Where(StrEnum):
    """Whether it is the sign that is not where it was, or its entry in the vehicle's map."""

    WORLD = "world"
    MAP = "map"


@dataclass(frozen=True, slots=True)
class SignsMissing:
    """Signs that have gone."""

    name: ClassVar[str] = "signs missing"
    where: Where  # From the world, or from the vehicle's map
    ids: tuple[str, ...]  # Which; all if empty


@dataclass(frozen=True, slots=True)
class SignsMoved:
    """Signs that are elsewhere."""

    name: ClassVar[str] = "signs moved"
    where: Where  # In the world, or on the vehicle's map
    ids: tuple[str, ...]  # Which; all if empty
    # along, left, up: how far, seen by those they speak to [m]
    along: float
    left: float
    up: float


@dataclass(frozen=True, slots=True)
class Fouled:
    """A scatterometer with dirt or water on its windows, or an insect in its beam."""

    name: ClassVar[str] = "scatterometer fouled"
    # Reported over correct value [-]: below 1 by windows that let less light through, above by what scatters
    factor: float


@dataclass(frozen=True, slots=True)
class NoSignal:
    """A scatterometer that reports nothing."""

    name: ClassVar[str] = "scatterometer no_signal"


CameraFault = Blackout | FrozenFrame | DroppedFrames | Latency | Miscalibration | DirtyLens | WetLens | Glare
LeadFault = LeadDropout | LeadBias | LeadNoise | LeadNarrowView
GpsFault = PositionBias | HeadingBias | Outage
SignFault = SignsMissing | SignsMoved
ScatterometerFault = Fouled | NoSignal
FaultKind = CameraFault | LeadFault | GpsFault | SignFault | ScatterometerFault
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
        return self.kind.name


@dataclass(frozen=True, slots=True)
class RunningFault:
    """A fault with its time and its own chance.

    Attributes
    ----------
    fault : Fault
        The fault.
    begin, end : float
        It is in force from `begin` until just before `end` [s].
    rng : numpy.random.Generator
        Random numbers of this fault alone.
    """

    fault: Fault
    begin: float
    end: float
    rng: np.random.Generator

    @property
    def kind(self) -> FaultKind:
        """What is wrong."""
        return self.fault.kind
