"""The schema of a scenario file. Lengths in m, times in s, speeds in km/h, angles in degrees: the units of its readers.

Everything inside FogSim is SI and radians; `fogsim.scenario.build` converts, once.
"""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from fogsim.advice import ADVISERS, CONTROLLERS
from fogsim.errors import RenamedWarning, UnknownNameError
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.render import RENDERERS, ROLES
from fogsim.scenario.camera_schema import CameraSection
from fogsim.scenario.drivers_schema import DriversSection
from fogsim.scenario.expect.checks import check_expectations
from fogsim.scenario.expect.conditions import WrittenCondition
from fogsim.scenario.expect.schema import Expectations
from fogsim.scenario.fog import Fog
from fogsim.scenario.roads.schema import Actors, DemandSection, Road, check_roads
from fogsim.scenario.section import Deceleration, Flag, Method, Number, Period, Section, Seed, Text, Time, method_of
from fogsim.scenario.sensors.schema import Sensors
from fogsim.scenario.timeline import Timeline, check_timeline, light_range
from fogsim.scenario.timeline.checks import PHOTONS_BY_DAY
from fogsim.scenario.traffic_alone import without_ego
from fogsim.scenario.traffic_schema import Traffic
from fogsim.simulation.run_config import NO_RENDERER
from fogsim.units import DAY_ILLUMINANCE
from fogsim.values.scene import USUAL_PAVEMENT, RoadSurface


class InformedMethod(Method):
    """A method that uses the visibility."""

    informed_by: Literal["belief", "truth", "sensors"] = "belief"
    """Source of the visibility: the ego's belief, the truth or, for advised sections, reports of roadside sensors."""


class ControllerSection(Method):
    """A controller in the ego, and what its actuators can do."""

    delay_s: Time = 0.2
    """From a request to the first change of the acceleration."""

    lag_s: Time = 0.1
    """Time constant of that change."""

    braking_mps2: Deceleration = 9.0
    """Greatest deceleration."""

    accelerating_mps2: Deceleration = 2.5
    """Greatest acceleration."""

    period_s: Annotated[Period, Field(le=3600)] | None = None
    """Time from one request to the next, a whole multiple of the camera period; by default that."""


class Clocks(Section):
    """The three clocks; each is a whole multiple of the one before."""

    traffic_step_s: Annotated[Period, Field(le=10)] = 0.1
    """SUMO's step: whole milliseconds."""

    camera_period_s: Annotated[Period, Field(le=3600)] = 0.1
    """Time between two frames."""

    decision_period_s: Annotated[Period, Field(le=3600)] = 0.5
    """Time between two decisions on advice and lamps."""

    @model_validator(mode="after")
    def _multiples(self) -> Self:
        _check_multiple("camera_period_s", self.camera_period_s, "traffic_step_s", self.traffic_step_s)
        _check_multiple("decision_period_s", self.decision_period_s, "camera_period_s", self.camera_period_s)
        return self


def _check_multiple(slower: str, period: float, faster: str, of: float) -> None:
    """Refuse a period that is no whole multiple of another one [s]."""
    if round(period / of) < 1 or abs(period / of - round(period / of)) > 1e-6:
        raise ValueError(f"{slower} must be a whole multiple of {faster}, got {period:g} s and {of:g} s")


class Light(Section):
    """Daylight."""

    illuminance_lx: Annotated[Number, Field(ge=0, le=200_000)] = 10_000.0
    """Horizontal illuminance of the overcast sky: 10 000 by day, 1 … 100 in twilight, 0.01 … 0.1 at night. Below 1000
    lamps light the road and the fog."""


_DUSK, _NIGHT = 100.0, 0.1
"""Horizontal illuminance below which methods for the night are of use, and those for the day are not [lx]."""


def _estimators_by_light(read: Mapping[str, Any]) -> tuple[Method, ...]:
    """Estimators for the light that there may be in a run, by what was read of a scenario."""
    light, timeline = read.get("light", Light()), read.get("timeline", ())
    darkest, brightest = light_range(timeline, light.illuminance_lx)
    by_day = ("joint_road", "lead_contrast") if brightest >= _NIGHT else ()
    by_night = ("night_road",) if darkest < _DUSK else ()
    return tuple(Method(method=name) for name in (*by_day, *by_night))


