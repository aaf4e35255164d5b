"""The schema of a scenario file. Lengths in m, times in s, speeds in km/h, angles in degrees: the units of its readers.

Everything inside FogSim is SI and radians; `fogsim.scenario.build` converts, once.
"""

import itertools
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, field_validator, model_validator

from fogsim.advice import ADVISERS
from fogsim.errors import UnknownNameError
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.render import RENDERERS
from fogsim.scenario.camera_schema import CameraSection
from fogsim.scenario.methods import Method, method_of
from fogsim.scenario.section import NotNegative, Positive, Section, Visibility
from fogsim.scenario.traffic_schema import DriversSection, Traffic


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
