"""Keys of what a timeline makes a vehicle or person do."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, field_validator, model_serializer, model_validator

from fogsim.errors import UnknownNameError
from fogsim.scenario.section import (
    Coordinate,
    Deceleration,
    Distance,
    Flag,
    Id,
    Length,
    Number,
    Period,
    Place,
    Section,
    SpeedKmh,
    Time,
    Whole,
)
from fogsim.scenario.timeline.lamps import LampActions
from fogsim.traffic.templates import VEHICLE_KINDS
from fogsim.values.script import Shape


class SpeedAction(Section):
    """A vehicle comes to a speed and holds it, whatever the limit and advice say; it hits no one for that."""

    to_kmh: SpeedKmh | None = None
    """Speed that a vehicle comes to, no higher than its type's `maxSpeed`."""

    like: Id | None = None
    """Or another vehicle (its id, or `ego`) whose speed at the beginning of the action it comes to."""

    profile: tuple[tuple[Time, SpeedKmh], ...] = ()
    """Or times from the beginning, and the speeds that it has then [km/h]; evenly in between, and the last one on."""

    factor: Annotated[Number, Field(ge=0, le=100)] = 1.0
    """Factor on that speed."""

    plus_kmh: Annotated[Number, Field(ge=-500, le=500)] = 0.0
    """What is added to it."""

    continuous: Flag = False
    """Whether it comes to the speed that the other vehicle has at each moment, not only at the beginning."""

    over_s: Time | None = None
    """Time that this takes, as far as its type can speed up; without it and the next, as fast as it can."""

    rate_mps2: Deceleration | None = None
    """Acceleration or deceleration, in place of the time."""

    shape: Shape = Shape.LINEAR
    """How the speed goes over: `linear`, `sinusoidal` (smooth at both ends), or `step`: as fast as the vehicle can."""

    for_s: Period | None = None
    """Time from the beginning until the driver drives by himself again; without it, to the end of the run."""

    @model_validator(mode="after")
    def _one_pace(self) -> Self:
        if [self.to_kmh is None, self.like is None, not self.profile].count(False) != 1:
            raise ValueError("say which speed: to_kmh, like (another vehicle) or profile, and only one of them")
        if [time for time, _ in self.profile] != sorted({time for time, _ in self.profile}):
            raise ValueError("profile: each time must be later than the one before")
        if self.continuous and self.like is None:
            raise ValueError("continuous goes with like, the vehicle whose speed it follows")
        if self.like is None and (self.factor != 1.0 or self.plus_kmh != 0.0):
            raise ValueError("factor and plus_kmh go with like, the vehicle whose speed they change")
        if self.profile and self.shape is Shape.SINUSOIDAL:
            raise ValueError("shape goes with to_kmh or like: a profile is even between its times")
        given = [key for key in ("over_s", "rate_mps2") if getattr(self, key) is not None]
        if len(given) > 1 or (given and (self.profile or self.shape is Shape.STEP)):
            raise ValueError("give over_s, rate_mps2, profile or shape: step, not two of them")
        return self


