"""The schema of the block ``timeline``: what is to happen when; ``do`` has one block for each of its subjects."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from fogsim.errors import UnknownNameError
from fogsim.scenario.expect.conditions import WrittenCondition
from fogsim.scenario.mistakes import mistakes_in
from fogsim.scenario.section import (
    MISTAKE,
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
    Visibility,
    Whole,
)
from fogsim.scenario.sensors.faults import AnyFault
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
    """How many lanes to the left; negative to the right."""

    to: Annotated[Whole, Field(ge=0, le=20)] | Literal["oncoming"] | None = None
    """Or the lane to go to: its number from the right, from 0; or `oncoming`, the one beyond the left lane, where the
    network lets vehicles overtake there (SUMO's `neigh`). Any other change leads back from it to the left lane."""

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
    """Distance of its middle from the lane's middle afterwards, to the left; `lanes: 0` moves it in its own lane, or,
    on a `path`, to the left of that."""

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
    """Lane: `right`, `left`, or its number from the right, from 0; by default the other one's, or the right one."""

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
        own = [key for key in ("on", "edges", "position_m") if key in self.model_fields_set]
        if self.like is not None and own:
            raise ValueError(f"give like, or a route ({' and '.join(own)}), not both")
        if self.like is not None and isinstance(self.lane, str):
            raise ValueError("lane: with like it must be a number, counted from 0 at the right")
        if self.on is not None and self.edges:
            raise ValueError("give on (a road by template) or edges (a network), not both")
        return self


class PathAction(Section):
    """A vehicle, or a body, moves along a path, on the lanes or off them, whoever is there."""

    points: Annotated[tuple[tuple[Place, Place] | tuple[Place, Place, Number], ...], Field(min_length=1)]
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


class SignalActions(Section):
    """What traffic lights show."""

    phase: Annotated[Whole, Field(ge=0, le=200)] | None = None
    """Phase of the program to go to, which goes on from there."""

    state: Annotated[str, Field(pattern="^(red|yellow|green|off|[rygGsuoO]{1,200})$")] | None = None
    """`red`, `yellow`, `green` or `off` for all links, or SUMO's letter for each link (`rrGGrr`), held in place of the
    program."""

    for_s: Period | None = None
    """Time after which the program goes on; without it, to the end of the run."""

    @model_validator(mode="after")
    def _one_state(self) -> Self:
        if (self.phase is None) == (self.state is None):
            raise ValueError("say what they show: phase or state, and not both")
        return self


class FogActions(Section):
    """How the fog changes, everywhere."""

    visibility_m: Visibility | None = None
    """Meteorological visibility to come to, where it is even or outside the banks."""

    density: Annotated[Number, Field(ge=0, le=1000)] | None = None
    """Or factor of the extinction coefficient that the scenario begins with."""

    over_s: Time = 0.0
    """Time that this takes."""

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if (self.visibility_m is None) == (self.density is None):
            raise ValueError("say how thick: visibility_m or density, and not both")
        return self


class LightActions(Section):
    """How daylight changes."""

    illuminance_lx: Annotated[Number, Field(ge=0, le=200_000)]
    """Horizontal illuminance to come to. If any is below 1000, where lamps light the road, they do in the whole run."""

    over_s: Time = 0.0
    """Time that this takes."""

    course: Literal["lux", "factors"] = "lux"
    """`lux`: by as many lux in each second; `factors`: by the same factor, as dusk and dawn do."""

    @model_validator(mode="after")
    def _never_dark(self) -> Self:
        if self.course == "factors" and self.illuminance_lx == 0.0:
            raise ValueError("no factor leads to illuminance_lx: 0; write 0.0001, an overcast night, or course: lux")
        return self


Doing = VehicleActions | SignalActions | FogActions | LightActions | AnyFault
"""What an entry does to one of its subjects."""

_KINDS: Mapping[str, type[Section]] = {"fog": FogActions, "light": LightActions}
_SIGNAL, _SENSOR = "signal.", "sensors."
_FAULTS: TypeAdapter[AnyFault] = TypeAdapter(AnyFault)


def _by_subject(written: object) -> object:
    """Read each block by what its subject is: fog, light, a sensor, traffic lights, or else a vehicle."""
    if not isinstance(written, dict):
        return written
    done: dict[str, tuple[object, ...]] = {}
    mistakes: list[InitErrorDetails] = []
    for subject, blocks in _flat(written):
        listed = blocks if isinstance(blocks, list | tuple) else [blocks]
        done[subject] = ()
        for place, block in enumerate(listed):
            at = (subject, place) if isinstance(blocks, list | tuple) else (subject,)
            try:
                done[subject] += (_read(subject, block),)
            except ValidationError as error:
                mistakes += [
                    InitErrorDetails(
                        type=PydanticCustomError(MISTAKE, "{message}", {"message": text}), loc=(*at, *inner), input=0
                    )
                    for inner, text in mistakes_in(_schema_of(subject), error, block)
                ]
    if mistakes:
        raise ValidationError.from_exception_data("do", mistakes)
    return done


def _flat(written: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Subjects and their blocks; ``--set`` makes blocks in blocks of a name with a dot."""
    for subject, block in written.items():
        if subject in ("signal", "sensors") and isinstance(block, dict):
            yield from ((f"{subject}.{name}", inner) for name, inner in block.items())
        else:
            yield str(subject), block


def _read(subject: str, block: object) -> object:
    if isinstance(block, Section):
        return block
    if subject.startswith(_SENSOR):
        sensor = subject.removeprefix(_SENSOR)
        return _FAULTS.validate_python({"sensor": sensor, **block} if isinstance(block, dict) else block)
    kind = _kind_of(subject)
    read = kind.model_validate(block)
    if not read.model_fields_set:
        message = f"no action given; allowed: {', '.join(kind.model_fields)}"
        mistake = InitErrorDetails(
            type=PydanticCustomError(MISTAKE, "{message}", {"message": message}), loc=(), input=0
        )
        raise ValidationError.from_exception_data("do", [mistake])
    return read


def _schema_of(subject: str) -> object:
    return AnyFault if subject.startswith(_SENSOR) else _kind_of(subject)


def _kind_of(subject: str) -> type[Section]:
    return SignalActions if subject.startswith(_SIGNAL) else _KINDS.get(subject, VehicleActions)


class TimelineEntry(Section):
    """Something that happens when a condition holds."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,99}$")] | None = None
    """Name in conditions, expectations and messages; `timeline.N` without one."""

    when: WrittenCondition
    """Condition: text such as `gap(ego, slow) < 80 m and ego.speed > 50 km/h`, or a mapping; see
    docs/reference/tests.md."""

    delay_s: Time = 0.0
    """Time from then until it begins."""

    repeat: Literal["once", "each"] = "once"
    """`once`: when the condition holds for the first time; `each`: each time that it comes to hold."""

    do: Annotated[dict[Id, Doing | tuple[Doing, ...]], BeforeValidator(_by_subject)]
    """What, by its subjects: the id of a vehicle (or `ego`), `signal.ID`, `fog`, `light`, `sensors.camera` and other
    sensors, each with a block or a list of blocks. `{}` in an entry with a name for nothing: it remembers that its
    condition has held, as `happened(NAME)`."""

    @field_validator("do")
    @classmethod
    def _something(cls, value: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        if not value and not info.data.get("name"):
            raise ValueError("must say what is done, or the entry must have a name by which happened(NAME) asks for it")
        return value


Timeline = tuple[TimelineEntry, ...]
"""The block."""
