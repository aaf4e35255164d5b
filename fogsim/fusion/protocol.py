"""What every fusion is to the loop."""

import functools
from collections.abc import Sequence
from typing import Protocol, cast, runtime_checkable

from fogsim.values.belief import Belief
from fogsim.values.estimate import Estimate
from fogsim.values.observation import FogReport


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
        ...

    def reset(self) -> None:
        """Forget everything."""
        ...


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
            What others have told since the last call.

        Raises
        ------
        InputError
            If the instant is not finite or lies before the last one.
        """
        ...

    def reset(self) -> None:
        """Forget everything."""
        ...


def fuse(
    fusion: Fusion | LocatedFusion,
    estimates: Sequence[Estimate],
    time: float,
    place: float,
    reports: Sequence[FogReport] = (),
) -> Belief:
    """Ask a fusion of either kind.

    Parameters
    ----------
    fusion : Fusion or LocatedFusion
        The fusion.
    estimates, time, place, reports
        As of `LocatedFusion.update_at`.
    """
    if _knows_places(type(fusion)):
        return cast("LocatedFusion", fusion).update_at(estimates, time, place, reports)
    return cast("Fusion", fusion).update(estimates, time)


@functools.cache
def _knows_places(kind: type) -> bool:
    return issubclass(kind, LocatedFusion)
