"""What a lighting policy is asked."""

from typing import Protocol

from fogsim.values import Belief, Lamp


class LightingPolicy(Protocol):
    """A rule from what is believed about the fog to the ego's lamps; it keeps nothing between calls."""

    def lamps(self, belief: Belief, previous: Lamp) -> Lamp:
        """Choose the lamps to light.

        Parameters
        ----------
        belief : Belief
            What is believed about the fog.
        previous : Lamp
            Lamps lit now.
        """
