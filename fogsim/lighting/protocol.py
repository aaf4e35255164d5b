"""What a lighting policy is asked."""

from typing import Protocol, runtime_checkable

from fogsim.values import Belief, Lamp, LampChoice, Observation


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


@runtime_checkable
class VehicleLightingPolicy(Protocol):
    """A rule that goes by what the vehicle itself measures too; it keeps nothing between calls."""

    def choose_lamps(self, belief: Belief, observation: Observation, time: float, previous: LampChoice) -> LampChoice:
        """Choose the lamps to light.

        Parameters
        ----------
        belief : Belief
            What is believed about the fog.
        observation : Observation
            Sensor readings of the vehicle: its speed, the vehicle ahead by radar, the light sensor.
        time : float
            Instant [s].
        previous : LampChoice
            Lamps lit now, and what else was asked for.
        """
