"""What others tell the ego of the fog where they are: sensors beside its route, and vehicles on it."""

import math
import zlib
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import extinction
from fogsim.scenario import Scenario
from fogsim.scenario.report_schema import ReportsFrom, RoadsideReports, VehicleReports
from fogsim.scenario.road_sections import stations
from fogsim.units import extinction_from_visibility
from fogsim.values import FogField, FogReport, TrafficState

Floats = NDArray[np.float64]

METER_HEIGHT = 2.0
"""Height of a visibility sensor above the road [m]."""

BESIDE = 15.0
"""How far from the line of the ego's route a vehicle is on its road [m]."""

SAME_WAY = 0.5
"""Least cosine of the angle between two vehicles' headings for them to go the same way [-]."""

WRONG = extinction_from_visibility(20.0), extinction_from_visibility(5000.0)
"""Extinctions between which a wrong measurement is any [1/m]."""


class FogReports:
    """The senders of a scenario, and what is on its way from them.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    route : (n, 3) float64
        Polyline along the ego's route [m].
    """

    def __init__(self, scenario: Scenario, route: Floats) -> None:
        section = scenario.sensors.reports
        self._roadside, self._vehicles = section.roadside, section.vehicles
        self._route, self._stations = route, stations(route)
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Begin a run.

        Parameters
        ----------
        rng : numpy.random.Generator
            Settles which vehicles are equipped, and is the source of all noise.
        """
        self._rng = rng
        self._draw = int(rng.integers(2**32))
        self._under_way: list[tuple[float, FogReport]] = []
        self._told: dict[str, int] = {}

    def heard(self, time: float, state: TrafficState, ego: int, fog: FogField) -> tuple[FogReport, ...]:
        """Let all measure that are to, and tell what has come in by now.

        Parameters
        ----------
        time : float
            Simulated time [s].
        state : TrafficState
            Every vehicle.
        ego : int
            Row of the one that listens.
        fog : FogField
            The fog now.
        """
        if self._roadside is not None:
            self._measure_roadside(self._roadside, time, fog)
        if self._vehicles is not None:
            self._measure_vehicles(self._vehicles, time, state, ego, fog)
        arrived = tuple(report for due, report in self._under_way if due <= time + 1e-9)
        self._under_way = [(due, report) for due, report in self._under_way if due > time + 1e-9]
        return arrived

    def _measure_roadside(self, sensors: RoadsideReports, time: float, fog: FogField) -> None:
        places = np.arange(sensors.first_m, self._stations[-1], sensors.every_m)
        due = [i for i in range(len(places)) if self._is_due(f"sensor {i}", sensors.period_s, time)]
        if not due:
            return
        points = np.stack([np.interp(places[due], self._stations, axis) for axis in self._route.T], axis=1)
        measured = extinction(fog, points + np.array([0.0, 0.0, METER_HEIGHT]))
        for i, k in zip(due, measured.tolist(), strict=True):
            self._send(f"sensor {i}", float(places[i]), k, sensors, time)

    def _measure_vehicles(
        self, radio: VehicleReports, time: float, state: TrafficState, ego: int, fog: FogField
    ) -> None:
        for row, place in self._senders(radio, state, ego):
            name = state.ids[row]
            if self._is_due(name, radio.period_s, time):
                eyes = state.position[row] + np.array([0.0, 0.0, METER_HEIGHT])
                self._send(name, place, float(extinction(fog, eyes)), radio, time)

    def _senders(self, radio: VehicleReports, state: TrafficState, ego: int) -> Iterator[tuple[int, float]]:
        """Rows of equipped vehicles that are in range and go the ego's way on its road, with their places on it [m]."""
        apart = np.hypot(*(state.position[:, :2] - state.position[ego, :2]).T)
        along = np.cos(state.heading - state.heading[ego])
        for row in np.flatnonzero((apart <= radio.range_m) & (along >= SAME_WAY)).tolist():
            if row == ego or not self._is_equipped(state.ids[row], radio.equipped):
                continue
            place, aside = self._on_route(state.position[row])
            if aside <= BESIDE:
                yield row, place

    def _is_equipped(self, name: str, share: float) -> bool:
        """Whether a vehicle is, which in one run it is always or never."""
        return zlib.crc32(f"{self._draw} {name}".encode()) < share * 2**32

    def _is_due(self, name: str, period: float, time: float) -> bool:
        """Whether a sender is to tell again; each has its own beat."""
        phase = zlib.crc32(f"{name} {self._draw}".encode()) / 2**32
        number = math.floor(time / period + phase)
        if self._told.get(name) == number:
            return False
        self._told[name] = number
        return True

    def _send(self, name: str, place: float, k: float, sender: ReportsFrom, time: float) -> None:
        lost, wrong, noise, any_k = (
            self._rng.random(),
            self._rng.random(),
            self._rng.standard_normal(),
            self._rng.random(),
        )
        if lost < sender.loss:
            return
        told = k * math.exp(sender.deviation * noise)
        if wrong < sender.wrong:
            told = WRONG[0] * (WRONG[1] / WRONG[0]) ** any_k
        report = FogReport(name, self._told[name], place, time, told, sender.deviation)
        self._under_way.append((time + sender.delay_s, report))

    def _on_route(self, position: Floats) -> tuple[float, float]:
        """Where on the route a position is, and how far from it [m]."""
        starts, ways = self._route[:-1, :2], np.diff(self._route[:, :2], axis=0)
        squares = np.maximum((ways**2).sum(axis=1), 1e-12)
        shares = np.clip(((position[:2] - starts) * ways).sum(axis=1) / squares, 0.0, 1.0)
        apart = np.hypot(*(starts + shares[:, None] * ways - position[:2]).T)
        nearest = int(apart.argmin())
        length = self._stations[nearest + 1] - self._stations[nearest]
        return float(self._stations[nearest] + shares[nearest] * length), float(apart[nearest])
