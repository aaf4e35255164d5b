"""Collisions of all vehicles near the ego, by how much is driven and by the cohort."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from fogsim.metrics.metric import Definition, JsonValue, definitions_of, share
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan


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
