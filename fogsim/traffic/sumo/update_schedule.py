"""Which vehicles are to be looked at again in which step: those whose gaps can have changed enough."""

import itertools
import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

MAX_RELATIVE_ACCELERATION = 20.0
"""One vehicle's acceleration minus another's is never larger than this [m/s²]: emergency braking and driving off."""

_BATCH_PERIOD = 0.5
"""Vehicles that may wait this long are gathered with others in the steps of this period [s]: a batch costs less than
many single vehicles."""

_ROUNDING = 1e-6
"""Share of a step by which clocks may differ from a whole number of steps [-]."""


Speed = TypeVar("Speed", float, NDArray[np.float64])


def closing_speed_bound(speed: Speed, leader_speed: Speed, horizon: float) -> Speed:
    """How fast the gap between two vehicles, or each of many gaps, changes at most [m/s].

    Takes `speed`, `leader_speed` (n,) [m/s], `horizon` [s].
    """
    return abs(leader_speed - speed) + 0.5 * MAX_RELATIVE_ACCELERATION * horizon


class UpdateSchedule:
    """Vehicles by the step in which each is due; only those due are ever touched (`step` [s], `now` [s])."""

    def __init__(self, step: float, now: float) -> None:
        self._step = step
        self._batch = max(1, round(_BATCH_PERIOD / step))
        self._current = self._number(now)
        self._due: dict[int, list[str]] = {}

    def _number(self, time: float) -> int:
        return math.floor(time / self._step + _ROUNDING)

    def _step_at(self, time: float) -> int:
        """Number of the step in which who is due at a time is looked at."""
        number = max(math.floor(time / self._step + _ROUNDING), self._current + 1)
        return number - number % self._batch if number - self._current >= self._batch else number

    def unscheduled(self, vehicles: Sequence[str]) -> list[str]:
        """Those of some vehicles that wait for no step, each once."""
        # Seldom asked for any, so that keeping a set of all scheduled vehicles would cost more.
        if not vehicles:
            return []
        scheduled = set(itertools.chain.from_iterable(self._due.values()))
        return [v for v in dict.fromkeys(vehicles) if v not in scheduled]

    def add(self, vehicles: Sequence[str], time: float) -> None:
        """Schedule vehicles that are not scheduled yet, at the earliest for the next step (`time` [s])."""
        if vehicles:
            self._due.setdefault(self._step_at(time), []).extend(vehicles)

    def add_each(self, vehicles: Sequence[str], times: Sequence[float]) -> None:
        """Schedule vehicles as `add` does, each for a time of its own (`times` [s])."""
        due, step_at, last, number = self._due, self._step_at, math.nan, 0
        for vehicle, time in zip(vehicles, times, strict=True):
            # Mostly many wait as long as they may, and so for the same time.
            if time != last:
                last, number = time, step_at(time)
            due.setdefault(number, []).append(vehicle)

    def bring_forward(self, vehicle: str) -> None:
        """Make a vehicle that waits due in the next step; one that waits for nothing stays so."""
        # Seldom asked for, so that keeping where each vehicle waits would cost more.
        for waiting in self._due.values():
            if vehicle in waiting:
                waiting.remove(vehicle)
                self._due.setdefault(self._current + 1, []).append(vehicle)
                return

    def pop_due(self, now: float) -> list[str]:
        """Take out the vehicles that are due (`now` [s])."""
        number, last = self._number(now), self._current
        self._current = number
        if number - last == 1:
            return self._due.pop(number, [])
        passed = sorted(n for n in self._due if n <= number)
        return [vehicle for n in passed for vehicle in self._due.pop(n)]

    def clear(self) -> None:
        """Forget all vehicles."""
        self._due.clear()
