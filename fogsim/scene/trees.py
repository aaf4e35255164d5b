"""Shapes of conifers, broad-leaved trees and distant woodland, a little different with every seed."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import cache, lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.edges import Edge
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Points
from fogsim.scene.road import TOWN
from fogsim.scene.roadside import Spacing, apart, placed, stations
from fogsim.scene.solids import GLASS, Material, grid, grid_faces, merge, mesh, polygon, quad
from fogsim.scene.terrain import Terrain
from fogsim.values.scene import FAR, LEVELS_OF_DETAIL, TINY, Batch, Mesh

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


_BARK = Material((0.055, 0.042, 0.032))

_OCTAHEDRON = (
    np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64),
    np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (1, 0, 5), (2, 1, 5), (3, 2, 5), (0, 3, 5)]),
)
_A, _B = np.array([1.0, (1.0 + 5.0**0.5) / 2.0]) / (1.0 + ((1.0 + 5.0**0.5) / 2.0) ** 2) ** 0.5
_ICOSAHEDRON = (
    np.array(
        [
            *((-_A, _B, 0), (_A, _B, 0), (-_A, -_B, 0), (_A, -_B, 0), (0, -_A, _B), (0, _A, _B)),
            *((0, -_A, -_B), (0, _A, -_B), (_B, 0, -_A), (_B, 0, _A), (-_B, 0, -_A), (-_B, 0, _A)),
        ]
    ),
    np.array(
        [
            *((0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)),
            *((10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)),
            *((2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)),
        ]
    ),
)
"""Corners, on the unit sphere, and triangles."""


def _conifer(rng: np.random.Generator, level: int) -> Mesh:
    """Spruce of 1 m height: ragged whorls of branches around a trunk."""
    whorls, branches, long = ((11, 11, 0.24), (8, 8, 0.28), (5, 5, 0.36), (2, 3, 0.7), (1, 2, 1.0))[level]
    colour = np.array([0.030, 0.052, 0.028]) * rng.uniform(0.8, 1.2) + np.array([0.006, 0.004, 0.0]) * rng.random()
    # Levels of detail have less of the bright tips.
    colour *= (1.0, 1.015, 1.035, 1.06, 1.12)[level]
    spread = rng.uniform(0.17, 0.24)
    parts = [_trunk(0.2, 0.016)] if level < 3 else []
    for place in range(whorls):
        share = place / whorls
        bottom = 0.07 + 0.88 * share
        top = min(bottom + long * (1.15 - share), 1.0)
        radius = spread * (1.0 - share) ** 0.85 * rng.uniform(0.88, 1.1)
        parts.append(_whorl(rng, bottom, top if place < whorls - 1 else 1.0, radius, branches, colour))
    return merge(parts)


def _trunk(height: float, radius: float, sides: int = 4) -> Mesh:
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    ring = np.column_stack((np.cos(angle), np.sin(angle), np.zeros(sides + 1)))
    points = np.stack((ring * radius, ring * radius * 0.8 + (0, 0, height)))
    return mesh(points, grid_faces(2, sides + 1), np.vstack((ring, ring)), _BARK)


def _whorl(
    rng: np.random.Generator, bottom: float, top: float, radius: float, branches: int, colour: NDArray[np.float64]
) -> Mesh:
    count = 2 * branches
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False) + rng.uniform(0, 1)
    # Every other point of the rim is a notch between two branches; branch tips hang.
    tip = np.arange(count) % 2 == 0
    reach = radius * np.where(tip, rng.uniform(0.75, 1.15, count), rng.uniform(0.5, 0.72, count))
    height = bottom + np.where(tip, rng.uniform(-0.025, 0.01, count), 0.03)
    rim = np.column_stack((reach * np.cos(angle), reach * np.sin(angle), height))
    points = np.vstack((rim, [(0.0, 0.0, top)]))
    following = (np.arange(count) + 1) % count
    faces = np.column_stack((np.arange(count), following, np.full(count, count)))
    normals = np.vstack((np.column_stack((np.cos(angle), np.sin(angle), np.full(count, 0.45))), [(0, 0, 1)]))
    # Light reaches the tips; towards the trunk, under the next whorl, it is dark.
    light = np.append(np.where(tip, 1.25, 0.7) * rng.uniform(0.85, 1.15, count), 0.35)
    return mesh(points, faces, normals, Material((0, 0, 0)), reflectance=light[:, None] * colour)


def _broad_leaved(rng: np.random.Generator, level: int) -> Mesh:
    """Broad-leaved tree of 1 m height: a trunk and a crown of blobs ragged with clusters of leaves."""
    colour = np.array([0.044, 0.066, 0.026]) * rng.uniform(0.75, 1.25) + np.array([0.014, 0.006, 0.0]) * rng.random()
    # Levels of detail have less of the bright leaves and of the ragged outline.
    colour *= (1.0, 1.035, 1.065, 1.09, 1.03)[level]
    width = rng.uniform(0.22, 0.30) * (1.0, 1.0, 1.01, 1.13, 1.42)[level]
    middle, size = np.array([0.0, 0.0, 0.60]), np.array([1.15 * width, 1.15 * width, 0.33])
    parts = [_trunk(0.4, 0.022, 4 if level < 3 else 3)] if level < 4 else []
    blobs, leaves = ((8, (80, 50)), (5, (30, 16)), (3, (0, 0)), (0, (0, 0)), (0, (0, 0)))[level]
    # A core that no light shines through, and around it what gives the crown its outline.
    parts += _blob(rng, middle, size, colour, leaves[0], level == 4)
    turn = rng.uniform(0, 2 * np.pi)
    for place in range(blobs):
        # The golden angle spreads any number of blobs evenly around the crown.
        angle, rise = turn + 2.4 * place, rng.uniform(-0.75, 0.8)
        out = np.array([np.cos(angle), np.sin(angle), 0.0]) * np.sqrt(1 - rise**2) + np.array([0, 0, rise])
        blob = rng.uniform(0.40, 0.58) * size * (1.0, 1.0, 0.8)
        parts += _blob(rng, middle + 0.8 * size * out, blob, colour, leaves[1])
    whole = merge(parts)
    return replace(whole, positions=whole.positions / whole.positions[:, 2].max())


def _blob(
    rng: np.random.Generator,
    centre: NDArray[np.float64],
    size: NDArray[np.float64],
    colour: NDArray[np.float64],
    leaves: int,
    coarse: bool = False,
) -> list[Mesh]:
    direction, faces = _OCTAHEDRON if coarse else _ICOSAHEDRON
    points = centre + direction * size * rng.uniform(0.85, 1.15, (len(direction), 1))
    light = _crown_light(direction, points) * rng.uniform(0.8, 1.2, len(points))
    parts = [mesh(points, faces, direction, Material((0, 0, 0)), reflectance=light[:, None] * colour)]
    return [*parts, _leaf_clusters(rng, centre, size, colour, leaves)] if leaves else parts


def _crown_light(direction: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of light that reaches the outside of a blob: little below it and little low in the crown."""
    return np.asarray((0.66 + 0.34 * direction[:, 2]) * (0.35 + 0.85 * np.clip(points[:, 2], 0.1, 1.0)), np.float64)


