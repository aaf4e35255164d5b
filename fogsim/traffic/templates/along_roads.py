"""Roads without junctions: a motorway, a straight road, a curve, a grade, a country road."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from fogsim.errors import InputError
from fogsim.traffic.templates.alignment import Axis, Bend, axis_of
from fogsim.traffic.templates.footpaths import STOP_TO_ZEBRA, ZEBRA_WIDTH
from fogsim.traffic.templates.layout import Layout
from fogsim.traffic.templates.net_plan import Edge, Link, NetPlan, ZebraPlan

SAME_WAY, ONCOMING = "same_way", "oncoming"
"""Names of the ego's way and of that of the oncoming traffic, and of the edges on them."""

_START = (0.0, 0.0, math.radians(20.0))
"""Where a road begins, and in which direction: no axis of the image or of the map is any road's."""

_CREST_RADIUS = 3000.0  # of vertical curves [m]
_SPIRAL_SHARE = 1.0 / 6.0  # length of a spiral by the radius that it leads to
_PRIORITY = 10
_ZEBRA_GAP = 2.0 * STOP_TO_ZEBRA + ZEBRA_WIDTH  # in the carriageway's edges, for a crossing on foot [m]
_CUT_GAP = 1.0  # for nothing but the footway to go on [m]
_BESIDE_ZEBRA = 15.0  # cuts are no nearer to one [m]
_BETWEEN_ZEBRAS = 40.0  # [m]


def _chain(name: str, axes: Sequence[Axis], nodes: Sequence[str], road: "_AlongRoad", lanes: int) -> tuple[Edge, ...]:
    """Edges of one direction, end to end: ``name``, ``name.1`` and so on."""
    names = [name, *(f"{name}.{number}" for number in range(1, len(nodes) - 1))]
    return tuple(
        Edge(own, *between, part, lanes, road.lane_width, road.limit, _PRIORITY)
        for own, between, part in zip(names, itertools.pairwise(nodes), axes, strict=True)
    )


def straight_links(edges: Sequence[Edge]) -> list[Link]:
    """Connections of edges that follow one another, lane to lane."""
    return [
        Link(one.name, other.name, lane, lane) for one, other in itertools.pairwise(edges) for lane in range(one.lanes)
    ]


