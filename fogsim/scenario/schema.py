"""The schema of a scenario file. Lengths in m, times in s, speeds in km/h, angles in degrees: the units of its readers.

Everything inside FogSim is SI and radians; `fogsim.scenario.build` converts, once.
"""

import itertools
import math
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, field_validator, model_validator

from fogsim.advice import ADVISERS
from fogsim.errors import UnknownNameError
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.render import RENDERERS
from fogsim.scenario.methods import Method, method_of
from fogsim.traffic import SPEED_CHOICES, AfterCollision
from fogsim.values import Response

Share = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


def _visibility(value: object) -> object:
    """Let a visibility be written as .inf, inf or infinity."""
    return math.inf if isinstance(value, str) and value.strip().lower() in {"inf", "infinity", ".inf"} else value


Visibility = Annotated[float, Field(gt=0), BeforeValidator(_visibility)]


class Section(BaseModel):
    """A block of a scenario file: unknown keys are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class Clocks(Section):
    """The three clocks; each is a whole multiple of the one before."""

    traffic_step_s: Positive = 0.1
    """SUMO's step."""

    camera_period_s: Positive = 0.1
    """Time between two frames."""

    decision_period_s: Positive = 0.5
    """Time between two decisions on advice and lamps."""

    @model_validator(mode="after")
    def _multiples(self) -> Self:
        for faster, slower in (("traffic_step_s", "camera_period_s"), ("camera_period_s", "decision_period_s")):
            ratio = getattr(self, slower) / getattr(self, faster)
            if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6:
                raise ValueError(
                    f"{slower} must be a whole multiple of {faster}, "
                    f"got {getattr(self, slower):g} s and {getattr(self, faster):g} s"
                )
        return self


class Event(Section):
    """Something that a vehicle is made to do, once, when one of its conditions holds."""

    vehicle: str
    """Id of the vehicle."""

    at_position_m: NotNegative | None = None
    """It begins when the vehicle has driven this far."""

    at_time_s: NotNegative | None = None
    """It begins at this time after the ego's appearance."""

    at_gap_to_ego_m: Positive | None = None
    """It begins when the vehicle is this near to the ego."""

    @model_validator(mode="after")
    def _begins(self) -> Self:
        if self.at_position_m is None and self.at_time_s is None and self.at_gap_to_ego_m is None:
            raise ValueError("say when it begins: at_position_m, at_time_s or at_gap_to_ego_m")
        return self


class Brake(Event):
    """A vehicle brakes, holds the lower speed, and drives on."""

    kind: Literal["brake"]
    """`brake`: brake, hold the lower speed, and drive on."""

    to_speed_kmh: NotNegative = 0.0
    """Speed that it brakes to; 0 is a standstill."""

    deceleration_mps2: Positive = 4.0
    """How hard it brakes, within its vehicle type's own limit."""

    hold_s: NotNegative = 30.0
    """How long it keeps that speed, from the beginning of the braking."""


class BreakDown(Event):
    """A vehicle comes to a standstill and stays there."""

    kind: Literal["break_down"]
    """`break_down`: come to a standstill and stay there."""

    deceleration_mps2: Positive = 3.0
    """How hard it brakes."""

    lamps: bool = True
    """Whether its lamps stay lit."""


class ChangeLane(Event):
    """A vehicle changes lane, whoever is there."""

    kind: Literal["change_lane"]
    """`change_lane`: change lane, whoever is there (cut in)."""

    lanes: int = Field(ge=-4, le=4)
    """How many lanes to the left; negative to the right."""

    stay_s: Positive = 60.0
    """How long it stays there."""


class LampsFail(Event):
    """All lamps of a vehicle go dark."""

    kind: Literal["lamps_fail"]
    """`lamps_fail`: all lamps go dark."""


AnyEvent = Annotated[Brake | BreakDown | ChangeLane | LampsFail, Field(discriminator="kind")]


