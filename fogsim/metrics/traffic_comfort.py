"""How smoothly all vehicles near the ego drive."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.core.kinematics import stopping_sight_distance
from fogsim.metrics.estimation import FOG_LIMIT
from fogsim.metrics.metric import Definition, Histogram, JsonValue, definitions_of, share
from fogsim.metrics.surrogate import CRITICAL_DECELERATION, potential_collision_speed
from fogsim.metrics.traffic_span import KILOMETRE, Exposure, TrafficMetric, TrafficSpan
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY


@dataclass(slots=True)
class TrafficSight(TrafficMetric):
    """Meteorological visibility where each driver is against the distance in which they could stop."""

    reaction_time: float  # Perception and reaction time in that distance [s]
    deceleration: float  # Deceleration in it [m/s²]
    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_sight")
    _sums: NDArray[np.float64] = field(default_factory=lambda: np.zeros(8))
    _margins: Histogram = field(default_factory=lambda: Histogram(-FOG_LIMIT, FOG_LIMIT, 0.5))

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        # Nothing is greater than nan, which stands for fog that is not known.
        foggy = span.extinction > OPTICAL_DEPTH_AT_VISIBILITY / FOG_LIMIT
        visibility, fast = OPTICAL_DEPTH_AT_VISIBILITY / span.extinction[foggy], span.speed[foggy]
        elapsed = span.elapsed[foggy]
        distance = elapsed * fast
        margin = visibility - stopping_sight_distance(fast, self.reaction_time, self.deceleration)
        impact = potential_collision_speed(visibility, fast, np.zeros(len(fast)))
        self._margins.add(margin, elapsed)
        self._sums += [
            span.elapsed[~np.isnan(span.extinction)].sum(),
            elapsed.sum(),
            elapsed[margin < 0.0].sum(),
            (elapsed * margin).sum(),
            (elapsed * impact).sum(),
            distance.sum(),
            distance[margin < 0.0].sum(),
            (distance * margin).sum(),
        ]

    def result(self) -> dict[str, JsonValue]:
        """Sight against stopping sight distance over the steps so far."""
        total, foggy, overdriving, margin, impact, distance, overdriven, margin_distance = map(float, self._sums)
        return {
            "traffic_overdriven_m_per_vehicle_km_in_fog": share(KILOMETRE * overdriven, distance),
            "traffic_sight_margin_by_distance_m": share(margin_distance, distance),
            "traffic_vehicle_distance_in_fog_m": distance,
            "traffic_fog_time_share": share(foggy, total),
            "traffic_overdriving_time_share": share(overdriving, total),
            "traffic_mean_sight_margin_m": share(margin, foggy),
            "traffic_sight_margin_p05_m": self._margins.quantile(0.05),
            "traffic_mean_obstacle_impact_speed_mps": share(impact, foggy),
        }


@dataclass(slots=True)
class TrafficCompliance(TrafficMetric):
    """Speeds against the advice in force that drivers have heard, whether they follow it, and whether they have yet."""

    tolerance: float  # Speed above the advice that still counts as following it [m/s]
    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_compliance")
    _exposure: Exposure = field(default_factory=Exposure)
    _advised_time: float = 0.0
    _compliant_time: float = 0.0

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self._exposure.add(span)
        advised = np.isfinite(span.advised_speed)
        if advised.any():
            elapsed, above = span.elapsed[advised], span.speed[advised] - span.advised_speed[advised]
            self._advised_time += float(elapsed.sum())
            self._compliant_time += float(elapsed[above <= self.tolerance].sum())

    def result(self) -> dict[str, JsonValue]:
        """Say how everyone followed the advice."""
        return {
            "traffic_advised_time_share": share(self._advised_time, self._exposure.time),
            "traffic_advice_compliance_share": share(self._compliant_time, self._advised_time),
        }


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
