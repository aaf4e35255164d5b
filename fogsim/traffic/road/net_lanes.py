"""A map of roads and signs from a SUMO network that sumolib has read."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.road.limit_signs import limit_sign
from fogsim.traffic.road.road_map import RoadMap, edge_ranges
from fogsim.traffic.road.signal_heads import crossing_heads, signal_heads
from fogsim.values import Lane, LaneEnd, LaneKind, LaneMarking, PavedArea, SignalHead

_WALKING_AREA = "walkingarea"
_OFF_ROAD = frozenset(
    ("rail", "rail_urban", "rail_electric", "rail_fast", "tram", "subway", "cable_car", "ship", "aircraft", "drone")
)
_STOP_STATES = frozenset(("s", "w", "a"))  # stop sign, all-way stop, traffic light with right turn on red
_ADJOINING = 0.6  # two carriageways whose borders are nearer than this share a line [m]


def map_of(net: Any, lefthand: bool) -> RoadMap:
    """Map of a network that was read with its internal edges.

    Without any road or footway, tracks or waterways are drawn instead, as lanes without lines.
    """
    edges = net.getEdges()
    lanes = [lane for edge in edges for lane in edge.getLanes()]
    walked = np.array([lane.getEdge().getFunction() == _WALKING_AREA for lane in lanes], np.bool_)
    drawn = ~walked & np.array([_kind(lane) is not None for lane in lanes], np.bool_)
    between = [not lane.getEdge().getFunction() and set(lane.getPermissions()) != {"pedestrian"} for lane in lanes]
    side = 1.0 if lefthand else -1.0
    signs = (limit_sign(edge, side) for edge in net.getEdges(withInternal=False))
    return RoadMap(
        edges=edge_ranges([edge.getID() for edge in edges], [len(edge.getLanes()) for edge in edges]),
        lanes=tuple(_lane(lane, lefthand) for lane in lanes),
        drawn=drawn if drawn.any() else ~walked,
        between=np.array(between, np.bool_),
        areas=(*_junctions(net), *_walking_areas(net)),
        limit_signs=tuple(sign for sign in signs if sign is not None),
        signal_heads=tuple(head for edge in edges for head in _heads(edge, side)),
        location=_location(net),
    )


def _heads(edge: Any, side: float) -> Iterator[SignalHead]:
    function = edge.getFunction()
    if function:
        return crossing_heads(edge.getLanes()[0], side) if function == "crossing" else iter(())
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
