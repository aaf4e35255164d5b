"""The block of a scenario file about the ego's sensors beside the camera, and about the faults of all of them."""

import math
from typing import Annotated, Literal

from pydantic import Field

from fogsim.scenario.section import Distance, Length, Number, Period, Section, Share, Time
from fogsim.values import Blackout, DroppedFrames, Fault, FaultKind, FrozenFrame, Latency, TimeStamp


class Lead(Section):
    """The radar that tracks the vehicle ahead."""

    reach_m: Length = 200.0
    """Distance up to which it tracks a vehicle."""

    distance_deviation_m: Annotated[Distance, Field(le=1000)] = 0.25
    """Standard deviation of its distance."""

    speed_deviation_mps: Annotated[Number, Field(ge=0, le=140)] = 0.1
    """Standard deviation of its relative speed."""


class FaultSection(Section):
    """A fault of a sensor."""

    at_s: Time = 0.0
    """When it begins: time after the beginning of the run, or of the entry of the timeline that orders it."""

    for_s: Period | None = None
    """How long it lasts; if not given, to the end of the run."""


class CameraBlackout(FaultSection):
    """Black frames."""

    sensor: Literal["camera"] = "camera"
    """Sensor that the fault is of."""

    fault: Literal["blackout"]
    """`blackout`: black frames, each with its own time."""


class CameraFrozen(FaultSection):
    """One frame again and again."""

    sensor: Literal["camera"] = "camera"
    """Sensor that the fault is of."""

    fault: Literal["frozen"]
    """`frozen`: the last frame before the fault, again and again."""

    time_stamp: TimeStamp = TimeStamp.DELIVERY
    """Time that the frame bears: that of its `exposure`, or of each `delivery`, as if it were new."""


class CameraDroppedFrames(FaultSection):
    """Frames that get lost."""

    sensor: Literal["camera"] = "camera"
    """Sensor that the fault is of."""

    fault: Literal["dropped_frames"]
    """`dropped_frames`: frames get lost, each by chance."""

    share: Share = 1.0
    """Share of them that do."""


class CameraLatency(FaultSection):
    """Frames that come late."""

    sensor: Literal["camera"] = "camera"
    """Sensor that the fault is of."""

    fault: Literal["latency"]
    """`latency`: frames come late."""

    delay_s: Annotated[Time, Field(le=60)] = 0.3
    """Time from their exposure to their delivery."""

    time_stamp: TimeStamp = TimeStamp.EXPOSURE
    """Which of both times they bear: `exposure` or `delivery`."""


AnyFault = Annotated[
    CameraBlackout | CameraFrozen | CameraDroppedFrames | CameraLatency,
    Field(discriminator="fault"),
]
"""Any fault of any sensor, known by its name."""


class Sensors(Section):
    """Sensors beside the camera."""

    lead: Lead = Lead()
    """The radar."""

    sign_reach_m: Length = 250.0
    """Distance up to which the map tells of signs ahead."""

    faults: tuple[AnyFault, ...] = ()
    """What is wrong with sensors, the camera among them, and when."""


def fault_of(written: AnyFault) -> Fault:
    """A fault of a scenario file in SI units.

    Parameters
    ----------
    written : AnyFault
        What the file has.
    """
    return Fault(_kind_of(written), written.at_s, math.inf if written.for_s is None else written.for_s)


def _kind_of(written: AnyFault) -> FaultKind:
    match written:
        case CameraBlackout():
            return Blackout()
        case CameraFrozen():
            return FrozenFrame(written.time_stamp)
        case CameraDroppedFrames():
            return DroppedFrames(written.share)
        case CameraLatency():
            return Latency(written.delay_s, written.time_stamp)
