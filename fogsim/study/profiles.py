"""Profiles of one run, which single numbers cannot hold: time by time to collision, speed over the road, collisions.

All are sums over time, so that those of several runs add.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fogsim.metrics.surrogate import QUEUE_SPEED, time_to_collision
from fogsim.metrics.traffic_span import TrafficSpan
from fogsim.units import clock_time
from fogsim.values import Step, TrafficState, TrafficStep

CLASS_WIDTH = 0.25
"""Width of a class of time to collision [s]."""

CLASSES = 40
"""Number of the classes; what is longer is in none."""

CELL_LENGTH = 50.0
"""Length of road over which speeds are averaged [m]."""

MOST_COLLISIONS = 100
"""Collisions of which place and speed are kept; their number is a metric."""

_PLACE = 10.0
"""Spacing of the points of the path, and side of the squares in which speeds are collected [m]."""

_ROAD_HALF_WIDTH = 20.0
"""How far beside the ego's path others still drive on its road [m]."""

_MOST_PENDING = 200_000


class RunProfiles:
    """Watches the steps of one run, and everybody in them as one of the watchers of its metrics."""

    def __init__(self) -> None:
        self._last: TrafficStep | None = None
        self._vehicle_time = 0.0
        self._by_class = np.zeros((2, CLASSES))
        self._road = _Road()
        self._collisions: list[tuple[float, float, float, float, str, str]] = []
        self._collision_count = 0

    def update(self, step: TrafficStep) -> None:
        """Take in one finished step; what was found at it is held to be true for the time since the one before.

        Parameters
        ----------
        step : TrafficStep
            The step, before the metrics get it; speeds over the road are of the ego's road, if there is one.
        """
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
                self._collisions.append((hit.time, x, y, hit.impact_speed, hit.collider, hit.victim))

    def add(self, span: TrafficSpan) -> None:
        """Take in everybody in some steps.

        Parameters
        ----------
        span : TrafficSpan
            The steps, which `update` has had.
        """
        self._vehicle_time += span.vehicle_time
        found = span.following
        remaining = time_to_collision(found.gap, found.speed, found.leader_speed)
        short = np.flatnonzero(remaining < CLASS_WIDTH * CLASSES)
        place = (remaining[short] / CLASS_WIDTH).astype(np.intp) + CLASSES * (found.leader_speed[short] < QUEUE_SPEED)
        times = np.bincount(place, span.elapsed[found.follower[short]], minlength=2 * CLASSES)
        self._by_class += times.reshape(2, CLASSES)
        self._road.add(span)

    def to_json(self) -> dict[str, Any]:
        """Give the profiles as JSON can hold them, once the metrics have handed over all that they gathered.

        Returns
        -------
        dict
            ``vehicle_time_s``; ``time_to_collision``: seconds of all vehicles in each class of `CLASS_WIDTH` seconds,
            behind a leader that moves and behind one slower than 5 m/s; ``road``: columns ``place_m`` (middle of a
            stretch along the ego's route), time and way of the ego and of everybody on its road there, and the sum
            of extinction over the ego's time; ``path``: the ego's way in plan, columns ``place_m``, ``x_m``, ``y_m``;
            ``collisions``: a list of columns for the first `MOST_COLLISIONS`.
        """
        moving, queue = self._by_class
        columns = list(zip(*self._collisions, strict=True)) or [()] * 6
        names = ("time_s", "x_m", "y_m", "impact_speed_mps", "collider", "victim")
        return {
            "vehicle_time_s": _short(self._vehicle_time),
            "time_to_collision": {"class_s": CLASS_WIDTH, "moving_s": _column(moving), "queue_s": _column(queue)},
            **self._road.to_json(),
            "collisions": {name: [_short(v) for v in c] for name, c in zip(names, columns, strict=True)},
            "collision_count": self._collision_count,
        }


class _Squares(NamedTuple):
    """Sums over the vehicles in squares of the plan, apart by eighths of the compass.

    Attributes
    ----------
    key : (n,) int64
        The square and the eighth.
    sums : (n, 6) float64
        Of time [s], way [m], and, times the time, east, north, and cosine and sine of the heading.
    """

    key: NDArray[np.int64]
    sums: NDArray[np.float64]


