"""Fog reports to the ego from sensors next to its route and from vehicles on it."""

import math
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import extinction
from fogsim.core.randomness import named_generator
from fogsim.errors import InputError
from fogsim.simulation.ego.route_places import RoutePlaces
from fogsim.simulation.run_config import RadioSender, ReportsConfig, ReportSender, RoadsideSender
from fogsim.units import extinction_from_visibility
from fogsim.values import Estimate, FogField, FogReport, TrafficState

Floats = NDArray[np.float64]

_METER_HEIGHT = 2.0
"""Height of a visibility sensor above the road [m]."""

_WRONG = extinction_from_visibility(20.0), extinction_from_visibility(5000.0)
"""Extinctions between which a wrong measurement is any [1/m]."""


SENSOR = "sensor"
"""What names of sensors next to the road begin with."""

REACH = 300.0
"""Most of the way ahead in whose middle what a camera has seen counts [m]."""


def is_of_sensor(report: FogReport) -> bool:
    """Whether a report is of a sensor next to the road."""
    return report.source.startswith(SENSOR + " ")


def sensor_places(sensors: RoadsideSender, length: float) -> Floats:
    """Places of sensors next to a route of a length [m] along it [m]; InputError if there is none."""
    if sensors.first >= length:
        raise InputError(
            f"sensors.reports.roadside.first_m: {sensors.first:g} m is beyond the route, which is {length:.0f} m long"
        )
    return np.arange(sensors.first, length, sensors.spacing)


def place_seen(place: float, estimate: Estimate) -> float:
    """Stretch of road over which a camera's estimate is the mean, given by its middle [m]."""
    return place + 0.5 * min(estimate.reach, estimate.visibility, REACH)


class Beats:
    """When senders report: all at the beginning of a run, then each in its own beat, which a draw settles."""

    def __init__(self, draw: int) -> None:
        self._draw = draw
        self._phases: dict[str, float] = {}
        self._numbers: dict[str, int] = {}

    def is_due(self, name: str, period: float, time: float) -> bool:
        """Whether a sender is to report again; its report is then the next one."""
        if name not in self._phases:
            self._phases[name] = zlib.crc32(f"{name} {self._draw}".encode()) / 2**32
        number = math.floor(time / period + self._phases[name])
        if self._numbers.get(name) == number:
            return False
        self._numbers[name] = number
        return True

    def number(self, name: str) -> int:
        """Number of a sender's last report."""
        return self._numbers[name]


