"""All vehicles near the ego over several steps, as arrays: together they cost a fraction of one by one."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.following import Following, pair_on_courses
from fogsim.metrics.metric import Definition, JsonValue, definitions_of, share
from fogsim.values import Cohort, Collision, Step, TrafficState, TrafficStep

_MOST_ROWS = 4096
"""Rows that are gathered before the metrics get them."""

_OF_ROWS = (
    *("moment", "vehicle", "lane", "kind", "elapsed", "time", "position", "heading", "speed", "acceleration"),
    *("length", "width", "free_speed", "advised_speed", "extinction", "course", "across"),
)
"""Fields of a span with a value for each row."""

HOUR = 3600.0
"""Seconds in an hour."""

KILOMETRE = 1000.0
"""Metres in a kilometre."""

_FIRST_COURSE = 1 << 20
"""Courses that are no lanes have numbers from here on, lanes smaller ones."""


@dataclass(frozen=True)
class TrafficSpan:
    """Some consecutive steps; row i is one vehicle on a lane in one of them."""

    moment: NDArray[np.intp]  # (n,) int: Number of the step, counted on from span to span
    # vehicle, lane, kind (n,) int: numbers of vehicle, lane and body kind, the same throughout a run
    vehicle: NDArray[np.intp]
    lane: NDArray[np.intp]
    kind: NDArray[np.intp]
    # (n,): Time since the step before [s]: what was found at the step is held to be true for it
    elapsed: NDArray[np.float64]
    time: NDArray[np.float64]  # (n,): Time of the step since the first one of the run [s]
    position: NDArray[np.float64]  # (n, 3): As of `TrafficState`, and so are the next seven
    # heading, speed, acceleration, length, width (n,): as of `TrafficState`
    heading: NDArray[np.float64]
    speed: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    length: NDArray[np.float64]
    width: NDArray[np.float64]
    free_speed: NDArray[np.float64]  # (n,): As of `TrafficState`; nan where it is not known
    advised_speed: NDArray[np.float64]  # (n,): As of `TrafficState`; ``inf`` where a driver has heard none
    # (n,): Extinction coefficient at the driver's eyes [1/m]; nan where it is not known
    extinction: NDArray[np.float64]
    duration: float  # Length of the span [s]
    collisions: tuple[Collision, ...]  # What happened in it, between vehicles of which one was near the ego
    # lane_names, kind_names: lanes and body kinds so far, by their numbers
    lane_names: tuple[str, ...]
    kind_names: tuple[str, ...]
    route: NDArray[np.float64] | None = None  # (m, 3): As of `Truth`
    cohort: Cohort | None = None  # The cohort at the last step; None without one
    # (vehicles,) bool: Whether each vehicle so far, by its number, is in the cohort
    in_cohort: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))
    cohort_waiting_time: float = 0.0  # Time that the cohort's vehicles have waited to enter the road [s]
    cohort_parked_time: float = 0.0  # Time that they have been off the lanes [s]
    # (k,) int: Rows of the ego, one in each step in which it is on a lane; None without an ego
    ego: NDArray[np.intp] | None = None
    reading_radius: float = math.inf  # As of `Step` [m]; ``inf`` without an ego
    # (n,) int: Number of the course of each, the same throughout a run
    course: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))
    # (n,): As of `TrafficState`; empty where vehicles do not share lanes
    across: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def following(self) -> Following:
        """Who follows whom, found once for all metrics."""
        course = self.moment * (int(self.course.max(initial=0)) + 1) + self.course
        return pair_on_courses(self.position, self.heading, self.length, self.speed, course, self.across, self.width)

    @cached_property
    def vehicle_time(self) -> float:
        """Time of all vehicles together [s]."""
        return float(self.elapsed.sum())

    @cached_property
    def vehicle_distance(self) -> float:
        """Way of all vehicles together [m]."""
        return float((self.elapsed * self.speed).sum())


class SpanWatcher(Protocol):
    """Whoever watches everyone near the ego."""

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""


class TrafficMetric(ABC):
    """A few numbers about everyone near the ego."""

    definitions: ClassVar[Mapping[str, Definition]]
    """Definition of each key of the result; a key ends in its unit."""

    @abstractmethod
    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""

    @abstractmethod
    def result(self) -> Mapping[str, JsonValue]:
        """Values over the steps so far; the keys are those of `definitions`."""


@dataclass(slots=True)
class Exposure:
    """Denominators of rates: time [s] and distance [m] of all vehicles read, and vehicles of the cohort."""

    time: float = 0.0
    distance: float = 0.0
    cohort: int | None = None

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self.time += span.vehicle_time
        self.distance += span.vehicle_distance
        self.cohort = None if span.cohort is None else len(span.cohort.vehicles)

    def per_hour(self, amount: float) -> float | None:
        """Amount per vehicle-hour; None without time."""
        return share(HOUR * amount, self.time)

    def per_kilometre(self, amount: float) -> float | None:
        """Amount per vehicle-kilometre; None without distance."""
        return share(KILOMETRE * amount, self.distance)

    def per_cohort_vehicle(self, amount: float) -> float | None:
        """Amount per vehicle of the cohort; None without a cohort."""
        return None if self.cohort is None else share(amount, self.cohort)


class TrafficGathering:
    """Gathers steps until they are worth a span."""

    def __init__(self) -> None:
        self._vehicles: dict[str, int] = {}
        self._lanes: dict[str, int] = {}
        self._kinds: dict[str, int] = {}
        self._courses: dict[str, int] = {}
        self._states: list[tuple[TrafficState, float, NDArray[np.float64] | None]] = []
        self._numbers: list[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]] = []
        self._collisions: list[Collision] = []
        self._route: NDArray[np.float64] | None = None
        self._cohort: Cohort | None = None
        self._cohort_waiting_time = self._cohort_parked_time = 0.0
        self._egos: list[int] = []
        self._reading_radius = math.inf
        self._last_ids: tuple[str, ...] = ()
        self._last_lanes: tuple[str, ...] = ()
        self._last = np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros(0, np.intp)
        self._rows = self._moments = 0
        self._time = 0.0

    @property
    def is_full(self) -> bool:
        """True if a span is worth making."""
        return self._rows >= _MOST_ROWS

    def add(self, step: TrafficStep, elapsed: float) -> None:
        """Add a step, a time [s] after the one before."""
        traffic, self._route, self._cohort = step.traffic, step.truth.route, step.cohort
        if self._cohort is not None:
            self._cohort_waiting_time += elapsed * self._cohort.waiting
            away = np.flatnonzero(traffic.off_lanes)
            self._cohort_parked_time += elapsed * sum(traffic.ids[i] in self._cohort.vehicles for i in away)
        if step.collisions:
            # The simulation may have removed both; then they were near at the step before.
            near = {*self._last_ids, *traffic.ids}
            self._collisions += [hit for hit in step.collisions if near & {hit.collider, hit.victim}]
        vehicles, lanes, kinds = self._last
        if traffic.ids != self._last_ids:
            vehicles, self._last_ids = _numbers(self._vehicles, traffic.ids), traffic.ids
            kinds = _numbers(self._kinds, traffic.types)
        if traffic.lane != self._last_lanes:
            lanes, self._last_lanes = _numbers(self._lanes, traffic.lane), traffic.lane
        self._last = vehicles, lanes, kinds
        courses = lanes
        if traffic.course is not traffic.lane:
            courses = _FIRST_COURSE + _numbers(self._courses, traffic.course)
        self._numbers.append((*self._last, courses))
        if isinstance(step, Step):
            self._egos.append(self._rows - len(self._states) + step.ego)
            self._reading_radius = step.reading_radius
        self._states.append((traffic, elapsed, step.truth.vehicle_extinctions))
        self._rows += len(vehicles) + 1

    def take(self) -> TrafficSpan | None:
        """All steps since the last call; None if there were none."""
        if not self._states:
            return None
        states, times, extinctions = zip(*self._states, strict=True)
        vehicles, lanes, kinds, courses = zip(*self._numbers, strict=True)
        counts = [len(state.ids) for state in states]
        clock = self._time + np.cumsum(times)
        free = [_known(state.free_speed, n, np.nan) for state, n in zip(states, counts, strict=True)]
        advised = [_known(state.advised_speed, n, np.inf) for state, n in zip(states, counts, strict=True)]
        fog = [np.full(n, np.nan) if k is None else k for k, n in zip(extinctions, counts, strict=True)]
        span = TrafficSpan(
            moment=np.repeat(np.arange(self._moments, self._moments + len(states)), counts),
            vehicle=np.concatenate(vehicles),
            lane=np.concatenate(lanes),
            kind=np.concatenate(kinds),
            elapsed=np.repeat(np.array(times), counts),
            time=np.repeat(clock, counts),
            position=np.concatenate([state.position.reshape(-1, 3) for state in states]),
            heading=np.concatenate([state.heading for state in states]),
            speed=np.concatenate([state.speed for state in states]),
            acceleration=np.concatenate([state.acceleration for state in states]),
            length=np.concatenate([state.length for state in states]),
            width=np.concatenate([state.width for state in states]),
            free_speed=np.concatenate(free),
            advised_speed=np.concatenate(advised),
            extinction=np.concatenate(fog),
            duration=float(sum(times)),
            collisions=tuple(self._collisions),
            lane_names=tuple(self._lanes),
            kind_names=tuple(self._kinds),
            route=self._route,
            cohort=self._cohort,
            in_cohort=self._in_cohort(),
            cohort_waiting_time=self._cohort_waiting_time,
            cohort_parked_time=self._cohort_parked_time,
            ego=np.array(self._egos, dtype=np.intp) if self._egos else None,
            reading_radius=self._reading_radius,
            course=np.concatenate(courses),
            across=_across(states),
        )
        self._moments += len(states)
        self._time = float(clock[-1])
        self._rows, self._states, self._numbers, self._collisions, self._egos = 0, [], [], [], []
        self._cohort_waiting_time = self._cohort_parked_time = 0.0
        return _on_lanes(span, ~np.concatenate([state.off_lanes for state in states]))

    def _in_cohort(self) -> NDArray[np.bool_]:
        members = frozenset() if self._cohort is None else self._cohort.vehicles
        return np.fromiter((name in members for name in self._vehicles), np.bool_, len(self._vehicles))


def _on_lanes(span: TrafficSpan, rows: NDArray[np.bool_]) -> TrafficSpan:
    """Some of the rows (n,) of a span: those of vehicles on lanes."""
    if rows.all():
        return span
    ego = span.ego if span.ego is None else (np.cumsum(rows) - 1)[span.ego[rows[span.ego]]]
    columns = {name: column[rows] for name in _OF_ROWS if len(column := getattr(span, name))}
    return replace(span, ego=ego, **columns)


def _known(values: NDArray[np.float64], count: int, unknown: float) -> NDArray[np.float64]:
    """Values of each vehicle; the same for all where a state has none."""
    return values if len(values) else np.full(count, unknown)


def _across(states: Sequence[TrafficState]) -> NDArray[np.float64]:
    """`TrafficState.across` of all; empty where it is so in each."""
    if not any(len(state.across) for state in states):
        return np.zeros(0)
    return np.concatenate([_known(state.across, len(state.ids), 0.0) for state in states])


class GatheredMetrics:
    """Hands whoever watches everyone the steps of a run, some at a time."""

    def __init__(self, watchers: Sequence[SpanWatcher]) -> None:
        self._watchers = watchers
        self._gathering = TrafficGathering()

    def add(self, step: TrafficStep, elapsed: float) -> None:
        """Add a step, a time [s] after the one before."""
        if self._watchers:
            self._gathering.add(step, elapsed)
            if self._gathering.is_full:
                self.hand_over()

    def hand_over(self) -> None:
        """Hand over what has been gathered."""
        span = self._gathering.take()
        if span is not None:
            for watcher in self._watchers:
                watcher.add(span)


def _numbers(known: dict[str, int], names: tuple[str, ...]) -> NDArray[np.intp]:
    """Numbers of names (n,), which new ones get."""
    return np.array([known.setdefault(name, len(known)) for name in names], dtype=np.intp)


@dataclass(slots=True)
class TrafficCohort(TrafficMetric):
    """Time that the vehicles of the cohort take and lose, waiting to enter the road included.

    The cohort is the same in every cell of a study for the same seed, so no policy moves its size. A vehicle that has
    not left when the run ends is unfinished and counts with its time until then.
    """

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_cohort")
    _exposure: Exposure = field(default_factory=Exposure)
    _cohort: Cohort | None = None
    _time: float = 0.0
    _lost: float = 0.0

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        if span.cohort is None:
            return
        self._exposure.add(span)
        self._cohort = span.cohort
        mine = np.flatnonzero(span.in_cohort[span.vehicle])
        elapsed, free = span.elapsed[mine], np.maximum(span.free_speed[mine], 0.1)
        self._time += float(elapsed.sum()) + span.cohort_waiting_time + span.cohort_parked_time
        self._lost += float((elapsed * (1.0 - span.speed[mine] / free)).sum()) + span.cohort_waiting_time

    def result(self) -> dict[str, JsonValue]:
        """Size, time and delay of the cohort."""
        per_vehicle = self._exposure.per_cohort_vehicle
        return {
            "traffic_cohort_vehicles": self._exposure.cohort,
            "traffic_cohort_unfinished": None if self._cohort is None else self._cohort.unfinished,
            "traffic_travel_time_s_per_cohort_vehicle": per_vehicle(self._time),
            "traffic_delay_s_per_cohort_vehicle": None if np.isnan(self._lost) else per_vehicle(self._lost),
        }
