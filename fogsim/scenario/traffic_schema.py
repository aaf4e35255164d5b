"""The schema of the blocks ``traffic`` and ``drivers``: who drives where, what is scripted, what drivers are like."""

import dataclasses
import itertools
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, field_validator, model_validator

from fogsim.errors import UnknownNameError
from fogsim.scenario.section import (
    Deceleration,
    Distance,
    Flag,
    Id,
    Length,
    Number,
    Period,
    RoadEnd,
    Section,
    Share,
    SpeedKmh,
    Text,
    Time,
    Whole,
)
from fogsim.scenario.traffic_alone import NO_EGO
from fogsim.traffic import COMPLIANCES, FOLLOWING_MODELS, SPEED_CHOICES, AfterCollision, Compliance
from fogsim.values import Display

_ROUNDING = 1e-6

_NEAREST_SIGNS = 10.0
"""Smallest distance between two message signs [m]."""


class Event(Section):
    """Something that a vehicle is made to do, once, when one of its conditions holds."""

    vehicle: Id
    """Id of the vehicle."""

    at_position_m: Distance | None = None
    """It begins when the vehicle has driven this far."""

    at_time_s: Time | None = None
    """It begins at this time after the ego's appearance, or after the run's beginning without an ego."""

    at_gap_to_ego_m: Annotated[Number, Field(ge=-10_000, le=10_000)] | None = None
    """It begins when the gap to the ego, bumper to bumper, comes to this: positive ahead, negative behind."""

    @model_validator(mode="after")
    def _begins(self) -> Self:
        if self.at_position_m is None and self.at_time_s is None and self.at_gap_to_ego_m is None:
            raise ValueError("say when it begins: at_position_m, at_time_s or at_gap_to_ego_m")
        return self


class Brake(Event):
    """A vehicle brakes, holds the lower speed, and drives on."""

    kind: Literal["brake"]
    """`brake`: brake, hold the lower speed, and drive on."""

    to_speed_kmh: SpeedKmh = 0.0
    """Speed that it brakes to; 0 is a standstill."""

    deceleration_mps2: Deceleration = 4.0
    """How hard it brakes, within its vehicle type's own limit."""

    hold_s: Time = 30.0
    """How long it keeps that speed, from the beginning of the braking."""


class BreakDown(Event):
    """A vehicle comes to a standstill and stays there."""

    kind: Literal["break_down"]
    """`break_down`: come to a standstill and stay there."""

    deceleration_mps2: Deceleration = 3.0
    """How hard it brakes."""

    lamps: Flag = True
    """Whether its lamps stay lit."""


class ChangeLane(Event):
    """A vehicle changes lane, whoever is there."""

    kind: Literal["change_lane"]
    """`change_lane`: change lane, whoever is there (cut in)."""

    lanes: Whole = Field(ge=-4, le=4)
    """How many lanes to the left; negative to the right."""

    stay_s: Period = 60.0
    """How long it stays there."""


class LampsFail(Event):
    """All lamps of a vehicle go dark."""

    kind: Literal["lamps_fail"]
    """`lamps_fail`: all lamps go dark."""


AnyEvent = Annotated[Brake | BreakDown | ChangeLane | LampsFail, Field(discriminator="kind")]


def _dotted_options(value: object) -> object:
    """Let options whose names have dots be written as blocks in blocks, as ``--set`` makes them."""
    return dict(_flat("", value)) if isinstance(value, dict) else value


def _flat(prefix: str, block: Mapping[object, object]) -> Iterator[tuple[str, object]]:
    for name, value in block.items():
        if isinstance(value, Mapping):
            yield from _flat(f"{prefix}{name}.", value)
        else:
            yield f"{prefix}{name}", value


SumoOptions = Annotated[
    dict[Annotated[str, Field(pattern="^[A-Za-z][A-Za-z0-9._-]{0,99}$")], Flag | Whole | Number | Text],
    BeforeValidator(_dotted_options),
]
"""Options of SUMO's command line by name."""


