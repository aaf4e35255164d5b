"""What a network consists of before it is written: edges, what connects them, and signals."""

import itertools
import math
from dataclasses import dataclass

from fogsim.traffic.templates.alignment import Axis, Points


@dataclass(frozen=True, slots=True)
class Edge:
    """One direction of a road between two nodes."""

    # name, start, end: its id, and those of the nodes that it leads from and to
    name: str
    start: str
    end: str
    axis: Axis  # Its left border, as far as the junctions at its ends
    lanes: int  # How many lanes it has
    lane_width: float  # Width of each [m]
    limit: float  # Speed limit [m/s]
    priority: int = 1  # At junctions the edge of more priority goes first
    footway: float = 0.0  # Width of the footway to its right [m]; 0 for none

    def lane(self, number: int) -> Points:
        """Centreline of a lane (n, 3) [m]."""
        return self.axis.beside(-(self.lanes - number - 0.5) * self.lane_width)

    def index(self, number: int) -> int:
        """Number of a lane in SUMO, where a footway is lane 0."""
        return number + (self.footway > 0.0)

    def lane_id(self, number: int) -> str:
        """Id of a lane."""
        return f"{self.name}_{self.index(number)}"

    @property
    def width(self) -> float:
        """Width of all its lanes [m]."""
        return self.lanes * self.lane_width

    @property
    def outer_width(self) -> float:
        """Width of all its lanes and its footway [m]."""
        return self.width + self.footway

    @property
    def length(self) -> float:
        """Length of its middle [m]."""
        middle = self.axis.beside(-0.5 * self.width)
        return sum(math.dist(one, other) for one, other in itertools.pairwise(middle))


@dataclass(frozen=True, slots=True)
class Link:
    """A way across a node from a lane to a lane."""

    # source, target: ids of the edges
    source: str
    target: str
    # from_lane, to_lane: numbers of the lanes
    from_lane: int = 0
    to_lane: int = 0
    direction: str = "s"  # ``s`` straight on, ``l`` left, ``r`` right


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of traffic lights."""

    duration: float  # How long it lasts [s]
    greens: tuple[str, ...]  # Edges that have green
    state: str = "G"  # ``G`` for green, ``y`` for the yellow after it
    walks: bool = False  # Whether persons may begin to cross the roads that do not have green


@dataclass(frozen=True, slots=True)
class ZebraPlan:
    """Where persons cross a road at a node."""

    node: str  # The node
    # into, away: ids of the edges that it crosses: the one that leads to the node, and the one that leads away
    into: str
    away: str


@dataclass(frozen=True, slots=True)
class NetPlan:
    """A network."""

    edges: tuple[Edge, ...]  # Its edges
    links: tuple[Link, ...] = ()  # What connects them
    signals: tuple[tuple[str, tuple[Phase, ...]], ...] = ()  # Traffic lights by node, as pairs
    zebras: tuple[ZebraPlan, ...] = ()  # Where persons cross