class _Road:
    """Speeds along the ego's route, its own and of everybody on its road.

    Where the route leads is known only when the ego has driven it: until then others' speeds wait in small squares.
    """

    def __init__(self) -> None:
        self._path: list[tuple[float, float, float]] = []
        self._ego: dict[int, list[float]] = {}
        self._pending: list[_Squares] = []
        self._pending_rows = 0

    def update(self, step: Step, elapsed: float) -> None:
        traffic, place = step.traffic, step.route_position
        if not self._path or place >= self._path[-1][0] + _PLACE:
            x, y, _ = traffic.position[step.ego]
            self._path.append((place, float(x), float(y)))
        sums = self._ego.setdefault(int(place // CELL_LENGTH), [0.0, 0.0, 0.0])
        sums[0] += elapsed
        sums[1] += elapsed * float(traffic.speed[step.ego])
        sums[2] += elapsed * step.truth.extinction

    def add(self, span: TrafficSpan) -> None:
        if not self._path:
            return
        self._pending.append(_squares(span))
        self._pending_rows += len(span.elapsed)
        if self._pending_rows > _MOST_PENDING:
            self._merge()

    def _merge(self) -> _Squares:
        key, row = np.unique(np.concatenate([part.key for part in self._pending]), return_inverse=True)
        columns = np.concatenate([part.sums for part in self._pending]).T
        sums = np.array([np.bincount(row, column) for column in columns], dtype=np.float64).T
        self._pending, self._pending_rows = [_Squares(key, sums)], 0
        return self._pending[0]

    def to_json(self) -> dict[str, Any]:
        everybody = self._everybody()
        cells = sorted(self._ego.keys() | everybody.keys())
        ego = np.array([self._ego.get(cell, [0.0] * 3) for cell in cells]).reshape(-1, 3)
        others = np.array([everybody.get(cell, np.zeros(2)) for cell in cells]).reshape(-1, 2)
        path = np.array(self._path[:: round(CELL_LENGTH / _PLACE)]).reshape(-1, 3)
        return {
            "road": {
                "place_m": [CELL_LENGTH * (cell + 0.5) for cell in cells],
                "ego_time_s": _column(ego[:, 0]),
                "ego_way_m": _column(ego[:, 1]),
                "ego_extinction_time_s_per_m": _column(ego[:, 2]),
                "vehicle_time_s": _column(others[:, 0]),
                "vehicle_way_m": _column(others[:, 1]),
            },
            "path": {name: _column(path[:, i]) for i, name in enumerate(("place_m", "x_m", "y_m"))},
        }

    def _everybody(self) -> dict[int, NDArray[np.float64]]:
        """Time and way of all vehicles that drove on the ego's road in its direction, by cell."""
        if len(self._path) < 2 or not self._pending:
            return {}
        _, sums = self._merge()
        sums = sums[sums[:, 0] > 0]
        middle, heading = sums[:, 2:4] / sums[:, :1], sums[:, 4:6]
        path = np.array(self._path)
        tangent = np.gradient(path[:, 1:], axis=0)
        tangent /= np.maximum(np.hypot(*tangent.T), 1e-9)[:, None]
        nearest = np.asarray(cKDTree(path[:, 1:]).query(middle)[1])
        way, along = middle - path[nearest, 1:], tangent[nearest]
        ahead = (way * along).sum(axis=1)
        beside = np.abs(way[:, 0] * along[:, 1] - way[:, 1] * along[:, 0])
        same = (heading * along).sum(axis=1) > math.cos(math.pi / 4) * np.hypot(*heading.T)
        on_road = same & (beside < _ROAD_HALF_WIDTH) & (np.abs(ahead) < 2 * _PLACE)
        cell = ((path[nearest, 0] + ahead)[on_road] // CELL_LENGTH).astype(int)
        found: dict[int, NDArray[np.float64]] = {}
        for number, part in zip(cell, sums[on_road, :2], strict=True):
            found[int(number)] = found.get(int(number), np.zeros(2)) + part
        return found


def _squares(span: TrafficSpan) -> _Squares:
    x, y = np.floor(span.position[:, :2].T / _PLACE).astype(np.int64) + 2**20
    eighth = np.round(span.heading / (math.pi / 4)).astype(np.int64) % 8
    columns = np.stack((span.speed, *span.position[:, :2].T, np.cos(span.heading), np.sin(span.heading)), axis=1)
    sums = np.concatenate((span.elapsed[:, None], span.elapsed[:, None] * columns), axis=1)
    return _Squares((x * 2**21 + y) * 8 + eighth, sums)


def _place(traffic: TrafficState, vehicle: str) -> tuple[float, float] | None:
    row = traffic.row(vehicle)
    return None if row is None else (float(traffic.position[row, 0]), float(traffic.position[row, 1]))


def _column(values: NDArray[np.float64]) -> list[object]:
    return [_short(float(value)) for value in values]


def _short(value: object) -> object:
    """A number in the digits that a figure needs; None where it is undefined."""
    if not isinstance(value, float):
        return value
    return float(f"{value:.6g}") + 0.0 if math.isfinite(value) else None


Profiles = Mapping[str, Any]
"""What `RunProfiles.to_json` gives."""
