"""What a speed adviser is asked."""

from typing import Protocol

from fogsim.values import Belief, SpeedAdvice


class Adviser(Protocol):
    """A rule from what is believed about the fog to an advised speed; it keeps nothing between calls."""

    def advise(self, belief: Belief, speed_limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
        """Advise a speed.

        Parameters
        ----------
        belief : Belief
            What is believed about the fog.
        speed_limit : float
            Speed limit [m/s].
        time : float
            Instant [s].
        previous : SpeedAdvice
            The advice in force.
        """
