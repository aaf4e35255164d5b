"""Profiles of all runs of a cell of the grid, summed."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.road_speeds import ROAD_COLUMNS
from fogsim.study.profiles import CLASSES, Profiles

Cell = tuple[str, ...]
"""Levels of all factors, in their order."""

_SUMS = ROAD_COLUMNS[1:]


class CollisionPlace(NamedTuple):
    """Time [s], position (east, north) [m] and speed difference [m/s] of a collision.

    x and y are None if neither vehicle was near the ego.
    """

    seed: int
    time: float
    x: float | None
    y: float | None
    impact_speed: float


@dataclass(slots=True)
class PooledProfiles:
    """Sums of the profiles of some runs.

    `moving` and `queue` are times [s] per class of time to collision, behind a leader that moves and behind one slower
    than 5 m/s. `road` maps a position along the road [m] to time, distance and extinction over time, of the ego and of
    all vehicles; `path` is the road in plan (n, 2) [m].
    """

    vehicle_time: float = 0.0
    moving: NDArray[np.float64] = field(default_factory=lambda: np.zeros(CLASSES))
    queue: NDArray[np.float64] = field(default_factory=lambda: np.zeros(CLASSES))
    road: dict[float, NDArray[np.float64]] = field(default_factory=dict)
    path: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    collisions: list[CollisionPlace] = field(default_factory=list)

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
        self.collisions += [CollisionPlace(seed, *values) for values in zip(*columns, strict=True)]

    def survival(self) -> NDArray[np.float64]:
        """Share of all vehicles' time with a time to collision above the upper end of each class [-].

        Followers slower than 5 m/s, which close up to a queue, count as above.
        """
        if self.vehicle_time <= 0.0:
            return np.full(CLASSES, np.nan)
        return np.asarray(1.0 - np.cumsum(self.moving + self.queue) / self.vehicle_time)

    def speeds(self, *, ego_only: bool = False) -> NDArray[np.float64]:
        """Columns of position along the road [m], mean speed there [m/s] and observed time [s].

        Of all vehicles on the ego's road, or of the ego only.
        """
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
