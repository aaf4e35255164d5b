"""The schema of the block ``drivers``: what drivers are like, and how advice reaches them."""

import dataclasses
import itertools
import math
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from fogsim.errors import UnknownNameError
from fogsim.scenario.section import (
    Deceleration,
    Distance,
    Flag,
    Length,
    Method,
    Number,
    RoadEnd,
    Section,
    Share,
    SpeedKmh,
    Time,
    method_of,
)
from fogsim.traffic import COMPLIANCES, FOLLOWING_MODELS, SPEED_CHOICES, Compliance
from fogsim.values import Display

_ROUNDING = 1e-6

_GOES_WITH = {
    "advised_stretch": "stretch",
    "signs": "signs",
    "equipped_share": "equipped",
    "harmonisation": "signs, equipped or law",
}
"""Keys that mean nothing without a value of `advised`."""

_NEAREST_SIGNS = 10.0
"""Smallest distance between two message signs [m]."""


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

    speed_choice: Annotated[Method, method_of(SPEED_CHOICES)] = Method(method="observed")
    """How fast they drive in fog by themselves: a method, with its constants as parameters, or your own class."""

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

    @model_validator(mode="after")
    def _receivers_are_given(self) -> Self:
        # With `advised`, keys of another choice may stay.
        for key in sorted(self.model_fields_set & _GOES_WITH.keys()) if "advised" not in self.model_fields_set else ():
            raise ValueError(f"{key} goes with advised: {_GOES_WITH[key]}, which is missing")
        return self
