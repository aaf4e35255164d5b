"""SUMO's network files, as netconvert writes them: `MSNet` reads what stands there, and nothing is computed again."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fogsim.traffic.templates.alignment import Points
from fogsim.traffic.templates.footpaths import ZEBRA_WIDTH, WalkingArea, Zebra, place_before, walking_areas
from fogsim.traffic.templates.layout import CrossingWay, clockwise_from_north, curve, line_length, waiting_place
from fogsim.traffic.templates.net_plan import Edge, NetPlan, Phase
from fogsim.traffic.templates.xml_text import element, opening

_TURNS = {"r": 0, "s": 1, "l": 2}
_ONE_ARM = 0.9  # cosine of the angle between two edges of one road
_SHORT = 0.5  # no curve is drawn over less than this [m]
_FARTHER = 20.0  # how far out the direction is taken in which an edge lies [m]


@dataclass(frozen=True, slots=True)
class _Junction:
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


def junctions(plan: NetPlan) -> Iterator[_Junction]:
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
        yield _made_junction(name, (tuple(incoming), outgoing), (ways, zebras), name in lit)


def _made_junction(
    name: str,
    around: tuple[tuple[Edge, ...], tuple[Edge, ...]],
    across: tuple[tuple[CrossingWay, ...], tuple[Zebra, ...]],
    has_signals: bool,
) -> _Junction:
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
    return _Junction(name, *around, ways, tuple(all_meet), tuple(all_yield), waits, has_signals, zebras, areas)


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


_ON_FOOT, _NOT_ON_FOOT = {"allow": "pedestrian"}, {"disallow": "pedestrian"}
_ALL: Mapping[str, str] = {}
_ZEBRA_SIGHT = 100  # from so far drivers see whether somebody crosses; SUMO's 4.5 m is for corners [m]
_ON_FOOT_LIMIT = 10.0 / 3.6  # of crossings and walking areas, which is netconvert's [m/s]
_HEADER = """<?xml version="1.0" encoding="UTF-8"?>
<net version="1.20" junctionCornerDetail="5" limitTurnSpeed="5.50">
"""


def net_text(plan: NetPlan) -> str:
    """Text of a network file."""
    nodes = list(junctions(plan))
    lines = [_location(plan)]
    for node in nodes:
        lines += _internal_edges(node)
    for edge in plan.edges:
        lines += _edge(edge)
    for node in nodes:
        if node.has_signals:
            lines += _signals(node, dict(plan.signals)[node.name])
    for node in nodes:
        lines += _junction(node)
    for node in nodes:
        lines += _internal_junctions(node)
    for node in nodes:
        lines += _connections(node)
    header = _HEADER.replace("limit", 'walkingareas="true" limit') if any(node.areas for node in nodes) else _HEADER
    return header + "\n".join(f"    {line}" for line in lines) + "\n</net>\n"


def _location(plan: NetPlan) -> str:
    points = np.concatenate([edge.axis.points for edge in plan.edges])
    (west, south), (east, north) = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    bounds = f"{west:.2f},{south:.2f},{east:.2f},{north:.2f}"
    return element("location", netOffset="0.00,0.00", convBoundary=bounds, origBoundary=bounds, projParameter="!")


def _shape(line: Points) -> str:
    level = bool(np.all(line[:, 2] == 0.0))
    return " ".join(f"{x:.2f},{y:.2f}" if level else f"{x:.2f},{y:.2f},{z:.3f}" for x, y, z in line.tolist())


def _edge(edge: Edge) -> Iterator[str]:
    yield opening("edge", id=edge.name, from_=edge.start, to=edge.end, priority=edge.priority)
    if edge.footway:
        middle = edge.axis.beside(-edge.width - 0.5 * edge.footway)
        yield "    " + _lane(edge.name, 0, edge.limit, edge.length, edge.footway, middle, _ON_FOOT)
    others = _NOT_ON_FOOT if edge.footway else _ALL
    for number in range(edge.lanes):
        lane = (edge.index(number), edge.limit, edge.length, edge.lane_width, edge.lane(number))
        yield "    " + _lane(edge.name, *lane, others)
    yield "</edge>"


def _lane(
    edge: str, number: int, limit: float, length: float, width: float, line: Points, allowed: Mapping[str, str]
) -> str:
    return element(
        "lane",
        id=f"{edge}_{number}",
        index=number,
        **allowed,
        speed=f"{limit:.2f}",
        length=f"{length:.2f}",
        width=f"{width:.2f}",
        shape=_shape(line),
    )


_InternalLane = tuple[str, int, Points]
"""Internal edge, number of a lane in it, and the lane's line [m]."""


