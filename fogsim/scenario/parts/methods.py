"""From a scenario to its methods: estimators, fusion, advisers, lighting, and what measures them."""

import dataclasses
from collections.abc import Callable
from importlib import import_module
from typing import TypeVar

from fogsim.advice import ADVISERS, Adviser, VehicleAdviser
from fogsim.core.parameters import paths_in
from fogsim.core.registry import Registry
from fogsim.errors import InputError
from fogsim.estimators import ESTIMATORS, Estimator
from fogsim.estimators.protocol import TakesCalibrations
from fogsim.fusion import FUSIONS, Fusion, LocatedFusion
from fogsim.lighting import LIGHTING_POLICIES, LightingPolicy, VehicleLightingPolicy
from fogsim.metrics import SafetyStandard
from fogsim.scenario.parts.lamp_file import load_lamps
from fogsim.scenario.schema import NO_RENDERER, Scenario
from fogsim.scenario.section import Method
from fogsim.values import Camera

T = TypeVar("T")


def check_ego(scenario: Scenario, who: str) -> None:
    """Refuse a scenario without an ego."""
    if not scenario.traffic.has_ego:
        raise InputError(
            f"{who} needs an ego vehicle, and traffic.ego is none; name one, or run traffic alone with fogsim "
            "run, fogsim study or fogsim.run_traffic"
        )


def check_frames(scenario: Scenario, who: str) -> None:
    """Refuse a scenario that draws no frames."""
    check_ego(scenario, who)
    if scenario.renderer == NO_RENDERER:
        raise InputError(f"{who} needs frames, and renderer: none draws none; choose auto, opengl, cpu or reference")


def estimators(scenario: Scenario, assumed: Camera) -> tuple[Estimator, ...]:
    """Estimators of a scenario, with the calibration that the vehicle assumes."""
    made = tuple(_made(ESTIMATORS, one, scenario, assumed) for one in scenario.estimators)
    for estimator in made:
        supply(estimator)
    return made


def supply(estimator: Estimator) -> None:
    """Give an estimator cached calibrations to take where it was given no files of them."""
    if isinstance(estimator, TakesCalibrations):
        # What draws staged scenes is imported when a calibration may be needed.
        calibrations = import_module("fogsim.calibration.cached").CachedCalibrations(load_lamps)
        estimator.take_calibrations(calibrations)


def fusion(scenario: Scenario) -> Fusion | LocatedFusion:
    """Fusion of a scenario."""
    return _made(FUSIONS, scenario.fusion, scenario)


def adviser(scenario: Scenario) -> Adviser | VehicleAdviser:
    """Speed adviser of a scenario."""
    return _made(ADVISERS, scenario.advice, scenario)


def road_adviser(scenario: Scenario) -> Adviser:
    """Speed adviser of a scenario, who advises roads."""
    advising = adviser(scenario)
    if isinstance(advising, VehicleAdviser):
        raise InputError(
            f"advice: {scenario.advice.method!r} uses a vehicle's own sensors (advise_vehicle), which roads do not "
            f"have; with drivers.advised: {scenario.drivers.advised} take an adviser with advise()"
        )
    return advising


def own_methods(scenario: Scenario) -> dict[str, str]:
    """Versions of the methods of a scenario that are not FogSim's, by their names."""
    folder, roadside = scenario.directory, scenario.sensors.reports.roadside
    beside_road = () if roadside is None or roadside.camera is None else (roadside.camera.estimator,)
    found = {
        **{one.method: ESTIMATORS.version(one.method, folder) for one in (*scenario.estimators, *beside_road)},
        scenario.fusion.method: FUSIONS.version(scenario.fusion.method, folder),
        scenario.advice.method: ADVISERS.version(scenario.advice.method, folder),
        scenario.lighting.method: LIGHTING_POLICIES.version(scenario.lighting.method, folder),
    }
    return {name: version for name, version in found.items() if version is not None}


def safety_standard(scenario: Scenario) -> SafetyStandard:
    """What a run is judged by: the reaction time and deceleration that its advice counts with, where it has them."""
    advising, usual = adviser(scenario), SafetyStandard()
    return dataclasses.replace(
        usual,
        reaction_time=getattr(advising, "reaction_time", usual.reaction_time),
        deceleration=getattr(advising, "deceleration", usual.deceleration),
    )


def lighting_policy(scenario: Scenario) -> LightingPolicy | VehicleLightingPolicy:
    """Lighting policy of a scenario."""
    return _made(LIGHTING_POLICIES, scenario.lighting, scenario)


def _made(registry: Registry[Callable[..., T]], written: Method, scenario: Scenario, *given: object) -> T:
    factory = registry.find(written.method, scenario.directory, scenario.method_timeout_s)
    paths = paths_in(factory, written.parameters, scenario.directory)
    return factory(*given, **{**written.parameters, **{name: str(path) for name, path in paths.items()}})
