"""Roads of a SUMO network as plain geometry."""

import itertools
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import sumolib
from numpy.typing import NDArray

from fogsim.core.files.readers import FARTHEST
from fogsim.core.files.xml_reader import read_elements, root_tag
from fogsim.core.garbage import no_garbage_collection
from fogsim.core.linear_algebra import matrix_product
from fogsim.errors import InputError, shown
from fogsim.traffic.road.configuration import is_true
from fogsim.traffic.road.map_cache import RoadMap, cached_map, compacted, edge_ranges, is_worth_caching, keep_map
from fogsim.traffic.road.signs import limit_sign
from fogsim.values import Lane, LaneEnd, LaneKind, LaneMarking, PavedArea, RoadNetwork, SignalHead, Structure
from fogsim.values.light import SIGNAL_DIAMETER

_MOST_LISTED_BYTES = 50_000_000
"""Unpacked bytes of a network file after which reading stops."""

_Point = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class NetEdges:
    """Edges for vehicles: number of lanes, and middle lanes [m] of the wanted ones; traffic lights.

    `signals` are the most phases that a program of traffic lights has, and the number of their links, by id.
    `gaps` are pairs of wanted edges that were to follow one another and have no lane from one to the next.
    """

    lanes: Mapping[str, int]
    axes: Mapping[str, Sequence[_Point]]
    signals: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    gaps: Collection[tuple[str, str]] = ()

    def route_length(self, route: Sequence[str]) -> float:
        """Length of the axis that fog is laid along [m]: middle lanes of a route's edges, end to end."""
        points = [point for edge in route for point in self.axes[edge]]
        return sum(math.dist(one, other) for one, other in itertools.pairwise(points))


