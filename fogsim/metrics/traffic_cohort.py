"""Travel time and delay of the cohort: the vehicles that are due to depart in a given time of the run."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from fogsim.metrics.metric import Definition, JsonValue, definitions_of
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan
from fogsim.values import Cohort


@dataclass(slots=True)
class TrafficCohort(TrafficMetric):
    """Time that the vehicles of the cohort take and lose, waiting to enter the road included.

    The cohort is the same in every cell of a study for the same seed, so no policy moves its size. A vehicle that has
    not left when the run ends is unfinished and counts with its time until then.
    """

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_cohort")
    _exposure: Exposure = field(default_factory=Exposure)
    _cohort: Cohort | None = None
    _time: float = 0.0
    _lost: float = 0.0

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        if span.cohort is None:
            return
        self._exposure.add(span)
        self._cohort = span.cohort
        mine = np.flatnonzero(span.in_cohort[span.vehicle])
        elapsed, free = span.elapsed[mine], np.maximum(span.free_speed[mine], 0.1)
        self._time += float(elapsed.sum()) + span.cohort_waiting_time
        self._lost += float((elapsed * (1.0 - span.speed[mine] / free)).sum()) + span.cohort_waiting_time

    def result(self) -> dict[str, JsonValue]:
        """Size, time and delay of the cohort."""
        per_vehicle = self._exposure.per_cohort_vehicle
        return {
            "traffic_cohort_vehicles": self._exposure.cohort,
            "traffic_cohort_unfinished": None if self._cohort is None else self._cohort.unfinished,
            "traffic_travel_time_s_per_cohort_vehicle": per_vehicle(self._time),
            "traffic_delay_s_per_cohort_vehicle": None if np.isnan(self._lost) else per_vehicle(self._lost),
        }