def _parts(node: _Junction, number: int) -> list[_InternalLane]:
    """Internal lanes of a way: two where it is waited within the junction."""
    way, share = node.ways[number], node.waits_at[number]
    if share is None:
        return [(*node.entry(number), way.line)]
    first, second = _split(way.line, share)
    return [(*node.entry(number), first), (*node.second_part(number), second)]


def _split(line: Points, share: float) -> tuple[Points, Points]:
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = share * along[-1]
    point = np.array([[np.interp(at, along, line[:, k]) for k in range(3)]])
    return np.concatenate([line[along < at], point]), np.concatenate([point, line[along > at]])


def _internal_edges(node: _Junction) -> Iterator[str]:
    lanes = list[tuple[_InternalLane, CrossingWay]]()
    for number, way in enumerate(node.ways):
        lanes += [(part, way) for part in _parts(node, number)]
    for name, members in itertools.groupby(sorted(lanes, key=_internal_place), key=lambda lane: lane[0][0]):
        yield opening("edge", id=name, function="internal")
        for (_, number, line), way in members:
            length = max(0.1, line_length(line))
            others = _NOT_ON_FOOT if way.source.footway else _ALL
            yield "    " + _lane(name, number, way.limit, length, way.target.lane_width, line, others)
        yield "</edge>"
    for zebra in node.zebras:
        yield opening("edge", id=zebra.name, function="crossing", crossingEdges=f"{zebra.away.name} {zebra.into.name}")
        length = line_length(zebra.line)
        yield "    " + _lane(zebra.name, 0, _ON_FOOT_LIMIT, length, ZEBRA_WIDTH, zebra.line, _ON_FOOT)
        yield "</edge>"
    for area in node.areas:
        yield opening("edge", id=area.name, function="walkingarea")
        outline = area.outline
        length = max(0.1, math.dist(outline[0], outline[-1]))
        yield "    " + _lane(area.name, 0, _ON_FOOT_LIMIT, length, area.into.footway, outline, _ON_FOOT)
        yield "</edge>"


def _internal_place(lane: tuple[_InternalLane, CrossingWay]) -> tuple[int, int]:
    name, number, _ = lane[0]
    return int(name.rpartition("_")[2]), number


def _junction(node: _Junction) -> Iterator[str]:
    x, y, z = node.place.tolist()
    last = [_parts(node, number)[-1][:2] for number in range(len(node.ways))]
    place = {"x": f"{x:.2f}", "y": f"{y:.2f}", **({"z": f"{z:.3f}"} if z else {})}
    incoming = [f"{edge.name}_{number}" for edge in node.incoming for number in range(edge.index(edge.lanes))]
    incoming += [f"{_area_before(node, zebra).name}_0" for zebra in node.zebras]
    yield opening(
        "junction",
        id=node.name,
        type=node.kind,
        **place,
        incLanes=" ".join(incoming),
        intLanes=" ".join([*(f"{name}_{lane}" for name, lane in last), *(f"{zebra.name}_0" for zebra in node.zebras)]),
        shape=_shape(node.outline()),
    )
    for number, met in enumerate(node.meets):
        waits = number < len(node.ways) and node.waits_at[number] is not None
        yield "    " + element(
            "request", index=number, response=_bits(node.yields[number]), foes=_bits(met), cont=int(waits)
        )
    yield "</junction>"


def _bits(flags: Sequence[bool]) -> str:
    """One character for each way, the first one last."""
    return "".join(str(int(flag)) for flag in reversed(flags))