class BrakeAction(Section):
    """A vehicle brakes, holds the lower speed, and drives on."""

    to_kmh: SpeedKmh = 0.0
    """Speed that it brakes to; 0 is a standstill."""

    deceleration_mps2: Deceleration = 4.0
    """How hard it brakes, up to its type's `emergencyDecel`."""

    hold_s: Period | None = 30.0
    """How long it keeps that speed, from the beginning of the braking; null for the rest of the run."""

    @model_serializer(mode="wrap")
    def _with_null(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # Without the null, the default would be read back.
        return {**dump(self), **({"hold_s": None} if self.hold_s is None else {})}


class BreakDownAction(Section):
    """A vehicle comes to a standstill and stays there."""

    deceleration_mps2: Deceleration = 3.0
    """How hard it brakes."""

    lamps: Flag = True
    """Whether its lamps stay lit."""

    hazard_lights: Flag = False
    """Whether it switches its hazard lights on."""


class FollowAction(Section):
    """A vehicle keeps a time headway to another one ahead of it."""

    vehicle: Id
    """The other one: its id, or `ego`."""

    headway_s: Annotated[Time, Field(le=60)] = 0.0
    """Gap, bumper to bumper, over its own speed."""

    gap_m: Annotated[Number, Field(ge=-100, le=1000)] = 2.0
    """Gap at standstill, to which the headway adds; negative between other points than the bumpers."""

    for_s: Period | None = None
    """How long; without it, to the end of the run."""

    @model_validator(mode="after")
    def _some_gap(self) -> Self:
        if not {"headway_s", "gap_m"} & self.model_fields_set:
            raise ValueError("say how far behind: headway_s, gap_m or both")
        return self


class ArriveAction(Section):
    """A vehicle drives so that it is at a place when another one is at a place of its own."""

    vehicle: Id
    """The other one: its id, or `ego`."""

    distance_m: Distance
    """How far it has driven by then since it came onto the road."""

    its_distance_m: Distance
    """How far the other one has."""

    to_kmh: Annotated[Number, Field(ge=-500, le=500)] | None = None
    """Speed that it has there, and keeps; any if it is not given."""

    factor: Annotated[Number, Field(ge=0, le=100)] = 0.0
    """Factor on the other one's speed, to which `to_kmh` is added."""

    steady_m: Distance = 0.0
    """Distance before that place over which it already has that speed."""

    steady_s: Time = 0.0
    """Or the time before its arrival for which it already has it."""

    @model_validator(mode="after")
    def _with_a_speed(self) -> Self:
        given = [key for key in ("factor", "steady_m", "steady_s") if getattr(self, key)]
        if given and self.to_kmh is None:
            raise ValueError(f"{given[0]} goes with to_kmh, which is missing")
        if self.steady_m and self.steady_s:
            raise ValueError("give steady_m or steady_s, not both")
        return self


class StopAction(Section):
    """A vehicle stops at a place, stands there, and drives on."""

    position_m: Place | None = None
    """Place along the ego's route, or `traffic.along`, where its front bumper comes to stand."""

    after_m: Distance | None = None
    """Or way to the place from where the vehicle is."""

    deceleration_mps2: Deceleration = 3.0
    """How hard it brakes, as late as it can."""

    for_s: Period | None = None
    """How long it stands; without it, to the end of the run."""

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.position_m is None) == (self.after_m is None):
            raise ValueError("say where: position_m or after_m, and not both")
        return self


LONGEST_CHANGE = 60.0
"""Longest time of a change of lane [s]."""


class LaneAction(Section):
    """A vehicle changes lane, whoever is there, as far as it does not hit anybody."""

    lanes: Annotated[Whole, Field(ge=-4, le=4)] | None = None
    """How many lanes to the left, negative to the right; in left-hand traffic the other way round."""

    to: Annotated[Whole, Field(ge=0, le=20)] | Literal["oncoming"] | None = None
    """Or the lane to go to: its number from the right, from 0 (in left-hand traffic: from the left); or `oncoming`, the
    one beyond the left lane, where the network lets vehicles overtake there (SUMO's `neigh`). Any other change leads
    back from it to the left lane."""

    duration_s: Annotated[Time, Field(le=LONGEST_CHANGE)] | None = None
    """Time that the way over takes in pictures and positions; 3 s a lane if not given. For SUMO it changes at once."""

    distance_m: Length | None = None
    """Or the distance that it drives meanwhile, at the speed with which it begins; for at most 60 s."""

    indicator_s: Annotated[Time, Field(le=60)] = 0.0
    """Time for which it indicates before; it does until it is over. 0 for not at all."""

    to_lane_of: Id | None = None
    """Or another vehicle (its id, or `ego`) in whose lane it goes, or `lanes` to the left of it."""

    stay_s: Period = 60.0
    """How long it stays there."""

    offset_m: Annotated[Number, Field(ge=-10, le=10)] | None = None
    """Distance of its middle from the lane's middle afterwards, to the left (in left-hand traffic: to the right);
    `lanes: 0` moves it in its own lane, or, on a `path`, to the left of that."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.duration_s is not None and self.distance_m is not None:
            raise ValueError("takes either duration or distance")
        is_stated = self.lanes is not None or self.to_lane_of is not None
        if is_stated == (self.to is not None):
            raise ValueError(
                "say where: lanes (to the left, negative to the right), to (number of the lane) or to_lane_of"
            )
        return self


class DepartAction(Section):
    """A vehicle that is not there yet comes onto the road: near another one, whose way it takes, or on its own."""

    like: Id | None = None
    """Another one, or `ego`, near which it begins: its type and the rest of its way are the new one's."""

    gap_m: Place | None = None
    """Gap to it along the road, bumper to bumper: positive ahead, negative behind."""

    type: str | None = None
    """Its type, as for actors; by default that of the other one, or a car."""

    on: Id | None = None
    """Without another one, its way on a road by template; by default `same_way`."""

    edges: tuple[Id, ...] = ()
    """Or its way on a network: edges; between those that do not follow one another SUMO finds the way."""

    position_m: Distance | None = None
    """Position of its front bumper along its way, or along the first of its edges; by default at the beginning."""

    lane: Literal["right", "left"] | Annotated[Whole, Field(ge=0, le=20)] | None = None
    """Lane: `right`, `left`, or its number from the right, from 0; by default the other one's, or the right one. In
    left-hand traffic the other way round."""

    speed_kmh: SpeedKmh | None = None
    """Its speed; by default that of the other one, or what its type and the limit allow."""

    @field_validator("type")
    @classmethod
    def _known_type(cls, value: str | None) -> str | None:
        if value is not None and value not in VEHICLE_KINDS:
            raise ValueError(str(UnknownNameError("vehicle type", value, VEHICLE_KINDS)))
        return value

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.like is None) != (self.gap_m is None):
            raise ValueError("like and gap_m go together: near whom, and how far")
        own = [key for key in ("on", "edges", "position_m") if getattr(self, key) not in (None, ())]
        if self.like is not None and own:
            raise ValueError(f"give like, or a route ({' and '.join(own)}), not both")
        if self.like is not None and isinstance(self.lane, str):
            raise ValueError("lane: with like it must be a number, counted from 0 at the right")
        if self.on is not None and self.edges:
            raise ValueError("give on (a road by template) or edges (a network), not both")
        return self


