"""The keys of a scenario file about what is wrong with the ego's sensors, the camera among them, and when."""

import math
from collections.abc import Callable
from typing import Annotated, ClassVar, Literal, Unpack

from pydantic import ConfigDict, Field

from fogsim.scenario.section import Id, Number, Period, Place, Section, Share, Time, in_si
from fogsim.values.fault import (
    Blackout,
    DirtyLens,
    DroppedFrames,
    Fault,
    FaultKind,
    Fouled,
    FrozenFrame,
    Glare,
    HeadingBias,
    Latency,
    LeadBias,
    LeadDropout,
    LeadNarrowView,
    LeadNoise,
    Miscalibration,
    NoSignal,
    Outage,
    PositionBias,
    SignsMissing,
    SignsMoved,
    TimeStamp,
    WetLens,
    Where,
)

Angle = Annotated[Number, Field(ge=-180, le=180)]
"""An angle [°]."""

SmallAngle = Annotated[Number, Field(ge=-10, le=10)]
"""An angle by which a camera may be knocked [°]."""

Speed = Annotated[Number, Field(ge=-140, le=140)]
"""A speed, or a difference of speeds [m/s]."""


class FaultSection(Section):
    """A fault of a sensor; `kind` is its value, whose fields are the keys without their units."""

    _kind: ClassVar[Callable[..., FaultKind]]

    at_s: Time = 0.0
    """When it begins: time after the beginning of the run, or of the entry of the timeline that orders it."""

    for_s: Period | None = None
    """How long it lasts; if not given, to the end of the run."""

    def __init_subclass__(cls, kind: Callable[..., FaultKind] | None = None, **options: Unpack[ConfigDict]) -> None:
        super().__init_subclass__(**options)
        if kind is not None:
            cls._kind = kind

    def in_si(self) -> FaultKind:
        """What is wrong, in SI units."""
        return self._kind(**in_si(self, "at_s", "for_s", "sensor", "fault"))


class CameraFaultSection(FaultSection):
    """A fault of the camera."""

    sensor: Literal["camera"] = "camera"
    """Sensor that the fault is of."""


class CameraBlackout(CameraFaultSection, kind=Blackout):
    """Black frames."""

    fault: Literal["blackout"]
    """`blackout`: black frames, each with its own time."""


class CameraFrozen(CameraFaultSection, kind=FrozenFrame):
    """One frame again and again."""

    fault: Literal["frozen"]
    """`frozen`: the last frame before the fault, again and again."""

    time_stamp: TimeStamp = TimeStamp.DELIVERY
    """Time that the frame bears: that of its `exposure`, or of each `delivery`, as if it were new."""


class CameraDroppedFrames(CameraFaultSection, kind=DroppedFrames):
    """Frames that get lost."""

    fault: Literal["dropped_frames"]
    """`dropped_frames`: frames get lost, each by chance; the last one stays."""

    share: Share = 1.0
    """Share that gets lost."""


class CameraLatency(CameraFaultSection, kind=Latency):
    """Frames that come late."""

    fault: Literal["latency"]
    """`latency`: frames come late."""

    delay_s: Annotated[Time, Field(le=60)] = 0.3
    """Time from their exposure to their delivery."""

    time_stamp: TimeStamp = TimeStamp.EXPOSURE
    """Which of both times they bear: `exposure` or `delivery`."""


class CameraCalibration(CameraFaultSection):
    """A camera that is knocked, or whose lens slips."""

    fault: Literal["calibration"]
    """`calibration`: the camera is knocked, or its lens slips; the estimators still assume what was."""

    pitch_deg: SmallAngle = 0.0
    """What is added to its true pitch."""

    roll_deg: SmallAngle = 0.0
    """What is added to its true roll."""

    focal_length_percent: Annotated[Number, Field(ge=-50, le=50)] = 0.0
    """What is added to its true focal length."""

    def in_si(self) -> FaultKind:
        """What is wrong, in SI units."""
        ratio = 1.0 + self.focal_length_percent / 100.0
        return Miscalibration(math.radians(self.pitch_deg), math.radians(self.roll_deg), ratio)


class CameraDirtyLens(CameraFaultSection, kind=DirtyLens):
    """Dirt on the glass."""

    fault: Literal["dirty_lens"]
    """`dirty_lens`: dirt on the glass before the camera, out of focus."""

    coverage: Share = 0.1
    """Sum of the areas of all blots over that of the glass."""

    diameter_m: Annotated[Number, Field(ge=1e-4, le=0.1)] = 0.002
    """Median of their diameters."""

    albedo: Share = 0.3
    """Luminance of a blot over the mean of the picture."""


class CameraWetLens(CameraFaultSection, kind=WetLens):
    """Water on the glass."""

    fault: Literal["wet_lens"]
    """`wet_lens`: drops and a film of water on the glass before the camera."""

    coverage: Share = 0.15
    """Sum of the areas of all drops over that of the glass."""

    diameter_m: Annotated[Number, Field(ge=1e-4, le=0.1)] = 0.003
    """Median of their diameters."""

    blur_deg: Annotated[Number, Field(ge=0, le=5)] = 0.1
    """Standard deviation of the blur by the film between them."""


class CameraGlare(CameraFaultSection, kind=Glare):
    """A low sun, or another small source, that shines into the camera."""

    fault: Literal["glare"]
    """`glare`: a small source, such as a low sun, shines into the camera; nothing hides it."""

    azimuth_deg: Angle = 0.0
    """Its direction, counterclockwise from the vehicle's axis."""

    elevation_deg: Annotated[Number, Field(ge=-90, le=90)] = 8.0
    """Its height over the road's plane."""

    illuminance_lx: Annotated[Number, Field(ge=0, le=200_000)] = 10_000.0
    """What it makes on a surface that faces it, at the camera."""

    haze: Annotated[Number, Field(ge=0, le=1000)] = 1.0
    """What the windscreen scatters over what a clean one does; a dirty one has 10 and more."""