@dataclass(frozen=True, slots=True)
class _AlongRoad:
    """A road with one curve and one grade at most; what a template leaves open is a straight, level country road.

    Lengths are in m, the limit in m/s, grades positive if they climb, and turns in rad, to the right if negative.
    Without oncoming lanes it is a road of one direction. Vertical curves belong to the length of a grade.
    """

    length: float = 2000.0
    lanes: int = 1
    oncoming_lanes: int = 1
    lane_width: float = 3.5
    median: float = 0.0
    limit: float = 100.0 / 3.6
    curve_at: float = 400.0
    curve_radius: float = 400.0
    curve_turn: float = 0.0
    grade: float = 0.0
    grade_at: float = 300.0
    grade_length: float = 1000.0

    @property
    def free_length(self) -> float:
        """How far from its beginning the ego's way may be cut [m]."""
        return self.length

    def layout(self, cuts: Sequence[float] = ()) -> Layout:
        """The road, the ego's way cut into edges at stations [m]; InputError if its curve or grade is too long."""
        ends = [0.0, *sorted(cuts), self.length]
        return self.laid(list(itertools.pairwise(ends)))

    def laid(self, spans: Sequence[tuple[float, float]]) -> Layout:
        """The road in parts between stations [m]."""
        axis = self.axis()
        parts = [axis.part(*span) for span in spans]
        nodes = ["begin", *(f"cut{number}" for number in range(1, len(parts))), "end"]
        edges = list(_chain(SAME_WAY, [part.moved(-0.5 * self.median) for part in parts], nodes, self, self.lanes))
        ways = [(SAME_WAY, tuple(edge.name for edge in edges))]
        links = straight_links(edges)
        if self.oncoming_lanes:
            back = self._oncoming(axis, parts, nodes)
            edges, links = [*edges, *back], [*links, *straight_links(back)]
            ways.append((ONCOMING, tuple(edge.name for edge in back)))
        return Layout(NetPlan(tuple(edges), tuple(links)), tuple(ways), self.beyond)

    def _oncoming(self, axis: Axis, parts: Sequence[Axis], nodes: Sequence[str]) -> tuple[Edge, ...]:
        """The other direction: where both share a line they share their nodes, by which that is known."""
        if self.median:
            parts, nodes = [axis], [f"{ONCOMING}.end", f"{ONCOMING}.begin"]
        axes = [part.moved(0.5 * self.median).reversed() for part in reversed(parts)]
        return _chain(ONCOMING, axes, nodes[::-1], self, self.oncoming_lanes)

    @property
    def beyond(self) -> float:
        """How far the road goes on to the left of the ego's left border [m]."""
        return self.median + self.oncoming_lanes * self.lane_width

    def axis(self) -> Axis:
        """Its middle."""
        return axis_of(self.bends(), self.grades(), _START)

    def bends(self) -> list[Bend]:
        """Its plan; InputError if its curve does not end on it."""
        if not self.curve_turn:
            return [Bend(self.length)]
        curve = spirals_and_arc(self.curve_radius, self.curve_turn)
        rest = self.length - self.curve_at - sum(bend.length for bend in curve)
        if rest <= 0.0:
            raise InputError(f"the curve ends {-rest:.0f} m beyond the road, which is {self.length:g} m long")
        before = [Bend(self.curve_at)] if self.curve_at else []
        return [*before, *curve, Bend(rest)]

    def grades(self) -> list[tuple[float, float]]:
        """Its profile: stations [m] and grades [-]; InputError if its grade is too short, or does not end on it."""
        if not self.grade:
            return []
        eased, end = abs(self.grade) * _CREST_RADIUS, self.grade_at + self.grade_length
        if end > self.length:
            raise InputError(
                f"the grade ends {end - self.length:.0f} m beyond the road, which is {self.length:g} m long"
            )
        if 2.0 * eased > self.grade_length:
            raise InputError(f"the grade must be at least {2.0 * eased:g} m long, got {self.grade_length:g} m")
        at = self.grade_at
        return [(at, 0.0), (at + eased, self.grade), (end - eased, self.grade), (end, 0.0)]


def spirals_and_arc(radius: float, turn: float) -> list[Bend]:
    """A curve: a spiral into it, an arc, and a spiral out of it (`radius` [m], `turn` [rad])."""
    curvature = math.copysign(1.0 / radius, turn)
    spiral = min(_SPIRAL_SHARE * radius, 0.5 * radius * abs(turn))
    arc = radius * abs(turn) - spiral
    return [Bend(spiral, 0.0, curvature), Bend(arc, curvature, curvature), Bend(spiral, curvature, 0.0)]


@dataclass(frozen=True, slots=True)
class Motorway(_AlongRoad):
    """A motorway with two carriageways."""

    length: float = 3000.0
    lanes: int = 2
    oncoming_lanes: int = 2
    lane_width: float = 3.75
    median: float = 4.0
    limit: float = 130.0 / 3.6


