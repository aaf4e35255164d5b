"""Conflicts of all vehicles near the ego, the ego among them: how often, how long and how hard."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.metric import Definition, Histogram, JsonValue, definitions_of, share
from fogsim.metrics.surrogate import (
    AVAILABLE_DECELERATION,
    CRITICAL_DECELERATION,
    QUEUE_SPEED,
    crash_potential,
    deceleration_rate_to_avoid_crash,
    modified_deceleration_rate_to_avoid_crash,
    potential_collision_speed,
    stopping_distance_difference,
    time_headway,
    time_to_collision,
)
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan
from fogsim.units import finite_or_none


@dataclass(slots=True)
class TrafficCollisions(TrafficMetric):
    """Collisions near the ego, each pair of vehicles once.

    One of the two was near at the step, or at the one before: the simulation may remove both. Only the distance of
    vehicles near the ego is known, so collisions far away, which ``collisions`` includes, have no rate.
    """

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_collisions")
    _exposure: Exposure = field(default_factory=Exposure)
    _impacts: list[float] = field(default_factory=list)
    _of_cohort: int = 0

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self._exposure.add(span)
        self._impacts += [hit.impact_speed for hit in span.collisions]
        members = frozenset() if span.cohort is None else span.cohort.vehicles
        self._of_cohort += sum(not members.isdisjoint((hit.collider, hit.victim)) for hit in span.collisions)

    def result(self) -> dict[str, JsonValue]:
        """Number, rates and severity."""
        impacts, rate = self._impacts, self._exposure.per_kilometre(len(self._impacts))
        return {
            "traffic_collisions": len(impacts),
            "traffic_collisions_per_cohort_vehicle": self._exposure.per_cohort_vehicle(self._of_cohort),
            "traffic_collisions_per_million_vehicle_km": None if rate is None else 1e6 * rate,
            "traffic_mean_impact_speed_mps": share(sum(impacts), len(impacts)),
            "traffic_max_impact_speed_mps": max(impacts, default=None),
        }


@dataclass(slots=True)
class TrafficHeadways(TrafficMetric):
    """Time headways of all followers near the ego that drive at 5 m/s or more.

    The headway is between bumpers, gap / v_F. It is also the post-encroachment time (PET, Allen, Shin & Cooper 1978) of
    vehicles in one lane: the time from when the leader's rear bumper leaves a place to when the follower's front bumper
    comes there, at the speed that it has.
    """

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_headways")
    _headways: Histogram = field(default_factory=lambda: Histogram(0.0, 10.0, 0.05))

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        found = span.following
        moving = found.speed >= QUEUE_SPEED
        headways = time_headway(found.gap[moving], found.speed[moving])
        self._headways.add(headways, span.elapsed[found.follower[moving]])

    def result(self) -> dict[str, JsonValue]:
        """Say how the headways are distributed."""
        return {
            **{f"traffic_headway_below_{s}_s_share": self._headways.share_below(s) for s in (1, 2, 3)},
            "traffic_headway_p05_s": self._headways.quantile(0.05),
            "traffic_median_headway_s": self._headways.quantile(0.5),
        }


_MOMENTS = 1 << 32
"""More than a run has moments."""


@dataclass(slots=True)
class TrafficConflicts(TrafficMetric):
    """Conflicts between followers at 5 m/s or more and their leaders, moving or standing."""

    threshold: float  # Time to collision below which a driver counts as exposed [s]
    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_conflicts")
    _exposure: Exposure = field(default_factory=Exposure)
    _times: NDArray[np.float64] = field(default_factory=lambda: np.zeros((11, 2)))
    _episodes: NDArray[np.intp] = field(default_factory=lambda: np.zeros(2, np.intp))
    _cohort_episodes: int = 0
    _exposed_before: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))
    _least: NDArray[np.float64] = field(default_factory=lambda: np.full(2, np.inf))
    _most: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))

    def add(self, span: TrafficSpan) -> None:
        """Add some steps; arrays of two are about moving and queued leaders."""
        self._exposure.add(span)
        found = span.following
        driving = found.speed >= QUEUE_SPEED
        row = found.follower[driving]
        gap, own, ahead = (part[driving] for part in (found.gap, found.speed, found.leader_speed))
        elapsed, queued = span.elapsed[row], (ahead < QUEUE_SPEED).astype(np.intp)
        remaining = time_to_collision(gap, own, ahead)
        exposed = remaining <= self.threshold
        drac = deceleration_rate_to_avoid_crash(gap, own, ahead)
        late = modified_deceleration_rate_to_avoid_crash(gap, own, ahead) > CRITICAL_DECELERATION
        impact = potential_collision_speed(gap, own, ahead)
        lacking = np.maximum(-stopping_distance_difference(gap, own, ahead), 0.0)
        potential = np.zeros(len(drac))
        hard = np.flatnonzero(drac > AVAILABLE_DECELERATION[2])
        potential[hard] = crash_potential(drac[hard])
        np.minimum.at(self._least, queued, remaining)
        free = np.flatnonzero(gap > 0.0)
        np.maximum.at(self._most, queued[free], drac[free])
        self._count_episodes(span, row[exposed], queued[exposed])
        values = (
            *(exposed, np.maximum(self.threshold - remaining, 0.0), drac > CRITICAL_DECELERATION, late, potential),
            *(lacking > 0.0, lacking, np.ones(len(row)), impact, impact > 0.0, np.maximum(own - ahead, 0.0)),
        )
        self._times += [np.bincount(queued, elapsed * value, minlength=2) for value in values]

    def _count_episodes(self, span: TrafficSpan, row: NDArray[np.intp], queued: NDArray[np.intp]) -> None:
        """Count those who are exposed (vehicle and moment in one number) and were not so a moment before."""
        exposed = span.vehicle[row] * _MOMENTS + span.moment[row]
        begun = ~np.isin(exposed - 1, np.concatenate((self._exposed_before, exposed)))
        self._episodes += np.bincount(queued[begun], minlength=2)
        self._cohort_episodes += int(span.in_cohort[span.vehicle[row[begun]]].sum())
        self._exposed_before = exposed[exposed % _MOMENTS == int(span.moment.max(initial=0))]

    def result(self) -> dict[str, JsonValue]:
        """Rates, shares and extremes over the steps so far."""
        total, rate = self._exposure.time, self._exposure
        conflicts = int(self._episodes.sum())
        exposed, missing, serious, late, potential, negative, lacking, driving, impact, hits, approach = map(
            float, self._times.sum(axis=1)
        )
        followed = self._times[7]
        found: dict[str, JsonValue] = {
            "traffic_conflicts_per_cohort_vehicle": rate.per_cohort_vehicle(self._cohort_episodes),
            "traffic_conflicts_per_vehicle_km": rate.per_kilometre(conflicts),
            "traffic_conflicts_per_vehicle_h": rate.per_hour(conflicts),
            "traffic_exposed_time_share": share(exposed, total),
            "traffic_exposed_time_s_per_vehicle_km": rate.per_kilometre(exposed),
            "traffic_integrated_time_to_collision_s2_per_h": rate.per_hour(missing),
            "traffic_integrated_time_to_collision_s2_per_vehicle_km": rate.per_kilometre(missing),
            "traffic_minimum_time_to_collision_s": finite_or_none(float(self._least.min())),
            "traffic_max_drac_mps2": float(self._most.max()) if driving else None,
            "traffic_serious_conflict_time_share": share(serious, total),
            "traffic_serious_mdrac_time_share": share(late, total),
            "traffic_crash_potential_index": share(potential, total),
            "traffic_negative_dss_time_share": share(negative, total),
            "traffic_time_integrated_dss_m_s_per_vehicle_km": rate.per_kilometre(lacking),
        }
        for sort, name in enumerate(("moving", "queue")):
            found[f"traffic_{name}_conflicts_per_vehicle_km"] = rate.per_kilometre(int(self._episodes[sort]))
            found[f"traffic_{name}_exposed_time_share"] = share(float(self._times[0, sort]), total)
            found[f"traffic_{name}_serious_conflict_time_share"] = share(float(self._times[2, sort]), total)
            found[f"traffic_minimum_{name}_time_to_collision_s"] = finite_or_none(float(self._least[sort]))
            found[f"traffic_max_{name}_drac_mps2"] = float(self._most[sort]) if followed[sort] else None
        return {
            **found,
            "traffic_mean_potential_collision_speed_mps": share(impact, driving),
            "traffic_potential_collision_time_share": share(hits, driving),
            "traffic_mean_approach_mps": share(approach, driving),
        }
