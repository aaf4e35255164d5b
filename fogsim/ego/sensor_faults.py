"""Which faults of the ego's sensors are in force, and when they begin and end."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from fogsim.values import Fault, FaultKind

_ROUNDING = 1e-9
"""Times that differ by no more than this are the same [s]."""


class RunningFault(NamedTuple):
    """A fault with its time and its own chance.

    Attributes
    ----------
    fault : Fault
        The fault.
    begin, end : float
        It is in force from `begin` until just before `end` [s].
    rng : numpy.random.Generator
        Random numbers of this fault alone.
    """

    fault: Fault
    begin: float
    end: float
    rng: np.random.Generator

    @property
    def kind(self) -> FaultKind:
        """What is wrong."""
        return self.fault.kind


class FaultSchedule:
    """Faults that have been ordered, in this order.

    Parameters
    ----------
    rng : numpy.random.Generator
        Each fault's generator is spawned from it, so that no fault shifts the chance of another.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._ordered: list[RunningFault] = []

    def begin(self, faults: Iterable[Fault], time: float) -> None:
        """Order faults.

        Parameters
        ----------
        faults : iterable of Fault
            The faults.
        time : float
            Time from which their delays count [s].
        """
        for fault in faults:
            begin = time + fault.delay
            self._ordered.append(RunningFault(fault, begin, begin + fault.duration, self._rng.spawn(1)[0]))

    def at(self, time: float) -> tuple[RunningFault, ...]:
        """Faults in force at a time.

        Parameters
        ----------
        time : float
            [s].
        """
        now = time + _ROUNDING
        return tuple(one for one in self._ordered if one.begin <= now < one.end)
