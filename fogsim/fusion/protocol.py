"""What every fusion is to the loop."""

from collections.abc import Sequence
from typing import Protocol

from fogsim.values.belief import Belief
from fogsim.values.estimate import Estimate


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
