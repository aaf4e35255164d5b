"""Who drives on a road: route files with actors, a road that is full when a run begins, and who comes after."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fogsim.traffic.templates.layout import Layout
from fogsim.traffic.templates.net_plan import Edge
from fogsim.traffic.templates.on_foot import Footfall, Walker, walkers_text
from fogsim.traffic.templates.placement import SLOW, VEHICLE_KINDS, Placed, VehicleKind, Ways, edge_at
from fogsim.traffic.templates.xml_text import element, opening

_END = 1_000_000  # of flows [s]
_MEAN_SHARE_OF_LIMIT = 0.9
_GAP = 2.0  # time gap to others that who gives way wants next to SUMO's, with which some collide [s]
_ROOM = 30.0  # around actors, kept free in their lanes [m]
_SHORTEST = 25.0  # edge that is filled [m]


@dataclass(frozen=True, slots=True)
class Demand:
    """Traffic next to the actors."""

    flows: tuple[tuple[str, float], ...]  # (str, float): Vehicles per second [1/s] by way
    mix: tuple[tuple[str, float], ...]  # (str, float): Shares of types, together 1
    turning: float = 0.2  # Share that turns where roads meet, half to either side [-]


def cuts_around(placed: Sequence[Placed], length: float) -> tuple[float, ...]:
    """Where the ego's way is cut so that actors' lanes stay free around and between them, and the rest fills [m]."""
    if not placed:
        return ()
    first = min(one.position - one.actor.length for one in placed) - _ROOM
    last = max(one.position for one in placed) + _ROOM
    return tuple(cut for cut in (first, last) if _SHORTEST < cut < length - _SHORTEST)


def routes_text(
    layout: Layout,
    demand: Demand,
    placed: Sequence[Placed],
    walkers: Sequence[Walker] = (),
    footfall: Footfall = Footfall(),  # noqa: B008 - a constant
) -> str:
    """Text of a route file."""
    lines = [*_types(demand.mix, max(edge.lanes for edge in layout.net.edges)), *_actors(placed, layout)]
    taken = _taken_lanes(layout, placed)
    for way, rate in _rates(layout, demand):
        lines += _filling(layout, way, rate, taken)
        lines += _flows(layout, way, rate)
    return _routes([*lines, *walkers_text(layout, walkers, footfall)])


def actors_text(ways: Ways, placed: Sequence[Placed]) -> str:
    """Text of a route file with actors alone."""
    return _routes(list(_actors(placed, ways)))


def _routes(lines: Sequence[str]) -> str:
    return '<?xml version="1.0" encoding="UTF-8"?>\n<routes>\n' + "\n".join(lines) + "\n</routes>\n"


def _actors(placed: Sequence[Placed], ways: Ways) -> Iterator[str]:
    for one in sorted(placed, key=lambda one: one.actor.depart):
        yield from _actor(one, ways)


def _rates(layout: Layout, demand: Demand) -> Iterator[tuple[str, float]]:
    """Flows of ways [1/s], those that turn apart."""
    for way, rate in demand.flows:
        turning = [f"{way}.{side}" for side in ("left", "right") if layout.way(f"{way}.{side}")]
        shares = {way: 1.0 - demand.turning if turning else 1.0, **dict.fromkeys(turning, 0.5 * demand.turning)}
        yield from ((name, share * rate) for name, share in shares.items() if share * rate > 0.0)


def _taken_lanes(layout: Layout, placed: Sequence[Placed]) -> set[tuple[str, int]]:
    """Edges and lanes that stay free: those of actors, and those between actors of one lane."""
    taken = set[tuple[str, int]]()
    reached = dict[tuple[str, int], int]()
    for one in sorted(placed, key=lambda one: one.position):
        names = layout.way(one.actor.way)
        name, _ = edge_at(layout, one.actor.way, one.position)
        lane, place = one.actor.lane % layout.edge(name).lanes, names.index(name)
        first = reached.get((one.actor.way, lane), place)
        taken.update((between, lane) for between in names[first : place + 1])
        reached[one.actor.way, lane] = place
    return taken


def _types(mix: Sequence[tuple[str, float]], lanes: int) -> Iterator[str]:
    """Types of the traffic: those of the right lane, and those of the others, where the slow ones do not drive."""
    slow = math.fsum(share for name, share in mix if name in SLOW)
    right = min(1.0, slow * lanes)
    quick = 1.0 - slow
    in_lane: dict[str, dict[str, float]] = {"right": {}, "left": {}}
    for name, share in mix:
        in_lane["right"][name] = share * right / slow if name in SLOW else share * (1 - right) / quick
        in_lane["left"][name] = 0.0 if name in SLOW and quick > 0 else share / (quick or 1.0)
    for place, shares in in_lane.items():
        yield opening("vTypeDistribution", id=f"mix.{place}")
        for name, share in shares.items():
            if share > 0.0:
                yield "    " + _type(f"{name}.{place}", VEHICLE_KINDS[name], probability=f"{share:.4f}")
        yield "</vTypeDistribution>"


def _type(name: str, kind: VehicleKind, **further: object) -> str:
    written = {
        "vClass": kind.vehicle_class,
        "length": kind.length,
        "width": kind.width,
        "height": kind.height,
        "maxSpeed": kind.top_speed,
        "speedFactor": kind.speed_factor,
        "tau": kind.headway,
        "accel": kind.acceleration,
        "decel": kind.deceleration,
        "sigma": kind.imperfection,
        "jmTimegapMinor": _GAP,
    }
    return element("vType", id=name, **(written | further))


def _actor(one: Placed, layout: Ways) -> Iterator[str]:
    actor = one.actor
    edge, position = edge_at(layout, actor.way, one.position)
    way = layout.way(actor.way)
    kind = VEHICLE_KINDS[actor.kind]
    speed = min(layout.edge(edge).limit, kind.top_speed) if actor.speed is None else actor.speed
    steady = {"speedFactor": "1.0", "speedDev": "0", "sigma": "0"}
    if actor.speed:
        # What it is to keep it also keeps where the limit is lower; SUMO refuses a maximum of 0.
        steady |= {
            "maxSpeed": f"{max(speed, 0.001):.3f}",
            "speedFactor": f"{max(1.0, speed / layout.edge(edge).limit):.3f}",
        }
    lane = actor.lane % layout.edge(edge).lanes
    yield _type(f"type.{actor.name}", kind, **steady)
    yield element("route", id=f"route.{actor.name}", edges=" ".join(way))
    yield opening(
        "vehicle",
        id=actor.name,
        type=f"type.{actor.name}",
        route=f"route.{actor.name}",
        depart=f"{actor.depart:g}",
        # The whole way is its route, along which places count.
        departEdge=way.index(edge),
        departLane=layout.edge(edge).index(lane),
        departPos=f"{position:.2f}",
        departSpeed="0" if actor.stands else f"{speed:.3f}",
        # Where actors are at first has been checked; who comes later comes when there is room.
        insertionChecks="all" if actor.depart else "none",
    )
    if actor.stands:
        yield "    " + element(
            "stop", lane=f"{edge}_{layout.edge(edge).index(lane)}", endPos=f"{position:.2f}", duration=_END
        )
    yield "</vehicle>"


def _filling(layout: Layout, way: str, rate: float, taken: set[tuple[str, int]]) -> Iterator[str]:
    """Vehicles that are there from the beginning, anywhere on the edges of a way."""
    names = layout.way(way)
    due = 0.0
    for place, name in enumerate(names):
        edge = layout.edge(name)
        if edge.length < _SHORTEST:
            continue
        route = f"route.{way}.{place}"
        yield element("route", id=route, edges=" ".join(names[place:]))
        for lane in range(edge.lanes):
            due += edge.length * rate / edge.lanes / (_MEAN_SHARE_OF_LIMIT * edge.limit)
            if (name, lane) in taken:
                due = 0.0
            count, due = math.floor(due), due % 1.0
            if count:
                there = {"begin": "0", "end": "0.001", "number": count, "departPos": "random_free"}
                yield _flow(f"{way}.there.{place}.{lane}", route, (lane, edge), there)


def _flows(layout: Layout, way: str, rate: float) -> Iterator[str]:
    """Vehicles that come at the beginning of a way, at times between which nothing is remembered."""
    first = layout.edge(layout.way(way)[0])
    if first.length < _SHORTEST:
        yield element("route", id=f"route.{way}.0", edges=" ".join(layout.way(way)))
    for lane in range(first.lanes):
        coming = {"begin": "0", "end": _END, "period": f"exp({rate / first.lanes:.6f})", "departPos": "base"}
        yield _flow(f"{way}.{lane}", f"route.{way}.0", (lane, first), coming)


def _flow(name: str, route: str, place: tuple[int, Edge], times: Mapping[str, object]) -> str:
    lane, edge = place
    mix = "mix.right" if lane == 0 else "mix.left"
    return element("flow", id=name, type=mix, route=route, departLane=edge.index(lane), departSpeed="desired", **times)
