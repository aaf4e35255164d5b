"""How near the ego came to harm: conflicts with its leader, sight, collisions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from fogsim.metrics.metric import JsonValue, Sample, share
from fogsim.metrics.surrogate import QUEUE_SPEED
from fogsim.units import clock_time, finite_or_none
from fogsim.values import Collision, Leader


@dataclass(slots=True)
class _Approach:
    """How near the ego came to leaders of one sort."""

    least_time_to_collision: float | None = None
    exposed: float = 0.0
    integrated: float = 0.0
    max_drac: float | None = None
    least_gap: float | None = None
    least_headway: float | None = None

    def add(self, sample: Sample, leader: Leader, threshold: float) -> None:
        speed, remaining = float(sample.step.traffic.speed[sample.step.ego]), sample.derived["time_to_collision_s"]
        self.least_gap = _least(self.least_gap, leader.gap)
        if speed > 0.0:
            self.least_headway = _least(self.least_headway, max(leader.gap, 0.0) / speed)
        self.max_drac = _most(self.max_drac, sample.derived["drac_mps2"])
        self.least_time_to_collision = _least(self.least_time_to_collision, remaining)
        if remaining is not None and remaining <= threshold:
            self.exposed += sample.elapsed
            self.integrated += (threshold - remaining) * sample.elapsed


@dataclass(slots=True)
class Conflict:
    """Surrogate safety of the ego and its leader.

    A leader slower than 5 m/s is a queue and counts apart, and only while the ego itself drives at 5 m/s or more: how
    it closes up to a standing car says how the traffic simulation's drivers do so, whatever the policy.

    Attributes
    ----------
    threshold : float
        Time to collision below which the ego counts as exposed [s].
    """

    threshold: float
    meanings: ClassVar[Mapping[str, str]] = {
        "minimum_time_to_collision_s": "least time to collision with a leader that moves (5 m/s or more); none if "
        "never approached",
        "time_exposed_time_to_collision_s": "time below the time-to-collision threshold (TET), likewise",
        "time_integrated_time_to_collision_s2": "what was missing to that threshold, over time (TIT), likewise",
        "max_drac_mps2": "highest deceleration rate to avoid a crash with such a leader, before any contact",
        "minimum_gap_m": "least gap to such a leader",
        "minimum_time_headway_s": "least gap over speed, likewise",
        "minimum_queue_time_to_collision_s": "least time to collision of the ego at 5 m/s or more with a leader that "
        "is slower than that",
        "time_exposed_to_queue_s": "time below the time-to-collision threshold, likewise",
        "max_queue_drac_mps2": "highest deceleration rate to avoid a crash, likewise",
        "minimum_queue_gap_m": "least gap, likewise",
    }
    _moving: _Approach = field(default_factory=_Approach)
    _queue: _Approach = field(default_factory=_Approach)

    def update(self, sample: Sample) -> None:
        """Add one step."""
        leader, speed = sample.step.leader, float(sample.step.traffic.speed[sample.step.ego])
        if leader is None:
            return
        if leader.speed >= QUEUE_SPEED:
            self._moving.add(sample, leader, self.threshold)
        elif speed >= QUEUE_SPEED:
            self._queue.add(sample, leader, self.threshold)

    def result(self) -> dict[str, JsonValue]:
        """Say how near a collision was."""
        moving, queue = self._moving, self._queue
        return {
            "minimum_time_to_collision_s": moving.least_time_to_collision,
            "time_exposed_time_to_collision_s": clock_time(moving.exposed),
            "time_integrated_time_to_collision_s2": moving.integrated,
            "max_drac_mps2": moving.max_drac,
            "minimum_gap_m": moving.least_gap,
            "minimum_time_headway_s": moving.least_headway,
            "minimum_queue_time_to_collision_s": queue.least_time_to_collision,
            "time_exposed_to_queue_s": clock_time(queue.exposed),
            "max_queue_drac_mps2": queue.max_drac,
            "minimum_queue_gap_m": queue.least_gap,
        }


@dataclass(slots=True)
class Sight:
    """True visibility ahead against the distance in which the ego could stop.

    Attributes
    ----------
    reaction_time : float
        Perception and reaction time in that distance [s].
    deceleration : float
        Deceleration in it [m/s²].
    """

    reaction_time: float
    deceleration: float
    meanings: ClassVar[Mapping[str, str]] = {
        "minimum_visibility_m": "least true visibility ahead; none if the air was clear throughout",
        "minimum_visibility_margin_m": "least true visibility ahead minus stopping sight distance",
        "negative_margin_time_share": "share of the time in which the ego could not have stopped in sight",
        "stopping_reaction_time_s": "reaction time in stopping sight distances: that of the advice, else 2.5 s",
        "stopping_deceleration_mps2": "deceleration in the same: that of the advice, else 3.4 m/s²",
    }
    _least_visibility: float | None = None
    _least_margin: float | None = None
    _negative_time: float = 0.0
    _time: float = 0.0
    _judged: bool = False

    def update(self, sample: Sample) -> None:
        """Add one step."""
        margin = sample.derived["visibility_margin_m"]
        self._judged = True
        self._least_visibility = _least(self._least_visibility, finite_or_none(sample.step.truth.visibility_ahead))
        self._least_margin = _least(self._least_margin, margin)
        self._time += sample.elapsed
        if margin is not None and margin < 0:
            self._negative_time += sample.elapsed

    def result(self) -> dict[str, JsonValue]:
        """Say whether the ego could have stopped within what it saw."""
        return {
            "minimum_visibility_m": self._least_visibility,
            "minimum_visibility_margin_m": self._least_margin,
            "negative_margin_time_share": share(self._negative_time, self._time),
            "stopping_reaction_time_s": self.reaction_time if self._judged else None,
            "stopping_deceleration_mps2": self.deceleration if self._judged else None,
        }


@dataclass(slots=True)
class Collisions:
    """Collisions of the ego and of everyone."""

    meanings: ClassVar[Mapping[str, str]] = {
        "collisions": "number of collisions of all vehicles",
        "ego_collisions": "number of those that the ego was in",
        "max_impact_speed_mps": "highest difference of speed in a collision of any vehicles",
        "ego_max_impact_speed_mps": "the same for the ego",
    }
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
        """Say how many collisions there were and how hard."""
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
