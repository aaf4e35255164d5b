"""The ground of a scene: all that is near it and drawn once, whole or in squares."""

import functools
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.edges import Edge, edge_meshes, guard_rail
from fogsim.scene.junctions import Areas, area_mesh, free_borders, walkable
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Chainage, Points, cleaned, parallel, refined, true_spans
from fogsim.scene.road import LONGEST, footway_mesh, lane_mesh, transverse_markings
from fogsim.scene.signs import Gantry, gantry_mesh
from fogsim.scene.solids import merge
from fogsim.scene.terrain import Terrain, plain_mesh
from fogsim.values.road import Lane, LaneKind, PavedArea
from fogsim.values.scene import GROUND_SQUARE, Mesh

T = TypeVar("T")
Bounds = NDArray[np.float64]
"""West, south, east and north ends of each of some things (n, 4) [m]."""

_LOOK = 1.0  # whether a road lies across a footway is looked at every so many metres
_ASTRAY = 0.3  # how far footways may reach onto a road [m]
_STICKING_OUT = 0.4  # how far lanes may stick out of their junction [m]
_BESIDE = 60.0  # what belongs to a line lies nearer to it than this on level ground [m]
_SLOPES = 5.0  # and so much farther for each metre of the network's heights
_BLOCK = 256  # parts that are put together at once, for many small arrays take more room than a few large ones
_LONG = 45.0  # no triangle is longer than this [m] (see `LONGEST`), but for those of larger junctions


class Squares:
    """Some squares of the ground (`squares` (k, 2) int64)."""

    def __init__(self, squares: NDArray[np.int64]) -> None:
        self._corner = squares.min(axis=0)
        self._has = np.zeros(squares.max(axis=0) - self._corner + 1, np.bool_)
        self._has[tuple((squares - self._corner).T)] = True
        # How many there are to the west and south of each corner of the grid.
        self._counts = np.zeros(np.array(self._has.shape) + 1, np.int64)
        self._counts[1:, 1:] = self._has.cumsum(axis=0).cumsum(axis=1)

    def touched_by(self, bounds: Bounds, margin: float) -> NDArray[np.bool_]:
        """Which bounds (n, 4) come nearer to one of the squares than a margin [m] (`bounds` (n, 4), `margin` [m])."""
        most = np.array(self._has.shape)
        low = np.floor((bounds[:, :2] - margin) / GROUND_SQUARE).astype(np.int64) - self._corner
        high = np.floor((bounds[:, 2:] + margin) / GROUND_SQUARE).astype(np.int64) - self._corner + 1
        (west, south), (east, north) = np.clip(low, 0, most).T, np.clip(high, 0, most).T
        counts = self._counts
        return np.asarray(counts[east, north] - counts[west, north] - counts[east, south] + counts[west, south] > 0)

    def part_of(self, ground: Mesh) -> Mesh:
        """Triangles of a mesh whose middles lie in the squares, in their order."""
        middle = ground.positions[ground.faces, :2].mean(axis=1)
        square = np.floor(middle / GROUND_SQUARE).astype(np.int64) - self._corner
        inside = np.all((square >= 0) & (square < self._has.shape), axis=1)
        inside[inside] = self._has[tuple(square[inside].T)]
        faces = ground.faces[inside]
        used = np.zeros(len(ground.positions), np.bool_)
        used[faces] = True
        renumbered = np.cumsum(used, dtype=np.uint32) - np.uint32(1)
        return Mesh(
            positions=ground.positions[used],
            normals=ground.normals[used],
            reflectance=ground.reflectance[used],
            surface=ground.surface[used],
            road=ground.road[used],
            instance=ground.instance[used],
            faces=renumbered[faces],
        )


class Spread(Generic[T]):
    """Things that lie here and there (`lines` (n, 2 or 3) [m])."""

    def __init__(self, things: Sequence[T], lines: Sequence[NDArray[np.float64]]) -> None:
        self._things = things
        self.bounds: Bounds = np.zeros((0, 4))
        if lines:
            first = np.cumsum([0, *map(len, lines[:-1])])
            places = np.concatenate([line[:, :2] for line in lines])
            self.bounds = np.hstack((np.minimum.reduceat(places, first), np.maximum.reduceat(places, first)))

    def near(self, squares: Squares | None, margin: float) -> Sequence[T]:
        """Those that come nearer to some squares than a margin [m], in their order; all, if no squares are given.

        Takes `margin` [m].
        """
        if squares is None:
            return self._things
        chosen = np.flatnonzero(squares.touched_by(self.bounds, margin)).tolist()
        return [self._things[place] for place in chosen]


@dataclass(frozen=True, slots=True)
class Rail:
    """A guard rail."""

    line: Points  # (n, 3): The road's line along it [m]
    side: int  # 1 on its left, −1 on its right
    distance: float  # How far next to that line it stands [m]


@dataclass(frozen=True, slots=True)
class Border:
    """A free side of a lane."""

    edge: Edge  # The side
    rails: tuple[Rail, ...] = ()  # Guard rails along it