def read_net_edges(
    net: Path, wanted: Sequence[str], most_bytes: int = _MOST_LISTED_BYTES, *, must_follow: bool = False
) -> NetEdges | None:
    """Edges of a network, with axes of the wanted ones and gaps between them; None if too large or not a network."""
    reader = _EdgeReader(wanted, set(itertools.pairwise(wanted)) if must_follow else set())
    try:
        size = read_elements(net, reader, most_bytes)
    except InputError:
        return None
    if not reader.lanes or (size == most_bytes and not reader.has_edges):
        return None
    axes = {edge: shapes[len(shapes) // 2] for edge, shapes in reader.shapes.items() if shapes}
    return NetEdges(reader.lanes, axes, reader.signals, reader.unlinked if size < most_bytes else ())


class _EdgeReader:
    """Counts lanes of edges, and finds which of the pairs `unlinked` no connection links."""

    def __init__(self, wanted: Collection[str], unlinked: set[tuple[str, str]]) -> None:
        self.is_done = self.has_edges = False
        self.unlinked = unlinked
        self.lanes: dict[str, int] = {}
        self.shapes: dict[str, list[list[_Point]]] = {edge: [] for edge in wanted}
        self.signals: dict[str, tuple[int, int]] = {}
        self._edge = self._signal = ""
        self._phases = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "edge":
            is_road = attributes.get("function", "normal") in {"normal", "connector"}
            self._edge = attributes.get("id", "") if is_road else ""
        elif tag == "lane" and self._edge:
            self.lanes[self._edge] = self.lanes.get(self._edge, 0) + 1
            if self._edge in self.shapes:
                self.shapes[self._edge].append(_points(attributes.get("shape", "")))
        elif tag == "tlLogic":
            self._signal, self._phases = attributes.get("id", ""), 0
            self.signals.setdefault(self._signal, (0, 0))
        elif tag == "phase":
            self._phases += 1
            most = max(self.signals.get(self._signal, (0, 0))[0], self._phases)
            self.signals[self._signal] = most, len(attributes.get("state", ""))
        elif tag == "connection":
            # All edges and programs of traffic lights come before the connections.
            self.has_edges = True
            self.unlinked.discard((attributes.get("from", ""), attributes.get("to", "")))
            self.is_done = not self.unlinked

    def end(self, tag: str) -> None:
        pass


def _points(shape: str) -> list[_Point]:
    """Points of a shape [m]; those without a height are at 0."""
    points = [tuple(map(float, point.split(","))) for point in shape.split()]
    return [(*point, 0.0) if len(point) == 2 else point for point in points]


LARGE_DIAMETER = 0.3
"""Diameter of the lenses above roads and next to fast ones [m]."""

_FAST = 16.7
"""Speed limit above which the lenses next to a road are large, too [m/s]."""

POST_HEIGHT, ARM_HEIGHT = 2.75, 5.5
"""Height of the middle lens next to and above the road [m]: footways are clear to 2.1 m, roads to 4.5 m."""

_ON_FOOT_HEIGHT = 2.4
"""Height of the middle of heads for pedestrians [m]."""

_BEYOND, _BESIDE_CROSSING = 0.5, 0.4  # of posts of such heads, from the end and the border of their crossing [m]
_BESIDE = 0.6  # of posts, beyond the edge of the outermost lane [m]


def signal_heads(lanes: Sequence[Any], side: float) -> Iterator[SignalHead]:
    """Heads at the end of an edge: one on a post for the outermost lane, one on its arm for each other lane.

    `lanes` (sumolib) are those for vehicles, from the side that they keep to: left (1) or right (−1). A lane whose
    points coincide, which SUMO reads as any other, has no direction to stand across, and no head.
    """
    lanes = [lane for lane in lanes if _steps(np.array(lane.getShape3D(), np.float64)).size]
    heads = [(lane, signal, links) for lane in lanes for signal, links in _signals(lane)]
    if not heads:
        return
    outer = np.array(lanes[0].getShape3D(), np.float64)
    half, heading = 0.5 * float(lanes[0].getWidth()), _heading(outer)
    across = side * np.array([-math.sin(heading), math.cos(heading), 0.0])
    post = outer[-1] + (half + _BESIDE) * across
    for number, (lane, signal, links) in enumerate(heads):
        end = np.array(lane.getShape3D()[-1], np.float64)
        # Lanes of an edge end on a line across it, and arms extend along that line.
        place = post if number == 0 else post + across * float(matrix_product(end - post, across))
        height = ARM_HEIGHT if number else POST_HEIGHT
        is_large = number > 0 or float(lane.getSpeed()) > _FAST
        yield SignalHead(
            signal_id=signal,
            lane_id=lane.getID(),
            links=links,
            position=_tuple(place + np.array([0.0, 0.0, height])),
            heading=heading,
            diameter=LARGE_DIAMETER if is_large else SIGNAL_DIAMETER,
            post=_tuple(post),
        )


def _crossing_heads(crossing: Any, side: float) -> Iterator[SignalHead]:
    """Heads for pedestrians at both ends of a crossing lane (sumolib); `side` is left (1) or right (−1) traffic."""
    edge = crossing.getEdge()
    ways = [way for source in edge.getIncoming() for way in source.getConnections(edge) if way.getTLSID()]
    line = np.array(crossing.getShape3D(), np.float64)
    if not ways or not _steps(line).size:
        return
    for name, there in ((crossing.getID(), line), (edge.getID(), line[::-1])):
        heading = _heading(there)
        ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
        across = side * np.array([-ahead[1], ahead[0], 0.0])
        post = there[-1] + _BEYOND * ahead + (0.5 * float(crossing.getWidth()) + _BESIDE_CROSSING) * across
        yield SignalHead(
            signal_id=ways[0].getTLSID(),
            lane_id=name,
            links=(ways[0].getTLLinkIndex(),),
            position=_tuple(post + np.array([0.0, 0.0, _ON_FOOT_HEIGHT])),
            heading=heading,
            diameter=SIGNAL_DIAMETER,
            post=_tuple(post),
            on_foot=True,
        )


def _signals(lane: Any) -> list[tuple[str, tuple[int, ...]]]:
    """The traffic light at the end of a lane with the links of the lane; none without a light."""
    # A link with the index −1 is not controlled, as that of a track across a level crossing.
    outgoing = lane.getOutgoing()
    ways = [(w.getTLSID(), w.getTLLinkIndex()) for w in outgoing if w.getTLSID() and w.getTLLinkIndex() >= 0]
    return [(ways[0][0], tuple(sorted(link for signal, link in ways if signal == ways[0][0])))] if ways else []


def _steps(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Horizontal steps (n, 2) [m] along a polyline between points that do not coincide."""
    steps = np.diff(line.reshape(-1, 3)[:, :2], axis=0)
    return steps[np.hypot(steps[:, 0], steps[:, 1]) > 1e-3]


def _heading(line: NDArray[np.float64]) -> float:
    x, y = _steps(line)[-1].tolist()
    return math.atan2(y, x)


def _tuple(place: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z


_WALKING_AREA = "walkingarea"
_OFF_ROAD = frozenset(
    ("rail", "rail_urban", "rail_electric", "rail_fast", "tram", "subway", "cable_car", "ship", "aircraft", "drone")
)
_STOP_STATES = frozenset(("s", "w", "a"))  # stop sign, all-way stop, traffic light with right turn on red
_ADJOINING = 0.6  # two carriageways whose borders are nearer than this share a line [m]


def _map_of(net: Any, lefthand: bool) -> RoadMap:
    """Map of a network that was read with its internal edges.

    Without any road, tracks and waterways are drawn, too, as lanes without lines.
    """
    edges = net.getEdges()
    lanes = [lane for edge in edges for lane in edge.getLanes()]
    walked = np.array([lane.getEdge().getFunction() == _WALKING_AREA for lane in lanes], np.bool_)
    kinds = [_kind(lane) for lane in lanes]
    has_roads = LaneKind.CARRIAGEWAY in kinds
    between = [not lane.getEdge().getFunction() and set(lane.getPermissions()) != {"pedestrian"} for lane in lanes]
    side = 1.0 if lefthand else -1.0
    signs = (limit_sign(edge, side) for edge in net.getEdges(withInternal=False) if _carriageway(edge))
    return RoadMap(
        edges=edge_ranges([edge.getID() for edge in edges], [len(edge.getLanes()) for edge in edges]),
        lanes=tuple(_lane(lane, lefthand) for lane in lanes),
        drawn=~walked & np.array([kind is not None or not has_roads for kind in kinds], np.bool_),
        between=np.array(between, np.bool_),
        areas=(*_junctions(net), *_walking_areas(net)),
        limit_signs=tuple(sign for sign in signs if sign is not None),
        signal_heads=tuple(head for edge in edges for head in _heads(edge, side)),
        location=_location(net),
        left_hand=lefthand,
    )


def _heads(edge: Any, side: float) -> Iterator[SignalHead]:
    function = edge.getFunction()
    if function:
        return _crossing_heads(edge.getLanes()[0], side) if function == "crossing" else iter(())
    return signal_heads([lane for lane in edge.getLanes() if _kind(lane) is LaneKind.CARRIAGEWAY], side)


def _location(net: Any) -> tuple[str, str] | None:
    """Offset and projection as written; None if the network has no location."""
    written: dict[str, str] = net._location  # sumolib returns both only in converted form
    return (written["netOffset"], written["projParameter"]) if written else None


def _kind(lane: Any) -> LaneKind | None:
    """Use of a lane; None for rails and waterways."""
    function = lane.getEdge().getFunction()
    if function == "crossing":
        return LaneKind.CROSSING
    allowed = set(lane.getPermissions())
    if allowed and allowed <= _OFF_ROAD:
        return None
    if allowed == {"pedestrian"}:
        return LaneKind.FOOTWAY
    return LaneKind.JUNCTION if function == "internal" else LaneKind.CARRIAGEWAY


def _lane(lane: Any, lefthand: bool) -> Lane:
    """A lane as it is drawn, whatever its use."""
    kind = _kind(lane)
    inner, outer = _markings(lane) if kind is LaneKind.CARRIAGEWAY else (LaneMarking.NONE, LaneMarking.NONE)
    # Lanes are counted from the side that vehicles keep to.
    left, right = (outer, inner) if lefthand else (inner, outer)
    rightmost = _carriageway(lane.getEdge())[-1 if lefthand else 0] if kind is LaneKind.CARRIAGEWAY else None
    return Lane(
        lane_id=lane.getID(),
        edge_id=lane.getEdge().getID(),
        centreline=_shape(lane),
        width=float(lane.getWidth()),
        speed_limit=float(lane.getSpeed()),
        left=left,
        right=right,
        outermost=lane is rightmost,
        kind=kind or LaneKind.CARRIAGEWAY,
        end=_end(lane) if kind is LaneKind.CARRIAGEWAY else LaneEnd.OPEN,
    )


def _shape(lane: Any) -> NDArray[np.float64]:
    return np.array(lane.getShape3D(), dtype=np.float64).reshape(-1, 3)


def _carriageway(edge: Any) -> list[Any]:
    """Lanes of an edge for vehicles, from the side that they keep to."""
    return [lane for lane in edge.getLanes() if _kind(lane) in {LaneKind.CARRIAGEWAY, LaneKind.JUNCTION}]


def _markings(lane: Any) -> tuple[LaneMarking, LaneMarking]:
    """Lines on the side of the other direction and on the side that vehicles keep to."""
    lanes = _carriageway(lane.getEdge())
    left = _between_directions(lanes) if lane is lanes[-1] else LaneMarking.DASHED
    return left, LaneMarking.SOLID if lane is lanes[0] else LaneMarking.DASHED


def _between_directions(lanes: Sequence[Any]) -> LaneMarking:
    """Line towards the other direction: overtaking is allowed on a road with two lanes, not on wider ones."""
    edge = lanes[-1].getEdge()
    here = _shape(lanes[-1])
    for other in edge.getToNode().getOutgoing():
        opposite = _carriageway(other)
        if other.getToNode() is not edge.getFromNode() or other is edge or not opposite:
            continue
        there = _shape(opposite[-1])
        if not (len(here) and len(there)):
            continue
        apart = 0.5 * (lanes[-1].getWidth() + opposite[-1].getWidth())
        if abs(math.dist(here[0, :2], there[-1, :2]) - apart) < _ADJOINING:
            return LaneMarking.DASHED if len(lanes) == len(opposite) == 1 else LaneMarking.DOUBLE
    return LaneMarking.SOLID


def _end(lane: Any) -> LaneEnd:
    """Line across the end of a lane: at traffic lights and stop signs, or where vehicles must give way."""
    states = {(connection.getState(), bool(connection.getTLSID())) for connection in lane.getOutgoing()}
    if any(controlled or state in _STOP_STATES for state, controlled in states):
        return LaneEnd.STOP
    # A lane that gives way only for turning has no line to wait behind.
    return LaneEnd.YIELD if states and all(state == "m" for state, _ in states) else LaneEnd.OPEN


def _junctions(net: Any) -> list[PavedArea]:
    outlines = [(node.getID(), np.array(node.getShape3D(), dtype=np.float64)) for node in net.getNodes()]
    return [PavedArea(name, outline) for name, outline in outlines if len(outline) > 2]


def _walking_areas(net: Any) -> list[PavedArea]:
    lanes = [lane for edge in net.getEdges() if edge.getFunction() == _WALKING_AREA for lane in edge.getLanes()]
    shapes = [(lane.getID(), np.array(lane.getShape3D(), dtype=np.float64)) for lane in lanes]
    return [PavedArea(name, shape, LaneKind.FOOTWAY) for name, shape in shapes if len(shape) > 2]


_MOST_BYTES = 2_000_000_000  # of a network, unpacked


@no_garbage_collection()
def read_net(path: Path) -> RoadMap:
    """Read a SUMO network file, gzip or not; maps of large ones are cached (`fogsim.traffic.road.map_cache`)."""
    if not is_worth_caching(path):
        return _parsed(path)
    known = cached_map(path)
    if known is None:
        known = compacted(_parsed(path))
        keep_map(path, known)
    return known


def _parsed(path: Path) -> RoadMap:
    reader = _NetElements()
    root_tag(path, "net")
    try:
        read_elements(path, reader, _MOST_BYTES)
        reader.endDocument()
        found = _map_of(reader.getNet(), reader.is_lefthand)
    except InputError:
        raise
    except Exception as error:  # sumolib checks nothing
        raise InputError(f"{path}: not a SUMO network: {type(error).__name__}: {error}") from error
    if not found.edges:
        raise InputError(f"{path}: the SUMO network has no edges")
    points = np.concatenate([np.zeros((0, 3)), *(lane.centreline for lane in found.lanes)])
    if not (np.abs(points) <= FARTHEST).all():
        lane_id = next(lane.lane_id for lane in found.lanes if not (np.abs(lane.centreline) <= FARTHEST).all())
        raise InputError(f"{path}: lane {lane_id!r}: its shape must have coordinates within ±{FARTHEST:g} m")
    return found


class _NetElements(sumolib.net.NetReader):  # type: ignore[misc]  # sumolib has no types
    """Passes elements to sumolib, and records left-hand traffic, which sumolib ignores."""

    is_done = is_lefthand = False

    def __init__(self) -> None:
        super().__init__(withInternal=True, withFoes=False)

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "net":
            self.is_lefthand = is_true(attributes.get("lefthand", "false"))
        elif attributes.get("function") == "normal":
            attributes["function"] = ""  # Networks of early versions write it out, which sumolib does not know.
        elif tag == "junction":
            attributes.setdefault("intLanes", "")
        try:
            self.startElement(tag, attributes)
        except KeyError as error:
            name = str(error.args[0])
            lacks = "nothing before it has the id" if name in attributes.values() else "it lacks the attribute"
            raise ValueError(f"not a SUMO network: {lacks} {shown(name)}") from error

    def end(self, tag: str) -> None:
        self.endElement(tag)


def road_network(roads: RoadMap, route: Sequence[str], structures: tuple[Structure, ...] = ()) -> RoadNetwork:
    """Lanes, footways, junctions and structures of a network, and the axis of the ego's route.

    Without any road, tracks and waterways are drawn, too, as lanes without lines.
    """
    lanes = tuple(lane for lane, is_drawn in zip(roads.lanes, roads.drawn.tolist(), strict=True) if is_drawn)
    for lane in lanes:
        _check_shape(lane)
    axis, limits = route_axis(roads, route)
    return RoadNetwork(lanes, axis, roads.areas, limits, structures, roads.signal_heads)


def _check_shape(lane: Lane) -> None:
    if len(lane.centreline) < 2:
        raise InputError(
            f"lane {lane.lane_id!r} of edge {lane.edge_id!r}: expected a shape of at least two points, got "
            f"{len(lane.centreline)}; roads are drawn along the shapes of their lanes, which netconvert writes into a "
            "network"
        )


def route_axis(roads: RoadMap, route: Sequence[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Middle of a route's lanes (n, 3) [m] without repeated points, and the highest limit up to each (n,) [m/s]."""
    middle = [roads.middle_lane(edge) for edge in route]
    for lane in middle:
        _check_shape(lane)
    points = np.concatenate([lane.centreline for lane in middle])
    limits = np.repeat([roads.speed_limit(edge) for edge in route], [len(lane.centreline) for lane in middle])
    kept = np.concatenate(([True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-3))
    return points[kept], limits[kept]
