"""What a scenario's script does in a run."""

import math
from dataclasses import dataclass
from enum import StrEnum

from fogsim.values.fault import Fault
from fogsim.values.light import Lamp, Side


@dataclass(frozen=True, slots=True)
class Begun:
    """Something of the script that has begun, or is over.

    Attributes
    ----------
    name : str
        Its name in the scenario: its own, or its key path, such as ``timeline.0``.
    time : float
        When it began [s].
    what : str
        What it does, in a few words.
    why : str
        What held then.
    who : tuple of str
        Vehicles that it is about.
    key : str
        Its place in the scenario, such as ``timeline.0``, whatever its name.
    is_over : bool
        True if this is its end.
    """

    name: str
    time: float
    what: str = ""
    why: str = ""
    who: tuple[str, ...] = ()
    key: str = ""
    is_over: bool = False


class Shape(StrEnum):
    """How a speed goes over into another: evenly, along half a wave of a cosine, or at once."""

    LINEAR = "linear"
    SINUSOIDAL = "sinusoidal"
    STEP = "step"


@dataclass(frozen=True, slots=True)
class ChangeSpeed:
    """A vehicle comes to a speed, whatever limits and advice say, and holds it; it hits no one for that."""

    vehicle: str  # Its id
    speed: float  # Speed to come to [m/s]
    duration: float = 0.0  # Time that it takes [s]; 0 for at once. A vehicle that cannot speed up as fast takes longer
    shape: Shape = Shape.LINEAR  # How
    hold: float = math.inf  # Time from the beginning until the driver drives by himself again [s]
    # Another vehicle, whose speed, times `factor`, plus `plus` [m/s], it comes to at each moment while that one is on
    # the road; "" for `speed`
    like: str = ""
    factor: float = 1.0
    plus: float = 0.0
    # (float, float): Times from the beginning [s] and speeds then [m/s], evenly in between; empty for `shape`
    profile: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Follow:
    """A vehicle keeps a time headway to another one ahead of it, in its own lane or in another."""

    # vehicle, leader: their ids
    vehicle: str
    leader: str
    headway: float  # Gap, bumper to bumper, over the vehicle's own speed [s]
    hold: float = math.inf  # Time until the driver drives by himself again [s]
    gap: float = 2.0  # Gap at standstill, to which the headway adds [m]


@dataclass(frozen=True, slots=True)
class Arrive:
    """A vehicle is at a place when another one is at a place of its own."""

    # vehicle, other: their ids
    vehicle: str
    other: str
    # distance, other_distance: how far each has driven by then since it came onto the road [m]
    distance: float
    other_distance: float
    # Speed that the vehicle has there, added to `factor` times the other's [m/s]; None for any
    speed: float | None = None
    factor: float = 0.0  # Share of the other's speed in that
    # steady, steady_time: way [m] and time [s] before the place for which it has that speed already
    steady: float = 0.0
    steady_time: float = 0.0


@dataclass(frozen=True, slots=True)
class Stop:
    """A vehicle stops at a place ahead, stands there, and drives on."""

    vehicle: str  # Its id
    distance: float  # Way to the place [m]
    deceleration: float = 3.0  # How hard it brakes for that, as late as it can [m/s²]
    stand: float = math.inf  # Time for which it stands [s]


@dataclass(frozen=True, slots=True)
class ChangeLane:
    """A vehicle changes lane, whoever is there: it cuts in."""

    vehicle: str  # Its id
    lanes: int  # How many lanes to the left; negative to the right
    stay: float = 60.0  # Time for which it stays there [s]
    duration: float | None = None  # Time that the way over takes [s]; None for the usual one
    # Time for which it indicates before [s]; the lamp goes out when it is over. 0 for no indicating
    indicator: float = 0.0
    # Whether it goes to the lane beyond the left one, whose traffic comes towards it, whatever `lanes` is
    oncoming: bool = False
    # Distance of its middle from the lane's middle afterwards, to the left [m]; None for the one that it has
    offset: float | None = None


@dataclass(frozen=True, slots=True)
class FollowPath:
    """A vehicle or body moves along a path, on or off the lanes; it enters the road there if it is not on it."""

    vehicle: str  # Its id
    # (float, float, float): x, y [m] and heading [rad], NaN for that of the path
    points: tuple[tuple[float, float, float], ...]
    times: tuple[float, ...] = ()  # When it is at each point, from the beginning [s]; empty for a speed of its own
    ahead: float = 0.0  # How far its front bumper is ahead of the point that follows the path [m]
    speed: float | None = None  # Speed with which it begins, without times [m/s]; None for the one that it has
    stays: bool = False  # Whether it stays at the end also on a lane
    # ``map`` if points are the network's coordinates; from the vehicle's point at the beginning they are along the
    # network's axes (``place``) or ahead of the vehicle and to its left (``vehicle``)
    origin: str = "map"


