"""What everyone near the ego emits and burns, by the functions that SUMO has of HBEFA 4."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.metrics.metric import Definition, JsonValue, definitions_of
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan
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
