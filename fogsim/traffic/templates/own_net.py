"""Ways on a network of a user's own, as far as actors need to know them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fogsim.core.files.xml_reader import read_elements
from fogsim.errors import InputError

_MOST_BYTES = 2_000_000_000


@dataclass(frozen=True, slots=True)
class _KnownEdge:
    """What is known of an edge."""

    lanes: int  # How many lanes it has, next to footways
    length: float  # Its length [m]
    limit: float  # Its speed limit [m/s]
    footways: int = 0  # How many footways lie to the right of its lanes

    def index(self, number: int) -> int:
        """Number of a lane in SUMO, which counts footways, too."""
        return number + self.footways


@dataclass(frozen=True, slots=True)
class KnownWays:
    """Ways on a network."""

    ways: tuple[tuple[str, tuple[str, ...]], ...]  # The ways by name
    edges: Mapping[str, _KnownEdge]  # What is known of their edges; those that the network does not have are missing

    def way(self, name: str) -> tuple[str, ...]:
        """Edges of a way; none where there is no such way."""
        return dict(self.ways).get(name, ())

    def edge(self, name: str) -> _KnownEdge:
        """An edge by its id."""
        return self.edges[name]

    def between(self, one: str, other: str) -> float:  # noqa: ARG002 - as of `Ways`
        """Length of the way across the junction between two edges, which is not looked up: 0."""
        return 0.0


def read_ways(net: Path, ways: Mapping[str, tuple[str, ...]]) -> KnownWays:
    """Read what a network says of the edges of ways."""
    reader = _Reader(frozenset(edge for edges in ways.values() for edge in edges))
    try:
        read_elements(net, reader, _MOST_BYTES)
    except InputError:
        # SUMO reports what is wrong with it.
        return KnownWays(tuple(ways.items()), {})
    return KnownWays(tuple(ways.items()), reader.edges)


class _Reader:
    """Reads edges as they come."""

    def __init__(self, wanted: frozenset[str]) -> None:
        self.is_done = False
        self.edges: dict[str, _KnownEdge] = {}
        self._wanted = wanted
        self._edge = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "edge":
            self._edge = attributes.get("id", "")
        elif tag == "lane" and self._edge in self._wanted:
            before = self.edges.get(self._edge, _KnownEdge(0, 0.0, 0.0))
            is_footway = attributes.get("allow") == "pedestrian"
            measures = (float(attributes.get("length", "")), float(attributes.get("speed", "")))
            self.edges[self._edge] = _KnownEdge(
                before.lanes + (not is_footway), *measures, before.footways + is_footway
            )
        elif tag == "connection":
            # All edges stand before the connections between them.
            self.is_done = True

    def end(self, tag: str) -> None:
        pass