@dataclass(frozen=True, slots=True)
class _WalkedRoad(_AlongRoad):
    """A road that may have footways to the right of either direction, and zebra crossings at stations [m]."""

    footways: bool = False
    footway_width: float = 2.0
    zebra_crossings: tuple[float, ...] = ()

    def layout(self, cuts: Sequence[float] = ()) -> Layout:
        """The road; see `_AlongRoad.layout`."""
        zebras = sorted(self.zebra_crossings)
        self._check_zebras(zebras)
        if not self.footways:
            return _AlongRoad.layout(self, cuts)
        # Where persons cross the road is cut anyhow.
        far = [cut for cut in cuts if all(abs(cut - zebra) > _BESIDE_ZEBRA for zebra in zebras)]
        gaps = sorted([*((zebra, _ZEBRA_GAP) for zebra in zebras), *((cut, _CUT_GAP) for cut in far)])
        starts = [0.0, *(at + 0.5 * gap for at, gap in gaps)]
        ends = [*(at - 0.5 * gap for at, gap in gaps), self.length]
        plain = self.laid(list(zip(starts, ends, strict=True)))
        ways = dict(plain.ways)
        crossed = [number for number, (at, _) in enumerate(gaps, 1) if at in zebras]
        planned = tuple(
            ZebraPlan(f"cut{number}", ways[SAME_WAY][number - 1], ways[ONCOMING][-number]) for number in crossed
        )
        edges = tuple(replace(edge, footway=self.footway_width) for edge in plain.net.edges)
        return replace(plain, net=replace(plain.net, edges=edges, zebras=planned))

    def _check_zebras(self, zebras: Sequence[float]) -> None:
        if not zebras:
            return
        if not self.footways:
            raise InputError("zebra_crossings go with footways: true, which is missing")
        if self.median or not self.oncoming_lanes:
            raise InputError("zebra_crossings need a road of two directions without a median")
        for one, other in itertools.pairwise([0.0, *zebras, self.length]):
            if other - one < _BETWEEN_ZEBRAS:
                raise InputError(
                    f"zebra_crossings must be {_BETWEEN_ZEBRAS:g} m from one another and from both ends of the road, "
                    f"which is {self.length:g} m long; got {one:g} and {other:g} m"
                )


@dataclass(frozen=True, slots=True)
class Straight(_WalkedRoad):
    """A straight, level road of two lanes."""


@dataclass(frozen=True, slots=True)
class Curve(_WalkedRoad):
    """A road of two lanes with a curve to the left."""

    curve_radius: float = 250.0
    curve_turn: float = math.radians(70.0)


@dataclass(frozen=True, slots=True)
class Grade(_WalkedRoad):
    """A road of two lanes that climbs."""

    grade: float = 0.04


@dataclass(frozen=True, slots=True)
class Rural(_WalkedRoad):
    """A country road that winds, to the right and to the left in turn, and goes up and down.

    Its curves and grades follow one another along the whole road, and have the measures of one curve and one grade.
    """

    length: float = 3000.0
    lane_width: float = 3.25
    curve_at: float = 250.0
    curve_radius: float = 320.0
    curve_turn: float = math.radians(40.0)
    grade: float = 0.025
    grade_at: float = 150.0
    grade_length: float = 300.0

    def bends(self) -> list[Bend]:
        """Its plan: a straight before each curve, as far as whole curves fit."""
        bends, left, side = list[Bend](), self.length, -1.0
        while self.curve_turn:
            curve = spirals_and_arc(self.curve_radius, side * self.curve_turn)
            needed = self.curve_at + sum(bend.length for bend in curve)
            if needed >= left:
                break
            bends += [*([Bend(self.curve_at)] if self.curve_at else []), *curve]
            left, side = left - needed, -side
        return [*bends, Bend(left)]

    def grades(self) -> list[tuple[float, float]]:
        """Its profile: up and down in turn."""
        if not self.grade:
            return []
        half = 0.5 * self.grade_length
        count = max(1, math.floor((self.length - self.grade_at) / half))
        return [(self.grade_at + half * n, self.grade * math.sin(0.5 * math.pi * n)) for n in range(count)]


@dataclass(frozen=True, slots=True)
class Tunnel(_AlongRoad):
    """A road of two lanes with a tunnel."""

    limit: float = 80.0 / 3.6
    tunnel_at: float = 500.0
    tunnel_length: float = 400.0
    tunnel_height: float = 5.2

    def layout(self, cuts: Sequence[float] = ()) -> Layout:
        """The road; see `_AlongRoad.layout`."""
        end = self.tunnel_at + self.tunnel_length
        if end > self.length:
            raise InputError(
                f"the tunnel ends {end - self.length:.0f} m beyond the road, which is {self.length:g} m long"
            )
        plain = _AlongRoad.layout(self, cuts)
        inside = self.axis().moved(-0.5 * self.median).part(self.tunnel_at, end)
        return replace(plain, tunnel=(inside, self.tunnel_height))
