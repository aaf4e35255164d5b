"""The schema of the blocks ``road``, ``demand`` and ``actors``: roads by template, and who drives on them."""

import math
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, WrapValidator, field_validator, model_validator

from fogsim.errors import UnknownNameError, suggest
from fogsim.scenario.section import (
    Distance,
    Flag,
    Id,
    Length,
    NewId,
    Number,
    Reach,
    Section,
    Share,
    SpeedKmh,
    Time,
    Whole,
)
from fogsim.scenario.timeline.lamps import LampActions, lamp_mistake
from fogsim.traffic.templates import RAMP, ROAD_TEMPLATES, VEHICLE_KINDS, measures
from fogsim.units.quantities import is_quantity, parse_quantity

_ROUNDING = 1e-6


def _signed_percent(value: object) -> object:
    is_percent = isinstance(value, str) and is_quantity(value) and value.rstrip().endswith("%")
    return parse_quantity(str(value), "") if is_percent else value


Grade = Annotated[Number, Field(ge=-0.15, le=0.15), BeforeValidator(_signed_percent)]
"""A grade [-], perhaps written in per cent; positive climbs."""

Flow = Annotated[Number, Field(ge=0, le=20_000)]
"""A flow of traffic [veh/h]."""


NO_MEASURES = frozenset({"template", "obstructions", "sign_spacing_m"})
"""Keys of a road that every template has, and that are none of its measures."""

_SIZES = {"wall": (0.3, 3.0, 60.0), "hedge": (1.2, 2.2, 60.0), "building": (9.0, 7.0, 20.0), "truck": (2.5, 3.8, 12.0)}
"""Default width, height and length of each kind of obstruction [m]."""


class ObstructionSection(Section):
    """Something next to the road that hides what is behind it from the camera."""

    kind: Literal["wall", "hedge", "building", "truck"]
    """What it is."""

    along: Id = "same_way"
    """Way next to which it is."""

    at_m: Distance
    """Where along that way it begins."""

    side: Literal["left", "right"] = "right"
    """On which side of the road, beyond the oncoming lanes on the left."""

    distance_m: Distance = 3.0
    """From the border of the carriageway to its near side."""

    length_m: Annotated[Length, Field(ge=0.1)] | None = None
    """Its length along the road; by default 60 of walls and hedges, 20 of buildings, 12 of trucks."""

    width_m: Annotated[Length, Field(ge=0.1)] | None = None
    """Its size across the road; by default 0.3, 1.2, 9 and 2.5."""

    height_m: Annotated[Length, Field(ge=0.1)] | None = None
    """Its height; by default 3, 2.2, 7 and 3.8."""

    def sizes(self) -> tuple[float, float, float]:
        """Width, height and length [m]."""
        given = (self.width_m, self.height_m, self.length_m)
        width, height, length = (
            one if one is not None else usual for one, usual in zip(given, _SIZES[self.kind], strict=True)
        )
        return width, height, length


class Road(Section):
    """A road by template, in place of a network; what is not written is as usual for the template."""

    template: str
    """Kind of road."""

    length_m: Annotated[Length, Field(ge=50, le=50_000)] | None = None
    """Length of the ego's way."""

    lanes: Annotated[Whole, Field(ge=1, le=6)] | None = None
    """Lanes in the ego's direction."""

    oncoming_lanes: Annotated[Whole, Field(ge=0, le=6)] | None = None
    """Lanes in the other direction; 0 for none."""

    lane_width_m: Annotated[Length, Field(ge=2.2, le=6)] | None = None
    """Width of each lane."""

    median_m: Annotated[Distance, Field(le=100)] | None = None
    """Distance between the inner borders of the two directions; 0 for a road whose directions share a line."""

    limit_kmh: Annotated[SpeedKmh, Field(ge=5)] | None = None
    """Speed limit."""

    curve_at_m: Distance | None = None
    """Where a curve begins; on a country road, how long the straights before its curves are."""

    curve_radius_m: Annotated[Length, Field(ge=30, le=100_000)] | None = None
    """Radius of the curve."""

    curve_turn_deg: Annotated[Number, Field(ge=-180, le=180)] | None = None
    """By how much it turns to the left; negative to the right, 0 for none."""

    grade: Grade | None = None
    """Grade; positive climbs."""

    grade_at_m: Distance | None = None
    """Where the grade begins."""

    grade_length_m: Length | None = None
    """How long it is, with its vertical curves; the road is level after it, and on a country road goes down again."""

    lights: Flag | None = None
    """Whether a crossing has traffic lights; without, the road that crosses the ego's gives way."""

    footways: Flag | None = None
    """Whether there are footways next to the road; where streets cross, with crossings on foot over all of them."""

    footway_width_m: Annotated[Length, Field(ge=1, le=10)] | None = None
    """Width of each footway."""

    zebra_crossings_m: tuple[Distance, ...] | None = None
    """Where persons cross a road with footways: places of the crossings' middles along it."""

    side_limit_kmh: Annotated[SpeedKmh, Field(ge=5)] | None = None
    """Speed limit of the road that meets the ego's."""

    radius_m: Annotated[Length, Field(ge=12, le=100)] | None = None
    """Radius of a roundabout, to the middle of its lane."""

    ramp_at_m: Annotated[Distance, Field(ge=100)] | None = None
    """Where the lane begins on which those who come from a ramp speed up."""

    ramp_length_m: Annotated[Length, Field(ge=150)] | None = None
    """Length of the ramp."""

    merge_length_m: Annotated[Length, Field(ge=50)] | None = None
    """Length of the lane to speed up on."""

    tunnel_at_m: Distance | None = None
    """Where a tunnel begins."""

    tunnel_length_m: Length | None = None
    """Its length."""

    tunnel_height_m: Annotated[Length, Field(ge=4)] | None = None
    """Its height."""

    sign_spacing_m: Annotated[Reach, Field(ge=20)] = math.inf
    """Distance between signs that repeat the speed limit on the right of the ego's way; inf for none."""

    obstructions: tuple[ObstructionSection, ...] = ()
    """What stands next to the road and hides what is behind it from the camera; drivers see through it."""

    @field_validator("template")
    @classmethod
    def _known_template(cls, value: str) -> str:
        if value not in ROAD_TEMPLATES:
            raise ValueError(str(UnknownNameError("road template", value, ROAD_TEMPLATES)))
        return value

    @model_validator(mode="after")
    def _measures_of_the_template(self) -> Self:
        has = [key for key in type(self).model_fields if measure_of(key)[0] in measures(self.template)]
        for key in self.model_fields_set - NO_MEASURES:
            if key not in has and getattr(self, key) is not None:
                raise ValueError(f"a {self.template} has no {key}; {suggest(key, has)}")
        return self


