"""Where every vehicle and person is at one instant, and what the traffic lights show."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fogsim.values.light import DARK_SHIFT, Lamp


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


@dataclass(frozen=True, slots=True, eq=False)
class BodyPieces:
    """Rigid pieces of bodies that bend, as arrays; those of one body are one after another, its front first."""

    # (m,) int: The vehicle that each belongs to
    row: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))
    kind: tuple[str, ...] = ()  # What each is: "tractor", "trailer", "bus" or "carriage"
    # (m, 3): Middles of their front ends on the road surface [m]
    position: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    # heading, grade (m,): as of `TrafficState` [rad]
    heading: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    grade: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    # (m,): Lengths [m]; width and height are the vehicle's
    length: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))


_NO_PIECES = BodyPieces()
"""Where every body is in one piece."""


@dataclass(frozen=True, slots=True)
class TrafficState:
    """All vehicles at one instant, as arrays; row i belongs to ``ids[i]``; and who and what is next to them.

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
        Lane ids; empty for vehicles off the lanes.
    lamps : (n,) int32
        Lit lamps, bits of `Lamp`; where one side of a kind is dark, with the bits of `fogsim.values.light.dark_on`.
    paint : (n, 3) float64
        Linear reflectance of the paint, 0 … 1.
    grade : (n,) float64
        Inclination along the heading of the road that a vehicle stands on, from its rear to its front bumper [rad];
        positive uphill. Left out, everyone stands on the level.
    free_speed : (n,) float64
        Speed at which a driver would travel alone in clear air [m/s]: the lane's limit times the driver's own factor,
        and no more than the vehicle can. Empty where it is not known.
    advised_speed : (n,) float64
        Lowest speed in force that a driver has heard advised, whether they follow it or not, the ego its own [m/s];
        ``inf`` where they have heard none. Empty where no one has.
    off_lanes : (n,) bool
        Whether a vehicle is off the lanes: parked next to the road (as a taxi that waits is), or put there by another
        simulator. It has its position and its heading, but no limit, no leader and no acceleration. Left out, all
        vehicles are on lanes.
    signals : SignalState
        Heads of traffic lights near the ego; none without an ego.
    persons : PersonState
        Persons on foot near the ego; without one, all.
    course : tuple of str
        Names of what vehicles follow one another along: their lanes, as a rule. Vehicles that share lanes side by side
        follow one another along an edge, where their widths overlap; those that overtake on the oncoming lane do not
        follow those that come along it. Left out, the lanes.
    across : (n,) float64
        Offsets of vehicles' middles to one side on their course [m]; empty where vehicles do not share lanes.
    pieces : BodyPieces
        Of those whose bodies bend, as trains; `heading` and `length` are those of the whole.
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
    off_lanes: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))
    signals: SignalState = NO_SIGNALS
    persons: PersonState = NO_PERSONS
    course: tuple[str, ...] = ()
    across: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    pieces: BodyPieces = _NO_PIECES

    def __post_init__(self) -> None:
        """Put vehicles on the level, on lanes and along these where nothing else is given."""
        if not len(self.grade):
            object.__setattr__(self, "grade", np.zeros(len(self.ids)))
        if not len(self.off_lanes):
            object.__setattr__(self, "off_lanes", np.zeros(len(self.ids), np.bool_))
        if not self.course:
            object.__setattr__(self, "course", self.lane)

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


def rear_of(state: TrafficState, row: int) -> tuple[NDArray[np.float64], float]:
    """Middle of a vehicle's rear bumper on the road surface (3,) [m], and the heading there [rad]."""
    pieces = np.flatnonzero(state.pieces.row == row) if state.pieces.kind else state.pieces.row
    if len(pieces):
        last = int(pieces[-1])
        front, heading, length = state.pieces.position[last], state.pieces.heading[last], state.pieces.length[last]
    else:
        front, heading, length = state.position[row], state.heading[row], state.length[row]
    rear = np.array([length * np.cos(heading), length * np.sin(heading), 0.0])
    return front - rear, float(heading)


BOX, PEDESTRIAN = "box", "pedestrian"
"""Body kinds of obstacles and of persons on foot where they are rows among vehicles."""

_PERSON_LENGTH, _PERSON_WIDTH, _PERSON_HEIGHT = 0.4, 0.6, 1.7  # [m]


def with_persons(state: TrafficState) -> TrafficState:
    """Traffic with persons on foot as further rows, behind the vehicles'; nan for what they do not have."""
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
        course=state.course + persons.lane,
        across=np.append(state.across, unknown) if len(state.across) else state.across,
        lamps=np.append(state.lamps, np.zeros(count, np.int32)),
        paint=np.concatenate((state.paint, np.full((count, 3), np.nan))),
        grade=np.append(state.grade, unknown),
        free_speed=np.append(state.free_speed, unknown) if len(state.free_speed) else state.free_speed,
        advised_speed=np.append(state.advised_speed, unknown) if len(state.advised_speed) else state.advised_speed,
        off_lanes=np.append(state.off_lanes, np.zeros(count, np.bool_)),
    )


