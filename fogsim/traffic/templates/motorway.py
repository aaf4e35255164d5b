"""Roads without junctions: a motorway, and roads of two directions beside each other."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from fogsim.traffic.templates.alignment import Axis, Bend, axis_of
from fogsim.traffic.templates.net_plan import Edge, Layout, Link, NetPlan

SAME_WAY, ONCOMING = "same_way", "oncoming"
"""Names of the ego's way and of that of the oncoming traffic, and of the edges on them."""


@dataclass(frozen=True, slots=True)
class CrossSection:
    """What a road has across.

    Attributes
    ----------
    lanes, oncoming_lanes : int
        Lanes of either direction; 0 oncoming ones for a road of one direction.
    lane_width, median : float
        Width of each, and distance between the two directions' inner borders [m].
    limit : float
        Speed limit [m/s].
    """

    lanes: int
    oncoming_lanes: int
    lane_width: float
    median: float
    limit: float


def road_without_junctions(axis: Axis, section: CrossSection, cuts: Sequence[float] = ()) -> Layout:
    """Both directions of a road.

    Parameters
    ----------
    axis : Axis
        Its middle.
    section : CrossSection
        What it has across.
    cuts : sequence of float
        Stations at which its first direction is cut into edges [m].
    """
    ahead = axis.moved(-0.5 * section.median)
    edges = list(cut_edges(SAME_WAY, ahead, section, section.lanes, cuts))
    links = straight_links(edges)
    ways = [(SAME_WAY, tuple(edge.name for edge in edges))]
    if section.oncoming_lanes:
        back = axis.moved(0.5 * section.median).reversed()
        edges += cut_edges(ONCOMING, back, section, section.oncoming_lanes)
        ways.append((ONCOMING, (ONCOMING,)))
    return Layout(NetPlan(tuple(edges), tuple(links)), tuple(ways))


def cut_edges(name: str, axis: Axis, section: CrossSection, lanes: int, cuts: Sequence[float] = ()) -> tuple[Edge, ...]:
    """Edges of one direction, end to end: ``name``, ``name.1`` and so on.

    Parameters
    ----------
    name : str
        Id of the first.
    axis : Axis
        Their left border.
    section : CrossSection
        What they have across.
    lanes : int
        How many lanes they have.
    cuts : sequence of float
        Stations between them [m].
    """
    ends = [float(axis.stations[0]), *sorted(cuts), float(axis.stations[-1])]
    count = len(ends) - 1
    names = [name, *(f"{name}.{number}" for number in range(1, count))]
    nodes = [f"{name}.begin", *(f"{name}.cut{number}" for number in range(1, count)), f"{name}.end"]
    return tuple(
        Edge(own, *between, axis.part(*span), lanes, section.lane_width, section.limit, priority=10)
        for own, between, span in zip(names, itertools.pairwise(nodes), itertools.pairwise(ends), strict=True)
    )


def straight_links(edges: Sequence[Edge]) -> list[Link]:
    """Connections of edges that follow one another, lane to lane.

    Parameters
    ----------
    edges : sequence of Edge
        The edges, with as many lanes each.
    """
    return [
        Link(one.name, other.name, lane, lane) for one, other in itertools.pairwise(edges) for lane in range(one.lanes)
    ]


@dataclass(frozen=True, slots=True)
class Motorway:
    """A motorway with two carriageways, straight or with one bend.

    Attributes
    ----------
    length : float
        Length [m].
    lanes, oncoming_lanes, lane_width, median, limit
        As of `CrossSection`.
    """

    length: float = 3000.0
    lanes: int = 2
    oncoming_lanes: int = 2
    lane_width: float = 3.75
    median: float = 4.0
    limit: float = 130.0 / 3.6

    def layout(self, cuts: Sequence[float] = ()) -> Layout:
        """The road.

        Parameters
        ----------
        cuts : sequence of float
            Stations at which the ego's way is cut into edges [m].
        """
        section = CrossSection(self.lanes, self.oncoming_lanes, self.lane_width, self.median, self.limit)
        return road_without_junctions(axis_of([Bend(self.length)], (), (0.0, 0.0, math.radians(20.0))), section, cuts)

    @property
    def free_length(self) -> float:
        """How far from its beginning the ego's way may be cut [m]."""
        return self.length
