"""What goes back into the traffic."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from fogsim.values.light import Lamp


@dataclass(frozen=True, slots=True)
class SpeedAdvice:
    """An advised speed and what the adviser remembers with it.

    Attributes
    ----------
    speed : float
        Advised speed [m/s]; ``inf`` for no advice.
    raise_since : float or None
        Instant [s] since which a higher speed has been justified without a break, None if it is not.
    """

    speed: float = float("inf")
    raise_since: float | None = None


@dataclass(frozen=True, slots=True)
class Command:
    """Advice and lamps in force until the next decision.

    Attributes
    ----------
    advice : SpeedAdvice
        The advice to the ego vehicle.
    lamps : Lamp
        Lamps that the ego vehicle is to light; dipped head lamps until somebody decides.
    advised_speeds : mapping from vehicle id to float
        Advice to other vehicles [m/s].
    """

    advice: SpeedAdvice = field(default_factory=SpeedAdvice)
    lamps: Lamp = Lamp.POSITION | Lamp.LOW_BEAM
    advised_speeds: Mapping[str, float] = field(default_factory=dict)
