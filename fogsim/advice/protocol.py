"""What a speed adviser is asked."""

from typing import Protocol, runtime_checkable

from fogsim.values import Belief, Observation, SpeedAdvice


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


@runtime_checkable
class VehicleAdviser(Protocol):
    """A rule that goes by the vehicle's own speed and its lead vehicle too, in the ego alone; it keeps nothing."""

    def advise_vehicle(
        self, belief: Belief, observation: Observation, speed_limit: float, time: float, previous: SpeedAdvice
    ) -> SpeedAdvice:
        """Advise a speed.

        Parameters
        ----------
        belief : Belief
            What is believed about the fog.
        observation : Observation
            Sensor readings of the vehicle: its speed, the lead vehicle, the frame, the signs ahead.
        speed_limit : float
            Speed limit [m/s].
        time : float
            Instant [s].
        previous : SpeedAdvice
            The advice in force.
        """
