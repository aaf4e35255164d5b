"""How near the ego came to harm: conflicts with its leader, sight, collisions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from fogsim.core.kinematics import stopping_sight_distance
from fogsim.metrics.estimation import FOG_LIMIT
from fogsim.metrics.metric import Definition, JsonValue, Sample, definitions_of, share
from fogsim.metrics.surrogate import (
    AVAILABLE_DECELERATION,
    QUEUE_SPEED,
    SafetyStandard,
    crash_potential,
    stopping_distance_difference,
)
from fogsim.units import clock_time, finite_or_none
from fogsim.values import Collision, Leader, Step

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
    """TTC and DRAC of one pair, None without a limit; the functions of `surrogate` would cost ten times as much."""
    approach = speed - leader.speed
    if approach <= 0.0:
        return None, 0.0
    return max(leader.gap, 0.0) / approach, 0.5 * approach**2 / leader.gap if leader.gap > 0.0 else None


@dataclass(slots=True)
class _Approach:
    """How near the ego came to some of its leaders."""

    least_time_to_collision: float | None = None
    exposed: float = 0.0
    integrated: float = 0.0
    max_drac: float | None = None
    least_gap: float | None = None

    def add(self, sample: Sample, leader: Leader, threshold: float) -> None:
        remaining = sample.derived["time_to_collision_s"]
        self.least_gap = _least(self.least_gap, leader.gap)
        self.max_drac = _most(self.max_drac, sample.derived["drac_mps2"])
        self.least_time_to_collision = _least(self.least_time_to_collision, remaining)
        if remaining is not None and remaining <= threshold:
            self.exposed += sample.elapsed
            self.integrated += (threshold - remaining) * sample.elapsed


@dataclass(slots=True)
class Conflict:
    """Surrogate safety of the ego at 5 m/s or more and its leader, moving or standing.

    A slower ego is closing up to a queue, which shows the traffic simulation's drivers, not the policy.
    """

    threshold: float  # Time to collision below which the ego counts as exposed [s]
    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("conflict")
    _all: _Approach = field(default_factory=_Approach)
    _moving: _Approach = field(default_factory=_Approach)
    _queue: _Approach = field(default_factory=_Approach)
    _least_headway: float | None = None
    _least_dss: float | None = None
    _lacking: float = 0.0
    _potential: float = 0.0
    _time: float = 0.0

    def update(self, sample: Sample) -> None:
        """Add one step."""
        self._time += sample.elapsed
        leader, speed = sample.step.leader, float(sample.step.traffic.speed[sample.step.ego])
        if leader is None or speed < QUEUE_SPEED:
            return
        self._all.add(sample, leader, self.threshold)
        (self._moving if leader.speed >= QUEUE_SPEED else self._queue).add(sample, leader, self.threshold)
        self._least_headway = _least(self._least_headway, max(leader.gap, 0.0) / speed)
        dss = float(stopping_distance_difference(leader.gap, speed, leader.speed))
        self._least_dss = _least(self._least_dss, dss)
        self._lacking += max(-dss, 0.0) * sample.elapsed
        drac = sample.derived["drac_mps2"]
        if drac is None or drac > AVAILABLE_DECELERATION[2]:
            self._potential += sample.elapsed * (1.0 if drac is None else float(crash_potential(drac)))

    def result(self) -> dict[str, JsonValue]:
        """Measures over the steps so far."""
        found: dict[str, JsonValue] = {
            "minimum_time_to_collision_s": self._all.least_time_to_collision,
            "time_exposed_time_to_collision_s": clock_time(self._all.exposed),
            "time_integrated_time_to_collision_s2": self._all.integrated,
            "max_drac_mps2": self._all.max_drac,
            "crash_potential_index": share(self._potential, self._time),
            "minimum_dss_m": self._least_dss,
            "time_integrated_dss_m_s": self._lacking,
            "minimum_gap_m": self._all.least_gap,
            "minimum_time_headway_s": self._least_headway,
        }
        for name, one in (("moving", self._moving), ("queue", self._queue)):
            found[f"minimum_{name}_time_to_collision_s"] = one.least_time_to_collision
            found[f"time_exposed_to_{name}_s"] = clock_time(one.exposed)
            found[f"max_{name}_drac_mps2"] = one.max_drac
            found[f"minimum_{name}_gap_m"] = one.least_gap
        return found


@dataclass(slots=True)
class Sight:
    """True visibility ahead against the distance in which the ego could stop."""

    reaction_time: float  # Perception and reaction time in that distance [s]
    deceleration: float  # Deceleration in it [m/s²]
    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("sight")
    _least_visibility: float | None = None
    _least_margin: float | None = None
    _negative_time: float = 0.0
    _time: float = 0.0
    _fog_distance: float = 0.0
    _overdriven: float = 0.0
    _margin_distance: float = 0.0
    _judged: bool = False

    def update(self, sample: Sample) -> None:
        """Add one step."""
        margin, visibility = sample.derived["visibility_margin_m"], sample.step.truth.visibility_ahead
        self._judged = True
        self._least_visibility = _least(self._least_visibility, finite_or_none(visibility))
        self._least_margin = _least(self._least_margin, margin)
        self._time += sample.elapsed
        if margin is None:
            return
        distance = float(sample.step.traffic.speed[sample.step.ego]) * sample.elapsed
        if margin < 0:
            self._negative_time += sample.elapsed
        if visibility < FOG_LIMIT:
            self._fog_distance += distance
            self._overdriven += distance if margin < 0 else 0.0
            self._margin_distance += margin * distance

    def result(self) -> dict[str, JsonValue]:
        """Sight over the steps so far."""
        return {
            "overdriven_m_per_km_in_fog": share(1000.0 * self._overdriven, self._fog_distance),
            "sight_margin_by_distance_m": share(self._margin_distance, self._fog_distance),
            "distance_in_fog_m": self._fog_distance,
            "minimum_visibility_m": self._least_visibility,
            "minimum_visibility_margin_m": self._least_margin,
            "negative_margin_time_share": share(self._negative_time, self._time),
            "stopping_reaction_time_s": self.reaction_time if self._judged else None,
            "stopping_deceleration_mps2": self.deceleration if self._judged else None,
        }


@dataclass(slots=True)
class Collisions:
    """Collisions of the ego and of all vehicles."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("collisions")
    _all: list[Collision] = field(default_factory=list)
    _ego: list[Collision] = field(default_factory=list)

    def update(self, sample: Sample) -> None:
        """Add one step."""
        if not sample.step.collisions:
            return
        ego = sample.step.traffic.ids[sample.step.ego]
        self._all.extend(sample.step.collisions)
        self._ego.extend(hit for hit in sample.step.collisions if ego in {hit.collider, hit.victim})

    def result(self) -> dict[str, JsonValue]:
        """Collisions in the steps so far."""
        return {
            "collisions": len(self._all),
            "ego_collisions": len(self._ego),
            "max_impact_speed_mps": max((hit.impact_speed for hit in self._all), default=None),
            "ego_max_impact_speed_mps": max((hit.impact_speed for hit in self._ego), default=None),
        }


def _least(one: float | None, other: float | None) -> float | None:
    return one if other is None or (one is not None and one <= other) else other


def _most(one: float | None, other: float | None) -> float | None:
    return one if other is None or (one is not None and one >= other) else other