class Traffic(Section):
    """A SUMO simulation and its ego, if it has one."""

    config: Path | None = None
    """SUMO configuration (.sumocfg), relative to the scenario's folder; in place of the three below."""

    net: Path | None = None
    """SUMO network, relative to the scenario's folder."""

    routes: tuple[Path, ...] = ()
    """SUMO route files."""

    additional: tuple[Path, ...] = ()
    """SUMO additional files; POIs of type `fogsim.sign.KIND` in them are signs."""

    ego: Id = "ego"
    """Id of the ego vehicle in the route files; `any` for the first car, van, truck or bus that drives with 1 km and no
    stop ahead of it, or the best of the first 10 minutes; `none` for traffic alone, without camera and estimators."""

    equipped: Share = 0.0
    """Share of the other vehicles that have a camera, estimators, a belief and lighting policy like the ego's, and are
    advised like it, as long as they are read and on its way."""

    equipped_vehicles: tuple[Id, ...] = ()
    """Ids of vehicles that have them in any case; `ego: [a, b, c]` writes b and c here."""

    along: tuple[Id, ...] = ()
    """With `ego: none`: edges, as they are driven one after the other, along which places count, not its route. On a
    road by template it is `same_way`, the whole way, if not written."""

    keep_lane: tuple[Id, ...] = ()
    """Vehicles that never change lane."""

    warm_up_limit_s: Period = 600.0
    """Simulated time within which the ego must appear; the run begins when it does."""

    warm_up_s: Time = 0.0
    """With `ego: none`: simulated time before the run begins."""

    cohort_s: Period | None = None
    """With `ego: none`: vehicles due to depart in this time from the run's start form the cohort of the metrics per
    cohort vehicle. The run ends when all of them have left, and after `duration_s` at the latest."""

    advice_deceleration_mps2: Deceleration = 2.0
    """How hard an advised vehicle slows down to the advice."""

    reading_radius_m: Annotated[Length, Field(ge=1)] = 1000.0
    """Vehicles farther from the ego than this are not read and not drawn; with `ego: none` all are read."""

    events: tuple[AnyEvent, ...] = ()
    """What is scripted."""

    after_collision: AfterCollision = AfterCollision.STOP
    """What becomes of vehicles that have collided: `stop` (they stand and block the lane) or `remove`."""

    stop_before_end_m: Distance = 60.0
    """The ego has arrived when it is this near to the end of its route."""

    sumo_options: SumoOptions = Field(default_factory=dict)
    """Further options of SUMO by name: `{tripinfo-output: trips.xml, device.ssm.probability: 1}`. Outputs go into the
    run's directory; files that are read are named relative to the scenario's folder."""

    @property
    def has_ego(self) -> bool:
        """Whether there is an ego."""
        return self.ego != NO_EGO

    @property
    def has_equipped(self) -> bool:
        """Whether other vehicles than the ego have a camera."""
        return self.equipped > 0.0 or bool(self.equipped_vehicles)

    @model_validator(mode="before")
    @classmethod
    def _several_egos(cls, value: object) -> object:
        if not isinstance(value, dict) or not isinstance(value.get("ego"), list | tuple):
            return value
        if value.get("equipped_vehicles"):
            raise ValueError("equipped_vehicles: written with a list of egos; write them all under one of the two keys")
        if not value["ego"]:
            raise ValueError("ego: an empty list; write the ego's id, several of them, or none")
        first, *others = value["ego"]
        return {**value, "ego": first, "equipped_vehicles": others}

    @model_validator(mode="after")
    def _keys_without_ego(self) -> Self:
        for key in ("along", "warm_up_s", "cohort_s"):
            if self.has_ego and getattr(self, key):
                raise ValueError(f"{key}: goes with ego: none, and the ego is {self.ego!r}")
        for key in ("equipped", "equipped_vehicles"):
            if not self.has_ego and getattr(self, key):
                raise ValueError(f"{key}: goes with an ego, about which they are read, and ego is none")
        named = (self.ego, *self.equipped_vehicles)
        if len({*named}) < len(named):
            raise ValueError(f"equipped_vehicles: {', '.join(named)}: one of them, or the ego, is named twice")
        return self

    @model_validator(mode="after")
    def _no_gap_to_itself(self) -> Self:
        for place, event in enumerate(self.events):
            if event.vehicle == self.ego and event.at_gap_to_ego_m is not None:
                raise ValueError(f"events.{place}.at_gap_to_ego_m: {event.vehicle!r} is the ego itself")
        return self

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        beside = [key for key in ("net", "routes", "additional") if getattr(self, key)]
        if self.config is not None and beside:
            raise ValueError(
                f"give either config (a SUMO configuration, which names its own files) or net with routes, not both: "
                f"config is {str(self.config)!r}, and there is also {', '.join(beside)}"
            )
        return self


