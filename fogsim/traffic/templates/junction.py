"""Junctions as SUMO has them: ways across in their order, right of way, internal lanes, outlines."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fogsim.traffic.templates.alignment import Points
from fogsim.traffic.templates.crossing_ways import CrossingWay, clockwise_from_north, curve, waiting_place
from fogsim.traffic.templates.footpaths import WalkingArea, Zebra, place_before, walking_areas
from fogsim.traffic.templates.net_plan import Edge, NetPlan

_TURNS = {"r": 0, "s": 1, "l": 2}
_ONE_ARM = 0.9  # cosine of the angle between two edges of one road
_SHORT = 0.5  # no curve is drawn over less than this [m]
_FARTHER = 20.0  # how far out the direction is taken in which an edge lies [m]


@dataclass(frozen=True, slots=True)
class Junction:
    """A node of a network."""

    name: str  # Its id
    # incoming, outgoing: edges that lead to it, clockwise from north, and from it
    incoming: tuple[Edge, ...]
    outgoing: tuple[Edge, ...]
    ways: tuple[CrossingWay, ...]  # Ways across it in the order of their numbers
    meets: tuple[tuple[bool, ...], ...]  # Which ways, and then crossings of persons, meet which
    yields: tuple[tuple[bool, ...], ...]  # Which ways, and then crossings, let which go first
    waits_at: tuple[float | None, ...]  # Share of each way after which it is waited within the junction
    has_signals: bool  # Whether it has traffic lights
    zebras: tuple[Zebra, ...] = ()  # Crossings of persons, in the order of their numbers
    areas: tuple[WalkingArea, ...] = ()  # What joins its footways

    @property
    def place(self) -> Points:
        """Its middle (3,) [m]."""
        ends = [edge.axis.points[-1] for edge in self.incoming] + [edge.axis.points[0] for edge in self.outgoing]
        middle: Points = np.mean(ends, axis=0)
        return middle

    @property
    def kind(self) -> str:
        """SUMO's type of it."""
        return "dead_end" if not self.ways else "traffic_light" if self.has_signals else "priority"

    def entry(self, number: int) -> tuple[str, int]:
        """Internal edge with which a way begins, and the number of its lane there."""
        first = number
        while first and self._run_in_background(first - 1, number):
            first -= 1
        return f":{self.name}_{first}", number - first

    def _run_in_background(self, number: int, other: int) -> bool:
        """Whether two ways are lanes of one internal edge."""
        one, two = self.ways[number].link, self.ways[other].link
        waits = self.waits_at[number] is not None or self.waits_at[other] is not None
        return (one.source, one.target) == (two.source, two.target) and not waits

    def second_part(self, number: int) -> tuple[str, int]:
        """Internal edge with which a way goes on from where it is waited, and the number of its lane there."""
        before = sum(share is not None for share in self.waits_at[:number])
        return f":{self.name}_{len(self.ways) + before}", 0

    def outline(self) -> Points:
        """Its border (n, 3), counterclockwise [m]: ends of edges, and curves from one to the next."""
        ends = [_End.of(edge, arriving=True) for edge in self.incoming]
        ends += [_End.of(edge, arriving=False) for edge in self.outgoing]
        ends.sort(key=lambda end: end.angle_from(self.place))
        points = list[Points]()
        for end, following in zip(ends, [*ends[1:], ends[0]], strict=True):
            points += [end.right, end.left]
            are_one_arm = math.cos(end.inward - following.inward) > _ONE_ARM
            if not are_one_arm and math.dist(following.right, end.left) > _SHORT:
                points += list(curve(end.left, end.inward, following.right, following.inward + math.pi)[1:-1])
        return np.array(points)


@dataclass(frozen=True, slots=True)
class _End:
    """Where an edge meets its node: its borders as seen from the node, and the direction into the node."""

    right: Points
    left: Points
    inward: float

    @classmethod
    def of(cls, edge: Edge, *, arriving: bool) -> "_End":
        inner, outer = edge.axis.points, edge.axis.beside(-edge.outer_width)
        if arriving:
            return cls(inner[-1], outer[-1], float(edge.axis.headings[-1]))
        return cls(outer[0], inner[0], float(edge.axis.headings[0]) + math.pi)

    def angle_from(self, place: Points) -> float:
        """Direction from a node's place to where the edge lies [rad]."""
        outward = -_FARTHER * np.array([math.cos(self.inward), math.sin(self.inward), 0.0])
        away = 0.5 * (self.right + self.left) + outward - place
        return math.atan2(away[1], away[0])


