"""How near the ego came to harm: conflicts with its leader, sight, collisions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from fogsim.metrics.metric import JsonValue, Sample, share
from fogsim.metrics.surrogate import (
    time_exposed_time_to_collision,
    time_headway,
    time_integrated_time_to_collision,
)
from fogsim.units import clock_time, finite_or_none
from fogsim.values import Collision


@dataclass(slots=True)
class Conflict:
    """Surrogate safety of the ego and its leader.

    Attributes
    ----------
    threshold : float
        Time to collision below which the ego counts as exposed [s].
    """

    threshold: float
    meanings: ClassVar[Mapping[str, str]] = {
        "minimum_time_to_collision_s": "least time to collision with the leader; none if never approached",
        "time_exposed_time_to_collision_s": "time below the time-to-collision threshold (TET)",
        "time_integrated_time_to_collision_s2": "what was missing to that threshold, over time (TIT)",
        "max_drac_mps2": "highest deceleration rate to avoid a crash with the leader, before any contact",
        "minimum_gap_m": "least gap to the leader",
        "minimum_time_headway_s": "least gap over speed",
    }
    _least_time_to_collision: float | None = None
    _exposed: float = 0.0
    _integrated: float = 0.0
    _max_drac: float | None = None
    _least_gap: float | None = None
    _least_headway: float | None = None

    def update(self, sample: Sample) -> None:
        """Take in one step.

        Parameters
        ----------
        sample : Sample
            The step, and what is derived from it.
        """
        leader = sample.step.leader
        if leader is None:
            return
        speed = float(sample.step.traffic.speed[sample.step.ego])
        self._least_gap = _least(self._least_gap, leader.gap)
        headway = finite_or_none(float(time_headway(leader.gap, speed)))
        self._least_headway = _least(self._least_headway, headway)
        self._max_drac = _most(self._max_drac, sample.derived["drac_mps2"])
        self._add_time_to_collision(sample.derived["time_to_collision_s"], sample.elapsed)

    def _add_time_to_collision(self, time_to_collision: float | None, elapsed: float) -> None:
        if time_to_collision is None:
            return
        self._least_time_to_collision = _least(self._least_time_to_collision, time_to_collision)
        self._exposed += time_exposed_time_to_collision(time_to_collision, elapsed, self.threshold)
        self._integrated += time_integrated_time_to_collision(time_to_collision, elapsed, self.threshold)

    def result(self) -> dict[str, JsonValue]:
        """Say how near a collision was."""
        return {
            "minimum_time_to_collision_s": self._least_time_to_collision,
            "time_exposed_time_to_collision_s": clock_time(self._exposed),
            "time_integrated_time_to_collision_s2": self._integrated,
            "max_drac_mps2": self._max_drac,
            "minimum_gap_m": self._least_gap,
            "minimum_time_headway_s": self._least_headway,
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
        """Take in one step.

        Parameters
        ----------
        sample : Sample
            The step, and what is derived from it.
        """
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
        """Take in one step.

        Parameters
        ----------
        sample : Sample
            The step, and what is derived from it.
        """
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
    return min((value for value in (one, other) if value is not None), default=None)


def _most(one: float | None, other: float | None) -> float | None:
    return max((value for value in (one, other) if value is not None), default=None)