class PathAction(Section):
    """A vehicle, or a body, moves along a path, on the lanes or off them, whoever is there."""

    points: Annotated[
        tuple[tuple[Coordinate, Coordinate] | tuple[Coordinate, Coordinate, Number], ...], Field(min_length=1)
    ]
    """x and y of its points in the network's coordinates [m], each with a heading [deg, to the left of x] or none:
    then it faces the way that it goes."""

    at_s: tuple[Time, ...] = ()
    """When it is at each point, from the beginning; without these it moves at its speed, which other entries order."""

    ahead_m: Distance = 0.0
    """How far its front bumper is ahead of the point that follows the path."""

    speed_kmh: SpeedKmh | None = None
    """Speed with which it begins; without it, the one that it has."""

    stays: Flag = False
    """Whether it stays at the end also on a lane, where a vehicle otherwise drives on; off the lanes all stay."""

    origin: Literal["map", "place", "vehicle"] = "map"
    """Where points and headings count from: the network's origin; the vehicle's point at the beginning, along the
    network's axes (`place`), or ahead of it and to its left (`vehicle`)."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.at_s and (len(self.at_s) != len(self.points) or list(self.at_s) != sorted({*self.at_s})):
            raise ValueError("at_s has a time for each of points, each later than the one before")
        if len({len(point) for point in self.points}) > 1 or len(self.points[0]) + len(self.points) < 4:
            raise ValueError("give a heading with each of points or with none, and with a single one")
        return self


class WalkAction(Section):
    """A person who waits, or walks, walks on at a speed."""

    speed_kmh: Annotated[SpeedKmh, Field(ge=0.5, le=20)] = 5.0
    """The speed."""


class VehicleActions(Section):
    """What a vehicle does, or a person on foot, who can `walk`; what is given begins together."""

    speed: SpeedAction | None = None
    """Come to a speed and hold it."""

    brake: BrakeAction | None = None
    """Brake, hold the lower speed, and drive on."""

    follow: FollowAction | None = None
    """Keep a headway to another vehicle."""

    arrive: ArriveAction | None = None
    """Be at a place when another vehicle is at one."""

    stop: StopAction | None = None
    """Stop at a place."""

    change_lane: LaneAction | None = None
    """Change lane."""

    break_down: BreakDownAction | None = None
    """Come to a standstill for good."""

    lamps: LampActions | None = None
    """Switch lamps by hand, or let them fail."""

    hazard_lights: Flag | None = None
    """Whether both indicators are lit."""

    leave: Literal[True] | None = None
    """Leave the road at once."""

    depart: DepartAction | None = None
    """Come onto the road, for an id that is in no file."""

    take_route: tuple[Id, ...] | None = None
    """Drive to the first of these edges, on the way that SUMO finds, and then along them; not for the ego."""

    path: PathAction | None = None
    """Move along a path, also onto the road, for a vehicle of a route file that waits (`depart="triggered"`)."""

    walk: WalkAction | None = None
    """Walk, for a person."""

    @model_validator(mode="after")
    def _one_motion(self) -> Self:
        motions = ("speed", "brake", "follow", "arrive", "stop", "break_down")
        given = [key for key in motions if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueError(f"{' and '.join(given)} cannot begin together: each sets the speed; take two entries")
        if self.walk and len(self.model_fields_set) > 1:
            raise ValueError("walk must be the only key: a person does nothing else")
        if self.leave and len(self.model_fields_set) > 1:
            raise ValueError("leave must be the only key: the vehicle is gone")
        if self.depart and len(self.model_fields_set) > 1:
            raise ValueError("depart must be the only key: add another entry for what the vehicle does then")
        return self