@dataclass(frozen=True, slots=True)
class SetLamps:
    """Lamps of a vehicle are switched by hand, or fail."""

    vehicle: str  # Its id
    # lit, dark: lamps that are lit, or dark, from now on, whatever the vehicle does
    lit: Lamp = Lamp.NONE
    dark: Lamp = Lamp.NONE
    failed: Lamp = Lamp.NONE  # Lamps that are dark for ever
    automatic: Lamp = Lamp.NONE  # Lamps that are the vehicle's own again
    side: Side | None = None  # The side on which they are; None for all of a kind


@dataclass(frozen=True, slots=True)
class SetSignal:
    """Traffic lights show something else than their program."""

    signal: str  # Id of the traffic lights
    phase: int | None = None  # Phase of their program to go to, from which it goes on; None for `state`
    state: str = "r"  # SUMO's letter for each link, such as ``rrGG``, or one letter for all
    hold: float = math.inf  # Time after which the program goes on where it was left [s]


@dataclass(frozen=True, slots=True)
class Depart:
    """A vehicle comes onto the road near another one, of the same type and with the rest of its way."""

    vehicle: str  # Its id, which no one on the road has
    like: str  # The other one
    gap: float  # Gap to the other one along the road, bumper to bumper [m]; negative behind it
    lane: int | None = None  # Lane from the right; None for the other one's
    speed: float | None = None  # Its speed [m/s]; None for the other one's
    kind: str = ""  # Its type, of `fogsim.traffic.templates.VEHICLE_KINDS`; the other one's where it is empty


@dataclass(frozen=True, slots=True)
class Enter:
    """A vehicle comes onto the road on a way of its own."""

    vehicle: str  # Its id, which no one on the road has
    kind: str  # Its type, of `fogsim.traffic.templates.VEHICLE_KINDS`
    # Its way, from the edge on which it begins; the way between two that do not follow one another is looked for
    edges: tuple[str, ...]
    position: float  # Place of its front bumper on that edge [m]
    lane: int = 0  # SUMO's number of its lane there
    # Speed with which it begins and which it keeps where it can [m/s]; None for what its type and the limit allow
    speed: float | None = None


@dataclass(frozen=True, slots=True)
class TakeRoute:
    """A vehicle drives to the first of some edges, on the way that SUMO finds, and then along them."""

    vehicle: str  # Its id
    edges: tuple[str, ...]  # The edges


@dataclass(frozen=True, slots=True)
class Leave:
    """A vehicle leaves the road at once."""

    vehicle: str  # Its id


@dataclass(frozen=True, slots=True)
class Walk:
    """A person on foot walks at another speed from now on."""

    person: str  # Its id
    speed: float  # The speed [m/s]


TrafficAction = (
    ChangeSpeed
    | Follow
    | Arrive
    | Stop
    | ChangeLane
    | FollowPath
    | TakeRoute
    | SetLamps
    | SetSignal
    | Depart
    | Enter
    | Leave
    | Walk
)
"""Instantaneous actions that a traffic simulation can carry out."""


@dataclass(frozen=True, slots=True)
class ChangeFog:
    """The fog becomes thicker or thinner everywhere."""

    density: float  # Factor of the extinction coefficient of the scenario to come to [-]
    duration: float = 0.0  # Time that it takes [s]


@dataclass(frozen=True, slots=True)
class ChangeLight:
    """Daylight becomes brighter or darker."""

    illuminance: float  # Horizontal illuminance to come to [lx]
    duration: float = 0.0  # Time that it takes [s]
    # Whether it changes by the same factor in each second, as dusk and dawn do, and not by as many lux
    by_factors: bool = False


@dataclass(frozen=True, slots=True)
class Actions:
    """What of a script begins now, and is in force in the next camera period."""

    traffic: tuple[TrafficAction, ...] = ()  # For the traffic
    fog: tuple[ChangeFog, ...] = ()  # For the fog
    light: tuple[ChangeLight, ...] = ()  # For the daylight
    faults: tuple[Fault, ...] = ()  # For the ego's sensors
