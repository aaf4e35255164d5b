"""Induction loops across a road: how many passed since they were last read, and how fast."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.polyline import project
from fogsim.values import TrafficState

_SECONDS_PER_HOUR = 3600.0


class LoopReading(NamedTuple):
    """What a loop across all lanes has counted."""

    flow: float  # Vehicles per hour [1/h]
    speed: float | None  # Mean speed of those who passed [m/s]; None if no one did


class InductionLoops:
    """Loops at some places along a road (`places` [m], `route` (n, 3) [m])."""

    def __init__(self, places: Sequence[float], route: NDArray[np.float64], edges: Sequence[str]) -> None:
        self._places = np.array(places, dtype=float)
        self._route, self._edges = route[:, :2], frozenset(edges)
        self._before: dict[str, float] = {}
        self._count, self._speeds = np.zeros(len(places)), np.zeros(len(places))
        self._time = 0.0

    def count(self, traffic: TrafficState, elapsed: float) -> None:
        """Take in everyone's places after some time (`elapsed` [s])."""
        here = [row for row, lane in enumerate(traffic.lane) if lane.rpartition("_")[0] in self._edges]
        station, ids = project(traffic.position[here, :2], self._route), [traffic.ids[row] for row in here]
        # Who was not there before has not come over a loop: vehicles enter where there is none.
        before = np.array([self._before.get(one, np.inf) for one in ids])
        passed = (before[:, None] < self._places) & (station[:, None] >= self._places)
        self._count += passed.sum(axis=0)
        self._speeds += (passed * traffic.speed[here][:, None]).sum(axis=0)
        self._before = dict(zip(ids, station.tolist(), strict=True))
        self._time += elapsed

    def read(self) -> tuple[LoopReading, ...]:
        """Return what was counted since the last reading, loop by loop, and start again."""
        hours = self._time / _SECONDS_PER_HOUR
        counted = zip(self._count.tolist(), self._speeds.tolist(), strict=True)
        readings = tuple(
            LoopReading(count / hours if hours > 0.0 else 0.0, speeds / count if count else None)
            for count, speeds in counted
        )
        self._count, self._speeds, self._time = np.zeros_like(self._count), np.zeros_like(self._speeds), 0.0
        return readings
