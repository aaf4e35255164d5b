"""Who is to be looked at in which step."""

import itertools
import math
from collections.abc import Sequence

BEAT = 0.5
"""Who may wait this long is gathered with others in the steps of this beat [s]: a batch costs less than many single
vehicles."""

_ROUNDING = 1e-6
"""Share of a step by which clocks may differ from a whole number of steps [-]."""


class Schedule:
    """Vehicles by the step in which each is due; only those due are ever touched.

    Parameters
    ----------
    step : float
        Time between two steps [s].
    now : float
        Simulated time [s].
    """

    def __init__(self, step: float, now: float) -> None:
        self._step = step
        self._beat = max(1, round(BEAT / step))
        self._current = self._number(now)
        self._buckets: dict[int, list[str]] = {}

    def _number(self, time: float) -> int:
        return math.floor(time / self._step + _ROUNDING)

    def not_waiting(self, vehicles: Sequence[str]) -> list[str]:
        """Those of some vehicles who wait for no step, each once."""
        # Seldom asked for more than nobody, so that keeping a set of all who wait would cost more.
        if not vehicles:
            return []
        waiting = set(itertools.chain.from_iterable(self._buckets.values()))
        return [v for v in dict.fromkeys(vehicles) if v not in waiting]

    def put(self, vehicles: Sequence[str], time: float) -> None:
        """Let vehicles that are not waiting be due by a time [s], and at the earliest in the next step.

        Parameters
        ----------
        vehicles : sequence of str
            Their ids.
        time : float
            When at the latest [s].
        """
        if vehicles:
            number = max(self._number(time), self._current + 1)
            if number - self._current >= self._beat:
                number -= number % self._beat
            self._buckets.setdefault(number, []).extend(vehicles)

    def due(self, now: float) -> list[str]:
        """Take out those who are due at a time [s]."""
        number, last = self._number(now), self._current
        self._current = number
        if number - last == 1:
            found = self._buckets.pop(number, [])
        else:
            passed = sorted(n for n in self._buckets if n <= number)
            found = [vehicle for n in passed for vehicle in self._buckets.pop(n)]
        return found

    def clear(self) -> None:
        """Forget everybody."""
        self._buckets.clear()
