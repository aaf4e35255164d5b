"""Whether all vehicles near the ego could stop within the visibility."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.core.kinematics import stopping_sight_distance
from fogsim.metrics.estimation import FOG_LIMIT
from fogsim.metrics.histogram import Histogram
from fogsim.metrics.metric import Definition, JsonValue, definitions_of, share
from fogsim.metrics.surrogate import potential_collision_speed
from fogsim.metrics.traffic_span import KILOMETRE, TrafficMetric, TrafficSpan
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
