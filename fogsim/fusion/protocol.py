"""What every fusion is to the loop."""

import functools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol, cast, runtime_checkable

import numpy as np

from fogsim.fusion.grid_filter import CELLS, LOG_HIGH, LOG_LOW
from fogsim.values.belief import Belief
from fogsim.values.estimate import Estimate
from fogsim.values.observation import FogReport
from fogsim.values.result_checks import checked_belief


class NoFusion:
    """Believes all visibilities between 10 m and 10 km equally likely, whatever is estimated."""

    def __init__(self) -> None:
        self._log_extinction = np.linspace(LOG_LOW, LOG_HIGH, CELLS)
        self._log_extinction.flags.writeable = False

    def update(self, estimates: Sequence[Estimate], time: float) -> Belief:  # noqa: ARG002 - the protocol's parameters
        """Say what is believed, always the same; see `Fusion.update`."""
        return Belief(self._log_extinction, np.full(CELLS, 1.0 / CELLS))

    def reset(self) -> None:
        """Do nothing: there is nothing to be forgotten."""


class Fusion(Protocol):
    """Turns many estimates over time into one belief."""

    def update(self, estimates: Sequence[Estimate], time: float) -> Belief:
        """Take in the estimates of one instant and say what is believed now.

        Parameters
        ----------
        estimates : sequence of Estimate
            From any estimators.
        time : float
            The instant [s].

        Raises
        ------
        InputError
            If the instant is not finite or lies before the last one.
        """

    def reset(self) -> None:
        """Forget everything."""


@runtime_checkable
class LocatedFusion(Protocol):
    """Turns many estimates, and reports of others, into a belief that knows of places."""

    def update_at(
        self, estimates: Sequence[Estimate], time: float, place: float, reports: Sequence[FogReport] = ()
    ) -> Belief:
        """Take in the estimates of one instant and say what is believed now.

        Parameters
        ----------
        estimates : sequence of Estimate
            From any estimators.
        time : float
            The instant [s].
        place : float
            How far the vehicle has come along its way [m].
        reports : sequence of FogReport
            Reports from others since the last call.

        Raises
        ------
        InputError
            If the instant is not finite or lies before the last one.
        """

    def reset(self) -> None:
        """Forget everything."""


class DatedFusion:
    """A fusion of either kind whose beliefs are checked, and know how old the last evidence is.

    Parameters
    ----------
    fusion : Fusion or LocatedFusion
        The fusion.
    name : str
        What error messages call it.
    """

    def __init__(self, fusion: Fusion | LocatedFusion, name: str = "") -> None:
        self._fusion, self._name = fusion, name
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._fusion.reset()
        self._last = -math.inf

    def update_at(
        self, estimates: Sequence[Estimate], time: float, place: float, reports: Sequence[FogReport] = ()
    ) -> Belief:
        """Take in the estimates and reports of one instant; see `LocatedFusion.update_at`.

        Parameters
        ----------
        estimates, time, place, reports
            See `LocatedFusion.update_at`.

        Raises
        ------
        InputError
            If what the fusion returns is no belief.
        """
        if _knows_places(type(self._fusion)):
            belief = cast("LocatedFusion", self._fusion).update_at(estimates, time, place, reports)
        else:
            belief = cast("Fusion", self._fusion).update(estimates, time)
        belief = checked_belief(self._name, belief)
        # Reports inform only a fusion that knows of places.
        if (reports and belief.profile is not None) or any(one.valid or one.bounds is not None for one in estimates):
            self._last = time
        age = time - self._last
        return belief if belief.age == age else replace(belief, age=age)


@functools.cache
def _knows_places(kind: type) -> bool:
    return issubclass(kind, LocatedFusion)
