"""Edges of a SUMO network as listed in its file, for checks that must be faster than reading the whole network."""

import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fogsim.core.files.xml_reader import read_elements
from fogsim.errors import InputError

_MOST_BYTES = 50_000_000
"""Unpacked bytes of a network file after which reading stops."""

_Point = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class NetEdges:
    """Edges for vehicles: number of lanes, middle lanes [m] of the wanted ones, and ids of traffic lights.

    `gaps` are pairs of wanted edges that were to follow one another and have no lane from one to the next.
    """

    lanes: Mapping[str, int]
    axes: Mapping[str, Sequence[_Point]]
    signals: tuple[str, ...] = ()
    gaps: Collection[tuple[str, str]] = ()

    def route_length(self, route: Sequence[str]) -> float:
        """Length of the axis that fog is laid along [m]: middle lanes of a route's edges, end to end."""
        points = [point for edge in route for point in self.axes[edge]]
        return sum(math.dist(one, other) for one, other in itertools.pairwise(points))


def read_net_edges(
    net: Path, wanted: Sequence[str], most_bytes: int = _MOST_BYTES, *, must_follow: bool = False
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
    return NetEdges(reader.lanes, axes, tuple(reader.signals), reader.unlinked if size < most_bytes else ())


class _EdgeReader:
    """Counts lanes of edges, and finds which of the pairs `unlinked` no connection links."""

    def __init__(self, wanted: Collection[str], unlinked: set[tuple[str, str]]) -> None:
        self.is_done = self.has_edges = False
        self.unlinked = unlinked
        self.lanes: dict[str, int] = {}
        self.shapes: dict[str, list[list[_Point]]] = {edge: [] for edge in wanted}
        self.signals: dict[str, None] = {}
        self._edge = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "edge":
            is_road = attributes.get("function", "normal") in {"normal", "connector"}
            self._edge = attributes.get("id", "") if is_road else ""
        elif tag == "lane" and self._edge:
            self.lanes[self._edge] = self.lanes.get(self._edge, 0) + 1
            if self._edge in self.shapes:
                self.shapes[self._edge].append(_points(attributes.get("shape", "")))
        elif tag == "tlLogic":
            self.signals[attributes.get("id", "")] = None
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
