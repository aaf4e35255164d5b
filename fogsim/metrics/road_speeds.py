"""Speeds over a road: those of an ego that drives along it, and of everyone on it in its direction."""

import math
from importlib import import_module
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.traffic_span import TrafficSpan
from fogsim.values import Step

CELL_LENGTH = 50.0
"""Length of road over which speeds are averaged [m]."""

PATH_SPACING = 10.0
"""Spacing of the points of the path, and side of the squares in which speeds are collected [m]."""

ROAD_COLUMNS = (
    "place_m",
    "ego_time_s",
    "ego_way_m",
    "ego_extinction_time_s_per_m",
    "vehicle_time_s",
    "vehicle_way_m",
    "vehicle_extinction_time_s_per_m",
)
"""Columns of `RoadSpeeds.sums`."""

ROAD_HALF_WIDTH = 20.0
"""How far next to the path others still drive on its road [m]."""

_MOST_PENDING = 200_000


class _Squares(NamedTuple):
    """Sums over the vehicles in squares of the plan, apart by eighths of the compass."""

    key: NDArray[np.int64]  # (n,) int64: The square and the eighth
    # (n, 7): Of time [s], way [m], and, times the time, extinction, east, north, and cosine and sine of the heading
    sums: NDArray[np.float64]


class RoadSpeeds:
    """Speeds along a road: the ego's way, passed to `update`, or else the route that spans name.

    Only afterwards is it known what was on the ego's way: until then, others' speeds are kept in small squares.
    """

    def __init__(self) -> None:
        self._path: list[tuple[float, float, float]] = []
        self._ego: dict[int, NDArray[np.float64]] = {}
        self._pending: list[_Squares] = []
        self._pending_rows = 0

    @property
    def path(self) -> NDArray[np.float64]:
        """Place along the road, east and north of points on it (n, 3) [m]."""
        return np.array(self._path).reshape(-1, 3)

    def update(self, step: Step, elapsed: float) -> None:
        """Add a step of the ego, a time [s] after the one before, before `add` gets its traffic."""
        traffic, place = step.traffic, step.route_position
        if not self._path or place >= self._path[-1][0] + PATH_SPACING:
            x, y, _ = traffic.position[step.ego]
            self._path.append((place, float(x), float(y)))
        speed, cell = float(traffic.speed[step.ego]), int(place // CELL_LENGTH)
        self._ego[cell] = self._ego.get(cell, np.zeros(3)) + elapsed * np.array([1.0, speed, step.truth.extinction])

    def add(self, span: TrafficSpan) -> None:
        """Add all vehicles of some steps."""
        if not self._path and span.route is not None:
            self._path = _points_along(span.route)
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

    def sums(self) -> NDArray[np.float64]:
        """Sums over all steps so far (n, 7), `ROAD_COLUMNS` for each stretch of road that had vehicles [m, s, s/m]."""
        everybody, nobody = self._all_vehicles(), np.zeros(3)
        cells = sorted(self._ego.keys() | everybody.keys())
        rows = [(CELL_LENGTH * (c + 0.5), *self._ego.get(c, nobody), *everybody.get(c, nobody)) for c in cells]
        return np.array(rows).reshape(-1, len(ROAD_COLUMNS))

    def means(self) -> NDArray[np.float64]:
        """Middle [m], speed [m/s], extinction [1/m] and vehicles' time [s] of each stretch with vehicles (n, 4)."""
        place, *_, time, way, extinction = self.sums().T
        met = time > 0.0
        return np.stack((place[met], way[met] / time[met], extinction[met] / time[met], time[met]), axis=1)

    def _all_vehicles(self) -> dict[int, NDArray[np.float64]]:
        """Time, way and extinction over time of all vehicles on the road in its direction, by cell."""
        if len(self._path) < 2 or not self._pending:
            return {}
        _, sums = self._merge()
        sums = sums[sums[:, 0] > 0]
        middle, heading = sums[:, 3:5] / sums[:, :1], sums[:, 5:7]
        path = self.path
        tangent = np.gradient(path[:, 1:], axis=0)
        tangent /= np.maximum(np.hypot(*tangent.T), 1e-9)[:, None]
        nearest = np.asarray(import_module("scipy.spatial").cKDTree(path[:, 1:]).query(middle)[1])
        way, along = middle - path[nearest, 1:], tangent[nearest]
        ahead = (way * along).sum(axis=1)
        beside = np.abs(way[:, 0] * along[:, 1] - way[:, 1] * along[:, 0])
        same = (heading * along).sum(axis=1) > math.cos(math.pi / 4) * np.hypot(*heading.T)
        on_road = same & (beside < ROAD_HALF_WIDTH) & (np.abs(ahead) < 2 * PATH_SPACING)
        cell = ((path[nearest, 0] + ahead)[on_road] // CELL_LENGTH).astype(int)
        found: dict[int, NDArray[np.float64]] = {}
        for number, part in zip(cell, sums[on_road, :3], strict=True):
            found[int(number)] = found.get(int(number), np.zeros(3)) + part
        return found


def _points_along(axis: NDArray[np.float64]) -> list[tuple[float, float, float]]:
    """Place, east and north of points along a polyline (n, 3) [m]; places count as those of fog do, slopes included."""
    station = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(axis, axis=0), axis=1))))
    places = np.minimum(np.arange(0.0, station[-1] + 0.5 * PATH_SPACING, PATH_SPACING), station[-1])
    x, y = (np.interp(places, station, axis[:, i]) for i in range(2))
    return list(zip(places.tolist(), x.tolist(), y.tolist(), strict=True))


def _squares(span: TrafficSpan) -> _Squares:
    x, y = np.floor(span.position[:, :2].T / PATH_SPACING).astype(np.int64) + 2**20
    eighth = np.round(span.heading / (math.pi / 4)).astype(np.int64) % 8
    fog = np.nan_to_num(span.extinction)
    columns = np.stack((span.speed, fog, *span.position[:, :2].T, np.cos(span.heading), np.sin(span.heading)), axis=1)
    sums = np.concatenate((span.elapsed[:, None], span.elapsed[:, None] * columns), axis=1)
    return _Squares((x * 2**21 + y) * 8 + eighth, sums)
