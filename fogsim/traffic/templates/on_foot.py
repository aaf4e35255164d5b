"""Who is on foot on a road: persons that a scenario places, and those who walk along footways and cross at random."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fogsim.traffic.templates.footpaths import STOP_TO_ZEBRA, ZEBRA_WIDTH
from fogsim.traffic.templates.layout import Layout
from fogsim.traffic.templates.net_plan import Edge, ZebraPlan
from fogsim.traffic.templates.placement import PlacementError, edge_at, way_length
from fogsim.traffic.templates.xml_text import element, opening

WALKING_SPEED = 5.0 / 3.6
"""Default walking speed of persons [m/s]."""

_WAITING_SPEED = 1e-3
"""Speed of a person who waits for an order to walk [m/s]: SUMO's persons do not stand still on a footway."""

_BESIDE = 15.0  # from a crossing to where those who cross come from, and go to [m]
_NEAR = 15.0  # as far as this from a crossing's middle a place means that crossing [m]
_SHORTEST = 25.0  # footway on which persons are from the beginning [m]
_SPEEDS = "normc(1.00,0.12,0.70,1.40)"  # shares of the walking speed
_TYPE = "person.demand"


@dataclass(frozen=True, slots=True)
class Walker:
    """A person that a scenario places."""

    name: str  # Its id
    way: str = "same_way"  # Way next to which it walks
    is_left: bool = False  # Whether it begins on the footway to the left of the road
    position: float = 200.0  # Where along that way it begins [m]
    speed: float = WALKING_SPEED  # How fast it walks [m/s]
    depart: float = 0.0  # When it appears [s]
    # Place along that way of the crossing that it takes [m]; None if it walks on to the end of the way
    crosses_at: float | None = None
    waits: bool = False  # Whether it waits where it begins until an action makes it walk


@dataclass(frozen=True, slots=True)
class Footfall:
    """Persons next to those that a scenario places."""

    along: float = 0.0  # Persons who walk along each footway, in both directions together [1/s]
    across: float = 0.0  # Persons who cross at each crossing, from both sides together [1/s]
    until: float = 600.0  # When the last of them come [s]: SUMO makes all persons of a flow when it reads it


def walkers_text(layout: Layout, walkers: Sequence[Walker], footfall: Footfall) -> list[str]:
    """Elements of a route file of all who are on foot."""
    lines = list[str]()
    if footfall.along or footfall.across:
        lines.append(_person_type(_TYPE, WALKING_SPEED, _SPEEDS))
    for way, names in layout.ways:
        if footfall.along and "." not in way and all(layout.edge(name).footway for name in names):
            lines += _along(layout, way, (0.5 * footfall.along, footfall.until))
    for zebra in layout.net.zebras if footfall.across else ():
        lines += _across(zebra, (0.5 * footfall.across, footfall.until))
    # SUMO reads no further than the time that it needs: who comes later stands last.
    return lines + [line for walker in sorted(walkers, key=lambda one: one.depart) for line in _walker(walker, layout)]


def _person_type(name: str, speed: float, factor: str) -> str:
    return element(
        "vType", id=name, vClass="pedestrian", width="0.6", length="0.4", maxSpeed=f"{speed:.4f}", speedFactor=factor
    )


def _walker(walker: Walker, layout: Layout) -> Iterator[str]:
    _check(walker, layout)
    edge, position = _beside(walker, layout)
    end = _crossed(walker, layout) if walker.crosses_at is not None else _onward(walker, layout)
    yield _person_type(f"type.{walker.name}", _WAITING_SPEED if walker.waits else walker.speed, "1.0")
    yield opening(
        "person", id=walker.name, type=f"type.{walker.name}", depart=f"{walker.depart:g}", departPos=f"{position:.2f}"
    )
    yield "    " + element("walk", from_=edge.name, to=end[0], arrivalPos=f"{end[1]:.2f}")
    yield "</person>"


def _check(walker: Walker, layout: Layout) -> None:
    if not layout.way(walker.way):
        ways = ", ".join(dict(layout.ways))
        raise PlacementError(walker.name, f"the road has no way {walker.way!r}; it has {ways}")
    if not any(edge.footway for edge in layout.net.edges):
        raise PlacementError(walker.name, "a person needs a footway, and the road has none; give road.footways: true")
    length = way_length(layout, walker.way)
    if not 0.0 <= walker.position <= length:
        raise PlacementError(
            walker.name, f"must begin within 0 … {length:.0f} m of its way, got {walker.position:.0f} m"
        )


def _beside(walker: Walker, layout: Layout) -> tuple[Edge, float]:
    """Edge next to which a person begins, and where along it [m]."""
    name, position = edge_at(layout, walker.way, walker.position)
    edge = layout.edge(name)
    return (_opposite(layout, edge, walker.name), edge.length - position) if walker.is_left else (edge, position)


