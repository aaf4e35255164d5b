"""Collisions of everybody near the ego, by how much was driven."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from fogsim.metrics.metric import JsonValue, share
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan


@dataclass(slots=True)
class TrafficCollisions(TrafficMetric):
    """Collisions near the ego, each pair of vehicles once.

    One of the two was near at the step, or at the one before: the simulation may remove both. Only the way of those
    near is known, so those far away, which ``collisions`` has too, have no rate.
    """

    meanings: ClassVar[Mapping[str, str]] = {
        "traffic_collisions": "number of collisions of vehicles read, the ego among them, each pair once",
        "traffic_collisions_per_million_vehicle_km": "the same per million kilometres of all vehicles",
        "traffic_mean_impact_speed_mps": "mean difference of speed in them",
        "traffic_max_impact_speed_mps": "highest difference of speed in them",
    }
    _exposure: Exposure = field(default_factory=Exposure)
    _impacts: list[float] = field(default_factory=list)

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self._exposure.add(span)
        self._impacts += [hit.impact_speed for hit in span.collisions]

    def result(self) -> dict[str, JsonValue]:
        """Say how many there were and how hard."""
        impacts, rate = self._impacts, self._exposure.per_kilometre(len(self._impacts))
        return {
            "traffic_collisions": len(impacts),
            "traffic_collisions_per_million_vehicle_km": None if rate is None else 1e6 * rate,
            "traffic_mean_impact_speed_mps": share(sum(impacts), len(impacts)),
            "traffic_max_impact_speed_mps": max(impacts, default=None),
        }
