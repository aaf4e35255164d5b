"""A road of a template: its network, its ways, its tunnel."""

from dataclasses import dataclass

from fogsim.traffic.templates.alignment import Axis
from fogsim.traffic.templates.crossing_ways import CrossingWay
from fogsim.traffic.templates.net_plan import Edge, NetPlan


@dataclass(frozen=True, slots=True)
class Layout:
    """A road of a template: its network, and the ways that traffic takes on it."""

    net: NetPlan  # The network
    # Ways by name: ``same_way``, which is the ego's, ``oncoming``, and others that the template has
    ways: tuple[tuple[str, tuple[str, ...]], ...]
    beyond: float = 0.0  # How far the road goes on to the left of a way's left border: median and oncoming lanes [m]
    tunnel: tuple[Axis, float] | None = None  # Left border of the ego's way in a tunnel, and the tunnel's height [m]

    def way(self, name: str) -> tuple[str, ...]:
        """Edges of a way; none where there is no such way."""
        return dict(self.ways).get(name, ())

    def edge(self, name: str) -> Edge:
        """An edge by its id."""
        return next(edge for edge in self.net.edges if edge.name == name)

    def between(self, one: str, other: str) -> float:
        """Length of the way across the junction between two edges [m]."""
        across = (link for link in self.net.links if (link.source, link.target) == (one, other))
        return CrossingWay(next(across), self.edge(one), self.edge(other)).length