def junctions(plan: NetPlan) -> Iterator[Junction]:
    """Nodes of a network."""
    edges = {edge.name: edge for edge in plan.edges}
    lit = {name for name, _ in plan.signals}
    for name in dict.fromkeys(itertools.chain.from_iterable((edge.start, edge.end) for edge in plan.edges)):
        incoming = sorted((edge for edge in plan.edges if edge.end == name), key=clockwise_from_north)
        outgoing = tuple(edge for edge in plan.edges if edge.start == name)
        order = {edge.name: number for number, edge in enumerate(incoming)}
        links = [link for link in plan.links if link.source in order and edges[link.target].start == name]
        links.sort(key=lambda link: (order[link.source], link.from_lane, _TURNS[link.direction], link.to_lane))
        ways = tuple(CrossingWay(link, edges[link.source], edges[link.target]) for link in links)
        planned = sorted((one for one in plan.zebras if one.node == name), key=lambda one: order[one.into])
        zebras = tuple(Zebra(f":{name}_c{k}", edges[one.into], edges[one.away]) for k, one in enumerate(planned))
        yield _junction(name, (tuple(incoming), outgoing), (ways, zebras), name in lit)


def _junction(
    name: str,
    around: tuple[tuple[Edge, ...], tuple[Edge, ...]],
    across: tuple[tuple[CrossingWay, ...], tuple[Zebra, ...]],
    has_signals: bool,
) -> Junction:
    ways, zebras = across
    meets = tuple(tuple(way is not other and way.meets(other) for other in ways) for way in ways)
    yields = [
        [met and way.yields_to(other) for met, other in zip(row, ways, strict=True)]
        for row, way in zip(meets, ways, strict=True)
    ]
    lit = has_signals
    waits = tuple(_waits_at(number, across, (meets[number], yields[number]), lit) for number in range(len(ways)))
    if has_signals:
        # Who waited within the junction leaves it when the lights have changed: those who have green then let him.
        for row, met, way in zip(yields, meets, ways, strict=True):
            for place, (other, share) in enumerate(zip(ways, waits, strict=True)):
                row[place] |= share is not None and met[place] and way.source.priority != other.source.priority
    # Whoever drives lets those who cross on foot go first.
    walked = [tuple(zebra.is_met_by(way) for zebra in zebras) for way in ways]
    all_meet = [(*met, *crossed) for met, crossed in zip(meets, walked, strict=True)]
    all_meet += [(*(row[k] for row in walked), *(False for _ in zebras)) for k in range(len(zebras))]
    all_yield = [(*row, *crossed) for row, crossed in zip(yields, walked, strict=True)]
    all_yield += [(False,) * (len(ways) + len(zebras)) for _ in zebras]
    areas = walking_areas(name, around, zebras)
    return Junction(name, *around, ways, tuple(all_meet), tuple(all_yield), waits, has_signals, zebras, areas)


def _waits_at(
    number: int,
    across: tuple[Sequence[CrossingWay], Sequence[Zebra]],
    rows: tuple[Sequence[bool], Sequence[bool]],
    has_signals: bool,
) -> float | None:
    """Where a way is waited on within the junction: who turns left off the main road, or at lights, lets pass.

    Where persons cross, no one waits within a junction without lights, and at lights who turns right waits for them.
    """
    ways, zebras = across
    way = ways[number]
    if zebras and not has_signals:
        return None
    if way.link.direction == "r":
        crossed = [zebra for zebra in zebras if zebra.away == way.target]
        return place_before(way, crossed[0]) if crossed else None
    met, yielded = ([other for other, flag in zip(ways, row, strict=True) if flag] for row in rows)
    may_wait = has_signals or way.source.priority == max(other.source.priority for other in ways)
    if way.link.direction != "l" or not may_wait or not any(other.is_opposite(way) for other in yielded):
        return None
    return waiting_place(way, met)