class Traffic(Section):
    """A SUMO simulation and its ego."""

    config: Path | None = None
    """SUMO configuration (.sumocfg), relative to the scenario's folder; in place of the three below."""

    net: Path | None = None
    """SUMO network, relative to the scenario's folder."""

    routes: tuple[Path, ...] = ()
    """SUMO route files."""

    additional: tuple[Path, ...] = ()
    """SUMO additional files; POIs of type `fogsim.sign.KIND` in them are signs."""

    ego: str = "ego"
    """Id of the ego vehicle in the route files."""

    keep_lane: tuple[str, ...] = ()
    """Vehicles that never change lane."""

    warm_up_limit_s: Positive = 600.0
    """Simulated time within which the ego must appear; the run begins when it does."""

    advice_deceleration_mps2: Positive = 2.0
    """How hard an advised vehicle slows down to the advice."""

    reading_radius_m: Positive = 1000.0
    """Vehicles farther from the ego than this are not read and not drawn."""

    events: tuple[AnyEvent, ...] = ()
    """What is scripted."""

    after_collision: AfterCollision = AfterCollision.STOP
    """What becomes of vehicles that have collided: `stop` (they stand and block the lane) or `remove`."""

    stop_before_end_m: NotNegative = 60.0
    """The ego has arrived when it is this near to the end of its route."""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        beside = [key for key in ("net", "routes", "additional") if getattr(self, key)]
        if self.config is not None and beside:
            raise ValueError(
                f"give either config (a SUMO configuration, which names its own files) or net with routes, not both: "
                f"config is {str(self.config)!r}, and beside it there is {', '.join(beside)}"
            )
        return self


class ComplianceSection(Section):
    """Who follows advice, and how far."""

    reached_share: Share = 1.0
    """Share of drivers whom advice reaches."""

    rate: Share = 1.0
    """Share of those who follow it."""

    strength: Share = 1.0
    """How far they go from their own speed towards the advised one."""

    delay_s: NotNegative = 2.0
    """Time before they do."""


class DriversSection(Section):
    """The drivers of all vehicles but, for speed, the ego."""

    see_through_fog: bool = False
    """True for SUMO's own drivers, who see their leader through any fog."""

    reaction_time_s: NotNegative = 1.0
    """Time from the first sight of a leader that was hidden to the first reaction."""

    headlamp_reach_m: Positive = 55.0
    """Distance at which an unlit vehicle is seen in the headlamps at night in clear air."""

    speed_choice: str = "too_fast"
    """How fast they drive in fog by themselves."""

    speed_spread: NotNegative = 0.1
    """Standard deviation of the logarithm of a driver's own factor on that speed."""

    distance_misjudgement: NotNegative = 0.0
    """By which share they take distances for longer in dense fog, and so follow closer; 0.3 to 0.6 at night."""

    compliance: ComplianceSection = ComplianceSection()
    """How they follow advice."""

    advised: Literal["ego", "all"] = "ego"
    """Whether the advice goes to the ego alone, or to every vehicle near it as well."""

    @field_validator("speed_choice")
    @classmethod
    def _known_choice(cls, value: str) -> str:
        if value not in SPEED_CHOICES:
            raise ValueError(str(UnknownNameError("speed choice", value, SPEED_CHOICES)))
        return value


class Bank(Section):
    """A fog bank along the ego's route; start and end are where it is half as dense as inside."""

    start_m: float
    """Where it begins: half as dense as inside, along the ego's route."""

    end_m: float
    """Where it ends, likewise."""

    visibility_m: Visibility
    """Meteorological visibility inside."""

    edge_m: Positive = 100.0
    """Length of each soft edge."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.start_m < self.end_m:
            raise ValueError(f"start_m must be less than end_m, got {self.start_m:g} and {self.end_m:g}")
        if self.edge_m > self.end_m - self.start_m:
            raise ValueError(
                f"edge_m must not be longer than the bank ({self.end_m - self.start_m:g} m), got {self.edge_m:g}"
            )
        return self


class Fog(Section):
    """Either homogeneous (visibility_m), or banks with another visibility outside them."""

    visibility_m: Visibility | None = None
    """Meteorological visibility of homogeneous fog; `inf` is clear air. Leaves no room for the two below."""

    outside_visibility_m: Visibility | None = None
    """Meteorological visibility outside the banks."""

    banks: tuple[Bank, ...] = ()
    """Fog banks along the ego's route; they must not overlap."""

    top_m: Visibility = 250.0
    """Height of the fog layer."""

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        homogeneous = self.visibility_m is not None
        heterogeneous = self.outside_visibility_m is not None or bool(self.banks)
        if homogeneous and heterogeneous:
            raise ValueError("give either visibility_m (homogeneous fog) or outside_visibility_m with banks, not both")
        if not homogeneous and self.outside_visibility_m is None:
            raise ValueError("visibility_m (homogeneous fog), or outside_visibility_m with banks, is missing")
        ordered = sorted(self.banks, key=lambda b: b.start_m)
        for one, other in itertools.pairwise(ordered):
            if one.end_m + 0.5 * one.edge_m > other.start_m - 0.5 * other.edge_m:
                raise ValueError(f"banks overlap: one ends at {one.end_m:g} m, another starts at {other.start_m:g} m")
        return self


class Light(Section):
    """Daylight."""

    illuminance_lx: Positive = 10_000.0
    """Horizontal illuminance of the overcast day."""


