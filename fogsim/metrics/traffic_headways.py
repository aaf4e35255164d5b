"""Distances in time between everyone and the vehicle ahead."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from fogsim.metrics.histogram import Histogram
from fogsim.metrics.metric import Definition, JsonValue, definitions_of
from fogsim.metrics.surrogate import QUEUE_SPEED, time_headway
from fogsim.metrics.traffic_span import TrafficMetric, TrafficSpan


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
