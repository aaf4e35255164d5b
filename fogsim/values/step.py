"""One finished instant of a run: what metrics and recorders get."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fogsim.units import clock_time, visibility_from_extinction
from fogsim.values.belief import Belief, FogProfile
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.command import Command, SpeedAdvice, Stretch
from fogsim.values.estimate import Estimate
from fogsim.values.fault import Fault
from fogsim.values.fog import FogField
from fogsim.values.image import View
from fogsim.values.light import Lamp
from fogsim.values.observation import Observation
from fogsim.values.road import SignMap
from fogsim.values.script import Begun
from fogsim.values.traffic import Collision, Leader, SignalAhead, TrafficState


class Reason(StrEnum):
    """Why an event was not played."""

    NOT_REACHED = "its time, position or gap was not reached"
    NEVER_SEEN = "the vehicle was never on the road"
    LEFT = "the vehicle left the road before"
    NEVER_HELD = "its condition never held"
    NO_LANE = "there was no such lane"
    NOT_AHEAD = "the vehicle to follow was not ahead"
    NO_PLACE = "there was no place for the vehicle, or such a vehicle already"


@dataclass(frozen=True, slots=True)
class UnplayedEvent:
    """An event that never began.

    Attributes
    ----------
    name : str
        Key path in the scenario, and what it is.
    reason : Reason
        Why.
    """

    name: str
    reason: Reason

    def __str__(self) -> str:
        return f"{self.name}: {self.reason.value}"


@dataclass(frozen=True, slots=True)
class Unplayed:
    """What of a script has not been played; empty if all was.

    Attributes
    ----------
    events : tuple of UnplayedEvent
        Events that never began, in the order of the scenario.
    vehicles : tuple of str
        Vehicles that events or ``traffic.keep_lane`` name and that were never on the road, sorted.
    """

    events: tuple[UnplayedEvent, ...] = ()
    vehicles: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.events or self.vehicles)

    def __add__(self, other: "Unplayed") -> "Unplayed":
        """What two parts of a script have not played, together."""
        return Unplayed(self.events + other.events, tuple(sorted({*self.vehicles, *other.vehicles})))

    def __str__(self) -> str:
        return "; ".join(self.lines)

    @property
    def lines(self) -> list[str]:
        """One line on each event and each vehicle."""
        return [*map(str, self.events), *(f"vehicle {v!r} was never on the road" for v in self.vehicles)]

    @property
    def is_final(self) -> bool:
        """True if a longer run would not have played all of it either."""
        final = Reason.LEFT, Reason.NO_LANE, Reason.NOT_AHEAD, Reason.NO_PLACE
        return any(event.reason in final for event in self.events)


NOTHING_UNPLAYED = Unplayed()


class Ending(StrEnum):
    """Why a run is over."""

    ARRIVED = "arrived"
    COLLISION = "collision"
    TIME = "time"
    LEFT_NETWORK = "left the network"
    END_CONDITION = "end condition"
    """The scenario's ``end_when`` holds."""

    COHORT_LEFT = "cohort left"
    """Without an ego: all vehicles of the cohort (``traffic.cohort_s``) have left."""

    NONE_LEFT = "nobody left"
    """Without an ego: all vehicles have gone, and no more will come."""


@dataclass(frozen=True, slots=True)
class RoadSection:
    """A section of the ego's route that is advised by itself, and what the visibility meter on it measures.

    Attributes
    ----------
    stretch : Stretch
        The section.
    extinction : float
        Extinction coefficient at the meter [1/m].
    speed_limit : float
        Speed limit where the section begins [m/s], as the map has it; ``inf`` where that is not known.
    reported : float or None
        Extinction coefficient that the nearest sensor next to the road has reported last [1/m]: with errors, and old;
        None while it has reported nothing.
    """

    stretch: Stretch
    extinction: float
    speed_limit: float
    reported: float | None = None


@dataclass(frozen=True, slots=True)
class LampEffects:
    """What the ego's lamps do by night.

    Attributes
    ----------
    own_sight : float
        Distance at which a small object on the road reaches visibility level 7 by them [m].
    veils : tuple of float
        Veil of disability glare that they lay over the eyes of each driver whom they meet, or who has them in the
        mirrors [cd/m²].
    """

    own_sight: float
    veils: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Truth:
    """What no estimator and no agent may see.

    Attributes
    ----------
    extinction : float
        Extinction coefficient at the ego's camera, or at the visibility meters where there is no ego [1/m].
    extinction_ahead : float
        Mean extinction coefficient from the camera to one visibility length ahead along the heading [1/m]: what a
        camera that looks ahead can at best report where the fog varies.
    camera : Camera or None
        The true calibration of the ego's camera; None where no camera was there.
    pose : CameraPose or None
        Where the camera truly is, too.
    fog : FogField or None
        The fog at this instant as a field, too.
    signs : SignMap or None
        Every sign that stands in the world, too.
    vehicle_extinctions : (n,) float64 or None
        Extinction coefficient at the eyes of each driver of `Step.traffic` [1/m]; None where no one asked.
    sections : tuple of RoadSection
        Visibility meters next to the ego's route, or next to ``traffic.along``, in the direction of travel, where
        sections of it are advised.
    route : (n, 3) float64 or None
        Polyline along the ego's route, or along ``traffic.along`` [m]; None where there is neither.
    faults : tuple of Fault
        Faults of the ego's sensors in force now.
    carriageways : mapping from str to tuple of str
        Ids of the lanes for vehicles of each edge, from the right; empty where no network is known.
    lamp_effects : LampEffects or None
        What the ego's lamps do; None by day.
    profile : FogProfile or None
        The fog at places along the route behind the ego and ahead, with deviations of 0; None where no route is known.
    illuminance : float or None
        Horizontal illuminance of the sky [lx]; None where it is not known.
    """

    extinction: float
    extinction_ahead: float
    camera: Camera | None = None
    pose: CameraPose | None = None
    fog: FogField | None = None
    signs: SignMap | None = None
    vehicle_extinctions: NDArray[np.float64] | None = None
    sections: tuple[RoadSection, ...] = ()
    route: NDArray[np.float64] | None = None
    faults: tuple[Fault, ...] = ()
    carriageways: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    lamp_effects: LampEffects | None = None
    profile: FogProfile | None = None
    illuminance: float | None = None

    @property
    def visibility(self) -> float:
        """Meteorological visibility at the camera [m]."""
        return visibility_from_extinction(self.extinction)

    @property
    def visibility_ahead(self) -> float:
        """Meteorological visibility of the fog ahead [m]."""
        return visibility_from_extinction(self.extinction_ahead)


