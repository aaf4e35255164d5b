"""SUMO's network files, as netconvert writes them: `MSNet` reads what stands there, and nothing is computed anew."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from fogsim.traffic.templates.alignment import Points
from fogsim.traffic.templates.crossing_ways import CrossingWay, line_length
from fogsim.traffic.templates.junction import Junction, junctions
from fogsim.traffic.templates.net_plan import Edge, NetPlan, Phase
from fogsim.traffic.templates.xml_text import element, opening

_HEADER = """<?xml version="1.0" encoding="UTF-8"?>
<net version="1.20" junctionCornerDetail="5" limitTurnSpeed="5.50">
"""


def net_text(plan: NetPlan) -> str:
    """Text of a network file.

    Parameters
    ----------
    plan : NetPlan
        The network.
    """
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
    return _HEADER + "\n".join(f"    {line}" for line in lines) + "\n</net>\n"


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
    for number in range(edge.lanes):
        yield "    " + _lane(edge.name, number, edge.limit, edge.length, edge.lane_width, edge.lane(number))
    yield "</edge>"


def _lane(edge: str, number: int, limit: float, length: float, width: float, line: Points) -> str:
    return element(
        "lane",
        id=f"{edge}_{number}",
        index=number,
        speed=f"{limit:.2f}",
        length=f"{length:.2f}",
        width=f"{width:.2f}",
        shape=_shape(line),
    )


InternalLane = tuple[str, int, Points]
"""Internal edge, number of a lane in it, and the lane's line [m]."""


def _parts(node: Junction, number: int) -> list[InternalLane]:
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


def _internal_edges(node: Junction) -> Iterator[str]:
    lanes = list[tuple[InternalLane, CrossingWay]]()
    for number, way in enumerate(node.ways):
        lanes += [(part, way) for part in _parts(node, number)]
    for name, members in itertools.groupby(sorted(lanes, key=_internal_place), key=lambda lane: lane[0][0]):
        yield opening("edge", id=name, function="internal")
        for (_, number, line), way in members:
            length = max(0.1, line_length(line))
            yield "    " + _lane(name, number, way.limit, length, way.target.lane_width, line)
        yield "</edge>"


def _internal_place(lane: tuple[InternalLane, CrossingWay]) -> tuple[int, int]:
    name, number, _ = lane[0]
    return int(name.rpartition("_")[2]), number


def _junction(node: Junction) -> Iterator[str]:
    x, y, z = node.place.tolist()
    last = [_parts(node, number)[-1][:2] for number in range(len(node.ways))]
    place = {"x": f"{x:.2f}", "y": f"{y:.2f}", **({"z": f"{z:.3f}"} if z else {})}
    incoming = [f"{edge.name}_{number}" for edge in node.incoming for number in range(edge.lanes)]
    yield opening(
        "junction",
        id=node.name,
        type=node.kind,
        **place,
        incLanes=" ".join(incoming),
        intLanes=" ".join(f"{name}_{lane}" for name, lane in last),
        shape=_shape(node.outline()),
    )
    for number in range(len(node.ways)):
        yield "    " + element(
            "request",
            index=number,
            response=_bits(node.yields[number]),
            foes=_bits(node.meets[number]),
            cont=int(node.waits_at[number] is not None),
        )
    yield "</junction>"


def _bits(flags: Sequence[bool]) -> str:
    """One character for each way, the first one last."""
    return "".join(str(int(flag)) for flag in reversed(flags))


def _internal_junctions(node: Junction) -> Iterator[str]:
    """Where it is waited within the junction: for vehicles on lanes that lead to it, and on internal lanes."""
    for number, share in enumerate(node.waits_at):
        if share is None:
            continue
        way = node.ways[number]
        met = [n for n, meeting in enumerate(node.meets[number]) if meeting]
        lanes = dict.fromkeys(_lane_from(node.ways[n]) for n in met if node.ways[n].is_opposite(way))
        x, y, _ = _parts(node, number)[0][2][-1].tolist()
        yield element(
            "junction",
            id=f"{node.second_part(number)[0]}_0",
            type="internal",
            x=f"{x:.2f}",
            y=f"{y:.2f}",
            incLanes=" ".join([_entry(node, number), *lanes]),
            intLanes=" ".join(_entry(node, n) for n in met),
        )


def _entry(node: Junction, number: int) -> str:
    edge, lane = node.entry(number)
    return f"{edge}_{lane}"


def _lane_from(way: CrossingWay) -> str:
    return f"{way.link.source}_{way.link.from_lane}"


def _connections(node: Junction) -> Iterator[str]:
    for number, way in enumerate(node.ways):
        signals: dict[str, object] = {"tl": node.name, "linkIndex": number} if node.has_signals else {}
        states = "Oo" if node.has_signals else "Mm"
        state = states[any(node.yields[number])]
        yield _connection(way.link.source, way.link.from_lane, way, via=_entry(node, number), **signals, state=state)
    for number, way in enumerate(node.ways):
        parts = _parts(node, number)
        for (name, lane, _), following in itertools.zip_longest(parts, parts[1:]):
            on: dict[str, object] = {} if following is None else {"via": f"{following[0]}_{following[1]}"}
            yield _connection(name, lane, way, **on, state="M" if following is None else "m")


def _connection(source: str, lane: int, way: CrossingWay, **further: object) -> str:
    link = way.link
    ends: dict[str, object] = {"from": source, "to": link.target, "fromLane": lane, "toLane": link.to_lane}
    return element("connection", **ends, dir=link.direction, **further)


def _signals(node: Junction, phases: Sequence[Phase]) -> Iterator[str]:
    yield opening("tlLogic", id=node.name, type="static", programID="0", offset="0")
    for phase in phases:
        states = [_signal(node, number, phase) for number in range(len(node.ways))]
        yield "    " + element("phase", duration=f"{phase.duration:g}", state="".join(states))
    yield "</tlLogic>"


def _signal(node: Junction, number: int, phase: Phase) -> str:
    """Signal of a way: green that must let others go first is a small letter."""
    if node.ways[number].link.source not in phase.greens:
        return "r"
    if phase.state == "y":
        return "y"
    yields = zip(node.yields[number], node.ways, strict=True)
    return "g" if any(yielded and way.link.source in phase.greens for yielded, way in yields) else "G"