_SI = {"m": 1.0, "kmh": 1.0 / 3.6, "deg": math.pi / 180.0}


def measure_of(key: str) -> tuple[str, float]:
    """Name of a template's measure by its key in a file, and its SI unit's worth in the file's."""
    stem, _, suffix = key.rpartition("_")
    return (stem, _SI[suffix]) if suffix in _SI else (key, 1.0)


class PersonsSection(Section):
    """Persons on foot on a road with footways; they are there from the beginning, and differ with the seed."""

    along_pph: Flow = 0.0
    """Persons who walk along each footway, in both directions together [persons/h]."""

    across_pph: Flow = 0.0
    """Persons who cross at each zebra crossing, from both sides together [persons/h]."""


class DemandSection(Section):
    """Traffic next to the actors, on a road by template: it is there from the beginning, and differs with the seed."""

    same_way_vph: Flow = 0.0
    """Vehicles that drive as the ego does."""

    oncoming_vph: Flow = 0.0
    """Vehicles that come towards it."""

    ramp_vph: Flow = 0.0
    """Vehicles that come from a ramp."""

    north_vph: Flow = 0.0
    """Vehicles that come from the left, where a road meets the ego's, which comes from the west."""

    south_vph: Flow = 0.0
    """Vehicles that come from the right there."""

    persons: PersonsSection = PersonsSection()
    """Persons on foot."""

    turning: Share = 0.2
    """Share of vehicles that turn where roads meet, half of them to either side."""

    mix: dict[str, Share] | None = None
    """Shares of types of vehicles; what they leave is cars. By default as usual for the template."""

    @field_validator("mix")
    @classmethod
    def _known_types(cls, value: dict[str, float] | None) -> dict[str, float] | None:
        if value is None:
            return None
        for name in value:
            _check_type(name)
        rest = 1.0 - math.fsum(share for name, share in value.items() if name != "car")
        if rest < -_ROUNDING or ("car" in value and abs(rest - value["car"]) > _ROUNDING):
            raise ValueError(f"shares of types must together be 1, and are {math.fsum(value.values()):g}")
        return {**value, "car": max(rest, 0.0)}


def _all_or_some(value: object, _: object) -> object:
    if isinstance(value, dict | LampActions):
        return LampActions.model_validate(value)
    word = {True: "on"}.get(value, value) if isinstance(value, bool) else value
    if word not in ("on", "failed"):
        raise ValueError("must be on, failed, or a block of lamps such as {position: {left: failed}}")
    return word


def _check_type(name: str) -> str:
    if name not in VEHICLE_KINDS:
        raise ValueError(str(UnknownNameError("vehicle type", name, VEHICLE_KINDS)))
    return name


_PERSON = "person"
"""Type of actors on foot."""

_OF_PERSONS = frozenset({"side", "crosses_at_m", "waits"})
_OF_BOTH = frozenset({"type", "on", "position_m", "speed_kmh", "depart_s"})