def _compliance_keys(compliance: Compliance) -> dict[str, float]:
    written = {field.name: getattr(compliance, field.name) for field in dataclasses.fields(compliance)}
    return {**{key: value for key, value in written.items() if key != "delay"}, "delay_s": compliance.delay}


class ComplianceSection(Section):
    """Who follows advice, and how far."""

    like: str = "full"
    """Kind of advice whose compliance, as far as it has been measured, the keys below begin with."""

    reached_share: Share = 1.0
    """Share of drivers whom advice reaches."""

    rate: Share = 1.0
    """Share of those who follow it."""

    strength: Share = 1.0
    """How far they go from their own speed down to the advised one."""

    delay_s: Time = 2.0
    """Time before they do."""

    trust: Share = 0.0
    """How far those who are slower in fog by themselves go up to the advised speed."""

    foreseen: Share = 1.0
    """Share of strength and trust where they do not see the fog yet (200 m and more)."""

    @model_validator(mode="before")
    @classmethod
    def _begin_with_what_is_measured(cls, value: object) -> object:
        if not isinstance(value, dict) or not isinstance(value.get("like"), str):
            return value
        try:
            measured = COMPLIANCES[value["like"]]
        except UnknownNameError as error:
            # Only a plain ValueError is a message to pydantic's user.
            raise ValueError(str(error)) from None
        return {**_compliance_keys(measured), **value}


class AdvisedStretch(Section):
    """The stretch of road on which all hear the ego's advice."""

    start_m: Distance = 0.0
    """Position along the ego's route at which it begins."""

    end_m: RoadEnd = math.inf
    """Position at which it ends; inf for the end of the route."""

    display: Display = Display.IN_CAR
    """Where they hear it: `in_car` (wherever they are on it) or off a `message_sign` (where it begins)."""

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if not self.start_m < self.end_m:
            raise ValueError(f"start_m must be less than end_m, got {self.start_m:g} and {self.end_m:g}")
        return self


class ComplianceByDisplay(Section):
    """How they follow advice, by where they hear it; what is not written is as in `compliance`."""

    message_sign: ComplianceSection | None = None
    """Off a message sign."""

    in_car: ComplianceSection | None = None
    """In the car."""

    law: ComplianceSection | None = None
    """Nowhere: a law that they know."""