class FogReports:
    """The senders of a run, and what is on its way from them (`route` (n, 3) [m])."""

    def __init__(self, senders: ReportsConfig, route: Floats) -> None:
        self._roadside, self._vehicles, self._cameras = senders.roadside, senders.vehicles, senders.cameras
        self._route, self._places = route, RoutePlaces(route)
        self._sensors: Floats = np.zeros(0)
        if senders.roadside is not None:
            self._sensors = sensor_places(senders.roadside, float(self._places.stations[-1]))
        self._names = [f"{SENSOR} {i}" for i in range(len(self._sensors))]
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Begin a run."""
        self._rng = rng
        self._draw = int(rng.integers(2**32))
        self._under_way: list[tuple[float, FogReport]] = []
        self._beats = Beats(self._draw)
        self._has_begun = False

    def heard(
        self, time: float, state: TrafficState, ego: int, fog: FogField, sent: Iterable[tuple[str, FogReport]] = ()
    ) -> tuple[FogReport, ...]:
        """Take the measurements that are due; return the reports that have arrived by now (`time` [s])."""
        sent = tuple(sent)
        if self._cameras is not None:
            self._take_from_cameras(self._cameras, sent, state, ego)
        if self._roadside is not None:
            self._take_from_sensors(self._roadside, sent)
        if self._vehicles is not None:
            self._measure_vehicles(self._vehicles, time, state, ego, fog)
        return self.heard_from_roadside(time, fog)

    def heard_from_roadside(self, time: float, fog: FogField) -> tuple[FogReport, ...]:
        """Let sensors next to the road measure; return all reports that have arrived by now."""
        if self._roadside is not None and self._roadside.camera is None:
            self._measure_roadside(self._roadside, time, fog)
        if not self._under_way:
            return ()
        arrived = tuple(report for due, report in self._under_way if due <= time + 1e-9)
        self._under_way = [(due, report) for due, report in self._under_way if due > time + 1e-9]
        return arrived

    def _measure_roadside(self, sensors: RoadsideSender, time: float, fog: FogField) -> None:
        due = [i for i, name in enumerate(self._names) if self._beats.is_due(name, sensors.period, time)]
        if not due:
            return
        # A run begins with the sensors' earlier reports, made in the fog of that moment.
        time = time if self._has_begun else time - sensors.delay
        self._has_begun = True
        places = self._sensors[due]
        points = np.stack([np.interp(places, self._places.stations, axis) for axis in self._route.T], axis=1)
        measured = extinction(fog, points + np.array([0.0, 0.0, _METER_HEIGHT]))
        for i, place, k in zip(due, places.tolist(), measured.tolist(), strict=True):
            self._send(self._names[i], place, k, sensors, time)

    def _measure_vehicles(self, radio: RadioSender, time: float, state: TrafficState, ego: int, fog: FogField) -> None:
        for row, place in self._senders(radio, state, ego):
            name = state.ids[row]
            if self._beats.is_due(name, radio.period, time):
                eyes = state.position[row] + np.array([0.0, 0.0, _METER_HEIGHT])
                self._send(name, place, float(extinction(fog, eyes)), radio, time)

    def _senders(self, radio: RadioSender, state: TrafficState, ego: int) -> Iterator[tuple[int, float]]:
        """Rows of equipped vehicles that are in range and go the ego's way on its road, with their places on it [m]."""
        along, _, on_way = self._places.of(state)
        for row in np.flatnonzero(on_way & (_apart(state, ego) <= radio.reach)).tolist():
            if row != ego and self._is_equipped(state.ids[row], radio.equipped):
                yield row, float(along[row])

    def _take_from_cameras(
        self, radio: RadioSender, sent: Iterable[tuple[str, FogReport]], state: TrafficState, ego: int
    ) -> None:
        """Let what others have seen be on its way to the ego, as far as it is in range of them."""
        apart = dict(zip(state.ids, _apart(state, ego).tolist(), strict=True))
        for vehicle, report in sent:
            in_range = vehicle != state.ids[ego] and apart.get(vehicle, math.inf) <= radio.reach
            if in_range and self._beats.is_due(report.source, radio.period, report.time):
                self._forward(report, radio)

    def _take_from_sensors(self, sensors: RoadsideSender, sent: Iterable[tuple[str, FogReport]]) -> None:
        """Let what roadside cameras have seen be on its way to the ego."""
        for _, report in sent:
            if is_of_sensor(report):
                self._forward(report, sensors)

    def _forward(self, report: FogReport, sender: ReportSender) -> None:
        """Let a report with the time of its picture be on its way, with that of the sender's clock in it."""
        ahead = self._clock_error(report.source, sender.clock_deviation)
        self._let_travel(replace(report, time=report.time + ahead), report.time, sender)

    def _is_equipped(self, name: str, share: float) -> bool:
        """Whether a vehicle is, which in one run it is always or never."""
        return zlib.crc32(f"{self._draw} {name}".encode()) < share * 2**32

    def _send(self, name: str, place: float, k: float, sender: ReportSender, time: float) -> None:
        wrong, noise, any_k = self._rng.random(), self._rng.standard_normal(), self._rng.random()
        reported = k * math.exp(sender.deviation * noise)
        if wrong < sender.wrong:
            reported = _WRONG[0] * (_WRONG[1] / _WRONG[0]) ** any_k
        stated_time = time + self._clock_error(name, sender.clock_deviation)
        number = self._beats.number(name)
        self._let_travel(FogReport(name, number, place, stated_time, reported, sender.deviation), time, sender)

    def _clock_error(self, name: str, deviation: float) -> float:
        """How far a sender's clock is ahead [s]; in one run always the same."""
        return deviation * float(named_generator(self._draw, name).standard_normal()) if deviation else 0.0

    def _let_travel(self, report: FogReport, time: float, sender: ReportSender) -> None:
        if self._rng.random() >= sender.loss:
            self._under_way.append((time + sender.delay, report))


def _apart(state: TrafficState, ego: int) -> Floats:
    """How far vehicles are from the ego [m]."""
    return np.asarray(np.hypot(*(state.position[:, :2] - state.position[ego, :2]).T), np.float64)
