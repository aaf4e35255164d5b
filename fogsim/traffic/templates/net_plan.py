"""What a network consists of before it is written: edges, what connects them, and signals."""

import itertools
import math
from dataclasses import dataclass

from fogsim.traffic.templates.alignment import Axis, Points


@dataclass(frozen=True, slots=True)
class Edge:
    """One direction of a road between two nodes.

    Attributes
    ----------
    name, start, end : str
        Its id, and those of the nodes that it leads from and to.
    axis : Axis
        Its left border, as far as the junctions at its ends.
    lanes : int
        How many lanes it has.
    lane_width : float
        Width of each [m].
    limit : float
        Speed limit [m/s].
    priority : int
        At junctions the edge of more priority goes first.
    """

    name: str
    start: str
    end: str
    axis: Axis
    lanes: int
    lane_width: float
    limit: float
    priority: int = 1

    def lane(self, number: int) -> Points:
        """Centreline of a lane (n, 3) [m].

        Parameters
        ----------
        number : int
            Its number from the right, from 0.
        """
        return self.axis.beside(-(self.lanes - number - 0.5) * self.lane_width)

    @property
    def width(self) -> float:
        """Width of all its lanes [m]."""
        return self.lanes * self.lane_width

    @property
    def length(self) -> float:
        """Length of its middle [m]."""
        middle = self.axis.beside(-0.5 * self.width)
        return sum(math.dist(one, other) for one, other in itertools.pairwise(middle))


@dataclass(frozen=True, slots=True)
class Link:
    """A way across a node from a lane to a lane.

    Attributes
    ----------
    source, target : str
        Ids of the edges.
    from_lane, to_lane : int
        Numbers of the lanes.
    direction : str
        ``s`` straight on, ``l`` left, ``r`` right.
    """

    source: str
    target: str
    from_lane: int = 0
    to_lane: int = 0
    direction: str = "s"


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of traffic lights.

    Attributes
    ----------
    duration : float
        How long it lasts [s].
    greens : tuple of str
        Edges that have green.
    state : str
        ``G`` for green, ``y`` for the yellow after it.
    """

    duration: float
    greens: tuple[str, ...]
    state: str = "G"


@dataclass(frozen=True, slots=True)
class NetPlan:
    """A network.

    Attributes
    ----------
    edges : tuple of Edge
        Its edges.
    links : tuple of Link
        What connects them.
    signals : mapping from node to phases
        Traffic lights by node, as pairs.
    """

    edges: tuple[Edge, ...]
    links: tuple[Link, ...] = ()
    signals: tuple[tuple[str, tuple[Phase, ...]], ...] = ()


@dataclass(frozen=True, slots=True)
class Layout:
    """A road of a template: its network, and the ways that traffic takes on it.

    Attributes
    ----------
    net : NetPlan
        The network.
    ways : mapping from name to edge ids, as pairs
        Ways by name: ``same_way``, which is the ego's, ``oncoming``, and others that the template has.
    beyond : float
        How far the road goes on to the left of a way's left border: median and oncoming lanes [m].
    tunnel : tuple of (Axis, float) or None
        Left border of the ego's way in a tunnel, and the tunnel's height [m].
    """

    net: NetPlan
    ways: tuple[tuple[str, tuple[str, ...]], ...]
    beyond: float = 0.0
    tunnel: tuple[Axis, float] | None = None

    def way(self, name: str) -> tuple[str, ...]:
        """Edges of a way; none where there is no such way.

        Parameters
        ----------
        name : str
            Its name.
        """
        return dict(self.ways).get(name, ())

    def edge(self, name: str) -> Edge:
        """An edge by its id.

        Parameters
        ----------
        name : str
            The id.
        """
        return next(edge for edge in self.net.edges if edge.name == name)

    def length(self, way: str) -> float:
        """Length of a way's edges [m].

        Parameters
        ----------
        way : str
            Its name.
        """
        return sum(self.edge(name).length for name in self.way(way))
