"""From a scenario to its methods: estimators, fusion, advisers, lighting, and what measures them."""

import dataclasses
from typing import TypeVar

from fogsim.advice import ADVISERS, Adviser, VehicleAdviser
from fogsim.calibration.cached import supply
from fogsim.errors import InputError
from fogsim.estimators import ESTIMATORS, Estimator
from fogsim.fusion import FUSIONS, Fusion, LocatedFusion
from fogsim.lighting import LIGHTING_POLICIES, LightingPolicy, VehicleLightingPolicy
from fogsim.metrics import SafetyStandard
from fogsim.registry import Registry
from fogsim.scenario.schema import NO_RENDERER, Scenario
from fogsim.scenario.section import Method
from fogsim.values import Camera

T = TypeVar("T")


def check_ego(scenario: Scenario, who: str) -> None:
    """Refuse a scenario without an ego.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    who : str
        Who needs it, for the message.

    Raises
    ------
    InputError
        If its ego is none.
    """
    if not scenario.traffic.has_ego:
        raise InputError(
            f"{who} needs an ego vehicle, and traffic.ego is none; name one, or run traffic alone with fogsim "
            "run, fogsim study or fogsim.run_traffic"
        )


def check_frames(scenario: Scenario, who: str) -> None:
    """Refuse a scenario that draws no frames.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    who : str
        Who needs them, for the message.

    Raises
    ------
    InputError
        If its renderer is "none", or its ego is.
    """
    check_ego(scenario, who)
    if scenario.renderer == NO_RENDERER:
        raise InputError(f"{who} needs frames, and renderer: none draws none; choose auto, opengl, cpu or reference")


def estimators(scenario: Scenario, assumed: Camera) -> tuple[Estimator, ...]:
    """Estimators of a scenario, with the calibration that the vehicle assumes.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    assumed : Camera
        The assumed calibration.
    """
    made = tuple(_factory(ESTIMATORS, one, scenario)(assumed, **one.parameters) for one in scenario.estimators)
    for estimator in made:
        supply(estimator)
    return made


def fusion(scenario: Scenario) -> Fusion | LocatedFusion:
    """Fusion of a scenario.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    return _factory(FUSIONS, scenario.fusion, scenario)(**scenario.fusion.parameters)


def adviser(scenario: Scenario) -> Adviser | VehicleAdviser:
    """Speed adviser of a scenario.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    return _factory(ADVISERS, scenario.advice, scenario)(**scenario.advice.parameters)


def road_adviser(scenario: Scenario) -> Adviser:
    """Speed adviser of a scenario, who advises roads.

    Parameters
    ----------
    scenario : Scenario
        The scenario.

    Raises
    ------
    InputError
        If it needs the sensors of a vehicle.
    """
    advising = adviser(scenario)
    if isinstance(advising, VehicleAdviser):
        raise InputError(
            f"advice: {scenario.advice.method!r} goes by a vehicle's own sensors (advise_vehicle), which roads do not "
            f"have; with drivers.advised: {scenario.drivers.advised} take an adviser with advise()"
        )
    return advising


def own_methods(scenario: Scenario) -> dict[str, str]:
    """Versions of the methods of a scenario that are not FogSim's, by their names.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
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
    """What a run is judged by: the reaction time and deceleration that its advice counts with, where it has them.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    advising, usual = adviser(scenario), SafetyStandard()
    return dataclasses.replace(
        usual,
        reaction_time=getattr(advising, "reaction_time", usual.reaction_time),
        deceleration=getattr(advising, "deceleration", usual.deceleration),
    )


def lighting_policy(scenario: Scenario) -> LightingPolicy | VehicleLightingPolicy:
    """Lighting policy of a scenario.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """
    return _factory(LIGHTING_POLICIES, scenario.lighting, scenario)(**scenario.lighting.parameters)


def _factory(registry: Registry[T], written: Method, scenario: Scenario) -> T:
    return registry.find(written.method, scenario.directory, scenario.method_timeout_s)
