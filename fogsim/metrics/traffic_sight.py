"""Whether everybody near the ego could stop within what there is to see."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.kinematics import stopping_sight_distance
from fogsim.metrics.estimation import FOG_LIMIT
from fogsim.metrics.histogram import Histogram
from fogsim.metrics.metric import JsonValue, share
from fogsim.metrics.surrogate import potential_collision_speed
from fogsim.metrics.traffic_span import TrafficMetric, TrafficSpan
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY


@dataclass(slots=True)
class TrafficSight(TrafficMetric):
    """Meteorological visibility where each driver is against the distance in which they could stop.

    Attributes
    ----------
    reaction_time : float
        Perception and reaction time in that distance [s].
    deceleration : float
        Deceleration in it [m/s²].
    """

    reaction_time: float
    deceleration: float
    meanings: ClassVar[Mapping[str, str]] = {
        "traffic_fog_time_share": "share of the time of all vehicles read in fog (below 1000 m where they are)",
        "traffic_overdriving_time_share": "share of the same time with a stopping sight distance above the visibility "
        "at the vehicle's place; on the level, with stopping_reaction_time_s and stopping_deceleration_mps2",
        "traffic_mean_sight_margin_m": "mean over the time in fog of visibility minus stopping sight distance",
        "traffic_sight_margin_p05_m": "its 5th percentile; none beyond ± 1000 m",
        "traffic_mean_obstacle_impact_speed_mps": "mean over the time in fog of the speed at which vehicles would hit "
        "what stands at the visibility distance, braking at 6.43 m/s² after 1 s; 0 where they would stop",
    }
    _times: NDArray[np.float64] = field(default_factory=lambda: np.zeros(5))
    _margins: Histogram = field(default_factory=lambda: Histogram(-FOG_LIMIT, FOG_LIMIT, 0.5))

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        # Nothing is greater than nan, which stands for fog that is not known.
        foggy = span.extinction > OPTICAL_DEPTH_AT_VISIBILITY / FOG_LIMIT
        visibility, fast = OPTICAL_DEPTH_AT_VISIBILITY / span.extinction[foggy], span.speed[foggy]
        elapsed = span.elapsed[foggy]
        margin = visibility - stopping_sight_distance(fast, self.reaction_time, self.deceleration)
        impact = potential_collision_speed(visibility, fast, np.zeros(len(fast)))
        self._margins.add(margin, elapsed)
        self._times += [
            span.elapsed[~np.isnan(span.extinction)].sum(),
            elapsed.sum(),
            elapsed[margin < 0.0].sum(),
            (elapsed * margin).sum(),
            (elapsed * impact).sum(),
        ]

    def result(self) -> dict[str, JsonValue]:
        """Say how far everybody saw, against how far they needed to."""
        total, foggy, overdriving, margin, impact = map(float, self._times)
        return {
            "traffic_fog_time_share": share(foggy, total),
            "traffic_overdriving_time_share": share(overdriving, total),
            "traffic_mean_sight_margin_m": share(margin, foggy),
            "traffic_sight_margin_p05_m": self._margins.quantile(0.05),
            "traffic_mean_obstacle_impact_speed_mps": share(impact, foggy),
        }
