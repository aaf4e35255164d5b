"""Lanes of a network that netconvert made from an OpenDRIVE file, found by road, lane and s, or by coordinates."""

import heapq
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree.ElementTree import Element, fromstring

import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.xml_reader import read_tree
from fogsim.errors import InputError
from fogsim.traffic.road.configuration import is_true
from fogsim.traffic.road.opendrive import PlanView, is_opendrive, plan_view, read_opendrive

_FARTHEST_ROUTE, _LONGEST_LAPS = 50_000.0, 10_000.0
"""Lengths at which an endless route, and one that goes round and round, is cut off [m]."""

_ROUNDING = 0.01  # of places across a lane [m]
_STOREY = 2.0  # by which the heights of a road's lanes differ at most [m]
_NEAR_JUNCTION = 2.0
"""Distance by which a place inside a junction is moved to its end [m]."""

_Links = Mapping[tuple[str, int], Sequence[tuple[str, int]]]
"""Edge and index of lanes, and of those to which they lead."""

_TURNS = {"s": 0, "r": 1, "R": 1, "l": 2, "L": 2}
"""Directions of connections, in order of preference."""


@dataclass(frozen=True, slots=True)
class _RoadLane:
    """A lane by edge and index from the right: length, width [m], limit [m/s] and middle (n, 2) [m].

    `heights` are those of the middle's points [m]; `origins` are OpenDRIVE's ``road_lane``, several where they form one
    edge.
    """

    edge: str
    index: int
    length: float
    width: float
    limit: float
    shape: NDArray[np.float64]
    heights: NDArray[np.float64]
    origins: tuple[str, ...]

    def pieces(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Steps between points (n - 1, 2), and how long they are on the map and, as SUMO counts, on their slope [m]."""
        steps = np.diff(self.shape, axis=0)
        flat = np.hypot(steps[:, 0], steps[:, 1])
        return steps, flat, np.hypot(flat, np.diff(self.heights))


@dataclass(frozen=True, slots=True)
class Spot:
    """A place on a lane, by its distance from the start as SUMO counts it, and to the left of its middle [m]."""

    lane: _RoadLane
    position: float
    offset: float = 0.0

    @property
    def world(self) -> tuple[float, float, float]:
        """x, y [m] and heading [rad]."""
        steps, flat, lengths = self.lane.pieces()
        along = self.position * float(lengths.sum()) / self.lane.length
        ends = np.cumsum(lengths)
        piece = min(int(np.searchsorted(ends, along)), len(lengths) - 1)
        left = (along - (ends[piece] - lengths[piece])) * (flat[piece] / lengths[piece])
        (x, y), (dx, dy) = self.lane.shape[piece], steps[piece] / flat[piece]
        return float(x + left * dx - self.offset * dy), float(y + left * dy + self.offset * dx), math.atan2(dy, dx)

    @property
    def height(self) -> float:
        """Height of the lane there [m]."""
        ends = np.cumsum([0.0, *self.lane.pieces()[2]])
        return float(np.interp(self.position / self.lane.length * ends[-1], ends, self.lane.heights))

    def shifted(self, offset: float) -> "Spot":
        """The place so far to the left of the lane's middle [m]; ValueError if it is not in the lane."""
        if abs(offset) > 0.5 * self.lane.width + _ROUNDING:
            raise ValueError(f"{abs(offset):g} m from the middle is not in its lane, {self.lane.width:g} m wide")
        return replace(self, offset=offset)


class _RoadWidths:
    """Widths of all lanes of a road, for driving or not, along it."""

    def __init__(self, road: Element) -> None:
        self._road = road

    def middle(self, lane: str, s: float) -> float:
        """The t of the middle of a lane at s [m]; ValueError if there is no such lane."""
        section = _last_before(self._road.iterfind("lanes/laneSection"), "s", s)
        side = "right" if lane.startswith("-") else "left"
        inner = [] if section is None else list(section.iterfind(f"{side}/lane"))
        numbers = {int(one.get("id", "0")): one for one in inner}
        if section is None or (lane != "0" and (not lane.lstrip("-").isdecimal() or int(lane) not in numbers)):
            known = ", ".join(map(str, sorted(numbers))) or "none"
            raise ValueError(f"the {side} side of its road has no lane {lane!r}; it has {known}")
        sign, along = (-1 if side == "right" else 1), s - float(section.get("s", "0"))
        widths: list[float] = []
        for one in (numbers[sign * i] for i in range(1, abs(int(lane)) + 1)):
            if one.find("width") is None and one.find("border") is not None:
                widths.append(abs(_polynomial(one.iterfind("border"), "sOffset", along)) - math.fsum(widths))
            else:
                widths.append(_polynomial(one.iterfind("width"), "sOffset", along))
        t = _polynomial(self._road.iterfind("lanes/laneOffset"), "s", s)
        return t + sign * (math.fsum(widths) - 0.5 * widths[-1]) if widths else t


def _last_before(elements: Iterable[Element], key: str, s: float) -> Element | None:
    """The last of elements that begin at or before s, otherwise the first."""
    found = list(elements)
    return next((one for one in reversed(found) if float(one.get(key, "0")) <= s), found[0] if found else None)


def _polynomial(elements: Iterable[Element], key: str, s: float) -> float:
    """Value at s of the cubic that holds there [m]; 0 without one."""
    piece = _last_before(elements, key, s)
    if piece is None:
        return 0.0
    ds = s - float(piece.get(key, "0"))
    return math.fsum(float(piece.get(name, "0")) * ds**power for power, name in enumerate("abcd"))


@dataclass(frozen=True, slots=True)
class OpenDriveLanes:
    """Lanes for vehicles and their connections.

    `followers` are the next edges, the straight one first, and `links` the next lanes of each lane; `crossings` are the
    lengths of the ways to them across junctions [m]; `roads` are reference lines; latitude and longitude [rad] are None
    if the file has none; `moved` is what the network adds to the x, y of its source [m].
    """

    lanes: tuple[_RoadLane, ...]
    followers: Mapping[str, Sequence[str]]
    roads: Mapping[str, PlanView]
    latitude: float | None
    longitude: float | None
    crossings: Mapping[tuple[str, str], float] = field(default_factory=dict)
    widths: Mapping[str, "_RoadWidths"] = field(default_factory=dict)
    moved: tuple[float, float] = (0.0, 0.0)
    links: _Links = field(default_factory=dict)

    def on_lane(self, road: str, lane: str, s: float) -> Spot:
        """Place on a lane by OpenDRIVE's road, lane and s [m]; ValueError if it is not on the road."""
        x, y, _ = self._reference(road, s)
        found = [one for one in self.lanes if f"{road}_{lane}" in one.origins]
        if not found:
            known = sorted(
                o.removeprefix(f"{road}_") for one in self.lanes for o in one.origins if o.startswith(f"{road}_")
            )
            raise ValueError(f"road {road!r} has no lane {lane!r} to drive on; it has {', '.join(known) or 'none'}")
        # Across the road, the reference point is projected onto each lane.
        return min((_foot(one, x, y) for one in found), key=lambda found: found[0])[1]

    def across(self, road: str, s: float, t: float) -> tuple[float, float, float]:
        """x, y [m] and heading [rad] at s along a road's reference line and t to its left [m]."""
        x, y, heading = self._reference(road, s)
        return x - t * math.sin(heading), y + t * math.cos(heading), heading + (math.pi if t > 0.0 else 0.0)

    def middle(self, road: str, lane: str, s: float) -> float:
        """The t of the middle of any lane, for driving or not, at s of its road [m]; ValueError if there is none."""
        self._reference(road, s)
        return self.widths[road].middle(lane, s)

    def at(self, x: float, y: float, heading: float | None, road: str = "", z: float | None = None) -> Spot:
        """Place on the nearest lane that leads in the direction `heading` [rad] (None for any); ValueError if none.

        Of roads on top of one another it is on `road`, or on that nearest to the height z [m].
        """
        feet = [_foot(one, x, y) for one in self.lanes]
        fit = [(d, spot) for d, spot in feet if heading is None or math.cos(spot.world[2] - heading) > 0.0]
        found = [(d, spot) for d, spot in fit if d <= 0.5 * spot.lane.width + _ROUNDING]
        if not found:
            away = f"; the nearest is {min(d for d, _ in fit):.1f} m away" if fit else ""
            raise ValueError(f"({x:g}, {y:g}) is on no lane that leads there{away}")
        on_road = [one for one in found if road in [origin.rpartition("_")[0] for origin in one[1].lane.origins]]
        found = on_road or found
        heights = [spot.height for _, spot in found]
        if z is None and max(heights) - min(heights) > _STOREY:
            several = f"at ({x:g}, {y:g}) are roads {min(heights):.1f} m and {max(heights):.1f} m high"
            raise ValueError(f"{several}; give z, or a position on one of them")
        level = min(heights, key=lambda height: abs(height - (z or 0.0)))
        near = [one for one, height in zip(found, heights, strict=True) if abs(height - level) <= _STOREY]
        return _aside(min(near, key=lambda one: one[0])[1], x, y)

    def nearest(self, x: float, y: float) -> Spot | None:
        """Place on the nearest lane, whatever its direction; None off the lanes."""
        distance, spot = min((_foot(one, x, y) for one in self.lanes), key=lambda one: one[0])
        return _aside(spot, x, y) if distance <= 0.5 * spot.lane.width + _ROUNDING else None

    def foot(self, lane: _RoadLane, x: float, y: float) -> Spot:
        """Place in the middle of a lane that is nearest to a point [m]."""
        return _foot(lane, x, y)[1]

    def beside(self, spot: Spot, lanes: int) -> Spot:
        """Place on the lane that is `lanes` to the left on the same edge; ValueError if there is none."""
        index = spot.lane.index + lanes
        found = [one for one in self.lanes if one.edge == spot.lane.edge and one.index == index]
        if not found:
            raise ValueError(f"there is no lane {abs(lanes)} to the {'left' if lanes > 0 else 'right'}")
        return Spot(found[0], spot.position * found[0].length / spot.lane.length)

    def farther(self, spot: Spot, ds: float) -> Spot:
        """Place on the same lane `ds` [m] farther along the reference line; beyond the road's ends, along the lanes."""
        road, _, lane = (spot.lane.origins or ("",))[0].rpartition("_")
        sense, rest = 1.0 if lane.startswith("-") else -1.0, ds
        if road in self.roads:
            x, y, _ = spot.world
            to, pieces = self.roads[road].nearest(x, y) + ds, self.roads[road].pieces
            s = min(max(to, 0.0), pieces[-1].s + pieces[-1].length)
            spot, rest = self.on_lane(road, lane, s), to - s
        return self.along(spot, sense * rest)

    def along(self, spot: Spot, distance: float, route: Sequence[str] = ()) -> Spot:
        """Place `distance` [m] farther along a route, or the road straight on, or back; ValueError if it ends before.

        Junctions count, and no place is inside one but within `_NEAR_JUNCTION` of its ends, where it is moved to.
        """
        lane, position = spot.lane, spot.position + distance
        for _ in range(len(self.lanes)):
            if 0.0 <= position <= lane.length:
                return Spot(lane, position, spot.offset)
            other, crossing = self._neighbour(lane, position > lane.length, route)
            beyond = position - lane.length if position > lane.length else -position
            if beyond < crossing:
                before, after = (lane, other) if position > lane.length else (other, lane)
                left = beyond if position > lane.length else crossing - beyond
                if min(left, crossing - left) > _NEAR_JUNCTION:
                    raise ValueError(f"{distance:g} m from there is inside a junction, where no vehicle can begin")
                return Spot(before, before.length) if 2.0 * left < crossing else Spot(after, 0.0)
            position, lane = (beyond - crossing if position > lane.length else other.length - beyond + crossing), other
        raise ValueError(f"{distance:g} m from there is not on the road any more")

    def _neighbour(self, lane: _RoadLane, ahead: bool, route: Sequence[str]) -> tuple[_RoadLane, float]:
        """The lane of the next edge, or the one before, and the length of the way across the junction between [m]."""
        edges = self.followers.get(lane.edge, ()) if ahead else [e for e, f in self.followers.items() if lane.edge in f]
        here = lane.edge, lane.index
        linked = self.links.get(here, ()) if ahead else [there for there, to in self.links.items() if here in to]
        near = [edge for edge, _ in linked] or edges
        edge = next((one for one in edges if one in route), near[0] if near else "")
        lanes = [one for one in self.lanes if one.edge == edge]
        if not lanes:
            raise ValueError(f"the road {'ends' if ahead else 'begins'} before that")
        other = min(lanes, key=lambda one: ((one.edge, one.index) not in linked, abs(one.index - lane.index)))
        return other, self.crossings.get((lane.edge, edge) if ahead else (edge, lane.edge), 0.0)

    def backwards(self, spot: Spot) -> list[tuple[float, float]]:
        """Points from a place against its lane's direction, straight on until the road ends [m]."""
        found, lane, position, length = [spot.world[:2]], spot.lane, spot.position, 0.0
        while length < _LONGEST_LAPS:
            steps, flat, lengths = lane.pieces()
            along = np.concatenate([[0.0], np.cumsum(lengths)]) * lane.length / lengths.sum()
            to_left = np.column_stack([-steps[:, 1], steps[:, 0]]) / flat[:, None]
            points = lane.shape + spot.offset * np.vstack([to_left, to_left[-1:]])
            found += [(float(x), float(y)) for x, y in points[along < position][::-1]]
            length += lane.length
            try:
                lane, _ = self._neighbour(lane, ahead=False, route=())
            except ValueError:
                break
            position = math.inf
        return found

    def route(self, edge: str, wanted: Sequence[str] = (), index: int | None = None) -> tuple[str, ...]:
        """Edges from one on through the `wanted`, and straight ahead until the road ends; ValueError without a way.

        From a lane on, by its `index`, they are those to which the lane leads. A closed road is repeated.
        """
        if wanted:
            before = () if edge in wanted else self.way(edge, wanted[0])[:-1]
            joined = (*before, *(wanted if before else wanted[list(wanted).index(edge) :]))
            return (*joined, *self.route(joined[-1])[1:])
        lengths = {one.edge: one.length for one in self.lanes}
        found, length, most = [edge], lengths[edge], _FARTHEST_ROUTE
        while length < most and (following := self.followers.get(edge)):
            edge, index = next(iter(self.links.get((edge, -1 if index is None else index), ())), (following[0], None))
            most = _LONGEST_LAPS if edge in found else most
            found.append(edge)
            length += lengths[edge]
        return tuple(found)

    def way(self, begin: str, end: str, *, is_fastest: bool = False) -> tuple[str, ...]:
        """Edges of the shortest or fastest way between two, both included; ValueError if there is none."""
        costs = {one.edge: 1.0 / one.limit if is_fastest else 1.0 for one in self.lanes}
        lengths = {one.edge: one.length for one in self.lanes}
        ahead: list[tuple[float, tuple[str, ...]]] = [(0.0, (begin,))]
        seen: set[str] = set()
        while ahead:
            cost, edges = heapq.heappop(ahead)
            if edges[-1] == end:
                return edges
            if edges[-1] in seen:
                continue
            seen.add(edges[-1])
            for edge in self.followers.get(edges[-1], ()):
                further = self.crossings.get((edges[-1], edge), 0.0) + lengths[edge]
                heapq.heappush(ahead, (cost + further * costs[edge], (*edges, edge)))
        raise ValueError(f"no way leads from {self._described(begin)} to {self._described(end)}")

    def starts(self, route: Sequence[str]) -> tuple[float, ...]:
        """Where along a route each of its edges begins, and where the last one ends [m]."""
        lengths = {one.edge: one.length for one in self.lanes}
        steps = [lengths[a] + self.crossings.get((a, b), 0.0) for a, b in itertools.pairwise((*route, ""))]
        return (0.0, *itertools.accumulate(steps))

    def _described(self, edge: str) -> str:
        return f"lanes {', '.join(origin for one in self.lanes if one.edge == edge for origin in one.origins) or edge}"

    def _reference(self, road: str, s: float) -> tuple[float, float, float]:
        if not self.roads:
            raise ValueError("a map that is a SUMO network has no roads; write a WorldPosition, or take an .xodr")
        if road not in self.roads:
            raise ValueError(f"there is no road {road!r}; there are {', '.join(sorted(self.roads))}")
        return self.roads[road].at(s)


def _foot(lane: _RoadLane, x: float, y: float) -> tuple[float, Spot]:
    """Distance of a point to a lane [m], and its nearest place on it."""
    steps, flat, lengths = lane.pieces()
    to_point = np.array([x, y]) - lane.shape[:-1]
    share = np.clip((to_point * steps).sum(axis=1) / flat**2, 0.0, 1.0)
    away = np.hypot(*(to_point - share[:, None] * steps).T)
    piece = int(np.argmin(away))
    along = float(lengths[:piece].sum() + share[piece] * lengths[piece])
    return float(away[piece]), Spot(lane, along * lane.length / float(lengths.sum()))


def _aside(spot: Spot, x: float, y: float) -> Spot:
    """A place in the middle of a lane with its offset to a point next to it [m]."""
    middle_x, middle_y, along = spot.world
    return replace(spot, offset=(y - middle_y) * math.cos(along) - (x - middle_x) * math.sin(along))


def read_opendrive_lanes(net: str, opendrive: Path) -> OpenDriveLanes:
    """Lanes of a network from `map_net`, and roads of its OpenDRIVE file; InputError if it has no lanes for vehicles.

    A map that is a SUMO network has no roads; left-hand traffic is refused.
    """
    # Text that netconvert wrote just now is no data from outside.
    root = fromstring(net) if is_opendrive(opendrive) else read_tree(opendrive, "net")  # noqa: S314
    if is_true(root.get("lefthand", "false")):
        raise InputError(f"{opendrive}: lefthand: expected a network of right-hand traffic")
    lanes = tuple(_lanes(root))
    if not lanes:
        raise InputError(f"{opendrive}: there is no lane to drive on")
    followers = _followers(root, {lane.edge for lane in lanes})
    links = _links(root, {(lane.edge, lane.index) for lane in lanes})
    if not is_opendrive(opendrive):
        location = root.find("location")
        x, y = map(float, ("0,0" if location is None else location.get("netOffset", "0,0")).split(","))
        return OpenDriveLanes(lanes, followers, {}, None, None, _crossings(root), moved=(x, y), links=links)
    source = read_opendrive(opendrive)
    roads, widths = {}, {}
    for road in source.iter("road"):
        try:
            roads[road.get("id", "")] = plan_view(road.iterfind("planView/geometry"))
            widths[road.get("id", "")] = _RoadWidths(road)
        except ValueError as error:
            raise InputError(f"{opendrive}: road {road.get('id')!r}: {error}") from None
    latitude, longitude = _origin(source.findtext("header/geoReference", ""))
    return OpenDriveLanes(lanes, followers, roads, latitude, longitude, _crossings(root), widths, links=links)


def _lanes(root: Element) -> Iterator[_RoadLane]:
    for edge in root.iter("edge"):
        for lane in edge.iter("lane") if edge.get("function", "normal") in ("normal", "connector") else ():
            if not _is_for_cars(lane):
                continue
            origins = next((p.get("value", "") for p in lane.iter("param") if p.get("key") == "origId"), "")
            points = [tuple(map(float, point.split(","))) for point in lane.attrib["shape"].split()]
            # A point that is repeated has no direction; of a lane without any, any will do.
            points = [next(same) for _, same in itertools.groupby(points, key=lambda point: point[:2])]
            points += [(points[0][0] + _ROUNDING, *points[0][1:])] if len(points) == 1 else []
            length, width = float(lane.attrib["length"]), float(lane.get("width", "3.2"))
            yield _RoadLane(
                edge.attrib["id"],
                int(lane.attrib["index"]),
                length,
                width,
                float(lane.attrib["speed"]),
                np.array([point[:2] for point in points], dtype=np.float64),
                np.array([math.fsum(point[2:]) for point in points]),
                tuple(origins.split()),
            )


def _is_for_cars(lane: Element) -> bool:
    refused, allowed = lane.get("disallow", "").split(), lane.get("allow", "all").split()
    return not {"all", "passenger"} & {*refused} and bool({"all", "passenger"} & {*allowed})


def _followers(root: Element, edges: set[str]) -> dict[str, list[str]]:
    found: dict[str, dict[str, int]] = {}
    for one in root.iter("connection"):
        begin, end = one.attrib["from"], one.attrib["to"]
        if begin in edges and end in edges:
            found.setdefault(begin, {}).setdefault(end, _TURNS.get(one.get("dir", ""), 3))
    return {begin: sorted(ends, key=lambda end: (ends[end], end)) for begin, ends in found.items()}


def _links(root: Element, lanes: set[tuple[str, int]]) -> _Links:
    """The lanes to which each lane leads, the straight ones, and of an edge the nearest, first."""
    found: dict[tuple[str, int], list[tuple[int, str, int, int]]] = {}
    for one in root.iter("connection"):
        begin, end = (one.attrib["from"], int(one.attrib["fromLane"])), (one.attrib["to"], int(one.attrib["toLane"]))
        if {begin, end} <= lanes:
            order = _TURNS.get(one.get("dir", ""), 3), end[0], abs(end[1] - begin[1]), end[1]
            found.setdefault(begin, []).append(order)
    return {begin: [(edge, index) for _, edge, _, index in sorted(ends)] for begin, ends in found.items()}


def _crossings(root: Element) -> dict[tuple[str, str], float]:
    """Length of the way across a junction between two edges, that of its first lane [m]."""
    lengths = {one.attrib["id"]: float(one.attrib["length"]) for one in root.iter("lane")}
    onward = {(one.attrib["from"], one.attrib["fromLane"]): one.get("via") for one in root.iter("connection")}
    found: dict[tuple[str, str], float] = {}
    for one in root.iter("connection"):
        length, via = 0.0, one.get("via")
        while via is not None:
            length += lengths[via]
            edge, _, number = via.rpartition("_")
            via = onward.get((edge, number))
        found.setdefault((one.attrib["from"], one.attrib["to"]), length)
    return found


def _origin(reference: str) -> tuple[float | None, float | None]:
    """Latitude and longitude [rad] of a map projection's origin, if the file has one."""
    terms = dict(term.partition("=")[::2] for term in reference.replace("+", " ").split())
    try:
        return math.radians(float(terms["lat_0"])), math.radians(float(terms.get("lon_0", "0")))
    except (KeyError, ValueError):
        return None, None
