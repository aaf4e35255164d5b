"""How fast everybody near the ego gets on, how evenly, and what time is lost."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.exposure import HOUR, KILOMETRE, Exposure
from fogsim.metrics.metric import JsonValue, Sample, share


class SpeedsByName:
    """Time and way of each vehicle, or in each lane."""

    def __init__(self) -> None:
        self._rows: dict[str, int] = {}
        self._sums = np.zeros((2, 64))

    def add(self, names: Sequence[str], speed: NDArray[np.float64], elapsed: float) -> None:
        """Take in the speeds of one instant.

        Parameters
        ----------
        names : (n,) sequence of str
            Vehicles or lanes.
        speed : (n,) float64
            Speeds [m/s].
        elapsed : float
            How long they are held to have been so [s].
        """
        rows = np.array([self._rows.setdefault(name, len(self._rows)) for name in names], dtype=np.intp)
        while len(self._rows) > self._sums.shape[1]:
            self._sums = np.concatenate((self._sums, np.zeros_like(self._sums)), axis=1)
        size = self._sums.shape[1]
        self._sums[0] += elapsed * np.bincount(rows, minlength=size)
        self._sums[1] += elapsed * np.bincount(rows, speed, minlength=size)

    def variance_between(self, group: Sequence[int] | None = None) -> float | None:
        """Variance of the mean speeds about that of their group, by time [m²/s²]; None without time.

        Parameters
        ----------
        group : (n,) sequence of int or None
            Group of each name in the order of `names`; None for one of all.
        """
        time, way = self._sums[:, : len(self._rows)]
        groups = np.zeros(len(time), np.intp) if group is None else np.array(group, dtype=np.intp)
        whole = np.bincount(groups, time)[groups], np.bincount(groups, way)[groups]
        been = time > 0.0
        deviation = way[been] / time[been] - whole[1][been] / whole[0][been]
        return share(float((time[been] * deviation**2).sum()), float(time.sum()))

    @property
    def names(self) -> tuple[str, ...]:
        """Who has been taken in."""
        return tuple(self._rows)


@dataclass(slots=True)
class TrafficFlow:
    """Speeds, their spread, delay and throughput of all vehicles near the ego.

    The variance of speed over the time of all vehicles is the sum of two: within vehicles (about each one's own mean
    speed over the time in which it was near) and between them (of these means). Delay counts as SUMO's ``timeLoss``
    does: of each second the part 1 − v / v_free, where v_free is what the driver would drive alone in clear air.
    """

    meanings: ClassVar[Mapping[str, str]] = {
        "traffic_vehicle_time_s": "time of all vehicles near the ego (traffic.reading_radius_m) together",
        "traffic_vehicle_distance_m": "way of all of them in it",
        "traffic_mean_vehicles": "mean number of them",
        "traffic_vehicle_km_per_h": "throughput: their way per hour of simulated time (within that radius)",
        "traffic_mean_speed_mps": "mean speed over their time: way over time",
        "traffic_speed_standard_deviation_mps": "standard deviation of speed over their time",
        "traffic_speed_standard_deviation_within_vehicles_mps": "root of its part within vehicles: each about its own "
        "mean speed",
        "traffic_speed_standard_deviation_between_vehicles_mps": "root of the other part: of vehicles' mean speeds",
        "traffic_speed_standard_deviation_between_lanes_mps": "the same of lanes' mean speeds about that of their edge",
        "traffic_delay_s_per_vehicle_km": "time lost to driving slower than alone in clear air at the limit times the "
        "driver's own factor, ∫ 1 − v / v_free dt, per kilometre of all vehicles; none where that speed is not known",
        "traffic_delay_share": "the same per time of all vehicles",
    }
    _exposure: Exposure = field(default_factory=Exposure)
    _duration: float = 0.0
    _squares: float = 0.0
    _lost: float = 0.0
    _lost_known: bool = False
    _vehicles: SpeedsByName = field(default_factory=SpeedsByName)
    _lanes: SpeedsByName = field(default_factory=SpeedsByName)

    def update(self, sample: Sample) -> None:
        """Take in one step.

        Parameters
        ----------
        sample : Sample
            The step, and what is derived from it.
        """
        traffic, elapsed = sample.step.traffic, sample.elapsed
        self._exposure.add(sample)
        self._duration += elapsed
        self._squares += elapsed * float((traffic.speed**2).sum())
        self._vehicles.add(traffic.ids, traffic.speed, elapsed)
        self._lanes.add(traffic.lane, traffic.speed, elapsed)
        if len(traffic.free_speed):
            self._lost_known = True
            self._lost += elapsed * float((1.0 - traffic.speed / np.maximum(traffic.free_speed, 0.1)).sum())

    def result(self) -> dict[str, JsonValue]:
        """Say how everybody got on."""
        total, way = self._exposure.time, self._exposure.distance
        mean = share(way, total)
        variance = None if mean is None else max(self._squares / total - mean**2, 0.0)
        between = self._vehicles.variance_between()
        within = None if variance is None or between is None else max(variance - between, 0.0)
        edges: dict[str, int] = {}
        edge_of = [edges.setdefault(lane.rpartition("_")[0], len(edges)) for lane in self._lanes.names]
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
            "traffic_delay_s_per_vehicle_km": self._exposure.per_kilometre(self._lost) if self._lost_known else None,
            "traffic_delay_share": share(self._lost, total) if self._lost_known else None,
        }


def _root(variance: float | None) -> float | None:
    return None if variance is None else math.sqrt(variance)
