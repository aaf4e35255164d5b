"""What an episode is worth: named terms that no standing, crawling or early end can farm."""

import math
from dataclasses import dataclass

from fogsim.core.kinematics import stopping_sight_distance
from fogsim.core.parameters import checked_parameters
from fogsim.metrics import DEFAULT_STANDARD, SafetyStandard
from fogsim.values import Ending, Lamp, Step

_COMFORTABLE_DECELERATION = 2.0
"""Decelerations up to this are comfortable [m/s²] (ISO 15622: 2–3.5)."""

REAR_FOG_LAMP_VISIBILITY = 50.0
"""Rear fog lamps are lit below this visibility and not above [m] (German StVO § 17(3))."""

FRONT_FOG_LAMP_VISIBILITY = 100.0
"""Front fog lamps are lit below this visibility and not above [m] (Highway Code, rules 226 and 236)."""


@checked_parameters
@dataclass(frozen=True, slots=True)
class TaskWeights:
    """Weights of the terms, in points: a drive at the limit all the way with nothing amiss is worth 40.

    Attributes
    ----------
    progress : float
        For the whole way, in proportion to what was driven within the limit.
    time : float
        Against the time that the way takes at the limit; against every second in proportion, those included that an
        episode would have had left when it ended before the arrival.
    arrival : float
        For arriving.
    overdriving : float
        Against the whole way driven with no sight at all; in proportion to the way and to the share of the stopping
        sight distance that lies beyond the sight.
    conflict : float
        Against each second at a time to collision of 0, in proportion to what is missing to the standard's, 3 s.
    discomfort : float
        Against each second of braking by 1 m/s² more than 2 m/s².
    collision : float
        Against a collision in which the ego strikes another road user.
    rear_fog_lamp : float
        Against the whole way driven with the rear fog lamp lit above 50 m, where it dazzles those behind, or dark
        below, where the ego is not seen.
    front_fog_lamp : float
        The same for the front fog lamps and 100 m, where they dazzle those who come the other way.
    """

    progress: float = 40.0
    time: float = 10.0
    arrival: float = 10.0
    overdriving: float = 150.0
    conflict: float = 2.0
    discomfort: float = 0.5
    collision: float = 100.0
    rear_fog_lamp: float = 15.0
    front_fog_lamp: float = 8.0


@dataclass(frozen=True, slots=True)
class Way:
    """The way of an episode, against which time and distance are counted."""

    length: float  # From the start to the arrival [m]
    limit: float  # Speed limit at the start [m/s]
    duration: float  # Longest time [s]

    @property
    def time_at_limit(self) -> float:
        """Time that it takes at the limit [s]."""
        return self.length / self.limit


def task_terms(
    before: Step, after: Step, way: Way, weights: TaskWeights, standard: SafetyStandard = DEFAULT_STANDARD
) -> dict[str, float]:
    """Weighted terms, by the names of `TaskWeights`, whose sum is the reward for one decision period."""
    duration = after.time - before.time
    driven = max(after.route_position - before.route_position, 0.0)
    share = driven / way.length
    # Who drives faster than allowed gains no more than who drives at the limit.
    allowed = min(driven, max(before.speed_limit, after.speed_limit) * duration) / way.length
    ended_early = after.ending not in (None, Ending.ARRIVED)
    lost = max(way.duration - after.time, 0.0) if ended_early else 0.0
    terms = {
        "progress": allowed,
        "time": -(duration + lost) / way.time_at_limit,
        "arrival": float(after.ending is Ending.ARRIVED),
        "overdriving": -share * unseen_share(after, standard),
        "conflict": -duration * conflict(after, standard.time_to_collision),
        "discomfort": -duration * max(-_acceleration(after) - _COMFORTABLE_DECELERATION, 0.0),
        "collision": -float(strikes(after)),
        "rear_fog_lamp": -share * _amiss(after, Lamp.REAR_FOG, REAR_FOG_LAMP_VISIBILITY),
        "front_fog_lamp": -share * _amiss(after, Lamp.FRONT_FOG, FRONT_FOG_LAMP_VISIBILITY),
    }
    return {name: getattr(weights, name) * value for name, value in terms.items()}


def unseen_share(step: Step, standard: SafetyStandard) -> float:
    """Share of the stopping sight distance that lies beyond what can be seen ahead [-]."""
    speed = float(step.traffic.speed[step.ego])
    needed = stopping_sight_distance(speed, standard.reaction_time, standard.deceleration)
    return max(0.0, 1.0 - step.truth.visibility_ahead / needed) if needed > 0.0 else 0.0


def time_to_collision(step: Step) -> float:
    """Time in which the ego would strike its leader if both kept their speeds [s]; ``inf`` if it would not."""
    speed = float(step.traffic.speed[step.ego])
    if step.leader is None or speed <= step.leader.speed:
        return math.inf
    return max(step.leader.gap, 0.0) / (speed - step.leader.speed)


def conflict(step: Step, threshold: float) -> float:
    """How far the time to collision is below a threshold, 0 … 1 (`threshold` [s])."""
    return max(0.0, 1.0 - time_to_collision(step) / threshold)


def fault(step: Step) -> str:
    """Who is at fault in the ego's collision: "ego" if it strikes somebody, "other" if it is struck; "" without one."""
    if strikes(step):
        return "ego"
    ego = step.traffic.ids[step.ego]
    return "other" if any(ego == one.victim for one in step.collisions) else ""


def strikes(step: Step) -> bool:
    """Whether the ego strikes another road user."""
    ego = step.traffic.ids[step.ego]
    return any(ego == one.collider for one in step.collisions)


def _acceleration(step: Step) -> float:
    return float(step.traffic.acceleration[step.ego])


def _amiss(step: Step, lamp: Lamp, visibility: float) -> float:
    """Whether a lamp is lit above a visibility, or dark below."""
    return float((lamp in step.command.lamps) != (step.truth.visibility < visibility))