class LeadFaultSection(FaultSection):
    """A fault of the radar."""

    sensor: Literal["lead"] = "lead"
    """Sensor that the fault is of."""


class LeadDropoutSection(LeadFaultSection, kind=LeadDropout):
    """A radar that loses the vehicle ahead."""

    fault: Literal["dropout"]
    """`dropout`: the vehicle ahead is lost, in each measurement by chance."""

    share: Share = 1.0
    """Share that gets lost."""


class LeadBiasSection(LeadFaultSection, kind=LeadBias):
    """A radar that measures wrong."""

    fault: Literal["bias"]
    """`bias`: distance and relative speed are wrong."""

    distance_m: Annotated[Place, Field(ge=-1000, le=1000)] = 0.0
    """What is added to the distance."""

    relative_speed_mps: Speed = 0.0
    """What is added to the relative speed."""


class LeadNoiseSection(LeadFaultSection, kind=LeadNoise):
    """A radar that is noisier."""

    fault: Literal["noise"]
    """`noise`: its standard deviations are larger."""

    factor: Annotated[Number, Field(ge=0, le=1000)] = 10.0
    """How many times as large."""


class LeadNarrowViewSection(LeadFaultSection, kind=LeadNarrowView):
    """A radar that sees less to the sides."""

    fault: Literal["narrow_view"]
    """`narrow_view`: its field of view is narrowed, as by snow on its cover."""

    field_of_view_deg: Annotated[Number, Field(ge=0.1, le=360)] = 2.0
    """Full angle that is left."""


class GpsFaultSection(FaultSection):
    """A fault of satellite positioning."""

    sensor: Literal["gps"] = "gps"
    """Sensor that the fault is of."""


class GpsPositionBias(GpsFaultSection, kind=PositionBias):
    """A position next to the true one."""

    fault: Literal["position_bias"]
    """`position_bias`: the position is next to the true one, as reflections from walls make it."""

    east_m: Place = 0.0
    """How far east."""

    north_m: Place = 0.0
    """How far north."""

    along_m: Place = 0.0
    """How far ahead in the direction of travel."""

    left_m: Place = 0.0
    """How far to its left."""


class GpsHeadingBias(GpsFaultSection, kind=HeadingBias):
    """A wrong heading."""

    fault: Literal["heading_bias"]
    """`heading_bias`: the heading is wrong."""

    angle_deg: Angle = 0.0
    """What is added, counterclockwise."""


class GpsOutage(GpsFaultSection, kind=Outage):
    """No position."""

    fault: Literal["outage"]
    """`outage`: no position, as in a tunnel, and so no signs ahead."""


class SignFaultSection(FaultSection):
    """A fault of signs or of the map that has them."""

    sensor: Literal["signs"] = "signs"
    """Sensor that the fault is of."""

    where: Where = Where.WORLD
    """Whether it is the signs that are not where they were (`world`), or their entries in the vehicle's `map`."""

    ids: tuple[Id, ...] = ()
    """Which signs; all if not given."""


class SignsMissingSection(SignFaultSection, kind=SignsMissing):
    """Signs that have gone."""

    fault: Literal["missing"]
    """`missing`: signs have gone."""


class SignsMovedSection(SignFaultSection, kind=SignsMoved):
    """Signs that are elsewhere."""

    fault: Literal["moved"]
    """`moved`: signs are elsewhere."""

    along_m: Place = 0.0
    """How far ahead, seen by those they speak to."""

    left_m: Place = 0.0
    """How far to the left."""

    up_m: Place = 0.0
    """How far up."""


class ScatterometerFaultSection(FaultSection):
    """A fault of the scatterometer."""

    sensor: Literal["scatterometer"] = "scatterometer"
    """Sensor that the fault is of."""


class ScatterometerFouled(ScatterometerFaultSection, kind=Fouled):
    """A scatterometer with dirty windows."""

    fault: Literal["fouled"]
    """`fouled`: its values are wrong by a factor, by dirt or water on its windows, or what else scatters its light."""

    factor: Annotated[Number, Field(ge=0, le=1000)] = 0.5
    """Reported over correct value; below 1 it reports thinner fog."""


class ScatterometerNoSignal(ScatterometerFaultSection, kind=NoSignal):
    """A scatterometer that reports nothing."""

    fault: Literal["no_signal"]
    """`no_signal`: it reports nothing."""


AnyFault = Annotated[
    CameraBlackout
    | CameraFrozen
    | CameraDroppedFrames
    | CameraLatency
    | CameraCalibration
    | CameraDirtyLens
    | CameraWetLens
    | CameraGlare
    | LeadDropoutSection
    | LeadBiasSection
    | LeadNoiseSection
    | LeadNarrowViewSection
    | GpsPositionBias
    | GpsHeadingBias
    | GpsOutage
    | SignsMissingSection
    | SignsMovedSection
    | ScatterometerFouled
    | ScatterometerNoSignal,
    Field(discriminator="fault"),
]
"""Any fault of any sensor, known by its name."""


def fault_of(written: AnyFault) -> Fault:
    """A fault of a scenario file in SI units."""
    return Fault(written.in_si(), written.at_s, math.inf if written.for_s is None else written.for_s)
