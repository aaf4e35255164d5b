"""Which faults of the ego's sensors are in force, and when they begin and end."""

from collections.abc import Iterable

import numpy as np

from fogsim.values.fault import Fault, RunningFault

_ROUNDING = 1e-9
"""Times that differ by no more than this are the same [s]."""


class FaultSchedule:
    """Faults that have been ordered, in this order."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._ordered: list[RunningFault] = []

    def begin(self, faults: Iterable[Fault], time: float) -> None:
        """Order faults (`time` [s])."""
        for fault in faults:
            begin = time + fault.delay
            self._ordered.append(RunningFault(fault, begin, begin + fault.duration, self._rng.spawn(1)[0]))

    def at(self, time: float) -> tuple[RunningFault, ...]:
        """Faults in force at a time (`time` [s])."""
        now = time + _ROUNDING
        return tuple(one for one in self._ordered if one.begin <= now < one.end)
