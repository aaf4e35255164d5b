"""Profiles of one run: time by time to collision, speed along the road, and collisions.

All are sums over time, so that those of several runs add up.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.road_speeds import CELL_LENGTH, PATH_SPACING, ROAD_COLUMNS, RoadSpeeds
from fogsim.metrics.surrogate import QUEUE_SPEED, time_to_collision
from fogsim.metrics.traffic_span import TrafficSpan
from fogsim.units import clock_time
from fogsim.values import Step, TrafficState, TrafficStep

CLASS_WIDTH = 0.25
"""Width of a class of time to collision [s]."""

CLASSES = 40
"""Number of the classes; longer times are in none."""

MOST_COLLISIONS = 100
"""Maximum number of collisions with position and speed; their total is a metric."""

COLLISION_COLUMNS = ("time_s", "x_m", "y_m", "impact_speed_mps", "collider", "victim")
PATH_COLUMNS = ("place_m", "x_m", "y_m")


class RunProfiles:
    """Watches the steps of one run, and all vehicles in them as one of the watchers of its metrics."""

    def __init__(self) -> None:
        self._last: TrafficStep | None = None
        self._vehicle_time = 0.0
        self._by_class = np.zeros((2, CLASSES))
        self._road = RoadSpeeds()
        self._collisions: list[tuple[float, float, float, float, str, str]] = []
        self._collision_count = 0

    def update(self, step: TrafficStep) -> None:
        """Add a finished step, before the metrics get it; it stands for the time since the step before."""
        last, self._last = self._last, step
        if last is not None and last.index == step.index:
            return
        elapsed = 0.0 if last is None else clock_time(step.time - last.time)
        if isinstance(step, Step):
            self._road.update(step, elapsed)
        for hit in step.collisions:
            places = [_place(s.traffic, name) for name in (hit.collider, hit.victim) for s in (step, last) if s]
            x, y = next((place for place in places if place is not None), (math.nan, math.nan))
            self._collision_count += 1
            if len(self._collisions) < MOST_COLLISIONS:
                self._collisions.append((step.time_of(hit), x, y, hit.impact_speed, hit.collider, hit.victim))

    def add(self, span: TrafficSpan) -> None:
        """Add all vehicles of a span of steps that `update` has received."""
        self._vehicle_time += span.vehicle_time
        found = span.following
        remaining = time_to_collision(found.gap, found.speed, found.leader_speed)
        short = np.flatnonzero((remaining < CLASS_WIDTH * CLASSES) & (found.speed >= QUEUE_SPEED))
        place = (remaining[short] / CLASS_WIDTH).astype(np.intp) + CLASSES * (found.leader_speed[short] < QUEUE_SPEED)
        times = np.bincount(place, span.elapsed[found.follower[short]], minlength=2 * CLASSES)
        self._by_class += times.reshape(2, CLASSES)
        self._road.add(span)

    def to_json(self) -> dict[str, Any]:
        """The profiles as JSON data, once the metrics have handed over everything that they gathered.

        ``vehicle_time_s``; ``time_to_collision``: seconds of vehicles at 5 m/s or more in each class,
        behind a leader that moves and behind one slower than 5 m/s; ``road``: columns ``place_m`` (middle of a stretch
        along the road), time and distance of the ego and of all vehicles there, and the sums of extinction over these
        times; ``path``: the road in plan, columns ``place_m``, ``x_m``, ``y_m``; ``collisions``: columns for the first
        `MOST_COLLISIONS`.
        """
        moving, queue = self._by_class
        columns = list(zip(*self._collisions, strict=True)) or [()] * 6
        return {
            "vehicle_time_s": _short(self._vehicle_time),
            "time_to_collision": {"class_s": CLASS_WIDTH, "moving_s": _column(moving), "queue_s": _column(queue)},
            **self._road_columns(),
            "collisions": {name: [_short(v) for v in c] for name, c in zip(COLLISION_COLUMNS, columns, strict=True)},
            "collision_count": self._collision_count,
        }

    def _road_columns(self) -> dict[str, Any]:
        path = self._road.path[:: round(CELL_LENGTH / PATH_SPACING)]
        return {
            "road": {name: _column(column) for name, column in zip(ROAD_COLUMNS, self._road.sums().T, strict=True)},
            "path": {name: _column(path[:, i]) for i, name in enumerate(PATH_COLUMNS)},
        }


def _place(traffic: TrafficState, vehicle: str) -> tuple[float, float] | None:
    row = traffic.row(vehicle)
    return None if row is None else (float(traffic.position[row, 0]), float(traffic.position[row, 1]))


def _column(values: NDArray[np.float64]) -> list[object]:
    return [_short(float(value)) for value in values]


def _short(value: object) -> object:
    """A number rounded to the digits that a figure needs; None if undefined."""
    if not isinstance(value, float):
        return value
    return float(f"{value:.6g}") + 0.0 if math.isfinite(value) else None


Profiles = Mapping[str, Any]
"""Schema of the data from `RunProfiles.to_json`."""


Cell = tuple[str, ...]
"""Levels of all factors, in their order."""

_SUMS = ROAD_COLUMNS[1:]


class _CollisionPlace(NamedTuple):
    """Time [s], position (east, north) [m], None far from the ego, and speed difference [m/s] of a collision."""

    seed: int
    time: float
    x: float | None
    y: float | None
    impact_speed: float


@dataclass(slots=True)
class PooledProfiles:
    """Sums over runs: times [s] by class of time to collision, behind leaders that move and slower ones (`queue`).

    `road` has time, distance and extinction over time by position [m], of the ego and of all; `path` is (n, 2) [m].
    """

    vehicle_time: float = 0.0
    moving: NDArray[np.float64] = field(default_factory=lambda: np.zeros(CLASSES))
    queue: NDArray[np.float64] = field(default_factory=lambda: np.zeros(CLASSES))
    road: dict[float, NDArray[np.float64]] = field(default_factory=dict)
    path: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    collisions: list[_CollisionPlace] = field(default_factory=list)

    def add(self, seed: int, profiles: Profiles) -> None:
        """Add the profiles of one run, from `RunProfiles.to_json`."""
        self.vehicle_time += profiles["vehicle_time_s"]
        classes, road, hits = profiles["time_to_collision"], profiles["road"], profiles["collisions"]
        self.moving += np.array(classes["moving_s"])
        self.queue += np.array(classes["queue_s"])
        for place, *sums in zip(road["place_m"], *(road[name] for name in _SUMS), strict=True):
            self.road[place] = self.road.get(place, np.zeros(len(_SUMS))) + np.array(sums)
        path = np.array([profiles["path"]["x_m"], profiles["path"]["y_m"]]).T
        self.path = path if len(path) > len(self.path) else self.path
        columns = (hits[name] for name in ("time_s", "x_m", "y_m", "impact_speed_mps"))
        self.collisions += [_CollisionPlace(seed, *values) for values in zip(*columns, strict=True)]

    def survival(self) -> NDArray[np.float64]:
        """Share of vehicles' time with a time to collision above each class's end [-]; below 5 m/s counts as above."""
        if self.vehicle_time <= 0.0:
            return np.full(CLASSES, np.nan)
        return np.asarray(1.0 - np.cumsum(self.moving + self.queue) / self.vehicle_time)

    def speeds(self, *, ego_only: bool = False) -> NDArray[np.float64]:
        """Columns of position [m], mean speed [m/s] and observed time [s] on the ego's road, of all or of the ego."""
        time, way = (0, 1) if ego_only else (3, 4)
        found = [(place, sums[way] / sums[time], sums[time]) for place, sums in self._road() if sums[time] > 0.0]
        return np.array(found).reshape(-1, 3)

    def extinctions(self) -> NDArray[np.float64]:
        """Columns of position along the road [m] and mean extinction there [1/m], at egos or else all vehicles."""
        time, fog = (0, 2) if any(sums[0] > 0.0 for sums in self.road.values()) else (3, 5)
        found = [(place, sums[fog] / sums[time]) for place, sums in self._road() if sums[time] > 0.0]
        return np.array(found).reshape(-1, 2)

    def _road(self) -> Iterator[tuple[float, NDArray[np.float64]]]:
        return iter(sorted(self.road.items()))


def pool_profiles(found: Iterable[tuple[Mapping[str, str], int, Profiles]]) -> dict[Cell, PooledProfiles]:
    """Sum the profiles of each cell, given as levels, seed and profiles of completed runs."""
    cells: dict[Cell, PooledProfiles] = {}
    for levels, seed, profiles in found:
        cells.setdefault(tuple(levels.values()), PooledProfiles()).add(seed, profiles)
    return cells
