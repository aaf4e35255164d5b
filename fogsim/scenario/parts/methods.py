"""From a scenario to its methods: which advice and lamps a run has, and whom the advice reaches."""

import dataclasses
import math

from fogsim.advice import ADVISERS, CONTROLLERS
from fogsim.core.registry import MethodConfig
from fogsim.errors import InputError
from fogsim.estimators import ESTIMATORS
from fogsim.fusion import FUSIONS
from fogsim.lighting import LIGHTING_POLICIES
from fogsim.scenario.drivers_schema import ComplianceSection
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.section import Method, in_si
from fogsim.simulation.run_config import (
    NO_RENDERER,
    AdviceConfig,
    ControllerConfig,
    Harmonisation,
    SectionsConfig,
    check_ego,
)
from fogsim.traffic import SPEED_CHOICES, Compliance, DriverSetup, DriverSight
from fogsim.traffic.drivers.speed_choice import SpeedChoice, checked_choice
from fogsim.values import Display, Stretch, StretchAdvice

DISPLAYS = {"signs": Display.MESSAGE_SIGN, "equipped": Display.IN_CAR, "law": Display.LAW}
"""How drivers hear advice that is given to sections of road, by `drivers.advised`."""


def check_frames(scenario: ScenarioFile, who: str) -> None:
    """Refuse a scenario that draws no frames."""
    check_ego(scenario.traffic.ego if scenario.traffic.has_ego else None, who)
    if scenario.renderer == NO_RENDERER:
        raise InputError(f"{who} needs frames, and renderer: none draws none; choose auto, opengl, cpu or reference")


def method(scenario: ScenarioFile, written: Method) -> MethodConfig:
    """A method of a scenario."""
    return MethodConfig(written.method, written.parameters, scenario.directory, scenario.method_timeout_s)


def own_methods(scenario: ScenarioFile) -> dict[str, str]:
    """Versions of the methods of a scenario that are not FogSim's, by their names."""
    folder, roadside = scenario.directory, scenario.sensors.reports.roadside
    beside_road = () if roadside is None or roadside.camera is None else (roadside.camera.estimator,)
    found = {
        **{one.method: ESTIMATORS.version(one.method, folder) for one in (*scenario.estimators, *beside_road)},
        scenario.fusion.method: FUSIONS.version(scenario.fusion.method, folder),
        scenario.advice.method: ADVISERS.version(scenario.advice.method, folder),
        scenario.drivers.speed_choice.method: SPEED_CHOICES.version(scenario.drivers.speed_choice.method, folder),
        scenario.lighting.method: LIGHTING_POLICIES.version(scenario.lighting.method, folder),
    }
    if scenario.controller is not None:
        found[scenario.controller.method] = CONTROLLERS.version(scenario.controller.method, folder)
    return {name: version for name, version in found.items() if version is not None}


def advice_config(scenario: ScenarioFile) -> AdviceConfig:
    """Advice and lamps, and whom the advice reaches."""
    drivers, stretch = scenario.drivers, scenario.drivers.advised_stretch
    on_stretch = Stretch(stretch.start_m, stretch.end_m, scenario.traffic.along)
    return AdviceConfig(
        adviser=method(scenario, scenario.advice),
        lighting=method(scenario, scenario.lighting),
        informed_by=scenario.advice.informed_by,
        lighting_informed_by=scenario.lighting.informed_by,
        reach=scenario.traffic.reading_radius_m if drivers.advised == "all" else 0.0,
        stretch=StretchAdvice(math.inf, on_stretch, stretch.display) if drivers.advised == "stretch" else None,
        sections=sections_config(scenario),
    )


def controller_config(scenario: ScenarioFile) -> ControllerConfig | None:
    """The controller in the ego, and what its actuators can do; None without one."""
    written = scenario.controller
    if written is None:
        return None
    return ControllerConfig(
        method(scenario, written),
        scenario.driver or "none",
        written.delay_s,
        written.lag_s,
        written.braking_mps2,
        written.accelerating_mps2,
        1 if written.period_s is None else round(written.period_s / scenario.clocks.camera_period_s),
    )


def sections_config(scenario: ScenarioFile) -> SectionsConfig | None:
    """Sections of the route that are advised each by itself; None where there are none."""
    drivers, signs, along = scenario.drivers, scenario.drivers.signs, scenario.traffic.along
    if drivers.advised not in DISPLAYS:
        return None
    harmonisation = None if drivers.harmonisation is None else Harmonisation(**in_si(drivers.harmonisation))
    if drivers.advised != "signs":
        return SectionsConfig(DISPLAYS[drivers.advised], harmonisation=harmonisation, along=along)
    return SectionsConfig(
        Display.MESSAGE_SIGN,
        signs.spacing_m,
        signs.from_m,
        signs.to_m,
        signs.at_m,
        signs.reading_distance_m,
        harmonisation,
        along,
    )


def driver_sight(scenario: ScenarioFile) -> DriverSight | None:
    """Eyes of the drivers; None if they see through the fog."""
    drivers = scenario.drivers
    if drivers.see_through_fog:
        return None
    return DriverSight(
        scenario.light.illuminance_lx,
        drivers.headlamp_reach_m,
        drivers.reaction_time_s,
        airlight_share=scenario.fog.airlight_share,
    )


def driver_setup(scenario: ScenarioFile) -> DriverSetup:
    """How drivers choose their speed and follow advice."""
    drivers = scenario.drivers
    compliance, given = _compliance(drivers.compliance), drivers.compliance_by_display
    by_display = {
        display: _compliance(own) for display in Display if (own := getattr(given, display.value)) is not None
    }
    if drivers.advised == "equipped":
        in_car = by_display.get(Display.IN_CAR, compliance)
        reached = drivers.equipped_share * in_car.reached_share
        by_display[Display.IN_CAR] = dataclasses.replace(in_car, reached_share=reached)
    return DriverSetup(
        speed_choice=_speed_choice(scenario),
        spread=drivers.speed_spread,
        compliance=compliance,
        misjudgement=drivers.distance_misjudgement,
        following=drivers.following,
        compliance_by_display=by_display,
    )


def _speed_choice(scenario: ScenarioFile) -> SpeedChoice:
    """How fast drivers drive in fog; results of a user's class are checked."""
    written = scenario.drivers.speed_choice
    made = method(scenario, written).make(SPEED_CHOICES)
    return checked_choice(written.method, made)


def _compliance(written: ComplianceSection) -> Compliance:
    return Compliance(**in_si(written, "like"))
