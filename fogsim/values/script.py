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
    """A vehicle comes to a speed, whatever limits and advice say, and holds it; it hits nobody for that.

    Attributes
    ----------
    vehicle : str
        Its id.
    speed : float
        Speed to come to [m/s].
    duration : float
        Time that it takes [s]; 0 for at once. A vehicle that cannot speed up as fast takes longer.
    shape : Shape
        How.
    hold : float
        Time from the beginning until the driver drives by himself again [s].
    like : str
        Another vehicle, whose speed, times `factor`, plus `plus` [m/s], it comes to at each moment while that one is on
        the road; "" for `speed`.
    profile : tuple of (float, float)
        Times from the beginning [s] and speeds then [m/s], evenly in between; empty for `shape`.
    """

    vehicle: str
    speed: float
    duration: float = 0.0
    shape: Shape = Shape.LINEAR
    hold: float = math.inf
    like: str = ""
    factor: float = 1.0
    plus: float = 0.0
    profile: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Follow:
    """A vehicle keeps a time headway to another one ahead of it, in its own lane or in another.

    Attributes
    ----------
    vehicle, leader : str
        Their ids.
    headway : float
        Gap, bumper to bumper, over the vehicle's own speed [s].
    hold : float
        Time until the driver drives by himself again [s].
    gap : float
        Gap at standstill, to which the headway adds [m].
    """

    vehicle: str
    leader: str
    headway: float
    hold: float = math.inf
    gap: float = 2.0


@dataclass(frozen=True, slots=True)
class Arrive:
    """A vehicle is at a place when another one is at a place of its own.

    Attributes
    ----------
    vehicle, other : str
        Their ids.
    distance, other_distance : float
        How far each has driven by then since it came onto the road [m].
    speed : float or None
        Speed that the vehicle has there, added to `factor` times the other's [m/s]; None for any.
    factor : float
        Share of the other's speed in that.
    """

    vehicle: str
    other: str
    distance: float
    other_distance: float
    speed: float | None = None
    factor: float = 0.0


@dataclass(frozen=True, slots=True)
class Stop:
    """A vehicle stops at a place ahead, stands there, and drives on.

    Attributes
    ----------
    vehicle : str
        Its id.
    distance : float
        Way to the place [m].
    deceleration : float
        How hard it brakes for that, as late as it can [m/s²].
    stand : float
        Time for which it stands [s].
    """

    vehicle: str
    distance: float
    deceleration: float = 3.0
    stand: float = math.inf


@dataclass(frozen=True, slots=True)
class ChangeLane:
    """A vehicle changes lane, whoever is there: it cuts in.

    Attributes
    ----------
    vehicle : str
        Its id.
    lanes : int
        How many lanes to the left; negative to the right.
    stay : float
        Time for which it stays there [s].
    duration : float or None
        Time that the way over takes [s]; None for the usual one.
    indicator : float
        Time for which it indicates before [s]; the lamp goes out when it is over. 0 for no indicating.
    oncoming : bool
        Whether it goes to the lane beyond the left one, whose traffic comes towards it, whatever `lanes` is.
    offset : float or None
        Distance of its middle from the lane's middle afterwards, to the left [m]; None for the one that it has.
    """

    vehicle: str
    lanes: int
    stay: float = 60.0
    duration: float | None = None
    indicator: float = 0.0
    oncoming: bool = False
    offset: float | None = None


@dataclass(frozen=True, slots=True)
class FollowPath:
    """A vehicle or body moves along a path, on the lanes or off them; it comes onto the road there if it is not on it.

    Attributes
    ----------
    vehicle : str
        Its id.
    points : tuple of (float, float, float)
        x, y [m] and heading [rad], NaN for that of the path.
    times : tuple of float
        When it is at each point, from the beginning [s]; empty for a speed of its own.
    ahead : float
        How far its front bumper is ahead of the point that follows the path [m].
    speed : float or None
        Speed with which it begins, without times [m/s]; None for the one that it has.
    stays : bool
        Whether it stays at the end also on a lane.
    origin : str
        ``map`` if points are the network's coordinates; from the vehicle's point at the beginning they are along the
        network's axes (``place``) or ahead of the vehicle and to its left (``vehicle``).
    """

    vehicle: str
    points: tuple[tuple[float, float, float], ...]
    times: tuple[float, ...] = ()
    ahead: float = 0.0
    speed: float | None = None
    stays: bool = False
    origin: str = "map"


