"""Roads of a SUMO network as plain geometry."""

import contextlib
import gc
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sumolib
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.traffic.road.xml_stream import open_unpacked
from fogsim.values import Lane, LaneEnd, LaneKind, LaneMarking, PavedArea, RoadNetwork

_WALKING_AREA = "walkingarea"
_OFF_ROAD = frozenset(
    ("rail", "rail_urban", "rail_electric", "rail_fast", "tram", "subway", "cable_car", "ship", "aircraft", "drone")
)
_STOP_STATES = frozenset(("s", "w", "a"))  # stop sign, all-way stop, traffic light that turns right on red
_ROOT, _HEAD = re.compile(rb"<net\s[^>]*>"), 1 << 20  # tag of the root, and in how many first bytes of a file it stands
_ADJOINING = 0.6  # two carriageways whose borders lie nearer than this share a line [m]


def read_net(path: Path) -> Any:
    """Read a SUMO network file.

    Parameters
    ----------
    path : Path
        The file, packed by gzip or not.

    Raises
    ------
    InputError
        If the file is no SUMO network.
    """
    try:
        with _no_garbage_collection():
            net = sumolib.net.readNet(str(path), withInternal=True, withFoes=False)
        net.lefthand = _is_lefthand(path)
    except Exception as error:
        raise InputError(f"{path}: not a SUMO network: {error}") from error
    if not net.getEdges():
        raise InputError(f"{path}: the SUMO network has no edges")
    return net


@contextlib.contextmanager
def _no_garbage_collection() -> Iterator[None]:
    """Pause garbage collection, which takes two thirds of the time where nothing made becomes garbage."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _is_lefthand(path: Path) -> bool:
    """Whether a network file says that its vehicles keep to the left, which sumolib does not tell."""
    with open_unpacked(path) as source:
        root = _ROOT.search(source.read(_HEAD))
    return root is not None and b'lefthand="' in root[0] and b'lefthand="false"' not in root[0]


def road_network(net: Any, route: Sequence[str]) -> RoadNetwork:
    """Every lane of a network that is a road or a footway, its junctions, and the axis of a route.

    In a network without any, the tracks or waterways are drawn in their place, as lanes without lines.

    Parameters
    ----------
    net : sumolib.net.Net
        The network.
    route : sequence of str
        Edge ids of the ego's route.

    Raises
    ------
    InputError
        If a lane has no shape to draw.
    """
    edges = [edge for edge in net.getEdges() if edge.getFunction() != _WALKING_AREA]
    lefthand = getattr(net, "lefthand", False)
    every = [lane for edge in edges for lane in edge.getLanes()]
    drawn = [lane for lane in every if _kind(lane)] or every
    lanes = tuple(_lane(lane, lefthand) for lane in drawn)
    return RoadNetwork(lanes=lanes, route=_route_axis(net, route), areas=(*_junctions(net), *_walking_areas(net)))


def _kind(lane: Any) -> LaneKind | None:
    """What a lane is for; None for rails and waterways."""
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
    points = np.array(lane.getShape3D(), dtype=np.float64)
    if len(points) < 2:
        raise InputError(
            f"lane {lane.getID()!r} of edge {lane.getEdge().getID()!r}: expected a shape of at least two points, got "
            f"{len(points)}; roads are drawn along the shapes of their lanes, which netconvert writes into a network"
        )
    return points


def _carriageway(edge: Any) -> list[Any]:
    """Lanes of an edge that vehicles drive on, from the side that they keep to."""
    return [lane for lane in edge.getLanes() if _kind(lane) in {LaneKind.CARRIAGEWAY, LaneKind.JUNCTION}]


def _markings(lane: Any) -> tuple[LaneMarking, LaneMarking]:
    """Lines on the side of the other direction and on the side that vehicles keep to."""
    lanes = _carriageway(lane.getEdge())
    left = _between_directions(lanes) if lane is lanes[-1] else LaneMarking.DASHED
    return left, LaneMarking.SOLID if lane is lanes[0] else LaneMarking.DASHED


def _between_directions(lanes: Sequence[Any]) -> LaneMarking:
    """Line towards the other direction: it may be overtaken on a road of two lanes, not on one of more."""
    edge = lanes[-1].getEdge()
    here = _shape(lanes[-1])
    for other in edge.getToNode().getOutgoing():
        opposite = _carriageway(other)
        if other.getToNode() is not edge.getFromNode() or other is edge or not opposite:
            continue
        apart = 0.5 * (lanes[-1].getWidth() + opposite[-1].getWidth())
        if abs(math.dist(here[0, :2], _shape(opposite[-1])[-1, :2]) - apart) < _ADJOINING:
            return LaneMarking.DASHED if len(lanes) == len(opposite) == 1 else LaneMarking.DOUBLE
    return LaneMarking.SOLID


def _end(lane: Any) -> LaneEnd:
    """Line across the end of a lane: at traffic lights and stop signs, or where it must give way."""
    states = {(connection.getState(), bool(connection.getTLSID())) for connection in lane.getOutgoing()}
    if any(controlled or state in _STOP_STATES for state, controlled in states):
        return LaneEnd.STOP
    # Who must give way only when turning has no line to wait behind.
    return LaneEnd.YIELD if states and all(state == "m" for state, _ in states) else LaneEnd.OPEN


def _junctions(net: Any) -> list[PavedArea]:
    outlines = [(node.getID(), np.array(node.getShape3D(), dtype=np.float64)) for node in net.getNodes()]
    return [PavedArea(name, outline) for name, outline in outlines if len(outline) > 2]


def _walking_areas(net: Any) -> list[PavedArea]:
    lanes = [lane for edge in net.getEdges() if edge.getFunction() == _WALKING_AREA for lane in edge.getLanes()]
    shapes = [(lane.getID(), np.array(lane.getShape3D(), dtype=np.float64)) for lane in lanes]
    return [PavedArea(name, shape, LaneKind.FOOTWAY) for name, shape in shapes if len(shape) > 2]


def _route_axis(net: Any, route: Sequence[str]) -> NDArray[np.float64]:
    """Middle lanes of a route's edges, end to end, without repeated points."""
    parts = []
    for edge_id in route:
        lanes = net.getEdge(edge_id).getLanes()
        parts.append(_shape(lanes[len(lanes) // 2]))
    points = np.concatenate(parts)
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-3
    return points[np.concatenate(([True], moved))]
