"""Where actors are when a run begins: along their ways, by themselves or next to one another."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from fogsim.core.files.xml_reader import read_elements
from fogsim.core.registry import Registry
from fogsim.errors import InputError, suggest


@dataclass(frozen=True, slots=True)
class VehicleKind:
    """A kind of vehicle."""

    vehicle_class: str  # SUMO's ``vClass``
    # length, width, height: size [m]
    length: float
    width: float
    height: float
    top_speed: float  # What it can drive at most [m/s]
    # Share of the limit that its drivers want to drive, as SUMO has it: ``normc(mean,deviation,least,most)``
    speed_factor: str
    headway: float  # Time that they keep to who is ahead (Krauss' tau) [s]
    # acceleration, deceleration: what they use at most [m/s²]
    acceleration: float = 2.6
    deceleration: float = 4.5
    imperfection: float = 0.4  # How imperfectly they drive (Krauss' sigma) [-]


_CAR = VehicleKind("passenger", 4.6, 1.85, 1.5, 55.0, "normc(0.95,0.10,0.75,1.20)", 1.4)

VEHICLE_KINDS: Registry[VehicleKind] = Registry(
    "vehicle type",
    {
        "car": _CAR,
        "van": VehicleKind("delivery", 5.9, 2.05, 2.4, 36.1, "normc(0.90,0.08,0.70,1.10)", 1.5),
        "lorry": VehicleKind("truck", 9.2, 2.5, 3.4, 25.0, "normc(0.95,0.05,0.80,1.05)", 1.6, 1.2, 4.0, 0.3),
        "truck": VehicleKind("truck", 15.5, 2.5, 3.8, 24.7, "normc(0.98,0.03,0.90,1.05)", 1.8, 0.8, 4.0, 0.3),
        "coach": VehicleKind("coach", 12.5, 2.55, 3.55, 27.8, "normc(1.00,0.02,0.95,1.05)", 1.7, 1.2, 4.0, 0.3),
        "motorcycle": VehicleKind("motorcycle", 2.2, 0.9, 1.5, 55.0, "normc(1.00,0.10,0.80,1.25)", 1.3, 4.0, 6.0),
        "bicycle": VehicleKind("bicycle", 1.8, 0.65, 1.7, 7.0, "normc(0.90,0.10,0.70,1.00)", 1.0, 1.2, 3.0),
    },
)
"""Vehicles by the name of their type."""

USUAL_MIX = (("car", 0.68), ("van", 0.14), ("truck", 0.15), ("coach", 0.03))
"""Default shares of types in traffic."""

TOWN_MIX = (("car", 0.84), ("van", 0.10), ("lorry", 0.06))
"""Shares of types in the traffic of streets."""

SLOW = ("truck", "coach", "bicycle")
"""Types that keep to the right lane."""


_LEAST_GAP = 0.5  # between two vehicles of a lane [m]


class _EdgeMeasures(Protocol):
    """What actors need to know of an edge: how many lanes it has, its length [m] and its limit [m/s]."""

    @property
    def lanes(self) -> int: ...
    @property
    def length(self) -> float: ...
    @property
    def limit(self) -> float: ...

    def index(self, number: int) -> int:
        """Number of a lane in SUMO; lanes are counted from the right, from 0."""


class Ways(Protocol):
    """Ways on which actors are placed: of a `Layout`, or on a network of a user's own."""

    @property
    def ways(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Ways by name."""

    def way(self, name: str) -> tuple[str, ...]:
        """Edges of a way."""

    def edge(self, name: str) -> _EdgeMeasures:
        """An edge by its id."""

    def between(self, one: str, other: str) -> float:
        """Length of the way across the junction between two edges [m]."""


@dataclass(frozen=True, slots=True)
class Relation:
    """Where an actor is as seen from another."""

    other: str  # The other's id
    gap: float  # Gap between bumpers [m]; negative behind the other; where `is_beside`, of the front bumpers
    is_beside: bool = False  # Whether the front bumpers count


@dataclass(frozen=True, slots=True)
class Actor:
    """A vehicle that a scenario places."""

    name: str  # Its id
    kind: str = "car"  # One of `VEHICLE_KINDS`
    way: str = "same_way"  # Way that it takes
    lane: int = 0  # Number of its lane from the right; negative ones count from the left
    # Position of its front bumper along its way [m], or where it is as seen from another
    place: float | Relation = 200.0
    # Speed with which it begins and which it keeps where it can [m/s]; None for what its road and type allow
    speed: float | None = None
    depart: float = 0.0  # When it appears [s]
    stands: bool = False  # Whether it stands still for good

    @property
    def length(self) -> float:
        """Length of the vehicle [m]."""
        return VEHICLE_KINDS[self.kind].length


@dataclass(frozen=True, slots=True)
class Placed:
    """An actor where it begins."""

    actor: Actor  # The actor
    position: float  # Position of its front bumper along its way [m]


class PlacementError(InputError):
    """An actor that cannot be where it is to be."""

    def __init__(self, actor: str, message: str) -> None:
        super().__init__(f"{actor}: {message}")
        self.actor = actor
        self.message = message


def place_actors(actors: Sequence[Actor]) -> tuple[Placed, ...]:
    """Positions of actors along their ways."""
    by_name = {actor.name: actor for actor in actors}
    return tuple(Placed(actor, _position(actor, by_name, ())) for actor in actors)


def _position(actor: Actor, by_name: Mapping[str, Actor], asked: tuple[str, ...]) -> float:
    relation = actor.place
    if not isinstance(relation, Relation):
        return relation
    if actor.name in asked:
        raise PlacementError(actor.name, f"is placed relative to itself, through {', '.join(asked)}")
    other = by_name.get(relation.other)
    if other is None:
        raise PlacementError(actor.name, f"there is no actor {relation.other!r}; {suggest(relation.other, by_name)}")
    if other.way != actor.way:
        message = f"is on the way {actor.way!r}, and {other.name!r} on {other.way!r}; give a position in its place"
        raise PlacementError(actor.name, message)
    place = _position(other, by_name, (*asked, actor.name))
    if relation.is_beside:
        return place + relation.gap
    return place + relation.gap + (actor.length if relation.gap >= 0 else -other.length)


def check_placement(placed: Sequence[Placed], layout: Ways) -> None:
    """Refuse actors that lie off their way or in one another."""
    ways = dict(layout.ways)
    for one in placed:
        actor = one.actor
        if actor.way not in ways:
            raise PlacementError(actor.name, f"the road has no way {actor.way!r}; {suggest(actor.way, ways)}")
        length = way_length(layout, actor.way)
        if not actor.length <= one.position <= length:
            room = f"{actor.length:g} … {length:.0f} m"
            raise PlacementError(actor.name, f"must begin within {room} of its way, got {one.position:.0f} m")
        edge, _ = edge_at(layout, actor.way, one.position)
        lanes = layout.edge(edge).lanes
        if not lanes:
            raise PlacementError(actor.name, f"edge {edge!r} has no lane for vehicles, only for pedestrians")
        if not -lanes <= actor.lane < lanes:
            raise PlacementError(actor.name, f"there are lanes 0 to {lanes - 1}, got {actor.lane}")
    _check_apart(placed, layout)


def _check_apart(placed: Sequence[Placed], layout: Ways) -> None:
    for number, one in enumerate(placed):
        for other in placed[:number]:
            if one.actor.depart != other.actor.depart or _lane(one, layout) != _lane(other, layout):
                continue
            ahead, behind = (one, other) if one.position > other.position else (other, one)
            gap = ahead.position - ahead.actor.length - behind.position
            if gap < _LEAST_GAP:
                message = (
                    f"must begin at least {_LEAST_GAP:g} m from {other.actor.name!r} in the same lane, got {gap:.1f} m"
                )
                raise PlacementError(one.actor.name, message)


def _lane(one: Placed, layout: Ways) -> tuple[str, int]:
    lanes = layout.edge(edge_at(layout, one.actor.way, one.position)[0]).lanes
    return one.actor.way, one.actor.lane % lanes


def edge_at(layout: Ways, way: str, position: float) -> tuple[str, float]:
    """Edge of a way at a position, and the position along that edge [m] (`position` [m])."""
    names = layout.way(way)
    for name, following in itertools.pairwise(names):
        length, across = layout.edge(name).length, layout.between(name, following)
        if position <= length + across:
            # No one begins within a junction.
            return name, min(position, length)
        position -= length + across
    return names[-1], min(position, layout.edge(names[-1]).length)


def way_length(layout: Ways, way: str) -> float:
    """Length of a way, junctions included [m]."""
    names = layout.way(way)
    across = (layout.between(one, other) for one, other in itertools.pairwise(names))
    return sum(layout.edge(name).length for name in names) + sum(across)


_MOST_BYTES = 2_000_000_000


@dataclass(frozen=True, slots=True)
class _KnownEdge:
    """What is known of an edge."""

    lanes: int  # How many lanes it has, next to footways
    length: float  # Its length [m]
    limit: float  # Its speed limit [m/s]
    footways: int = 0  # How many footways lie to the right of its lanes

    def index(self, number: int) -> int:
        """Number of a lane in SUMO, which counts footways, too."""
        return number + self.footways


@dataclass(frozen=True, slots=True)
class KnownWays:
    """Ways on a network."""

    ways: tuple[tuple[str, tuple[str, ...]], ...]  # The ways by name
    edges: Mapping[str, _KnownEdge]  # What is known of their edges; those that the network does not have are missing

    def way(self, name: str) -> tuple[str, ...]:
        """Edges of a way; none where there is no such way."""
        return dict(self.ways).get(name, ())

    def edge(self, name: str) -> _KnownEdge:
        """An edge by its id."""
        return self.edges[name]

    def between(self, one: str, other: str) -> float:  # noqa: ARG002 - as of `Ways`
        """Length of the way across the junction between two edges, which is not looked up: 0."""
        return 0.0


def read_ways(net: Path, ways: Mapping[str, tuple[str, ...]]) -> KnownWays:
    """Read what a network says of the edges of ways."""
    reader = _Reader(frozenset(edge for edges in ways.values() for edge in edges))
    try:
        read_elements(net, reader, _MOST_BYTES)
    except InputError:
        # SUMO reports what is wrong with it.
        return KnownWays(tuple(ways.items()), {})
    return KnownWays(tuple(ways.items()), reader.edges)


class _Reader:
    """Reads edges as they come."""

    def __init__(self, wanted: frozenset[str]) -> None:
        self.is_done = False
        self.edges: dict[str, _KnownEdge] = {}
        self._wanted = wanted
        self._edge = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "edge":
            self._edge = attributes.get("id", "")
        elif tag == "lane" and self._edge in self._wanted:
            before = self.edges.get(self._edge, _KnownEdge(0, 0.0, 0.0))
            is_footway = attributes.get("allow") == "pedestrian"
            measures = (float(attributes.get("length", "")), float(attributes.get("speed", "")))
            self.edges[self._edge] = _KnownEdge(
                before.lanes + (not is_footway), *measures, before.footways + is_footway
            )
        elif tag == "connection":
            # All edges stand before the connections between them.
            self.is_done = True

    def end(self, tag: str) -> None:
        pass