def _leaf_clusters(
    rng: np.random.Generator,
    centre: NDArray[np.float64],
    size: NDArray[np.float64],
    colour: NDArray[np.float64],
    count: int,
) -> Mesh:
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    middle = centre + direction * size * rng.uniform(0.85, 1.15, (count, 1))
    corners = middle[:, None, :] + rng.normal(size=(count, 3, 3)) * 0.026
    light = _crown_light(direction, middle) * rng.uniform(0.8, 1.45, count)
    return mesh(
        corners,
        np.arange(3 * count).reshape(-1, 3),
        np.repeat(direction, 3, axis=0),
        Material((0, 0, 0)),
        reflectance=np.repeat(light[:, None] * colour, 3, axis=0),
    )


def _woodland(rng: np.random.Generator, level: int) -> Mesh:
    """Edge of a wood, 1 m wide along x and 1 m high: two ragged curtains of crowns, dark below."""
    columns = (30, 24, 16, 7, 4)[level]
    green = np.array([0.040, 0.057, 0.027]) * rng.uniform(0.8, 1.2)
    parts = []
    # One curtain alone is as bright as both.
    curtains = ((0.08, 1.0, 0.7), (-0.06, 0.72, 1.0)) if level < 2 else ((0.0, 1.0, 1.0),)
    for depth, tall, bright in curtains:
        x = np.linspace(-0.5, 0.5, columns) + rng.uniform(-0.4, 0.4, columns) / columns
        # Crowns of different trees: some points are gaps between them, and the ends fall off to bushes.
        gap = rng.choice([0.74, 0.9, 1.0], columns, p=[0.2, 0.3, 0.5])
        top = tall * gap * rng.uniform(0.86, 1.0, columns) * np.clip(14 * (0.52 - np.abs(x)), 0.2, 1.0)
        rows = [np.column_stack((x, depth + 0.1 * s * np.ones(columns), top * s)) for s in (0.0, 1.0)]
        light = np.array([0.35, 1.05])[None, :, None] * rng.uniform(0.75, 1.25, (columns, 2, 1))
        shade = (bright * light * green).reshape(-1, 3)
        parts.append(grid(np.stack(rows, axis=1), Material((0, 0, 0)), (0, -1, 0.8), reflectance=shade))
    whole = merge(parts)
    return replace(whole, positions=(whole.positions / (1, 1, whole.positions[:, 2].max())).astype(np.float32))


_GROWN: Mapping[str, Callable[[np.random.Generator, int], Mesh]] = {
    "conifer": _conifer,
    "broad_leaved": _broad_leaved,
    "woodland": _woodland,
}


def tree_shapes(rng: np.random.Generator, kinds: int = 5) -> dict[str, Mesh]:
    """Shapes of all trees by name, each with its levels of detail."""
    shapes: dict[str, Mesh] = {}
    for name in _GROWN:
        for i in range(kinds):
            levels = _levels(name, int(rng.integers(2**31)))
            shapes |= {f"{name}_{i}{ending}": level for ending, level in zip(_ENDINGS, levels, strict=True)}
    return shapes


_ENDINGS = ("", *LEVELS_OF_DETAIL)


@lru_cache(maxsize=64)
def _levels(name: str, seed: int) -> tuple[Mesh, ...]:
    """A tree at each level of detail, remembered since runs begin again with the same seed of the scenery."""
    # All levels get the same random numbers first, so colour and spread agree.
    levels = tuple(_GROWN[name](np.random.default_rng(seed), level) for level in range(len(_ENDINGS)))
    for level, column in product(levels, fields(Mesh)):
        getattr(level, column.name).flags.writeable = False
    return levels
