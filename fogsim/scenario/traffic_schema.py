"""The schema of the block ``traffic``: who drives where, and what is scripted."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from fogsim.scenario.section import (
    Deceleration,
    Distance,
    Flag,
    Id,
    Length,
    Number,
    Period,
    Section,
    Share,
    SpeedKmh,
    Text,
    Time,
    Whole,
)
from fogsim.scenario.traffic_alone import NO_EGO
from fogsim.traffic import AfterCollision


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
    """How many lanes to the left, negative to the right; in left-hand traffic the other way round."""

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