def _internal_junctions(node: _Junction) -> Iterator[str]:
    """Where it is waited within the junction: for vehicles on lanes that lead to it, and on internal lanes."""
    for number, share in enumerate(node.waits_at):
        if share is None:
            continue
        way = node.ways[number]
        met = [n for n, meeting in enumerate(node.meets[number][: len(node.ways)]) if meeting]
        walked = [f"{zebra.name}_0" for zebra in node.zebras if zebra.is_met_by(way)]
        facing = (one for one in map(node.ways.__getitem__, met) if one.is_opposite(way))
        lanes = dict.fromkeys(one.source.lane_id(one.link.from_lane) for one in facing)
        x, y, _ = _parts(node, number)[0][2][-1].tolist()
        yield element(
            "junction",
            id=f"{node.second_part(number)[0]}_0",
            type="internal",
            x=f"{x:.2f}",
            y=f"{y:.2f}",
            incLanes=" ".join([_entry(node, number), *lanes]),
            intLanes=" ".join([*(_entry(node, n) for n in met), *walked]),
        )


def _entry(node: _Junction, number: int) -> str:
    edge, lane = node.entry(number)
    return f"{edge}_{lane}"


def _area_before(node: _Junction, zebra: Zebra) -> WalkingArea:
    """Where SUMO has a crossing begin: next to the edge that leads away."""
    return next(area for area in node.areas if area.away == zebra.away)


def _area_behind(node: _Junction, zebra: Zebra) -> WalkingArea:
    return next(area for area in node.areas if area.into == zebra.into)


def _connections(node: _Junction) -> Iterator[str]:
    for number, way in enumerate(node.ways):
        signals: dict[str, object] = {"tl": node.name, "linkIndex": number} if node.has_signals else {}
        states = "Oo" if node.has_signals else "Mm"
        state = states[any(node.yields[number])]
        first = way.source.index(way.link.from_lane)
        if any(node.yields[number]) and not any(node.yields[number][: len(node.ways)]):
            signals["visibility"] = _ZEBRA_SIGHT
        yield _connection(way.link.source, first, way, via=_entry(node, number), **signals, state=state)
    for number, way in enumerate(node.ways):
        parts = _parts(node, number)
        for (name, lane, _), following in itertools.zip_longest(parts, parts[1:]):
            on: dict[str, object] = {} if following is None else {"via": f"{following[0]}_{following[1]}"}
            yield _connection(name, lane, way, **on, state="M" if following is None else "m")
    for number, zebra in enumerate(node.zebras, len(node.ways)):
        signals = {"tl": node.name, "linkIndex": number} if node.has_signals else {}
        yield _path(_area_before(node, zebra).name, zebra.name, **signals)
        yield _path(zebra.name, _area_behind(node, zebra).name)
    for area in node.areas:
        yield _path(area.into.name, area.name)
        yield _path(area.name, area.away.name)


def _path(source: str, target: str, **signals: object) -> str:
    """Connection of persons."""
    ends: dict[str, object] = {"from": source, "to": target, "fromLane": 0, "toLane": 0}
    return element("connection", **ends, **signals, dir="s", state="M")


def _connection(source: str, lane: int, way: CrossingWay, **further: object) -> str:
    link = way.link
    to_lane = way.target.index(link.to_lane)
    ends: dict[str, object] = {"from": source, "to": link.target, "fromLane": lane, "toLane": to_lane}
    return element("connection", **ends, dir=link.direction, **further)


def _signals(node: _Junction, phases: Sequence[Phase]) -> Iterator[str]:
    yield opening("tlLogic", id=node.name, type="static", programID="0", offset="0")
    for phase in phases:
        states = [_signal(node, number, phase) for number in range(len(node.ways))]
        states += ["G" if phase.walks and zebra.into.name not in phase.greens else "r" for zebra in node.zebras]
        yield "    " + element("phase", duration=f"{phase.duration:g}", state="".join(states))
    yield "</tlLogic>"


def _signal(node: _Junction, number: int, phase: Phase) -> str:
    """Signal of a way: green that must let others go first is a small letter."""
    if node.ways[number].link.source not in phase.greens:
        return "r"
    if phase.state == "y":
        return "y"
    ways = zip(node.yields[number], node.ways, strict=False)
    yields = any(yielded and way.link.source in phase.greens for yielded, way in ways)
    # Who turns lets those go first who walk along the road that has green.
    walked = any(zebra.is_met_by(node.ways[number]) and zebra.into.name not in phase.greens for zebra in node.zebras)
    return "g" if yields or walked else "G"
