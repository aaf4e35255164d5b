"""How fast everyone near the ego gets on, how evenly, and what time is lost."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.metric import Definition, JsonValue, definitions_of, share
from fogsim.metrics.traffic_span import HOUR, KILOMETRE, Exposure, TrafficMetric, TrafficSpan


class SpeedsByNumber:
    """Time and way of each vehicle, or in each lane, by its number."""

    def __init__(self) -> None:
        self._time = np.zeros(0)
        self._way = np.zeros(0)

    def add(self, number: NDArray[np.intp], elapsed: NDArray[np.float64], way: NDArray[np.float64]) -> None:
        """Add times [s] and distances [m] by vehicle or lane."""
        size = max(len(self._time), int(number.max(initial=-1)) + 1)
        grown = (0, size - len(self._time))
        self._time = np.pad(self._time, grown) + np.bincount(number, elapsed, minlength=size)
        self._way = np.pad(self._way, grown) + np.bincount(number, way, minlength=size)

    def variance_between(self, group: Sequence[int] | None = None) -> float | None:
        """Variance of the mean speeds about that of their group, by time [m²/s²]; None without time."""
        # The last numbers may have no time.
        groups = np.zeros(len(self._time), np.intp) if group is None else np.array(group, np.intp)[: len(self._time)]
        times, ways = np.bincount(groups, self._time)[groups], np.bincount(groups, self._way)[groups]
        been = self._time > 0.0
        time = self._time[been]
        deviation = self._way[been] / time - ways[been] / times[been]
        return share(float((time * deviation**2).sum()), float(time.sum()))


@dataclass(slots=True)
class TrafficFlow(TrafficMetric):
    """Speeds, their spread, delay and throughput of all vehicles near the ego.

    The variance of speed over the time of all vehicles is the sum of two: within vehicles (about each one's own mean
    speed over the time in which it was near) and between them (of these means). Delay counts as SUMO's ``timeLoss``
    does: of each second the part 1 − v / v_free, where v_free is what the driver would drive alone in clear air.
    """

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_flow")
    _exposure: Exposure = field(default_factory=Exposure)
    _duration: float = 0.0
    _squares: float = 0.0
    _lost: float = 0.0
    _free_time: float = 0.0
    _free_way: float = 0.0
    _vehicles: SpeedsByNumber = field(default_factory=SpeedsByNumber)
    _lanes: SpeedsByNumber = field(default_factory=SpeedsByNumber)
    _lane_names: tuple[str, ...] = ()

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self._exposure.add(span)
        self._duration += span.duration
        way = span.elapsed * span.speed
        self._squares += float((way * span.speed).sum())
        self._vehicles.add(span.vehicle, span.elapsed, way)
        self._lanes.add(span.lane, span.elapsed, way)
        self._lane_names = span.lane_names
        known = ~np.isnan(span.free_speed)
        elapsed, free = span.elapsed[known], np.maximum(span.free_speed[known], 0.1)
        self._free_time += float(elapsed.sum())
        self._free_way += float(way[known].sum())
        self._lost += float((elapsed - way[known] / free).sum())

    def result(self) -> dict[str, JsonValue]:
        """Say how everyone got on."""
        total, way = self._exposure.time, self._exposure.distance
        mean = share(way, total)
        variance = None if mean is None else max(self._squares / total - mean**2, 0.0)
        between = self._vehicles.variance_between()
        within = None if variance is None or between is None else max(variance - between, 0.0)
        edges: dict[str, int] = {}
        edge_of = [edges.setdefault(lane.rpartition("_")[0], len(edges)) for lane in self._lane_names]
        return {
            "traffic_vehicle_time_s": total,
            "traffic_vehicle_distance_m": way,
            "traffic_mean_vehicles": share(total, self._duration),
            "traffic_vehicle_km_per_h": share(way / KILOMETRE * HOUR, self._duration),
            "traffic_mean_speed_mps": mean,
            "traffic_speed_standard_deviation_mps": _root(variance),
            "traffic_speed_standard_deviation_within_vehicles_mps": _root(within),
            "traffic_speed_standard_deviation_between_vehicles_mps": _root(between),
            "traffic_speed_standard_deviation_between_lanes_mps": _root(self._lanes.variance_between(edge_of)),
            "traffic_delay_s_per_vehicle_km": share(KILOMETRE * self._lost, self._free_way),
            "traffic_delay_share": share(self._lost, self._free_time),
        }


def _root(variance: float | None) -> float | None:
    return None if variance is None else math.sqrt(variance)
