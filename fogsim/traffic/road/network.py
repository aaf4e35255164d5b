"""Roads of a SUMO network as plain geometry."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import sumolib
from numpy.typing import NDArray

from fogsim.core.files.readers import FARTHEST
from fogsim.core.files.xml_reader import read_elements, root_tag
from fogsim.core.garbage import no_garbage_collection
from fogsim.errors import InputError
from fogsim.traffic.road.map_cache import cached_map, compacted, is_worth_caching, keep_map
from fogsim.traffic.road.net_lanes import map_of
from fogsim.traffic.road.road_map import RoadMap
from fogsim.values import Lane, RoadNetwork, Structure

_MOST_BYTES = 2_000_000_000  # of a network, unpacked


@no_garbage_collection()
def read_net(path: Path) -> RoadMap:
    """Read a SUMO network file, compressed by gzip or not.

    Maps of large files are cached (see `fogsim.traffic.road.map_cache`).
    """
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
        found = map_of(reader.getNet(), reader.is_lefthand)
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
            self.is_lefthand = attributes.get("lefthand", "false") != "false"
        self.startElement(tag, attributes)

    def end(self, tag: str) -> None:
        self.endElement(tag)


def road_network(roads: RoadMap, route: Sequence[str], structures: tuple[Structure, ...] = ()) -> RoadNetwork:
    """Lanes, footways, junctions and structures of a network, and the axis of the ego's route.

    Without any road or footway, tracks or waterways are drawn instead, as lanes without lines.
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
    """Middle lanes of a route's edges, end to end, as (n, 3) [m], and the speed limit up to each point (n,) [m/s].

    The polyline repeats no point; the limit is the highest of the edge that leads to the point.
    """
    middle = [roads.middle_lane(edge) for edge in route]
    for lane in middle:
        _check_shape(lane)
    points = np.concatenate([lane.centreline for lane in middle])
    limits = np.repeat([roads.speed_limit(edge) for edge in route], [len(lane.centreline) for lane in middle])
    kept = np.concatenate(([True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-3))
    return points[kept], limits[kept]
