"""How smoothly all vehicles near the ego drive."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.metric import Definition, JsonValue, definitions_of, share
from fogsim.metrics.surrogate import CRITICAL_DECELERATION
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan


@dataclass(slots=True)
class TrafficComfort(TrafficMetric):
    """Jerk, the change of acceleration between two steps, and hard braking of all vehicles near the ego."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_comfort")
    _exposure: Exposure = field(default_factory=Exposure)
    _last: tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]] = field(
        default_factory=lambda: (np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros(0), np.zeros(0))
    )
    _squared_jerk_time: float = 0.0
    _time: float = 0.0
    _braking: float = 0.0
    _cohort_events: int = 0

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self._exposure.add(span)
        self._braking += float(span.elapsed[span.acceleration < -CRITICAL_DECELERATION].sum())
        # The last step of the span before comes first.
        moment, vehicle, elapsed, acceleration = (
            np.concatenate(parts)
            for parts in zip(self._last, (span.moment, span.vehicle, span.elapsed, span.acceleration), strict=True)
        )
        # Moments ascend, and stay so within a vehicle.
        order = np.argsort(vehicle, kind="stable")
        before, after = order[:-1], order[1:]
        follows = (vehicle[before] == vehicle[after]) & (moment[before] + 1 == moment[after])
        if span.in_cohort.any():
            hard = (acceleration < -CRITICAL_DECELERATION) & span.in_cohort[vehicle]
            begins = hard[order]
            begins[1:] &= ~(follows & hard[before])
            # What began in the last step of the span before is counted already.
            self._cohort_events += int((begins & (order >= len(self._last[0]))).sum())
        follows &= elapsed[after] > 0.0
        change = np.diff(acceleration[order])[follows]
        passed = elapsed[after][follows]
        self._squared_jerk_time += float((change**2 / passed).sum())
        self._time += float(passed.sum())
        last = moment == moment.max(initial=-1)
        self._last = moment[last], vehicle[last], elapsed[last], acceleration[last]

    def result(self) -> dict[str, JsonValue]:
        """Say how rough everyone's drive was."""
        mean_square = share(self._squared_jerk_time, self._time)
        return {
            "traffic_rms_jerk_mps3": None if mean_square is None else math.sqrt(mean_square),
            "traffic_hard_braking_time_share": share(self._braking, self._exposure.time),
            "traffic_hard_braking_events_per_cohort_vehicle": self._exposure.per_cohort_vehicle(self._cohort_events),
        }
