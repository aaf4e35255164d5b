"""Surrogate safety of everybody near the ego, the ego among them, over the time of all vehicles together."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.following import find_following
from fogsim.metrics.metric import JsonValue, Sample, share
from fogsim.metrics.surrogate import deceleration_rate_to_avoid_crash, time_headway, time_to_collision

QUEUE_SPEED = 5.0
"""A leader slower than this stands in a queue, or is about to: closing up to it is no conflict of its own [m/s]."""

CRITICAL_DECELERATION = 3.4
"""Deceleration to avoid a crash from which a conflict is serious [m/s²] (MDRAC's threshold of SUMO's SSM device)."""

HOUR = 3600.0


@dataclass(slots=True)
class Everybody:
    """Conflicts, headways and speeds of all vehicles near the ego.

    Attributes
    ----------
    threshold : float
        Time to collision below which a driver counts as exposed [s].
    """

    threshold: float
    meanings: ClassVar[Mapping[str, str]] = {
        "traffic_vehicle_time_s": "time of all vehicles near the ego together, on which the shares below are based",
        "traffic_mean_speed_mps": "mean speed over that time",
        "traffic_speed_standard_deviation_mps": "standard deviation of speed over that time",
        "traffic_exposed_time_share": "share with a time to collision below the threshold, the leader moving (TET)",
        "traffic_integrated_time_to_collision_s2_per_h": "what was missing to that threshold (TIT), per hour",
        "traffic_serious_conflict_time_share": "share with a deceleration to avoid a crash above 3.4 m/s², likewise",
        "traffic_queue_exposed_time_share": "the first of these for leaders slower than 5 m/s: closing up to a queue",
        "traffic_headway_below_1_s_share": "share of the time of moving followers at less than 1 s behind the leader",
        "traffic_headway_below_2_s_share": "the same at less than 2 s",
        "traffic_mean_approach_mps": "mean speed at which followers would meet their leader if nobody did anything",
    }
    _times: NDArray[np.float64] = field(default_factory=lambda: np.zeros(8))
    _speed: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    def update(self, sample: Sample) -> None:
        """Take in one step.

        Parameters
        ----------
        sample : Sample
            The step, and what is derived from it.
        """
        traffic, elapsed = sample.step.traffic, sample.elapsed
        speed = traffic.speed
        self._speed += elapsed * np.array([len(speed), speed.sum(), (speed**2).sum()])
        follower, leader, gap = find_following(traffic)
        own, ahead = speed[follower], speed[leader]
        remaining = time_to_collision(gap, own, ahead)
        exposed, queue, moving = remaining <= self.threshold, ahead < QUEUE_SPEED, own >= QUEUE_SPEED
        headway = time_headway(gap, own)
        missing = np.where(exposed & ~queue, self.threshold - remaining, 0.0)
        serious = deceleration_rate_to_avoid_crash(gap, own, ahead) > CRITICAL_DECELERATION
        self._times += elapsed * np.array(
            [
                (exposed & ~queue).sum(),
                missing.sum(),
                (serious & ~queue).sum(),
                (exposed & queue).sum(),
                moving.sum(),
                (moving & (headway < 1.0)).sum(),
                (moving & (headway < 2.0)).sum(),
                np.maximum(own - ahead, 0.0)[moving].sum(),
            ]
        )

    def result(self) -> dict[str, JsonValue]:
        """Say what everybody's time amounts to."""
        total, way, squares = map(float, self._speed)
        exposed, missing, serious, queue, moving, below_1, below_2, approach = map(float, self._times)
        mean = share(way, total)
        return {
            "traffic_vehicle_time_s": total,
            "traffic_mean_speed_mps": mean,
            "traffic_speed_standard_deviation_mps": None
            if mean is None
            else float(np.sqrt(max(squares / total - mean**2, 0.0))),
            "traffic_exposed_time_share": share(exposed, total),
            "traffic_integrated_time_to_collision_s2_per_h": share(HOUR * missing, total),
            "traffic_serious_conflict_time_share": share(serious, total),
            "traffic_queue_exposed_time_share": share(queue, total),
            "traffic_headway_below_1_s_share": share(below_1, moving),
            "traffic_headway_below_2_s_share": share(below_2, moving),
            "traffic_mean_approach_mps": share(approach, moving),
        }