def _opposite(layout: Layout, edge: Edge, who: str) -> Edge:
    """The other direction of the road, to whose right lies the footway to the left."""
    for other in layout.net.edges:
        if (other.start, other.end) == (edge.end, edge.start):
            return other
    raise PlacementError(who, "the road has no footway on its left side")


def _onward(walker: Walker, layout: Layout) -> tuple[str, float]:
    """Where a person arrives who walks along the way: at its end."""
    last = layout.edge(layout.way(walker.way)[-1])
    return (_opposite(layout, last, walker.name).name, 0.0) if walker.is_left else (last.name, last.length)


def _crossed(walker: Walker, layout: Layout) -> tuple[str, float]:
    """Where a person arrives who crosses: on the other side of the road, next to the crossing."""
    zebra = _zebra(walker, layout)
    at = zebra_places(layout, walker.way)[zebra]
    names = layout.way(walker.way)
    is_before = walker.position <= at
    edges = [layout.edge(name) for name in names]
    adjacent = next(edge for edge in edges if (edge.end if is_before else edge.start) == zebra.node)
    opposite = _opposite(layout, adjacent, walker.name)
    others = [one for one in layout.net.zebras if one.node == zebra.node and one != zebra]
    if others and {adjacent.name, opposite.name} != {zebra.into, zebra.away}:
        raise PlacementError(walker.name, "cannot cross there without another crossing before it; begin at that road")
    beyond = adjacent if walker.is_left else opposite
    starts_there = beyond.start == zebra.node
    return beyond.name, min(_BESIDE, beyond.length) if starts_there else max(beyond.length - _BESIDE, 0.0)


def _zebra(walker: Walker, layout: Layout) -> ZebraPlan:
    places = zebra_places(layout, walker.way)
    wanted = walker.crosses_at or 0.0
    if not places:
        raise PlacementError(walker.name, "crosses_at needs a crossing, and the way has none; give zebra_crossings")
    zebra = min(places, key=lambda one: abs(places[one] - wanted))
    if abs(places[zebra] - wanted) > _NEAR:
        there = ", ".join(f"{place:.0f} m" for place in sorted(places.values()))
        raise PlacementError(
            walker.name, f"crosses_at: there is no crossing at {wanted:g} m; there are some at {there}"
        )
    return zebra


def zebra_places(layout: Layout, way: str) -> dict[ZebraPlan, float]:
    """Crossings over a way, with the place of their middles along it [m]."""
    found, passed = dict[ZebraPlan, float](), 0.0
    aside = STOP_TO_ZEBRA + 0.5 * ZEBRA_WIDTH
    names = layout.way(way)
    for place, name in enumerate(names):
        if place:
            passed += layout.between(names[place - 1], name)
        end = passed + layout.edge(name).length
        found |= {zebra: end + aside for zebra in layout.net.zebras if zebra.into == name}
        found |= {zebra: passed - aside for zebra in layout.net.zebras if zebra.away == name}
        passed = end
    return found


def _along(layout: Layout, way: str, flow: tuple[float, float]) -> Iterator[str]:
    """Persons on the footway to the right of a way, so many per second in either direction [1/s] until a time [s]."""
    names, (rate, until) = layout.way(way), flow
    for sense, ordered in (("", names), (".back", names[::-1])):
        due = 0.0
        for name in ordered:
            length = layout.edge(name).length
            due += rate * length / WALKING_SPEED
            count, due = math.floor(due), due % 1.0
            if count and length >= _SHORTEST:
                there = {"begin": "0", "end": "0.001", "number": count, "departPos": "random"}
                yield from _flow(f"{way}.walks{sense}.{name}", there, (name, ordered[-1]), "random")
        first, last = layout.edge(ordered[0]), layout.edge(ordered[-1])
        start, end = (first.length, 0.0) if sense else (0.0, last.length)
        coming = {"begin": "0", "end": f"{until:g}", "period": f"exp({rate:.6f})", "departPos": f"{start:.2f}"}
        yield from _flow(f"{way}.walks{sense}", coming, (first.name, last.name), f"{end:.2f}")


def _across(zebra: ZebraPlan, flow: tuple[float, float]) -> Iterator[str]:
    """Persons who cross, so many per second from either side [1/s] until a time [s]."""
    coming = {"begin": "0", "end": f"{flow[1]:g}", "period": f"exp({flow[0]:.6f})"}
    near, far = f"-{_BESIDE:g}", f"{_BESIDE:g}"
    for one, other, start, end in ((zebra.into, zebra.away, near, far), (zebra.away, zebra.into, far, near)):
        yield from _flow(f"{zebra.node}.{one}.crosses", {**coming, "departPos": start}, (one, other), end)


def _flow(name: str, times: Mapping[str, object], ends: tuple[str, str], arrival: str) -> Iterator[str]:
    yield opening("personFlow", id=name, type=_TYPE, **times)
    yield "    " + element("walk", from_=ends[0], to=ends[1], arrivalPos=arrival)
    yield "</personFlow>"
