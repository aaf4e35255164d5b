"""How fast everyone near the ego gets on, how evenly, and what time is lost."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.metrics.metric import Definition, JsonValue, definitions_of, share
from fogsim.metrics.traffic_span import HOUR, KILOMETRE, Exposure, TrafficMetric, TrafficSpan
from fogsim.values.traffic import BOX, PEDESTRIAN

_KINDS = ("car", "van", "truck", "bus", "motorcycle")

_RATES = np.array(
    [
        [
            [1521.0, 15.59, 0.0, 0.1199, 695.1, 132.5, 3.434],
            [1949.0, 34.07, 0.0, 0.2332, 659.6, 230.6, 8.244],
            [1936.0, 0.0, 16.21, 0.006403, 0.0, 551.1, 12.03],
            [2775.0, 651.0, 0.0, 0.0, 2643.0, 1627.0, 0.0],
            [1405.0, 0.0, 2.35, 0.02944, 744.2, 0.0, 0.6179],
        ],
        [
            [0.6117, 0.0, 0.0, 5.485e-05, 0.0, 0.04339, 0.002726],
            [3.352, 0.0, 0.0, 6.798e-04, 0.0, 0.264, 0.03613],
            [0.1158, 0.2321, 0.0, 0.0, 0.0, 0.0, 0.01005],
            [4.335, 0.0, 0.0, 6.582e-04, 0.0, 0.0, 0.01626],
            [0.5242, 0.0, 0.01004, 6.851e-06, 0.0, 0.1337, 0.001821],
        ],
        [
            [493.1, 5.054, 0.0, 0.03887, 225.3, 42.96, 1.113],
            [626.5, 10.95, 0.0, 0.07494, 212.0, 74.1, 2.649],
            [622.1, 0.0, 5.211, 0.002058, 0.0, 177.1, 3.866],
            [891.8, 209.2, 0.0, 0.0, 849.3, 522.9, 0.0],
            [455.6, 0.0, 0.762, 0.009544, 241.3, 0.0, 0.2003],
        ],
    ]
)
"""Milligrams a second of CO2, NOx and fuel, of each kind, as factors of 1, v, v², v³, a, a v and a v² in SI units."""

_COASTING = np.array([[0.25, 2.8e-4], [0.24, 2.0e-4], [0.21, 2.8e-4], [0.18, 1.8e-4], [0.25, 5.9e-4]])
"""Deceleration c + d v² beyond which the engine burns nothing, of each kind [m/s²], [1/m]; to 0.01 m/s²."""

_CREEPING = 0.5
"""Speed up to which the engine idles, however a vehicle slows down [m/s]."""


@dataclass(slots=True)
class TrafficEmissions(TrafficMetric):
    """Carbon dioxide, nitrogen oxides and fuel, on the level.

    The rate of each is a polynomial in speed v and acceleration a, and at least 0; who slows down harder than by
    coasting burns nothing. The classes are those that SUMO gives vehicles of these kinds by itself: petrol Euro 4 cars,
    diesel Euro 6 vans, 7.5 t lorries and 15 to 18 t buses of Euro VI, motorcycles above 250 cm³.
    """

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_emissions")
    _exposure: Exposure = field(default_factory=Exposure)
    _milligrams: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self._exposure.add(span)
        names = np.array([_KINDS.index(name) if name in _KINDS else 0 for name in span.kind_names], dtype=np.intp)
        kind, speed, acceleration = names[span.kind], span.speed, span.acceleration
        square = speed**2
        has_engine = np.array([name not in (BOX, PEDESTRIAN) for name in span.kind_names], dtype=np.bool_)[span.kind]
        burning = (-acceleration < _COASTING[kind, 0] + _COASTING[kind, 1] * square) | (speed <= _CREEPING)
        burning &= has_engine
        powers = np.ones(len(speed)), speed, square, square * speed
        terms = np.stack((*powers, acceleration, acceleration * speed, acceleration * square))
        for number in np.unique(names):
            of_kind = np.flatnonzero(burning & (kind == number))
            rates = np.maximum(matrix_product(_RATES[:, number], terms[:, of_kind]), 0.0)
            self._milligrams += (rates * span.elapsed[of_kind]).sum(axis=-1)

    def result(self) -> dict[str, JsonValue]:
        """Say what was emitted for what was driven."""
        dioxide, nitrogen, fuel = (self._exposure.per_kilometre(float(amount)) for amount in self._milligrams)
        return {
            "traffic_co2_g_per_vehicle_km": None if dioxide is None else 1e-3 * dioxide,
            "traffic_nox_mg_per_vehicle_km": nitrogen,
            "traffic_fuel_g_per_vehicle_km": None if fuel is None else 1e-3 * fuel,
        }


class _SpeedsByNumber:
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
    _vehicles: _SpeedsByNumber = field(default_factory=_SpeedsByNumber)
    _lanes: _SpeedsByNumber = field(default_factory=_SpeedsByNumber)
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
