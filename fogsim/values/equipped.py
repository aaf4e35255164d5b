"""Other vehicles with a camera and estimators of their own."""

from dataclasses import dataclass

from fogsim.values.belief import Belief
from fogsim.values.command import SpeedAdvice
from fogsim.values.estimate import Estimate
from fogsim.values.light import Lamp


@dataclass(frozen=True, slots=True)
class EquippedVehicle:
    """What an equipped vehicle sees, believes and does at one instant.

    Attributes
    ----------
    vehicle_id : str
        Its id.
    place : float
        How far along the ego's route its front bumper is [m].
    extinction, extinction_ahead : float
        The truth at its camera, and ahead of it, as of `Truth` [1/m].
    estimates : tuple of Estimate
        What its estimators make of its picture.
    belief : Belief
        What it believes.
    advice : SpeedAdvice
        What it is advised from now on.
    lamps : Lamp
        What it lights from now on.
    """

    vehicle_id: str
    place: float
    extinction: float
    extinction_ahead: float
    estimates: tuple[Estimate, ...]
    belief: Belief
    advice: SpeedAdvice
    lamps: Lamp