class PavementSection(Section):
    """What roads are like."""

    surface: RoadSurface = USUAL_PAVEMENT.surface
    """How they reflect the sky by the angle at which they are seen: `lambertian`, alike from everywhere; `dry`, `worn`
    (polished smooth) or `wet` asphalt, 1.8, 1.8 and 2.0 times as bright at 1° as `dry` from above."""

    wheel_tracks: Number = Field(default=USUAL_PAVEMENT.wheel_tracks, ge=-0.5, le=0.5)
    """How much darker they are where wheels roll, as a share; negative for brighter."""

    repairs: Number = Field(default=USUAL_PAVEMENT.repairs, ge=0, le=0.3)
    """Standard deviation of the reflectance of stretches of older and newer asphalt, 5 to 150 m long, as a share."""


class ScenarioFile(Section):
    """Keys of a scenario file."""

    name: str = Field(pattern=r"^[A-Za-z0-9_.-]+$", max_length=100)
    """Name; letters, digits, `_`, `.` and `-`."""

    description: Text = ""
    """What it is about, for lists and reports."""

    duration_s: Period = 120.0
    """Longest simulated time."""

    end_on_collision: Flag = True
    """Whether a collision of the ego ends the run."""

    end_when: WrittenCondition | None = None
    """Condition at which the run is over before `duration_s`, as `timeline` has them."""

    clocks: Clocks = Clocks()
    """The clocks."""

    road: Road | None = None
    """A road by template, in place of `traffic.net` and `traffic.routes`."""

    demand: DemandSection | None = None
    """Traffic on that road."""

    actors: Actors = Field(default_factory=dict)
    """Vehicles on it by their ids, the ego among them."""

    traffic: Traffic = Traffic()
    """The traffic."""

    drivers: DriversSection = DriversSection()
    """The drivers."""

    fog: Fog
    """The fog."""

    light: Light = Light()
    """The light."""

    pavement: PavementSection = PavementSection()
    """The roads' asphalt."""

    timeline: Timeline = ()
    """What happens in the run, and when."""

    camera: CameraSection = CameraSection()
    """The camera."""

    renderer: Annotated[str, Field(default="auto")]
    """`auto`, `opengl`, `cpu`, `reference` (pyrender's own drawing: slow, by day only), or `none` for no frames."""

    street_lamps: Flag = False
    """Whether lamps stand along the roads, about every 35 m."""

    scenery_seed: Seed = 0
    """Seed of trees and posts, which are the same for every seed of the run."""

    sensors: Sensors = Sensors()
    """The other sensors, and the faults of all."""

    estimators: tuple[Annotated[Method, method_of(ESTIMATORS)], ...] = Field(
        default_factory=_estimators_by_light, validate_default=True
    )
    """Estimators that read every frame; the agent sees the first one's estimate. None, `[]`, with `renderer: none`. By
    default those for the light: by night, below 0.1 lx in the whole run, `[night_road]`; where dusk may fall, below 100
    lx, `[joint_road, lead_contrast, night_road]`."""

    fusion: Annotated[Method, method_of(FUSIONS)] = Method(method="grid_filter")
    """How estimates become a belief."""

    advice: Annotated[InformedMethod, method_of(ADVISERS)] = InformedMethod(method="stopping_sight_distance")
    """How the belief becomes a speed advice; with `informed_by: truth`, how the true visibility does, and with
    `sensors`, on roads by sections, what the nearest of `sensors.reports.roadside` has reported last."""

    lighting: Annotated[InformedMethod, method_of(LIGHTING_POLICIES)] = InformedMethod(method="fog_lamp_rules")
    """How the belief becomes lamps; with `informed_by: truth`, how the true visibility does."""

    controller: Annotated[ControllerSection, method_of(CONTROLLERS)] | None = None
    """What drives the ego in its driver's place, by what the vehicle knows; none of SUMO's safety acts on it."""

    driver: Literal["none", "human", "human_until_intervention"] | None = None
    """Who drives the ego where its controller requests nothing: `none`, the default: the speed stays; `human`; or
    `human_until_intervention`: a human until its first request, then the speed stays."""

    method_timeout_s: Period | None = None
    """Longest time that one call of a user's method may take; a longer one fails the run. By default any."""

    expect: Expectations = Field(default_factory=dict)
    """What must hold in the run, by name; `fogsim test` checks it."""

    directory: Path = Field(default=Path(), exclude=True)

    @model_validator(mode="before")
    @classmethod
    def _without_ego(cls, written: object) -> object:
        return without_ego(written)

    @field_validator("directory", mode="before")
    @classmethod
    def _no_key(cls, _: object) -> None:
        # Where the file lies is known when it is read; no one writes it.
        raise PydanticCustomError("extra_forbidden", "unknown key")

    @model_validator(mode="after")
    def _road_or_network(self) -> Self:
        check_roads(self)
        return self

    @model_validator(mode="after")
    def _photons_by_day(self) -> Self:
        if self.fog.airlight == "photons" and self.light.illuminance_lx < DAY_ILLUMINANCE:
            raise ValueError(f"light.illuminance_lx is {self.light.illuminance_lx:g}, and {PHOTONS_BY_DAY}")
        return self

    @model_validator(mode="after")
    def _exposed_to_light(self) -> Self:
        if (
            not self.camera.automatic
            and self.camera.saturation_luminance_cdpm2 is None
            and not self.light.illuminance_lx
        ):
            raise ValueError(
                "camera.saturation_luminance_cdpm2 is missing: light.illuminance_lx is 0, and a fixed exposure goes by "
                "the airlight without it"
            )
        return self

    @model_validator(mode="after")
    def _can_be_shown(self, info: ValidationInfo) -> Self:
        check_expectations(self, is_shortened=bool((info.context or {}).get("is_shortened")))
        check_timeline(self)
        return self

    @field_validator("renderer")
    @classmethod
    def _known_renderer(cls, value: str) -> str:
        if value == "pyrender":
            # What drew under this name is what old files mean by it.
            warnings.warn(
                "renderer: pyrender is called opengl now, and opengl draws; write renderer: opengl (pyrender's own "
                "drawing is renderer: reference)",
                RenamedWarning,
                stacklevel=2,
            )
            return "opengl"
        known = [*ROLES, NO_RENDERER, *(name for name in RENDERERS if name != "pyrender")]
        if value not in known:
            raise ValueError(str(UnknownNameError("renderer", value, known)))
        return value

    @field_validator("estimators")
    @classmethod
    def _frames_for_estimators(cls, value: tuple[Method, ...], info: ValidationInfo) -> tuple[Method, ...]:
        draws = info.data.get("renderer") != NO_RENDERER
        if value and not draws:
            raise ValueError("renderer: none draws no frames that estimators could read; write estimators: [] with it")
        if draws and not value:
            raise PydanticCustomError("too_short", "must have at least one entry")
        return value

    @field_validator("sensors")
    @classmethod
    def _frames_for_cameras(cls, value: Sensors, info: ValidationInfo) -> Sensors:
        if info.data.get("renderer") == NO_RENDERER:
            roadside = value.reports.roadside
            if roadside is not None and roadside.camera is not None:
                raise ValueError(
                    "reports.roadside.camera takes images, and renderer: none draws none; leave it out, or choose auto"
                )
            for place, fault in enumerate(value.faults):
                if fault.sensor == "camera":
                    raise ValueError(f"faults.{place} is of the camera, and renderer: none draws no frames")
        return value

    @model_validator(mode="after")
    def _sensors_that_inform(self) -> Self:
        if self.lighting.informed_by == "sensors":
            raise ValueError(
                "lighting.informed_by: sensors next to the road cannot control lamps; write belief or truth"
            )
        if self.advice.informed_by == "sensors":
            if self.sensors.reports.roadside is None:
                raise ValueError(
                    "advice.informed_by: sensors needs sensors.reports.roadside, which is missing; {} will do"
                )
            if self.drivers.advised not in ("signs", "equipped", "law"):
                raise ValueError(
                    "advice.informed_by: sensors goes with drivers.advised: signs, equipped or law, which advise "
                    f"sections of road, and it is {self.drivers.advised}"
                )
        return self

    @model_validator(mode="after")
    def _controller_in_ego(self) -> Self:
        if self.controller is not None and not self.traffic.has_ego:
            raise ValueError("controller drives the ego, and traffic.ego is none; name one, or leave it out")
        if self.driver is not None and self.controller is None:
            raise ValueError("driver goes with controller, which is missing")
        if self.controller is not None and self.controller.period_s is not None:
            _check_multiple(
                "controller.period_s", self.controller.period_s, "clocks.camera_period_s", self.clocks.camera_period_s
            )
        return self

    @model_validator(mode="after")
    def _distinct_estimators(self) -> Self:
        names = [e.method for e in self.estimators]
        if len(set(names)) < len(names):
            raise ValueError(f"estimators must differ, got {', '.join(names)}")
        return self