def advised_speeds(ids: Sequence[str], heard: Mapping[str, float]) -> NDArray[np.float64]:
    """Heard advice as `TrafficState.advised_speed` has it (n,) [m/s]; empty where no one has heard any."""
    return np.fromiter(map(heard.get, ids, itertools.repeat(np.inf)) if heard else (), np.float64)


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
        Instant, by the clock of `TrafficState` [s].
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
        How far along its route the ego's front bumper is [m]; off the lanes, where it left them.
    route_length : float
        Length of the route [m].
    speed_limit : float
        Speed limit where the ego is [m/s]; ``inf`` off the lanes.
    leader : Leader or None
        The next vehicle ahead that goes the same way and whose width overlaps.
    collisions : tuple of Collision
        Collisions of any vehicles since the last snapshot, each pair once.
    signal_ahead : SignalAhead or None
        The next traffic light on its way.
    is_ended : bool
        True from the simulation's own end on, as its configuration sets it.
    """

    state: TrafficState
    ego: int
    route_position: float
    route_length: float
    speed_limit: float
    leader: Leader | None
    collisions: tuple[Collision, ...]
    signal_ahead: SignalAhead | None = None
    is_ended: bool = False


@dataclass(frozen=True, slots=True)
class NetworkSnapshot:
    """The traffic of a whole network at one instant, without an ego.

    Attributes
    ----------
    state : TrafficState
        Every vehicle.
    speed_limit : float
        Highest speed limit of the lanes that they are on [m/s]; ``inf`` where no one is.
    collisions : tuple of Collision
        Collisions since the last snapshot, each pair once.
    is_over : bool
        True if no one is there, and no one will come.
    waiting : tuple of str
        Ids of vehicles that are due and find no room to enter the road.
    is_ended : bool
        See `TrafficSnapshot`.
    """

    state: TrafficState
    speed_limit: float
    collisions: tuple[Collision, ...]
    is_over: bool
    waiting: tuple[str, ...] = ()
    is_ended: bool = False


_AHEAD = Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.FRONT_FOG | Lamp.DAYTIME
_BEHIND = Lamp.POSITION | Lamp.STOP | Lamp.REAR_FOG
_INDICATORS = Lamp.INDICATOR_LEFT | Lamp.INDICATOR_RIGHT


def with_pieces(state: TrafficState, skip: int | None) -> tuple[TrafficState, NDArray[np.intp]]:
    """Traffic with each piece of a body as a row, and the vehicle that each row belongs to (n,).

    The first piece of a vehicle has its row, further ones have rows behind all vehicles. Lamps burn at the front of the
    first and at the rear of the last piece.
    """
    pieces, count = state.pieces, len(state.ids)
    if not pieces.kind:
        return state, np.arange(count)
    is_first = np.append(True, pieces.row[1:] != pieces.row[:-1])
    is_last = np.append(is_first[1:], True)
    lit = _lamps_of_pieces(state.lamps[pieces.row], is_first, is_last)
    further = np.flatnonzero(~is_first & (pieces.row != (-1 if skip is None else skip)))
    rows = pieces.row[is_first]
    types = list(state.types)
    for row, kind in zip(rows.tolist(), np.array(pieces.kind)[is_first].tolist(), strict=True):
        types[row] = kind
    owner = pieces.row[further]
    body = np.concatenate((np.arange(count), owner))

    def column(own: NDArray[np.float64], of_pieces: NDArray[np.float64]) -> NDArray[np.float64]:
        first = own.copy()
        first[rows] = of_pieces[is_first]
        return np.concatenate((first, of_pieces[further]))

    lamps = state.lamps.copy()
    lamps[rows] = lit[is_first]
    drawn = replace(
        state,
        ids=state.ids + tuple(state.ids[row] for row in owner.tolist()),
        types=(*types, *(pieces.kind[piece] for piece in further.tolist())),
        lane=state.lane + tuple(state.lane[row] for row in owner.tolist()),
        position=column(state.position, pieces.position),
        heading=column(state.heading, pieces.heading),
        grade=column(state.grade, pieces.grade),
        length=column(state.length, pieces.length),
        lamps=np.concatenate((lamps, lit[further])).astype(np.int32),
        pieces=_NO_PIECES,
        speed=state.speed[body],
        acceleration=state.acceleration[body],
        width=state.width[body],
        height=state.height[body],
        paint=state.paint[body],
        off_lanes=state.off_lanes[body],
        course=tuple(state.course[row] for row in body.tolist()),
    )
    return drawn, body


def _lamps_of_pieces(
    lamps: NDArray[np.int32], is_first: NDArray[np.bool_], is_last: NDArray[np.bool_]
) -> NDArray[np.int32]:
    """What burns of the lamps of whole vehicles on each of their pieces."""
    at_ends = np.where(is_first | is_last, int(_INDICATORS), 0)
    kinds = at_ends | np.where(is_first, int(_AHEAD), 0) | np.where(is_last, int(_BEHIND), 0)
    known = sum((kinds << shift for shift in DARK_SHIFT.values()), kinds)
    return np.asarray(lamps & known, np.int32)
