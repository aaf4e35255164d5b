"""Profiles of one run: time by time to collision, speed along the road, and collisions.

All are sums over time, so that those of several runs add up.
"""

import math
from collections.abc import Mapping
from typing import Any

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
                self._collisions.append((hit.time, x, y, hit.impact_speed, hit.collider, hit.victim))

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
