"""Conflicts of everybody near the ego, the ego among them: how often, how long and how hard."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.metric import JsonValue, share
from fogsim.metrics.surrogate import (
    CRITICAL_DECELERATION,
    QUEUE_SPEED,
    deceleration_rate_to_avoid_crash,
    modified_deceleration_rate_to_avoid_crash,
    potential_collision_speed,
    time_to_collision,
)
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan
from fogsim.units import finite_or_none

_MOMENTS = 1 << 32
"""More than a run has moments."""


@dataclass(slots=True)
class TrafficConflicts(TrafficMetric):
    """Conflicts between followers and leaders of one lane.

    Leaders slower than 5 m/s are a queue, and count apart; who is slower than that itself only closes up to one, which
    counts nowhere.

    Attributes
    ----------
    threshold : float
        Time to collision below which a driver counts as exposed [s].
    """

    threshold: float
    meanings: ClassVar[Mapping[str, str]] = {
        "traffic_conflicts_per_vehicle_h": "how often a driver came below the time-to-collision threshold behind a "
        "leader that moved (5 m/s or more), per hour of all vehicles",
        "traffic_conflicts_per_vehicle_km": "the same per kilometre of all vehicles",
        "traffic_exposed_time_share": "share of the time of all vehicles below that threshold, likewise (TET)",
        "traffic_exposed_time_s_per_vehicle_km": "the same time per kilometre of all vehicles",
        "traffic_integrated_time_to_collision_s2_per_h": "what was missing to that threshold, over time (TIT), per "
        "hour of all vehicles",
        "traffic_integrated_time_to_collision_s2_per_vehicle_km": "the same per kilometre of all vehicles",
        "traffic_minimum_time_to_collision_s": "least time to collision of anybody, likewise",
        "traffic_max_drac_mps2": "highest deceleration rate to avoid a crash, Δv² / 2 gap, of anybody, likewise",
        "traffic_serious_conflict_time_share": "share with that deceleration above 3.4 m/s²",
        "traffic_serious_mdrac_time_share": "share with a deceleration after 1 s of reaction, Δv / 2 (TTC − 1 s), "
        "above 3.4 m/s² (MDRAC), or none that is enough",
        "traffic_queue_exposed_time_share": "as traffic_exposed_time_share, for leaders slower than 5 m/s: driving at "
        "5 m/s or more towards a queue",
        "traffic_queue_serious_conflict_time_share": "as traffic_serious_conflict_time_share, for those",
        "traffic_mean_potential_collision_speed_mps": "mean over the time of followers that move of the speed at which "
        "they would hit their leader, should it brake at 6.43 m/s² and they do so 1 s later; 0 where they would not",
        "traffic_potential_collision_time_share": "share of that time in which they would hit it",
        "traffic_mean_approach_mps": "mean speed at which followers would meet their leader if nobody did anything",
    }
    _exposure: Exposure = field(default_factory=Exposure)
    _times: NDArray[np.float64] = field(default_factory=lambda: np.zeros(10))
    _episodes: int = 0
    _exposed_before: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))
    _least: float = np.inf
    _most: float = 0.0

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self._exposure.add(span)
        found = span.following
        driving = found.speed >= QUEUE_SPEED
        row, gap, own, ahead = (part[driving] for part in (found.follower, found.gap, found.speed, found.leader_speed))
        elapsed, moving = span.elapsed[row], ahead >= QUEUE_SPEED
        remaining = time_to_collision(gap, own, ahead)
        exposed = remaining <= self.threshold
        drac = deceleration_rate_to_avoid_crash(gap, own, ahead)
        serious = drac > CRITICAL_DECELERATION
        late = modified_deceleration_rate_to_avoid_crash(gap, own, ahead) > CRITICAL_DECELERATION
        impact = potential_collision_speed(gap, own, ahead)
        self._least = float(remaining[moving].min(initial=self._least))
        self._most = float(drac[moving & (gap > 0.0)].max(initial=self._most))
        begun = row[exposed & moving]
        self._count_episodes(span.vehicle[begun] * _MOMENTS + span.moment[begun], int(span.moment.max(initial=0)))
        self._times += [
            elapsed[exposed & moving].sum(),
            (elapsed * np.maximum(self.threshold - remaining, 0.0))[moving].sum(),
            elapsed[serious & moving].sum(),
            elapsed[late & moving].sum(),
            elapsed[exposed & ~moving].sum(),
            elapsed[serious & ~moving].sum(),
            elapsed.sum(),
            (elapsed * impact).sum(),
            elapsed[impact > 0.0].sum(),
            (elapsed * np.maximum(own - ahead, 0.0)).sum(),
        ]

    def _count_episodes(self, exposed: NDArray[np.intp], last: int) -> None:
        """Count those who are exposed (vehicle and moment in one number) and were not so a moment before."""
        self._episodes += int((~np.isin(exposed - 1, np.concatenate((self._exposed_before, exposed)))).sum())
        self._exposed_before = exposed[exposed % _MOMENTS == last]

    def result(self) -> dict[str, JsonValue]:
        """Say what everybody's time amounts to."""
        total, rate = self._exposure.time, self._exposure
        exposed, missing, serious, late, queue, hard_queue, moving, impact, hits, approach = map(float, self._times)
        return {
            "traffic_conflicts_per_vehicle_h": rate.per_hour(self._episodes),
            "traffic_conflicts_per_vehicle_km": rate.per_kilometre(self._episodes),
            "traffic_exposed_time_share": share(exposed, total),
            "traffic_exposed_time_s_per_vehicle_km": rate.per_kilometre(exposed),
            "traffic_integrated_time_to_collision_s2_per_h": rate.per_hour(missing),
            "traffic_integrated_time_to_collision_s2_per_vehicle_km": rate.per_kilometre(missing),
            "traffic_minimum_time_to_collision_s": finite_or_none(self._least),
            "traffic_max_drac_mps2": self._most if moving else None,
            "traffic_serious_conflict_time_share": share(serious, total),
            "traffic_serious_mdrac_time_share": share(late, total),
            "traffic_queue_exposed_time_share": share(queue, total),
            "traffic_queue_serious_conflict_time_share": share(hard_queue, total),
            "traffic_mean_potential_collision_speed_mps": share(impact, moving),
            "traffic_potential_collision_time_share": share(hits, moving),
            "traffic_mean_approach_mps": share(approach, moving),
        }
