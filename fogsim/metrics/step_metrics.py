"""What can be derived from one step alone."""

from fogsim.kinematics import stopping_sight_distance
from fogsim.metrics.surrogate import SafetyStandard
from fogsim.units import finite_or_none
from fogsim.values import Leader, Step

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
    remaining, drac = (None, None) if step.leader is None else _approach_measures(step.leader, speed)
    stopping = stopping_sight_distance(speed, standard.reaction_time, standard.deceleration)
    return {
        "time_to_collision_s": remaining,
        "drac_mps2": drac,
        "stopping_sight_distance_m": stopping,
        "visibility_margin_m": finite_or_none(step.truth.visibility_ahead - stopping),
    }


def _approach_measures(leader: Leader, speed: float) -> tuple[float | None, float | None]:
    """Time to collision and deceleration to avoid a crash, as in `surrogate`, of one pair; None without a limit.

    They are asked for in each step, where arrays would cost ten times as much.
    """
    approach = speed - leader.speed
    if approach <= 0.0:
        return None, 0.0
    return max(leader.gap, 0.0) / approach, 0.5 * approach**2 / leader.gap if leader.gap > 0.0 else None