@dataclass(frozen=True, slots=True)
class Cohort:
    """Vehicles that are due to depart in the first ``traffic.cohort_s`` of a run.

    Attributes
    ----------
    vehicles : frozenset of str
        Ids of those that have been due so far.
    waiting : int
        How many of them find no room to enter the road yet.
    unfinished : int
        How many of them have not left yet: those on the road, those waiting, and those removed after a collision.
    """

    vehicles: frozenset[str]
    waiting: int
    unfinished: int


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficStep:
    """One finished instant of the traffic, whether an ego is in it or not.

    Attributes
    ----------
    index : int
        Number of the camera period, from 0.
    time : float
        Simulated time since the run began [s].
    traffic : TrafficState
        Every vehicle that is read.
    collisions : tuple of Collision
        Collisions that were new in this period.
    truth : Truth
        The fog as it is.
    command : Command
        What was in force while the traffic moved to this instant.
    ending : Ending or None
        Why the run is over, None while it goes on.
    unplayed : Unplayed
        What of the script has not been played, on the step that ends a run; empty on all others.
    begun : tuple of Begun
        What of the script began in this period.
    waiting : int
        Without an ego: vehicles that were to come by now and find no room to; 0 with one, where no one counts them.
    cohort : Cohort or None
        The vehicles that metrics of the cohort are about; None where the scenario has no ``traffic.cohort_s``.
    """

    index: int
    time: float
    traffic: TrafficState
    collisions: tuple[Collision, ...]
    truth: Truth
    command: Command
    ending: Ending | None
    unplayed: Unplayed = NOTHING_UNPLAYED
    begun: tuple[Begun, ...] = ()
    waiting: int = 0
    cohort: Cohort | None = None

    def time_of(self, collision: Collision) -> float:
        """Time of a collision since the run began [s]: its own is by the clock of the traffic simulation.

        Parameters
        ----------
        collision : Collision
            One of this step.
        """
        return clock_time(self.time + collision.time - self.traffic.time)


@dataclass(frozen=True, slots=True)
class EquippedVehicle:
    """What another vehicle with a camera and estimators of its own sees, believes and does at one instant.

    Attributes
    ----------
    vehicle_id : str
        Its id.
    place : float
        How far along the ego's route its front bumper is [m].
    extinction, extinction_ahead : float
        The truth at its camera, and ahead of it, see `Truth` [1/m].
    estimates : tuple of Estimate
        What its estimators make of its picture.
    belief : Belief
        What it believes.
    advice : SpeedAdvice
        What it is advised from now on.
    lamps : Lamp
        What it lights from now on.
    """

    vehicle_id: str
    place: float
    extinction: float
    extinction_ahead: float
    estimates: tuple[Estimate, ...]
    belief: Belief
    advice: SpeedAdvice
    lamps: Lamp


@dataclass(frozen=True, slots=True, kw_only=True)
class Step(TrafficStep):
    """One finished instant of the closed loop about an ego.

    Attributes
    ----------
    index, time, traffic, collisions, truth, command, ending, unplayed, begun, waiting, cohort
        See `TrafficStep`.
    ego : int
        Row of the ego vehicle in `traffic`.
    route_position : float
        How far the ego has driven along its route [m]; off the lanes, where it left them.
    speed_limit : float
        Speed limit where the ego is [m/s]; ``inf`` where it is off the lanes (`TrafficState.off_lanes`).
    leader : Leader or None
        The vehicle ahead.
    signal_ahead : SignalAhead or None
        The next traffic light on the ego's way.
    view : View
        The drawn scene before fog and camera.
    observation : Observation
        What the ego knows: camera frame and sensors.
    estimates : tuple of Estimate
        What the estimators make of it.
    belief : Belief
        What is believed after this step.
    reading_radius : float
        Distance from the ego up to which vehicles are in `traffic` [m].
    equipped : tuple of EquippedVehicle
        Other vehicles with a camera of their own, as far as they are in `traffic` and on the ego's way.
    """

    ego: int
    route_position: float
    speed_limit: float
    leader: Leader | None
    view: View
    observation: Observation
    estimates: tuple[Estimate, ...]
    belief: Belief
    reading_radius: float = math.inf
    signal_ahead: SignalAhead | None = None
    equipped: tuple[EquippedVehicle, ...] = ()
