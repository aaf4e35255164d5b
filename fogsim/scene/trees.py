"""Shapes of conifers, broad-leaved trees and distant woodland, a little different with every seed."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.solids import Material, grid, grid_faces, merge, mesh
from fogsim.values.scene import LEVELS_OF_DETAIL, Mesh

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


def tree_shapes(rng: np.random.Generator, kinds: int = 5) -> dict[str, Mesh]:
    """Shapes of all trees by name, each with its levels of detail."""
    shapes: dict[str, Mesh] = {}
    for name, grow in (("conifer", _conifer), ("broad_leaved", _broad_leaved), ("woodland", _woodland)):
        for i in range(kinds):
            # All levels get the same random numbers first, so colour and spread agree.
            seed = int(rng.integers(2**31))
            for level, ending in enumerate(("", *LEVELS_OF_DETAIL)):
                shapes[f"{name}_{i}{ending}"] = grow(np.random.default_rng(seed), level)
    return shapes
