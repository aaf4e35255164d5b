"""Houses along streets."""

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.edges import Edge
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Points
from fogsim.scene.road import TOWN
from fogsim.scene.roadside import Spacing, apart, placed, stations
from fogsim.scene.solids import GLASS, Material, merge, polygon, quad
from fogsim.scene.terrain import Terrain
from fogsim.values.scene import FAR, TINY, Batch, Mesh

_HOUSE_RADIUS = 9.0
"""Nothing else stands nearer to the middle of a house [m]."""

_PLOT = 21.0  # length of street for each house [m]
_GARDEN = 9.5  # from the end of the footway to a house's middle [m]
_KINDS = (  # width, depth, height of the eaves, rise of the roof [m], walls, roof
    (10.5, 9.0, 5.4, 3.6, (0.52, 0.49, 0.42), (0.15, 0.065, 0.045)),
    (12.5, 9.5, 5.8, 3.0, (0.24, 0.12, 0.085), (0.065, 0.066, 0.07)),
    (9.0, 8.5, 3.1, 4.2, (0.58, 0.57, 0.54), (0.17, 0.075, 0.05)),
    (13.5, 10.5, 8.6, 3.2, (0.44, 0.43, 0.38), (0.075, 0.07, 0.068)),
)
_SILL = Material((0.55, 0.55, 0.53))
_DOOR = Material((0.10, 0.055, 0.03))
_Z = np.array([0.0, 0.0, 1.0])


@cache
def house_shapes() -> Mapping[str, Mesh]:
    """Shapes of houses, fronts to −y, with their levels of detail: the same in every scene."""
    shapes: dict[str, Mesh] = {}
    for number, (width, depth, eaves, rise, wall, roof) in enumerate(_KINDS):
        size = (width, depth, eaves, rise)
        body = _walls(size, Material(wall), Material(roof))
        name = f"house_{number}"
        shapes |= {name: merge((body, *_openings(size))), name + FAR: merge((body, _bands(size))), name + TINY: body}
    return shapes


def _walls(size: tuple[float, float, float, float], wall: Material, roof: Material) -> Mesh:
    width, depth, eaves, rise = size
    x, y, top = width / 2, depth / 2, eaves + rise
    parts = []
    for side in (-1.0, 1.0):
        front = [(-x, side * y, -0.5), (x, side * y, -0.5), (x, side * y, eaves), (-x, side * y, eaves)]
        parts.append(quad(front, wall, (0.0, side, 0.0)))
        gable = [(-y, -0.5), (y, -0.5), (y, eaves), (0.0, top), (-y, eaves)]
        parts.append(polygon([(side * x, a, b) for a, b in gable], wall, (side, 0.0, 0.0)))
        out = [(-x - 0.4, side * (y + 0.5), eaves - 0.35), (x + 0.4, side * (y + 0.5), eaves - 0.35)]
        ridge = [(x + 0.4, 0.0, top + 0.05), (-x - 0.4, 0.0, top + 0.05)]
        parts.append(quad([*out, *ridge], roof, (0.0, side * rise, y)))
    return merge(parts)


def _openings(size: tuple[float, float, float, float]) -> list[Mesh]:
    """Windows with frames in rows, and a door in the front."""
    width, depth, eaves, _ = size
    parts = [_pane(0.0, 0.0, 1.05, 2.1, -depth / 2, _DOOR)]
    for floor in np.arange(0.95, eaves - 1.4, 2.7).tolist():
        for x in np.linspace(-width / 2 + 1.6, width / 2 - 1.6, max(round(width / 3), 2)).tolist():
            for y in (-depth / 2, depth / 2):
                if floor > 1.0 or abs(x) > 1.3:
                    parts += [_pane(x, floor - 0.08, 1.36, 1.46, y, _SILL), _pane(x, floor, 1.2, 1.3, 1.002 * y, GLASS)]
        for side in (-1.0, 1.0):
            pane = [(side * (width / 2 + 0.03), y, z) for y, z in _box(0.0, floor, 1.2, 1.3)]
            parts.append(quad(pane, GLASS, (side, 0.0, 0.0)))
    return parts


def _bands(size: tuple[float, float, float, float]) -> Mesh:
    """What windows look like from afar: one dark band for each floor."""
    width, depth, eaves, _ = size
    floors = np.arange(0.95, eaves - 1.4, 2.7).tolist()
    haze = Material((0.17, 0.165, 0.15))
    return merge([_pane(0.0, z, width - 2.0, 1.1, side * depth / 2, haze) for z in floors for side in (-1, 1)])


def _box(middle: float, low: float, width: float, height: float) -> list[tuple[float, float]]:
    a, b, top = middle - width / 2, middle + width / 2, low + height
    return [(a, low), (b, low), (b, top), (a, top)]


def _pane(x: float, low: float, width: float, height: float, y: float, material: Material) -> Mesh:
    side = 1.0 if y > 0 else -1.0
    return quad([(a, y + 0.02 * side, b) for a, b in _box(x, low, width, height)], material, (0.0, side, 0.0))


def houses(
    edges: Sequence[Edge], index: LaneIndex, terrain: Terrain, rng: np.random.Generator, buildings: Points
) -> list[Batch]:
    """Houses that face the streets, where there is room (`buildings` (n, 3) [m])."""
    found: dict[str, list[tuple[Points, float, float]]] = {}
    taken = Spacing(1.8 * _HOUSE_RADIUS)
    plots = [_plots(edge) for edge in edges if edge.speed_limit <= TOWN]
    places = np.concatenate([np.zeros((0, 3)), *(own for own, _ in plots)])
    facing = np.concatenate([np.zeros(0), *(turn for _, turn in plots)])
    room = (index.clearance(places) > _HOUSE_RADIUS) & apart(places, buildings, _PLOT)
    for place, turn, free in zip(places, facing.tolist(), room.tolist(), strict=True):
        built, kind, size = rng.random() < 0.8, int(rng.integers(len(_KINDS))), rng.uniform(0.9, 1.12)
        if built and free and taken.takes(place):
            found.setdefault(f"house_{kind}", []).append((place, turn, size))
    return [_built(name, members, terrain) for name, members in found.items()]


def _plots(edge: Edge) -> tuple[Points, NDArray[np.float64]]:
    """Where houses may stand along a street (n, 3) [m], and their headings [rad]."""
    places, along = stations(edge.line, _PLOT, edge.side * (edge.inner + edge.shoulder + _GARDEN))
    return places, along if edge.side > 0 else along + np.pi


def _built(name: str, members: Sequence[tuple[Points, float, float]], terrain: Terrain) -> Batch:
    places = np.array([place for place, _, _ in members])
    places[:, 2] = terrain.height(places)
    sizes = np.array([[size] * 3 for _, _, size in members])
    return placed(name, places, np.array([turn for _, turn, _ in members]), sizes)


def house_places(batches: Sequence[Batch]) -> Points:
    """Middles of houses (n, 3) [m]."""
    return np.concatenate([np.zeros((0, 3)), *(batch.transforms[:, :3, 3].astype(np.float64) for batch in batches)])


def shapes_in_use(shapes: Mapping[str, Mesh], batches: Sequence[Batch]) -> dict[str, Mesh]:
    """Those shapes, with their levels of detail, that batches refer to."""
    used = {batch.shape for batch in batches}
    return {name: shape for name, shape in shapes.items() if name.split(":", maxsplit=1)[0] in used}
