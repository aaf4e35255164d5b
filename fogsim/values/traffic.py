"""Where every vehicle and person is at one instant, and what the traffic lights show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray


class SignalColour(StrEnum):
    """What a traffic light shows."""

    RED = "red"
    RED_YELLOW = "red_yellow"
    YELLOW = "yellow"
    GREEN = "green"
    GREEN_ARROW = "green_arrow"
    """To the right after a stop."""
    BLINKING = "blinking"
    OFF = "off"


@dataclass(frozen=True, slots=True, eq=False)
class SignalState:
    """Heads of traffic lights at one instant, as arrays; row i belongs to ``ids[i]`` and ``lane[i]``.

    Attributes
    ----------
    ids : tuple of str
        The traffic light that each head belongs to.
    lane : tuple of str
        Id of the lane to whose drivers each speaks.
    position : (n, 3) float64
        Middles of their middle lenses [m].
    heading : (n,) float64
        Direction of travel of those they speak to [rad].
    diameter : (n,) float64
        Diameters of their lenses [m].
    colour : tuple of SignalColour
        What each shows.
    on_foot : (n,) bool
        Whether each speaks to persons who cross; empty where none does.
    """

    ids: tuple[str, ...] = ()
    lane: tuple[str, ...] = ()
    position: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    heading: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    diameter: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    colour: tuple[SignalColour, ...] = ()
    on_foot: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))


@dataclass(frozen=True, slots=True, eq=False)
class PersonState:
    """Persons on foot at one instant, as arrays; row i belongs to ``ids[i]``.

    Attributes
    ----------
    ids : tuple of str
        Their ids.
    position : (n, 3) float64
        Where they stand or walk, at the height of the street [m].
    heading : (n,) float64
        Where they look, counterclockwise from east [rad].
    speed : (n,) float64
        Speed [m/s].
    lane : tuple of str
        Lane ids.
    raised : (n,) bool
        Whether they are on a footway, which lies a kerb above the street.
    """

    ids: tuple[str, ...] = ()
    position: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    heading: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    speed: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    lane: tuple[str, ...] = ()
    raised: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))


NO_SIGNALS, NO_PERSONS = SignalState(), PersonState()
"""Where there are none."""


@dataclass(frozen=True, slots=True)
class TrafficState:
    """All vehicles at one instant, as arrays; row i belongs to ``ids[i]``; and who and what is beside them.

    Attributes
    ----------
    time : float
        Instant [s].
    ids : tuple of str
        Vehicle ids.
    types : tuple of str
        Body kinds: "car", "van", "truck", "bus", "motorcycle"; "box" and "pedestrian" of what has no engine or lamps.
    position : (n, 3) float64
        Middle of the front bumper on the road surface [m]: east, north, up.
    heading : (n,) float64
        Direction of travel, counterclockwise from east [rad].
    speed : (n,) float64
        Speed [m/s].
    acceleration : (n,) float64
        Acceleration along the heading [m/s²].
    length, width, height : (n,) float64
        Size of the body [m].
    lane : tuple of str
        Lane ids.
    lamps : (n,) int32
        Lit lamps, bits of `Lamp`; where one side of a kind is dark, with the bits of `fogsim.values.light.dark_on`.
    paint : (n, 3) float64
        Linear reflectance of the paint, 0 … 1.
    grade : (n,) float64
        Inclination along the heading of the road that a vehicle stands on, from its rear to its front bumper [rad];
        positive uphill. Left out, everybody stands on the level.
    free_speed : (n,) float64
        Speed at which a driver would travel alone in clear air [m/s]: the lane's limit times the driver's own factor,
        and no more than the vehicle can. Empty where it is not known.
    advised_speed : (n,) float64
        Lowest speed in force that a driver has heard advised, whether they follow it or not, the ego its own [m/s];
        ``inf`` where they have heard none. Empty where nobody has.
    signals : SignalState
        Heads of traffic lights near the ego; none without an ego.
    persons : PersonState
        Persons on foot near the ego; without one, all.
    """

    time: float
    ids: tuple[str, ...]
    types: tuple[str, ...]
    position: NDArray[np.float64]
    heading: NDArray[np.float64]
    speed: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    length: NDArray[np.float64]
    width: NDArray[np.float64]
    height: NDArray[np.float64]
    lane: tuple[str, ...]
    lamps: NDArray[np.int32]
    paint: NDArray[np.float64]
    grade: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    free_speed: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    advised_speed: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    signals: SignalState = NO_SIGNALS
    persons: PersonState = NO_PERSONS

    def __post_init__(self) -> None:
        """Put everybody on the level where no grade is given."""
        if not len(self.grade):
            object.__setattr__(self, "grade", np.zeros(len(self.ids)))

    def row(self, vehicle_id: str) -> int | None:
        """Row of a vehicle, or None if it is not on the road now.

        Parameters
        ----------
        vehicle_id : str
            The vehicle.
        """
        try:
            return self.ids.index(vehicle_id)
        except ValueError:
            return None


BOX, PEDESTRIAN = "box", "pedestrian"
"""Body kinds of obstacles and of persons on foot where they are rows among vehicles."""

_PERSON_LENGTH, _PERSON_WIDTH, _PERSON_HEIGHT = 0.4, 0.6, 1.7  # [m]


def with_persons(state: TrafficState) -> TrafficState:
    """Traffic with persons on foot as further rows, behind the vehicles'; nan for what they do not have.

    Parameters
    ----------
    state : TrafficState
        The traffic; without persons it is given back as it is.
    """
    persons, count = state.persons, len(state.persons.ids)
    if not count:
        return state
    unknown = np.full(count, np.nan)
    return replace(
        state,
        ids=state.ids + persons.ids,
        types=state.types + (PEDESTRIAN,) * count,
        position=np.concatenate((state.position, persons.position)),
        heading=np.append(state.heading, persons.heading),
        speed=np.append(state.speed, persons.speed),
        acceleration=np.append(state.acceleration, unknown),
        length=np.append(state.length, np.full(count, _PERSON_LENGTH)),
        width=np.append(state.width, np.full(count, _PERSON_WIDTH)),
        height=np.append(state.height, np.full(count, _PERSON_HEIGHT)),
        lane=state.lane + persons.lane,
        lamps=np.append(state.lamps, np.zeros(count, np.int32)),
        paint=np.concatenate((state.paint, np.full((count, 3), np.nan))),
        grade=np.append(state.grade, unknown),
        free_speed=np.append(state.free_speed, unknown) if len(state.free_speed) else state.free_speed,
        advised_speed=np.append(state.advised_speed, unknown) if len(state.advised_speed) else state.advised_speed,
    )


def advised_speeds(ids: Sequence[str], heard: Mapping[str, float]) -> NDArray[np.float64]:
    """Advice to vehicles as `TrafficState.advised_speed` has it (n,) [m/s]; empty where nobody has heard any.

    Parameters
    ----------
    ids : (n,) sequence of str
        The vehicles.
    heard : mapping from vehicle id to float
        What those who have heard any were advised [m/s].
    """
    return np.array([heard.get(vehicle, np.inf) for vehicle in ids]) if heard else np.zeros(0)


@dataclass(frozen=True, slots=True)
class Leader:
    """The vehicle ahead of the ego, as it truly is.

    Attributes
    ----------
    vehicle_id : str
        Its id.
    gap : float
        Distance from the ego's front bumper to its rear bumper [m].
    speed : float
        Its speed [m/s].
    """

    vehicle_id: str
    gap: float
    speed: float


@dataclass(frozen=True, slots=True)
class SignalAhead:
    """The next traffic light on the ego's way.

    Attributes
    ----------
    signal_id : str
        Its id.
    colour : SignalColour
        What it shows to the ego.
    distance : float
        Way from the ego's front bumper to its stop line [m].
    """

    signal_id: str
    colour: SignalColour
    distance: float


@dataclass(frozen=True, slots=True)
class Collision:
    """Two vehicles that have hit each other.

    Attributes
    ----------
    time : float
        Instant [s].
    collider, victim : str
        Their ids.
    impact_speed : float
        Difference of their speeds [m/s]; at a junction, the size of that of their velocities.
    """

    time: float
    collider: str
    victim: str
    impact_speed: float


@dataclass(frozen=True, slots=True)
class TrafficSnapshot:
    """The traffic at one instant as the ego's loop needs it.

    Attributes
    ----------
    state : TrafficState
        The vehicles near the ego, itself included.
    ego : int
        Row of the ego.
    route_position : float
        How far along its route the ego's front bumper is [m].
    route_length : float
        Length of the route [m].
    speed_limit : float
        Speed limit where the ego is [m/s].
    leader : Leader or None
        The vehicle ahead in its lane.
    collisions : tuple of Collision
        Collisions of any vehicles since the last snapshot, each pair once.
    signal_ahead : SignalAhead or None
        The next traffic light on its way.
    """

    state: TrafficState
    ego: int
    route_position: float
    route_length: float
    speed_limit: float
    leader: Leader | None
    collisions: tuple[Collision, ...]
    signal_ahead: SignalAhead | None = None


@dataclass(frozen=True, slots=True)
class NetworkSnapshot:
    """The traffic of a whole network at one instant, without an ego.

    Attributes
    ----------
    state : TrafficState
        Every vehicle.
    speed_limit : float
        Highest speed limit of the lanes that they are on [m/s]; ``inf`` where nobody is.
    collisions : tuple of Collision
        Collisions since the last snapshot, each pair once.
    is_over : bool
        True if nobody is there, and nobody will come.
    waiting : tuple of str
        Ids of vehicles that are due and find no room to enter the road.
    """

    state: TrafficState
    speed_limit: float
    collisions: tuple[Collision, ...]
    is_over: bool
    waiting: tuple[str, ...] = ()