class ActorSection(Section):
    """A vehicle, or a person on foot, and where it is when the run begins."""

    type: str = "car"
    """Type of the vehicle; or `person`, who walks on the footways of a road by template."""

    on: Id | None = None
    """Way that it takes on a road by template; by default `same_way`, or that of the actor that it is placed by."""

    edges: tuple[Id, ...] = ()
    """Way that it takes on a network of one's own: edges, one after the other; by default as `on`."""

    lane: Literal["right", "left"] | Annotated[Whole, Field(ge=0, le=9)] = "right"
    """Lane: `right`, `left`, or its number from the right, from 0; in left-hand traffic the other way
    round."""

    position_m: Distance | None = None
    """Position of its front bumper along its way; 200 where nothing else places it."""

    ahead_of: Id | None = None
    """It is ahead of this actor, by `gap_m`, bumper to bumper."""

    behind: Id | None = None
    """It is behind this actor, by `gap_m`."""

    beside: Id | None = None
    """It is next to this actor, front by front, in another lane."""

    gap_m: Length | None = None
    """That gap."""

    speed_kmh: SpeedKmh | None = None
    """Speed with which it begins, which it keeps where nothing slows it, and never exceeds; by default that of the road
    and type, and 5 of persons."""

    depart_s: Time | None = None
    """When it appears; the ego's appearance begins the run. By default 0, or as the actor that it is placed by."""

    stands: Flag = False
    """Whether it stands still for good."""

    lamps: Annotated[Literal["on", "failed"] | LampActions, WrapValidator(_all_or_some)] = "on"
    """Whether its lamps shine (`on`), have `failed`, or which of them are what when the run begins, as in `timeline`:
    `{position: {left: failed}}`."""

    keeps_lane: Flag | None = None
    """Whether it stays in its lane where nothing scripted makes it change; by default all do but those on a ramp."""

    side: Literal["left", "right"] = "right"
    """Side of the road on whose footway a person begins."""

    crosses_at_m: Distance | None = None
    """Place along its way of the crossing at which a person crosses; without it, it walks on to the way's end."""

    waits: Flag = False
    """Whether a person waits where it begins until the timeline says `walk`."""

    @field_validator("type")
    @classmethod
    def _known_type(cls, value: str) -> str:
        if value not in VEHICLE_KINDS and value != _PERSON:
            raise ValueError(str(UnknownNameError("type", value, (*VEHICLE_KINDS, _PERSON))))
        return value

    @property
    def is_person(self) -> bool:
        """Whether it is on foot."""
        return self.type == _PERSON

    @model_validator(mode="after")
    def _keys_of_its_kind(self) -> Self:
        fields = type(self).model_fields
        # A scenario that is written out in full has the defaults of the others' keys, too.
        given = {key for key in self.model_fields_set if getattr(self, key) != fields[key].default}
        others = given - _OF_BOTH - _OF_PERSONS if self.is_person else given & _OF_PERSONS
        for key in sorted(others):
            has = sorted(_OF_BOTH | _OF_PERSONS if self.is_person else set(fields) - _OF_PERSONS)
            raise ValueError(f"a {self.type} has no {key}; {suggest(key, has)}")
        return self

    @model_validator(mode="after")
    def _placed_once(self) -> Self:
        given = [key for key in ("position_m", "ahead_of", "behind", "beside") if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueError(f"give one of position_m, ahead_of, behind and beside, got {' and '.join(given)}")
        if (self.gap_m is not None) != (given in (["ahead_of"], ["behind"])):
            raise ValueError("gap_m goes with ahead_of or behind, which need it")
        if self.stands and self.speed_kmh:
            raise ValueError(f"it stands, and speed_kmh is {self.speed_kmh:g}; leave one of them out")
        return self

    @property
    def placed_by(self) -> str | None:
        """Id of the actor that it is placed by."""
        return self.ahead_of or self.behind or self.beside

    @property
    def stays_in_lane(self) -> bool:
        """Whether it stays in its lane."""
        return not self.is_person and (self.on != RAMP if self.keeps_lane is None else self.keeps_lane)

    @model_validator(mode="after")
    def _has_the_lamps(self) -> Self:
        mistake = lamp_mistake(self.type, self.lamps) if isinstance(self.lamps, LampActions) else None
        if mistake is not None:
            raise ValueError(mistake)
        return self


Actors = dict[NewId, ActorSection]


def check_roads(written: Any) -> None:
    """Refuse blocks of a scenario that do not go together."""
    traffic = written.traffic
    if written.road is not None:
        for key in ("net", "config"):
            if getattr(traffic, key) is not None:
                raise ValueError(
                    f"give road or traffic.{key}, not both: traffic.{key} is {str(getattr(traffic, key))!r}"
                )
        return
    if written.demand is not None:
        raise ValueError("demand: goes with a road by template (road: {template: …}), which is missing")
    if written.actors and traffic.net is None:
        raise ValueError(
            "actors: go with a road by template (road: {template: …}) or with traffic.net; both are missing"
        )