@dataclass(frozen=True, slots=True)
class SetLamps:
    """Lamps of a vehicle are switched by hand, or fail.

    Attributes
    ----------
    vehicle : str
        Its id.
    lit, dark : Lamp
        Lamps that are lit, or dark, from now on, whatever the vehicle does.
    failed : Lamp
        Lamps that are dark for ever.
    automatic : Lamp
        Lamps that are the vehicle's own again.
    side : Side or None
        The side on which they are; None for all of a kind.
    """

    vehicle: str
    lit: Lamp = Lamp.NONE
    dark: Lamp = Lamp.NONE
    failed: Lamp = Lamp.NONE
    automatic: Lamp = Lamp.NONE
    side: Side | None = None


@dataclass(frozen=True, slots=True)
class SetSignal:
    """Traffic lights show something else than their program.

    Attributes
    ----------
    signal : str
        Id of the traffic lights.
    phase : int or None
        Phase of their program to go to, from which it goes on; None for `state`.
    state : str
        SUMO's letter for each link, such as ``rrGG``, or one letter for all.
    hold : float
        Time after which the program goes on where it was left [s].
    """

    signal: str
    phase: int | None = None
    state: str = "r"
    hold: float = math.inf


@dataclass(frozen=True, slots=True)
class Depart:
    """A vehicle comes onto the road near another one, of the same type and with the rest of its way.

    Attributes
    ----------
    vehicle : str
        Its id, which nobody on the road has.
    like : str
        The other one.
    gap : float
        Gap to the other one along the road, bumper to bumper [m]; negative behind it.
    lane : int or None
        Lane from the right; None for the other one's.
    speed : float or None
        Its speed [m/s]; None for the other one's.
    kind : str
        Its type, of `fogsim.traffic.templates.VEHICLE_KINDS`; the other one's where it is empty.
    """

    vehicle: str
    like: str
    gap: float
    lane: int | None = None
    speed: float | None = None
    kind: str = ""


@dataclass(frozen=True, slots=True)
class Enter:
    """A vehicle comes onto the road on a way of its own.

    Attributes
    ----------
    vehicle : str
        Its id, which nobody on the road has.
    kind : str
        Its type, of `fogsim.traffic.templates.VEHICLE_KINDS`.
    edges : tuple of str
        Its way, from the edge on which it begins; the way between two that do not follow one another is looked for.
    position : float
        Place of its front bumper on that edge [m].
    lane : int
        SUMO's number of its lane there.
    speed : float or None
        Speed with which it begins and which it keeps where it can [m/s]; None for what its type and the limit allow.
    """

    vehicle: str
    kind: str
    edges: tuple[str, ...]
    position: float
    lane: int = 0
    speed: float | None = None


@dataclass(frozen=True, slots=True)
class TakeRoute:
    """A vehicle drives to the first of some edges, on the way that SUMO finds, and then along them.

    Attributes
    ----------
    vehicle : str
        Its id.
    edges : tuple of str
        The edges.
    """

    vehicle: str
    edges: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Leave:
    """A vehicle leaves the road at once.

    Attributes
    ----------
    vehicle : str
        Its id.
    """

    vehicle: str


@dataclass(frozen=True, slots=True)
class Walk:
    """A person on foot walks at another speed from now on.

    Attributes
    ----------
    person : str
        Its id.
    speed : float
        The speed [m/s].
    """

    person: str
    speed: float


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
"""What a traffic simulation can be told to do at once."""


@dataclass(frozen=True, slots=True)
class ChangeFog:
    """The fog becomes thicker or thinner everywhere.

    Attributes
    ----------
    density : float
        Factor of the extinction coefficient of the scenario to come to [-].
    duration : float
        Time that it takes [s].
    """

    density: float
    duration: float = 0.0


@dataclass(frozen=True, slots=True)
class ChangeLight:
    """Daylight becomes brighter or darker.

    Attributes
    ----------
    illuminance : float
        Horizontal illuminance to come to [lx].
    duration : float
        Time that it takes [s].
    by_factors : bool
        Whether it changes by the same factor in each second, as dusk and dawn do, and not by as many lux.
    """

    illuminance: float
    duration: float = 0.0
    by_factors: bool = False


@dataclass(frozen=True, slots=True)
class Actions:
    """What of a script begins now, and is in force in the next camera period.

    Attributes
    ----------
    traffic : tuple of TrafficAction
        For the traffic.
    fog : tuple of ChangeFog
        For the fog.
    light : tuple of ChangeLight
        For the daylight.
    faults : tuple of Fault
        For the ego's sensors.
    """

    traffic: tuple[TrafficAction, ...] = ()
    fog: tuple[ChangeFog, ...] = ()
    light: tuple[ChangeLight, ...] = ()
    faults: tuple[Fault, ...] = ()
