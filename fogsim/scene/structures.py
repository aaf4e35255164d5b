"""Walls, hedges, buildings, parked trucks and tunnels: boxes along lines."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from fogsim.scene.polyline import Points, parallel, refined
from fogsim.scene.road import LONGEST
from fogsim.scene.roadside import placed
from fogsim.scene.solids import Material, merge, quad
from fogsim.values.road import Structure, StructureKind
from fogsim.values.scene import Batch, Mesh

_MATERIALS = {
    StructureKind.WALL: Material((0.34, 0.33, 0.30)),
    StructureKind.HEDGE: Material((0.035, 0.065, 0.02)),
    StructureKind.BUILDING: Material((0.46, 0.43, 0.37)),
    StructureKind.TRUCK: Material((0.30, 0.33, 0.37)),
    StructureKind.TUNNEL: Material((0.30, 0.29, 0.27)),
}
_SPACING = 5.0  # of places along walls [m]
_UP = np.array([0.0, 0.0, 1.0])


def structure_shapes(structures: Sequence[Structure]) -> dict[str, Mesh]:
    """Shapes of structures, in pieces short enough to be culled."""
    return {name: _box(one, line - line[0]) for name, one, line in _pieces(structures)}


def structure_batches(structures: Sequence[Structure]) -> list[Batch]:
    """Where these shapes stand."""
    return [placed(name, line[:1], np.zeros(1)) for name, _, line in _pieces(structures)]


def building_places(structures: Sequence[Structure]) -> Points:
    """Places along the walls of buildings (n, 3) [m], near which nothing is put by chance."""
    walls = [refined(one.line, _SPACING) for one in structures if one.kind is StructureKind.BUILDING]
    return np.concatenate([np.zeros((0, 3)), *walls])


def _pieces(structures: Sequence[Structure]) -> Iterator[tuple[str, Structure, Points]]:
    for number, one in enumerate(structures):
        line = refined(one.line, LONGEST)
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        cuts = [0, *np.flatnonzero(np.diff(along // LONGEST)).tolist(), len(line) - 1]
        for piece, (start, end) in enumerate(itertools.pairwise(cuts)):
            if end > start:
                yield f"structure_{number}_{piece}", one, line[start : end + 1]


def _box(one: Structure, line: Points) -> Mesh:
    """A piece of a structure: its long sides, top, underside and ends."""
    material, half = _MATERIALS[one.kind], 0.5 * one.width
    low, high = ([parallel(line, side * half, lift) for side in (1, -1)] for lift in (one.bottom, one.top))
    parts = []
    for start, end in zip(range(len(line) - 1), range(1, len(line)), strict=True):
        left = np.cross(_UP, line[end] - line[start])
        for side, toward in enumerate((left, -left)):
            corners = [low[side][start], low[side][end], high[side][end], high[side][start]]
            parts.append(quad(corners, material, toward))
        for level, toward in ((low, -_UP), (high, _UP)):
            parts.append(quad([level[0][start], level[0][end], level[1][end], level[1][start]], material, toward))
    for place, toward in ((0, line[0] - line[1]), (-1, line[-1] - line[-2])):
        parts.append(quad([low[0][place], low[1][place], high[1][place], high[0][place]], material, toward))
    return merge(parts)