class GroundPlan:
    """What the ground is made of.

    Parameters
    ----------
    areas : sequence of PavedArea
        Where roads and footways meet.
    lanes : sequence of Lane
        All lanes with a length.
    across : sequence of Lane
        Those of them that lie within junctions.
    borders : sequence of Border
        Free sides of the others.
    bridges : sequence of Gantry
        Gantries.
    index : LaneIndex
        All lanes.
    terrain : Terrain
        The land.

    Attributes
    ----------
    plain : Mesh
        Level land without an end.
    bounds : (4,) float64
        West, south, east and north ends of the lanes [m].
    overhang : float
        How far triangles may reach beyond the square that their middle is in [m].
    beside : float
        How far next to lanes and junctions there may be ground of theirs [m].
    """

    def __init__(
        self,
        areas: Sequence[PavedArea],
        lanes: Sequence[Lane],
        across: Sequence[Lane],
        borders: Sequence[Border],
        bridges: Sequence[Gantry],
        index: LaneIndex,
        terrain: Terrain,
    ) -> None:
        self._index, self._terrain, self._bridges = index, terrain, bridges
        within = {lane.lane_id for lane in across}
        open_lanes = [lane for lane in lanes if lane.lane_id not in within]
        leading = [lane for lane in open_lanes if lane.kind in {LaneKind.CARRIAGEWAY, LaneKind.FOOTWAY}]
        self._driven = [lane for lane in lanes if lane.kind in {LaneKind.CARRIAGEWAY, LaneKind.JUNCTION}]
        self._open_lanes, self._across, self._leading = map(_spread, (open_lanes, across, leading))
        self._areas = Spread(areas, [area.outline for area in areas])
        self._borders = Spread(borders, [border.edge.line for border in borders])
        self._chainage = Chainage(self._driven)
        self.plain, self._land = plain_mesh(open_lanes, terrain.plain), terrain.mesh()
        everything = np.concatenate([lane.centreline for lane in lanes])
        self.beside = _BESIDE + _SLOPES * float(np.ptp(everything[:, 2])) + max(lane.width for lane in lanes)
        if self._land is not None:
            everything = np.concatenate((everything, self._land.positions))
        self.bounds = np.concatenate((everything[:, :2].min(axis=0), everything[:, :2].max(axis=0)))
        self._widest = float(np.max(self._areas.bounds[:, 2:] - self._areas.bounds[:, :2], initial=0.0))
        self.overhang = max(_LONG, self._widest)

    def mesh(self, squares: Squares | None = None) -> Mesh:
        """Build the ground."""
        parts = itertools.chain(
            [self.plain] if squares is None else [],
            self._pavement(squares),
            self._beside_roads(squares),
            (gantry_mesh(gantry, self._terrain) for gantry in self._bridges),
            [] if self._land is None else [self._land],
        )
        blocks = iter(lambda: list(itertools.islice(parts, _BLOCK)), [])
        return merge([merge(block) if squares is None else squares.part_of(merge(block)) for block in blocks])

    @functools.cached_property
    def _driven_index(self) -> LaneIndex:
        return LaneIndex(self._driven)

    def _pavement(self, squares: Squares | None) -> Iterator[Mesh]:
        """Lanes, junctions, footways and what is painted across them."""
        across = self._across.near(squares, self.beside)
        # Some stick out of their junction in bends.
        inside = self._junctions(squares).cover_all([_sides(lane) for lane in across])
        bulging = [lane for lane, is_inside in zip(across, inside, strict=True) if not is_inside]
        lanes = [*self._open_lanes.near(squares, self.beside), *bulging]
        seen = [lane for lane in lanes if lane.kind in {LaneKind.CARRIAGEWAY, LaneKind.JUNCTION}]
        footways = [lane for lane in lanes if lane.kind is LaneKind.FOOTWAY]
        paved = map(area_mesh, walkable(self._areas.near(squares, self.beside), self._driven))
        yield from (lane_mesh(lane, self._chainage) for lane in seen)
        yield from (footway_mesh(line, (-half, half)) for lane in footways for line, half in self._kept_off(lane))
        yield from (area for area in paved if area is not None)
        yield from transverse_markings(lanes)

    def _junctions(self, squares: Squares | None) -> Areas:
        return Areas(self._areas.near(squares, self.beside + 2.0 * self._widest))

    def _kept_off(self, lane: Lane) -> Iterator[tuple[Points, float]]:
        """Spans of a footway where no road lies across it, each with half its width [m]."""
        line, half = refined(cleaned(lane.centreline), LONGEST), lane.width / 2
        if not self._driven:
            yield line, half
            return
        driven = self._driven_index
        least = min(half, 0.8) - _ASTRAY
        if np.any(driven.clearance(refined(line, _LOOK), same_level=2.5, within=1.0) < least):
            line = refined(line, _LOOK)
        for start, end in true_spans(driven.clearance(line, same_level=2.5, within=1.0) >= least, least=2):
            yield line[start:end], half

    def _beside_roads(self, squares: Squares | None) -> Iterator[Mesh]:
        """What lies along free sides of lanes and of junctions."""
        for border in self._borders.near(squares, self.beside):
            yield from edge_meshes(border.edge, self._terrain, self._index)
            yield from (guard_rail(rail.line, rail.side, rail.distance) for rail in border.rails)
        areas = [area for area in self._areas.near(squares, self.beside) if area.kind is LaneKind.JUNCTION]
        leading = self._leading.near(squares, 2.0 * (self.beside + self._widest))
        if areas and leading:
            for edge in free_borders(areas, leading, self._index):
                yield from edge_meshes(edge, self._terrain, self._index)


def _spread(lanes: Sequence[Lane]) -> Spread[Lane]:
    return Spread(lanes, [lane.centreline for lane in lanes])


def _sides(lane: Lane) -> Points:
    """Both sides of a lane but for what may well stick out of a junction, and for the ends, which lie on its border."""
    line, half = refined(cleaned(lane.centreline), 2.0), max(lane.width / 2 - _STICKING_OUT, 0.0)
    if len(line) < 3:
        return line
    return np.concatenate((parallel(line, half)[1:-1], parallel(line, -half)[1:-1]))
