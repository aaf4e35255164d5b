"""The methods that a run has chosen: estimators, advisers and controllers."""

from collections.abc import Iterable

from fogsim.advice import ADVISERS, CONTROLLERS, Adviser, BeliefController, Controller, VehicleAdviser
from fogsim.core.registry import MethodConfig
from fogsim.errors import InputError
from fogsim.estimators import ESTIMATORS, Estimator, supply
from fogsim.values import Camera


def estimators(chosen: Iterable[MethodConfig], assumed: Camera) -> tuple[Estimator, ...]:
    """Estimators with the calibration that the vehicle assumes, supplied with cached calibrations."""
    made = tuple(one.make(ESTIMATORS, assumed) for one in chosen)
    for estimator in made:
        supply(estimator)
    return made


def adviser(chosen: MethodConfig) -> Adviser | VehicleAdviser:
    """A speed adviser."""
    return chosen.make(ADVISERS)


def controller(chosen: MethodConfig) -> Controller | BeliefController:
    """A controller."""
    return chosen.make(CONTROLLERS)


def road_adviser(chosen: MethodConfig) -> Adviser:
    """A speed adviser who advises roads."""
    advising = adviser(chosen)
    if isinstance(advising, VehicleAdviser):
        raise InputError(
            f"advice: {chosen.name!r} uses a vehicle's own sensors (advise_vehicle), which roads do not have; "
            "where roads are advised, take an adviser with advise()"
        )
    return advising
