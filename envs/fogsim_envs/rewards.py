"""What an agent is rewarded for: named terms, so that users can weigh them again."""

from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from fogsim.advice import ADVISERS
from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError, shown
from fogsim.metrics import DEFAULT_STANDARD, SafetyStandard, stopping_sight_distance
from fogsim.scenario import Scenario, build
from fogsim.values import Lamp, Step

_COMFORTABLE_DECELERATION = 2.0
"""Decelerations up to this are comfortable [m/s²] (ISO 15622: 2–3.5)."""

_REAR_FOG_LAMP_VISIBILITY = 50.0
"""Rear fog lamps are lit below this visibility and not above [m] (German StVO § 17(3))."""


W = TypeVar("W")


class WeightsOf(Generic[W]):
    """An environment's attribute ``reward_weights``, in force from the next step; None for the default ones."""

    def __init__(self, kind: type[W]) -> None:
        self._kind = kind

    def __get__(self, environment: Any, owner: type | None = None) -> W:
        found: W = environment.__dict__["reward_weights"]
        return found

    def __set__(self, environment: Any, weights: W | None) -> None:
        made = self._kind() if weights is None else weights
        if not isinstance(made, self._kind):
            raise InputError(f"reward_weights: expected {self._kind.__name__}, got {shown(weights)}")
        environment.__dict__["reward_weights"] = made


@checked_parameters
@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Weights of the reward's terms; each term is about 1 where it matters."""

    progress: float = 1.0  # For driving at the speed limit
    visibility_margin: float = 2.0  # Against driving so fast that one cannot stop within the visibility
    conflict: float = 2.0  # Against times to collision below the standard's, 3 s
    discomfort: float = 0.3  # Against decelerations above 2 m/s²
    collision: float = 50.0  # Against a collision, once
    lamps: float = 0.2  # Against a rear fog lamp that blinds others in clear air or is dark in dense fog


def advice_standard(scenario: Scenario) -> SafetyStandard:
    """What rewards judge by: the reaction time and deceleration that the scenario's adviser counts with, if it does."""
    advising, usual = build.advice_config(scenario).adviser.make(ADVISERS), DEFAULT_STANDARD
    return replace(
        usual,
        reaction_time=getattr(advising, "reaction_time", usual.reaction_time),
        deceleration=getattr(advising, "deceleration", usual.deceleration),
    )


def reward_terms(
    before: Step, after: Step, weights: RewardWeights, standard: SafetyStandard = DEFAULT_STANDARD
) -> dict[str, float]:
    """Weighted terms, by name, whose sum is the reward for one decision period."""
    ego = after.traffic.ids[after.ego]
    speed = float(after.traffic.speed[after.ego])
    driven = after.route_position - before.route_position
    duration = max(after.time - before.time, 1e-9)
    sight = after.truth.visibility_ahead
    needed = stopping_sight_distance(speed, standard.reaction_time, standard.deceleration)
    rear_fog = Lamp.REAR_FOG in after.command.lamps
    hit = any(ego in (c.collider, c.victim) for c in after.collisions)
    return {
        "progress": weights.progress * driven / (after.speed_limit * duration),
        "visibility_margin": -weights.visibility_margin * max(0.0, 1.0 - sight / needed) if needed > 0 else 0.0,
        "conflict": -weights.conflict * _conflict(after, speed, standard.time_to_collision),
        "discomfort": -weights.discomfort
        * max(0.0, -float(after.traffic.acceleration[after.ego]) - _COMFORTABLE_DECELERATION),
        "collision": -weights.collision * float(hit),
        "lamps": -weights.lamps * float(rear_fog != (after.truth.visibility < _REAR_FOG_LAMP_VISIBILITY)),
    }


def _conflict(step: Step, speed: float, threshold: float) -> float:
    """How far the time to collision is below a threshold, 0 … 1."""
    if step.leader is None or speed <= step.leader.speed:
        return 0.0
    time_to_collision = max(step.leader.gap, 0.0) / (speed - step.leader.speed)
    return max(0.0, 1.0 - time_to_collision / threshold)