class Told(Section):
    """How the calibration that the vehicle is told differs from the true one."""

    pitch_error_deg: float = Field(default=0.0, gt=-10, lt=10)
    """Told minus true pitch."""

    focal_length_error_percent: float = Field(default=0.0, gt=-50, lt=50)
    """Told over true focal length, minus 1."""


class CameraSection(Section):
    """The ego's camera."""

    width: int = Field(default=640, ge=16, le=8192)
    """Columns of the image."""

    height: int = Field(default=480, ge=16, le=8192)
    """Rows of the image."""

    field_of_view_deg: float = Field(default=58.0, gt=1, lt=170)
    """Horizontal field of view; sets the focal length, whatever the size of the image."""

    focal_length_px: Positive | None = None
    """Focal length, in place of the field of view."""

    principal_point_px: tuple[float, float] | None = None
    """Principal point [u0, v0]; the middle of the image if not given."""

    mount_height_m: Positive = 1.38
    """Height of the camera above the road."""

    setback_m: NotNegative = 1.7
    """Distance of the camera behind the front bumper."""

    pitch_deg: float = Field(default=2.0, gt=-45, lt=45)
    """Pitch; positive looks down."""

    roll_deg: float = Field(default=0.0, gt=-45, lt=45)
    """Roll; positive turns the image's right side down."""

    response: Response = Response.SRGB
    """Curve from light to pixel values: `linear`, `gamma` (2.2) or `srgb`."""

    saturation_luminance_cdpm2: Positive | None = None
    """Luminance that fills a pixel; if not given, the airlight fills 60 % of it."""

    full_well_e: Positive = 10_000.0
    """Electrons that fill a pixel; sets the photon noise."""

    read_noise_e: NotNegative = 5.0
    """Standard deviation of the read noise in electrons."""

    told: Told = Told()
    """Errors of the calibration that the estimators are told."""


class Lead(Section):
    """The radar that tracks the vehicle ahead."""

    reach_m: Positive = 200.0
    """Distance up to which it tracks a vehicle."""

    distance_deviation_m: NotNegative = 0.25
    """Standard deviation of its distance."""

    speed_deviation_mps: NotNegative = 0.1
    """Standard deviation of its relative speed."""


class Sensors(Section):
    """Sensors beside the camera."""

    lead: Lead = Lead()
    """The radar."""

    sign_reach_m: Positive = 250.0
    """Distance up to which the map tells of signs ahead."""


class Scenario(Section):
    """A whole scenario."""

    name: str = Field(pattern=r"^[A-Za-z0-9_.-]+$")
    """Name; letters, digits, `_`, `.` and `-`."""

    description: str = ""
    """What it is about, for lists and reports."""

    duration_s: Positive = 120.0
    """Longest simulated time."""

    end_on_collision: bool = True
    """Whether a collision of the ego ends the run."""

    clocks: Clocks = Clocks()
    """The clocks."""

    traffic: Traffic
    """The traffic."""

    drivers: DriversSection = DriversSection()
    """The drivers."""

    fog: Fog
    """The fog."""

    light: Light = Light()
    """The light."""

    camera: CameraSection = CameraSection()
    """The camera."""

    renderer: Annotated[str, Field(default="auto")]
    """`auto` or a renderer's name."""

    scenery_seed: int = Field(default=0, ge=0)
    """Seed of trees and posts, which are the same for every seed of the run."""

    sensors: Sensors = Sensors()
    """The other sensors."""

    estimators: tuple[Annotated[Method, method_of(ESTIMATORS)], ...] = Field(
        default=(Method(method="negru2013"),), min_length=1
    )
    """Estimators that read every frame; the agent sees the first one's estimate."""

    fusion: Annotated[Method, method_of(FUSIONS)] = Method(method="grid_filter")
    """How estimates become a belief."""

    advice: Annotated[Method, method_of(ADVISERS)] = Method(method="stopping_sight_distance")
    """How the belief becomes a speed advice."""

    lighting: Annotated[Method, method_of(LIGHTING_POLICIES)] = Method(method="fog_lamp_rules")
    """How the belief becomes lamps."""

    directory: Path = Field(default=Path(), exclude=True)

    @field_validator("renderer")
    @classmethod
    def _known_renderer(cls, value: str) -> str:
        if value != "auto" and value not in RENDERERS:
            raise ValueError(str(UnknownNameError("renderer", value, ["auto", *RENDERERS])))
        return value

    @model_validator(mode="after")
    def _distinct_estimators(self) -> Self:
        names = [e.method for e in self.estimators]
        if len(set(names)) < len(names):
            raise ValueError(f"estimators must differ, got {', '.join(names)}")
        return self