class Signs(Section):
    """Message signs along the ego's route, each with a visibility meter; what one says holds as far as the next."""

    spacing_m: Annotated[Length, Field(ge=10)] = 500.0
    """Distance from sign to sign."""

    from_m: Distance = 0.0
    """Position along the ego's route of the first."""

    to_m: RoadEnd = math.inf
    """Position as far as which the last one's advice holds; inf for the end of the route."""

    at_m: tuple[Distance, ...] = ()
    """Their positions, in place of the first one's and the spacing."""

    reading_distance_m: Annotated[Length, Field(ge=0, le=500)] = 0.0
    """How far before a sign drivers read it, through fog too: it shines."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        placed = {"from_m", "spacing_m"} & self.model_fields_set
        if self.at_m and placed and not {"from_m", "spacing_m", "to_m", "at_m"} <= self.model_fields_set:
            raise ValueError(f"give at_m, or from_m with spacing_m, not both: got at_m and {min(placed)}")
        if any(following - one < _NEAREST_SIGNS for one, following in itertools.pairwise(self.at_m)):
            raise ValueError(f"at_m must ascend by at least {_NEAREST_SIGNS:g} m, got {list(self.at_m)!r}")
        if not max((self.from_m, *self.at_m)) < self.to_m:
            raise ValueError(f"to_m must be more than the position of every sign, got {self.to_m:g}")
        return self


class Harmonisation(Section):
    """How advice to sections of road steps down towards the slow ones."""

    largest_step_kmh: Annotated[SpeedKmh, Field(ge=1)] = 20.0
    """Largest step from one section to the next."""

    deceleration_mps2: Deceleration = 1.0
    """Greatest deceleration needed to brake steadily from the beginning of one section to that of the next."""


def _shares_of_kinds(value: object) -> object:
    """Let one kind of driver be written as its name; names that are not known are refused."""
    shares = {value: 1.0} if isinstance(value, str) else value
    if isinstance(shares, dict):
        for name in shares:
            if name not in FOLLOWING_MODELS:
                raise ValueError(str(UnknownNameError("following model", name, FOLLOWING_MODELS)))
    return shares


def _together_one(shares: dict[str, float]) -> dict[str, float]:
    total = math.fsum(shares.values())
    if abs(total - 1.0) > _ROUNDING:
        raise ValueError(f"shares of kinds of drivers must together be 1, and are {total:g}")
    return shares


Following = Annotated[dict[str, Share], BeforeValidator(_shares_of_kinds), AfterValidator(_together_one)]
"""Shares of kinds of drivers, by name [-]."""


class DriversSection(Section):
    """The drivers of all vehicles but, for speed, the ego."""

    see_through_fog: Flag = False
    """True for SUMO's own drivers: they see through fog, and drive as in clear air unless a `speed_choice` is given."""

    reaction_time_s: Annotated[Time, Field(le=60)] = 1.0
    """Time from the first sight of a leader that was hidden to the first reaction."""

    headlamp_reach_m: Annotated[Length, Field(ge=1, le=1000)] = 55.0
    """Distance at which an unlit vehicle is seen in the headlamps at night in clear air."""

    speed_choice: str = "observed"
    """How fast they drive in fog by themselves."""

    speed_spread: Annotated[Number, Field(ge=0, le=1)] = 0.1
    """Standard deviation of the logarithm of a driver's own factor on that speed, where sight limits it."""

    following: Following | None = None
    """How they follow: a kind of driver, or shares of several that together are 1 (`{in_sight: 0.6, careful: 0.4}`). By
    default the mixture of docs/explanation/drivers.md with observed speeds, and as in clear air with the other
    choices."""

    distance_misjudgement: Annotated[Number, Field(ge=0, le=10)] = 0.0
    """By which share they take distances for longer where lamps show and the outline does not, and so follow closer;
    0.3 to 0.6."""

    compliance: ComplianceSection = ComplianceSection()
    """How they follow advice."""

    compliance_by_display: ComplianceByDisplay = ComplianceByDisplay()
    """The same by where they hear it, where that differs."""

    advised: Literal["ego", "all", "stretch", "signs", "equipped", "law"] = "ego"
    """Who hears the advice: the ego alone; all vehicles near it as well; all on a `stretch` of its route; all who pass
    message `signs` along it; all `equipped` vehicles on it; all on it, as a `law` that they know. With
    `ego: none`, `all` is everyone and the default, and `traffic.along` is the route."""

    signs: Signs = Signs()
    """Those signs."""

    equipped_share: Share = 1.0
    """Share of vehicles that are equipped, with `advised: equipped`."""

    harmonisation: Harmonisation | None = None
    """How advice steps down before slow sections, with `signs`, `equipped` and `law`; `{}` for usual steps, null for
    none."""

    advised_stretch: AdvisedStretch = AdvisedStretch()
    """That stretch, with `advised: stretch`."""

    @model_validator(mode="before")
    @classmethod
    def _as_in_clear_air(cls, written: object) -> object:
        # What is written stays; without it, drivers who see through fog are SUMO's own in every respect.
        if isinstance(written, dict) and written.get("see_through_fog") is True:
            return {"speed_choice": "unaffected", **written}
        return written

    @model_validator(mode="before")
    @classmethod
    def _all_comply_alike_but_for(cls, written: object) -> object:
        # Sections check what is no mapping; what names a kind of advice of its own begins with that.
        usual = written.get("compliance") if isinstance(written, dict) else None
        displays = written.get("compliance_by_display") if isinstance(written, dict) else None
        if not isinstance(written, dict) or not isinstance(usual, dict) or not isinstance(displays, dict):
            return written
        own = {
            name: {**usual, **given} if isinstance(given, dict) and "like" not in given else given
            for name, given in displays.items()
        }
        return {**written, "compliance_by_display": own}

    @field_validator("speed_choice")
    @classmethod
    def _known_choice(cls, value: str) -> str:
        if value not in SPEED_CHOICES:
            raise ValueError(str(UnknownNameError("speed choice", value, SPEED_CHOICES)))
        return value

    @model_validator(mode="after")
    def _stretch_is_advised(self) -> Self:
        # Who says whom the advice goes to may leave the stretch of another choice there.
        if "advised_stretch" in self.model_fields_set and "advised" not in self.model_fields_set:
            raise ValueError("advised_stretch goes with advised: stretch, which is missing")
        return self
