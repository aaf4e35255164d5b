"""What can be derived from one step alone."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fogsim.kinematics import stopping_sight_distance
from fogsim.metrics.surrogate import (
    SafetyStandard,
    deceleration_rate_to_avoid_crash,
    time_to_collision,
)
from fogsim.units import finite_or_none
from fogsim.values import Step

DEFAULT_STANDARD = SafetyStandard()
"""AASHTO's stopping sight distance, and the thresholds of SUMO's SSM device."""


def step_metrics(step: Step, standard: SafetyStandard = DEFAULT_STANDARD) -> dict[str, float | None]:
    """Derive the safety of one instant from its step.

    Parameters
    ----------
    step : Step
        The step.
    standard : SafetyStandard
        Reaction time and deceleration of the stopping sight distance.

    Returns
    -------
    dict
        ``time_to_collision_s``: None without a leader or where the ego does not approach it;
        ``drac_mps2``: None without a leader or once the bumpers touch;
        ``stopping_sight_distance_m``: at the ego's speed, on the level;
        ``visibility_margin_m``: true visibility ahead minus that distance, None where nothing limits sight.
    """
    speed = float(step.traffic.speed[step.ego])
    stopping = stopping_sight_distance(speed, standard.reaction_time, standard.deceleration)
    return {
        "time_to_collision_s": _leader_measure(time_to_collision, step, speed),
        "drac_mps2": _leader_measure(deceleration_rate_to_avoid_crash, step, speed),
        "stopping_sight_distance_m": stopping,
        "visibility_margin_m": finite_or_none(step.truth.visibility_ahead - stopping),
    }


def _leader_measure(
    measure: Callable[[float, float, float], NDArray[np.float64]], step: Step, speed: float
) -> float | None:
    if step.leader is None:
        return None
    return finite_or_none(float(measure(step.leader.gap, speed, step.leader.speed)))
