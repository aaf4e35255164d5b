"""What goes back into the traffic."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

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
    smoothed : tuple of float or None
        Instant [s] and logarithm of the visibility as smoothed till then [ln m]; None where nothing is smoothed.
    """

    speed: float = float("inf")
    raise_since: float | None = None
    smoothed: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class LampWish:
    """Other lamps than those that are lit, asked for without a break, and not yet for long enough.

    Attributes
    ----------
    lamps : Lamp
        The lamps.
    since : float
        Instant [s] since which.
    """

    lamps: Lamp
    since: float


@dataclass(frozen=True, slots=True)
class LampChoice:
    """Lamps to light, and what the lighting policy remembers with them.

    Attributes
    ----------
    lamps : Lamp
        The lamps.
    wish : LampWish or None
        What the policy would rather light; None for nothing else.
    """

    lamps: Lamp
    wish: LampWish | None = None


class DriverWarning(StrEnum):
    """What the ego's driver is warned of, and asked to take over for."""

    FOG_AHEAD = "fog_ahead"
    """Denser fog ahead, or fog in which the speed is too high for what will be seen."""
    CANNOT_SEE = "cannot_see"
    """The system knows too little about the fog: it decides nothing by it."""
    CAMERA_DEGRADED = "camera_degraded"
    """The camera is dirty, blinded, frozen or dark."""
    COLLISION = "collision"
    """A controller's: the vehicle ahead comes near."""


@dataclass(frozen=True, slots=True)
class WarningMemory:
    """What the warning policy remembers of its last decision.

    Attributes
    ----------
    time : float
        Its instant [s].
    since : mapping from DriverWarning to float
        Instants [s] since which there has been reason for a warning without a break.
    until : mapping from DriverWarning to float
        Instants [s] up to which warnings are in force.
    visibility : float
        Cautious visibility of late [m]: it follows a rise at once, and a fall slowly.
    """

    time: float = 0.0
    since: Mapping[DriverWarning, float] = field(default_factory=dict)
    until: Mapping[DriverWarning, float] = field(default_factory=dict)
    visibility: float = 0.0


class Display(StrEnum):
    """Where a driver hears advice to all on a stretch of road."""

    MESSAGE_SIGN = "message_sign"
    """Where the stretch begins, off a variable message sign; what was read there is kept to the stretch's end."""
    IN_CAR = "in_car"
    """In the car, wherever on the stretch it is, as long as the advice is in force."""
    LAW = "law"
    """Nowhere: a rule that drivers know and apply to what they see, wherever on the stretch they are."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A stretch of road, all lanes of one direction, junctions on the way included.

    Attributes
    ----------
    start, end : float
        Positions along the ego's route, or along `edges`, at which it begins and ends [m].
    edges : tuple of str
        Edges of the network in the order in which they are driven; none for the ego's route.
    """

    start: float = 0.0
    end: float = float("inf")
    edges: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class StretchAdvice:
    """Advice to all on a stretch, from here on: whoever comes there hears it, too, while it is in force.

    Attributes
    ----------
    speed : float
        Advised speed [m/s]; ``inf`` for no advice.
    stretch : Stretch
        Where.
    display : Display
        How drivers get it.
    """

    speed: float
    stretch: Stretch = Stretch()
    display: Display = Display.IN_CAR


@dataclass(frozen=True, slots=True)
class EgoControl:
    """The ego driven by hand, whoever is in the way: no driver brakes for it.

    Attributes
    ----------
    acceleration : float
        Acceleration along the road [m/s²], within what the vehicle's top speed leaves; it does not reverse.
    lanes : int
        Change of lane that begins now: how many lanes to the left, negative to the right; none where there is no such
        lane.
    brakes_with_driver : bool
        Whether SUMO's driver brakes too: of an acceleration below 0 and the driver's, the lower one counts.
    """

    acceleration: float = 0.0
    lanes: int = 0
    brakes_with_driver: bool = False


@dataclass(frozen=True, slots=True)
class Control:
    """What a controller requests for the next camera period; None for what it leaves to the driver and the policies.

    Attributes
    ----------
    acceleration : float or None
        Acceleration along the road [m/s²], negative for braking.
    speed : float or None
        Speed to reach [m/s], in place of an acceleration.
    lamps : Lamp or None
        Lamps to light.
    warning : DriverWarning or None
        What the driver is warned of.
    """

    acceleration: float | None = None
    speed: float | None = None
    lamps: Lamp | None = None
    warning: DriverWarning | None = None


@dataclass(frozen=True, slots=True)
class Command:
    """Advice and lamps in force until the next decision.

    The ego has its own `advice` alone. Another driver whom several of the others concern has the lowest speed.

    Attributes
    ----------
    advice : SpeedAdvice
        The advice to the ego vehicle.
    lamps : Lamp
        Lamps that the ego vehicle is to light; dipped head lamps until a policy decides.
    advised_speeds : mapping from vehicle id to float
        Advice to other vehicles [m/s].
    lamps_of : mapping from vehicle id to Lamp
        Lamps that other vehicles are to light, in place of the dipped ones that all have.
    advice_reach : float
        Distance from the ego within which all others hear the ego's advice too, from vehicle to vehicle, and whoever
        comes there [m]; 0 for no one.
    stretches : tuple of StretchAdvice
        Advice to all on stretches of road.
    control : EgoControl or None
        The ego driven by hand, in place of its driver and of the advice; None for the driver. SUMO's traffic alone.
    lamp_wish : LampWish or None
        What the lighting policy remembers with the lamps.
    warning : DriverWarning or None
        What the ego's driver is warned of; None for nothing. Simulated drivers do not react to it.
    warning_memory : WarningMemory
        What the warning policy remembers with it.
    """

    advice: SpeedAdvice = field(default_factory=SpeedAdvice)
    lamps: Lamp = Lamp.POSITION | Lamp.LOW_BEAM
    advised_speeds: Mapping[str, float] = field(default_factory=dict)
    lamps_of: Mapping[str, Lamp] = field(default_factory=dict)
    advice_reach: float = 0.0
    stretches: tuple[StretchAdvice, ...] = ()
    control: EgoControl | None = None
    lamp_wish: LampWish | None = None
    warning: DriverWarning | None = None
    warning_memory: WarningMemory = field(default_factory=WarningMemory)

    @property
    def is_for_others(self) -> bool:
        """True if others than the ego are advised something, or may be when they come where the advice is given."""
        return bool(self.advised_speeds or self.advice_reach > 0.0 or self.stretches)
