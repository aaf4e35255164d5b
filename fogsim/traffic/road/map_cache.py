"""Maps of large networks in the user's cache directory, so that a city is parsed only once.

A cache file is named after the content of the network's file and the version of the code that made the map, down to its
source, so that no other version reads it. It holds only arrays of numbers and texts. Damaged or unreadable files count
as missing; without a writable cache, each process parses again.
"""

import contextlib
import functools
import hashlib
import io
import itertools
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.user_cache import cache_directory, keep_newest, read_entry, write_entry
from fogsim.values import Lane, LaneEnd, LaneKind, LaneMarking, PavedArea, Sign, SignalHead


@dataclass(frozen=True, slots=True)
class RoadMap:
    """A SUMO network.

    `edges` are ranges of lane indices, from the side that vehicles keep to. `drawn` (n,) marks lanes to draw, and
    `between` (n,) lanes between junctions that are not only for pedestrians. `areas` are junctions. `location` is the
    offset added to the source's coordinates [m] and their projection, as in the file. `left_hand`: vehicles keep left.
    """

    edges: Mapping[str, range]
    lanes: tuple[Lane, ...]
    drawn: NDArray[np.bool_]
    between: NDArray[np.bool_]
    areas: tuple[PavedArea, ...]
    limit_signs: tuple[Sign, ...]
    signal_heads: tuple[SignalHead, ...]
    location: tuple[str, str] | None
    left_hand: bool

    def middle_lane(self, edge: str) -> Lane:
        """Middle lane of an edge; of two, the inner one."""
        places = self.edges[edge]
        return self.lanes[places[len(places) // 2]]

    def speed_limit(self, edge: str) -> float:
        """Highest speed limit of an edge's lanes [m/s]."""
        return max(self.lanes[place].speed_limit for place in self.edges[edge])


def edge_ranges(edges: Sequence[str], counts: Iterable[int]) -> dict[str, range]:
    """Lane indices of each edge when lanes are listed edge by edge, from the number of lanes of each."""
    ends = list(itertools.accumulate(counts, initial=0))
    return {edge: range(*ends_of) for edge, ends_of in zip(edges, itertools.pairwise(ends), strict=True)}


_WORTHWHILE = 1_000_000  # bytes of a network's file, above which reading takes a fifth of a second
_MOST_FILES = 16  # of the cache; the oldest are removed
_MADE_BY = ("map_cache.py", "network.py", "signs.py")
_MARKINGS, _KINDS, _ENDS = tuple(LaneMarking), tuple(LaneKind), tuple(LaneEnd)
_UNREADABLE = (OSError, ValueError, KeyError, IndexError, TypeError, EOFError, zipfile.BadZipFile, zlib.error)

_Arrays = dict[str, NDArray[Any]]


def is_worth_caching(net: Path) -> bool:
    """Whether reading a network takes long enough to keep its map."""
    with contextlib.suppress(OSError):
        return net.stat().st_size >= _WORTHWHILE
    return False


def cached_map(net: Path) -> RoadMap | None:
    """Cached map of a network; None if missing."""
    try:
        kept = read_entry(_place(net))
        if kept is None:
            return None
        with np.load(io.BytesIO(kept), allow_pickle=False) as arrays:
            return _map_of(arrays)
    except _UNREADABLE:
        return None


def compacted(roads: RoadMap) -> RoadMap:
    """The same map in a few large arrays: small ones between a parser's temporary objects would keep its memory."""
    return _map_of(_arrays_of(roads))


def keep_map(net: Path, roads: RoadMap) -> None:
    """Cache a map, if the user's cache directory can be written."""
    with contextlib.suppress(OSError):
        place, content = _place(net), io.BytesIO()
        np.savez(content, allow_pickle=False, **_arrays_of(roads))
        write_entry(place, content.getvalue())
        keep_newest(place.parent, _MOST_FILES)


def _place(net: Path) -> Path:
    digest = hashlib.sha256(_version())
    with net.open("rb") as file:
        while chunk := file.read(1 << 20):
            digest.update(chunk)
    return cache_directory() / "networks" / f"{digest.hexdigest()[:32]}.npz"


@functools.cache
def _version() -> bytes:
    """Identity of the code that makes maps: the versions of FogSim and sumolib, and the source."""
    sources = [Path(__file__).with_name(name).read_bytes() for name in _MADE_BY]
    versions = [metadata.version(name).encode() for name in ("fogsim", "eclipse-sumo")]
    return hashlib.sha256(b"\0".join((*versions, *sources))).digest()


def _arrays_of(roads: RoadMap) -> _Arrays:
    lanes, areas, signs, heads = roads.lanes, roads.areas, roads.limit_signs, roads.signal_heads
    return {
        "edges": _text(list(roads.edges)),
        "lane_counts": np.array([len(places) for places in roads.edges.values()], np.int64),
        "sizes": np.array([(lane.width, lane.speed_limit) for lane in lanes], np.float64).reshape(-1, 2),
        "codes": np.array([_codes(lane) for lane in lanes], np.uint8).reshape(-1, 5),
        "drawn": roads.drawn,
        "between": roads.between,
        **_lines("centrelines", [lane.centreline for lane in lanes]),
        **_lines("outlines", [area.outline for area in areas]),
        "areas": _text([area.area_id for area in areas]),
        "area_kinds": np.array([_KINDS.index(area.kind) for area in areas], np.uint8),
        "signs": _text([text for sign in signs for text in (sign.sign_id, sign.kind)]),
        "sign_places": np.array([(s.value, *s.position, s.heading, s.diameter) for s in signs]).reshape(-1, 6),
        "heads": _text([text for head in heads for text in (head.signal_id, head.lane_id)]),
        "head_places": np.array([(*h.position, h.heading, h.diameter, *h.post) for h in heads]).reshape(-1, 8),
        "heads_on_foot": np.array([head.on_foot for head in heads], np.bool_),
        "links": np.array([link for head in heads for link in head.links], np.int64),
        "link_counts": np.array([len(head.links) for head in heads], np.int64),
        "location": _text(roads.location or ()),
        "left_hand": np.array(roads.left_hand),
    }


def _codes(lane: Lane) -> tuple[int, int, int, int, int]:
    left, right = _MARKINGS.index(lane.left), _MARKINGS.index(lane.right)
    return left, right, int(lane.outermost), _KINDS.index(lane.kind), _ENDS.index(lane.end)


def _map_of(arrays: Mapping[str, NDArray[Any]]) -> RoadMap:
    edges = _texts(arrays["edges"])
    ranges = edge_ranges(edges, arrays["lane_counts"].tolist())
    names = [(f"{edge}_{number}", edge) for edge, places in ranges.items() for number in range(len(places))]
    rows = zip(names, _cut(arrays, "centrelines"), arrays["sizes"].tolist(), arrays["codes"].tolist(), strict=True)
    outlines = zip(_texts(arrays["areas"]), _cut(arrays, "outlines"), arrays["area_kinds"].tolist(), strict=True)
    signs = _texts(arrays["signs"])
    places = zip(signs[::2], signs[1::2], arrays["sign_places"].tolist(), strict=True)
    location = _texts(arrays["location"])
    return RoadMap(
        edges=ranges,
        lanes=tuple(_lane(*row) for row in rows),
        drawn=arrays["drawn"],
        between=arrays["between"],
        areas=tuple(PavedArea(name, outline, _KINDS[kind]) for name, outline, kind in outlines),
        limit_signs=tuple(Sign(name, kind, p[0], (p[1], p[2], p[3]), p[4], p[5]) for name, kind, p in places),
        signal_heads=tuple(_heads(arrays)),
        location=(location[0], location[1]) if location else None,
        left_hand=bool(arrays["left_hand"]),
    )


def _heads(arrays: Mapping[str, NDArray[Any]]) -> Iterator[SignalHead]:
    names, ends = _texts(arrays["heads"]), np.cumsum(np.append(0, arrays["link_counts"])).tolist()
    links = [tuple(arrays["links"][start:end].tolist()) for start, end in pairwise(ends)]
    places = zip(arrays["head_places"].tolist(), arrays["heads_on_foot"].tolist(), strict=True)
    rows = zip(names[::2], names[1::2], links, places, strict=True)
    for signal, lane, own, ((x, y, z, heading, diameter, *post), on_foot) in rows:
        yield SignalHead(signal, lane, own, (x, y, z), heading, diameter, (post[0], post[1], post[2]), on_foot)


def _lane(name: tuple[str, str], line: NDArray[np.float64], sizes: Sequence[float], codes: Sequence[int]) -> Lane:
    width, speed_limit = sizes
    left, right, outermost, kind, end = codes
    markings = _MARKINGS[left], _MARKINGS[right]
    return Lane(*name, line, width, speed_limit, *markings, bool(outermost), _KINDS[kind], _ENDS[end])


def _lines(name: str, lines: Sequence[NDArray[np.float64]]) -> _Arrays:
    points = np.concatenate([np.zeros((0, 3)), *lines])
    return {name: points, f"{name}_counts": np.array([len(line) for line in lines], np.int64)}


def _cut(arrays: Mapping[str, NDArray[Any]], name: str) -> list[NDArray[np.float64]]:
    points, ends = arrays[name], np.cumsum(np.append(0, arrays[f"{name}_counts"])).tolist()
    if ends[-1] != len(points):
        raise ValueError(f"{name}: {ends[-1]} points expected, got {len(points)}")
    return [points[start:end] for start, end in pairwise(ends)]


def _text(texts: Sequence[str]) -> NDArray[np.uint8]:
    # Texts from XML contain no NUL.
    return np.frombuffer("".join(f"{text}\0" for text in texts).encode(), np.uint8)


def _texts(array: NDArray[np.uint8]) -> list[str]:
    return array.tobytes().decode().split("\0")[:-1]
