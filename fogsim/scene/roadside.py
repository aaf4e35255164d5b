"""What stands next to the road and is drawn many times: trees, posts of guard rails, delineators."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import matrix_product
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import arc_length, at_distance, left_normals
from fogsim.scene.solids import Material, box, merge
from fogsim.scene.terrain import Terrain
from fogsim.values.scene import Batch, Instance, Mesh, Surface

_TREE_CLEARANCE = 9.0
"""Least distance of a tree's trunk from the edge of any lane [m]."""

Points = NDArray[np.float64]


def post_shapes() -> dict[str, Mesh]:
    """Posts in metres, standing on the origin, their backs to −x: of a guard rail and a delineator."""
    zinc = Material((0.26, 0.265, 0.27))
    white = Material((0.60, 0.60, 0.58))
    black = Material((0.02, 0.02, 0.02))
    reflector = Material((0.75, 0.72, 0.62), Surface.SHEETING)
    delineator = (
        tube(0.0, 0.76, 0.05, 0.06, white),
        tube(0.76, 0.96, 0.05, 0.06, black),
        tube(0.78, 0.94, 0.055, 0.025, reflector),
        box((-0.05, -0.06, 0.96), (0.05, 0.06, 1.05), white),
    )
    return {
        "rail_post": tube(-0.1, 0.74, 0.03, 0.06, zinc),
        "delineator": merge(delineator),
    }


def tube(bottom: float, top: float, half_depth: float, half_width: float, material: Material) -> Mesh:
    """Four upright sides of a box; the ends do not show (`bottom`, `top` [m], `half_depth`, `half_width` [m])."""
    upright = box((-half_depth, -half_width, bottom), (half_depth, half_width, top), material)
    level = np.abs(upright.normals[upright.faces[:, 0], 2]) > 0.5
    return replace(upright, faces=upright.faces[~level])


def stations(line: Points, spacing: float, left: float) -> tuple[Points, NDArray[np.float64]]:
    """Places (n, 3) at regular distances along a parallel of a line, and the directions [rad] of the line there.

    Takes `line` (n, 3) [m], `spacing` [m], `left` [m].
    """
    length = arc_length(line)
    distance = np.arange(0.5 * spacing, length[-1], spacing)
    here, normals = at_distance(line, distance), left_normals(line)
    normal = np.stack([np.interp(distance, length, normals[:, axis]) for axis in range(2)], axis=1)
    places = here + np.column_stack((left * normal, np.zeros(len(here))))
    return places, np.arctan2(-normal[:, 0], normal[:, 1])


def placed(
    shape: str,
    places: Points,
    heading: NDArray[np.float64],
    size: NDArray[np.float64] | float = 1.0,
    *,
    instance: int = Instance.ROADSIDE,
) -> Batch:
    """Batch of upright copies of a shape (`places` (n, 3) [m], `heading` (n,) [rad], `size` (n, 3))."""
    count = len(places)
    scale = np.broadcast_to(np.asarray(size, np.float64), (count, 3))
    transforms = np.zeros((count, 4, 4), np.float32)
    cosine, sine = np.cos(heading), np.sin(heading)
    transforms[:, 0, 0], transforms[:, 0, 1] = cosine * scale[:, 0], -sine * scale[:, 1]
    transforms[:, 1, 0], transforms[:, 1, 1] = sine * scale[:, 0], cosine * scale[:, 1]
    transforms[:, 2, 2], transforms[:, 3, 3] = scale[:, 2], 1.0
    transforms[:, :3, 3] = places
    return Batch(
        shape=shape,
        transforms=transforms,
        paint=np.zeros((count, 3), np.float32),
        lamps=np.zeros(count, np.int32),
        instance=np.full(count, instance, np.int32),
    )


class Spacing:
    """Places that keep a distance from one another (`distance` [m])."""

    def __init__(self, distance: float) -> None:
        self._distance = distance
        # By square cells of that side.
        self._cells: dict[tuple[int, int], list[tuple[float, float]]] = {}

    def takes(self, place: NDArray[np.float64]) -> bool:
        """Take a place unless one is taken that is too near (`place` (2 or 3,) [m])."""
        x, y = float(place[0]), float(place[1])
        column, row = math.floor(x / self._distance), math.floor(y / self._distance)
        for cell in product((column - 1, column, column + 1), (row - 1, row, row + 1)):
            if any(math.dist(other, (x, y)) <= self._distance for other in self._cells.get(cell, ())):
                return False
        self._cells.setdefault((column, row), []).append((x, y))
        return True


def trees(
    free: Sequence[tuple[int, Points]],
    index: LaneIndex,
    taken: Points,
    shapes: Mapping[str, Mesh],
    terrain: Terrain,
    rng: np.random.Generator,
) -> list[Batch]:
    """Trees near the road and woods behind them, clear of every lane (`free` (n, 3), `taken` (n, 3) [m])."""
    near = _scatter(free, rng, spacing=10.0, nearest=13.0, reach=38.0, clumps=90.0)
    near = near[(index.clearance(near) > _TREE_CLEARANCE) & apart(near, taken, 11.0)]
    conifers = _clumps(near[:, :2], 160.0, rng) + 0.35 * rng.normal(size=len(near)) > 0.1
    batches = []
    for name, members in (("conifer", conifers), ("broad_leaved", ~conifers)):
        kinds = sorted(shape for shape in shapes if shape.startswith(name) and ":" not in shape)
        batches += _planted(near[members], kinds, terrain, rng, height=(6.0, 15.0), slender=1.0)
    far = _scatter(free, rng, spacing=60.0, nearest=75.0, reach=170.0, clumps=400.0)
    far = far[(index.clearance(far) > 25.0) & apart(far, taken, 35.0)]
    kinds = sorted(shape for shape in shapes if shape.startswith("woodland") and ":" not in shape)
    return batches + _planted(far, kinds, terrain, rng, height=(9.0, 16.0), slender=5.0, clear_of=index)


def apart(places: Points, taken: Points, distance: float) -> NDArray[np.bool_]:
    """Which places lie farther than a distance from every place that is taken.

    Takes `places`, `taken` (m, 3) [m], `distance` [m].
    """
    order = np.argsort(places[:, 0], kind="stable")
    apart = np.empty(len(places), np.bool_)
    apart[order] = _sorted_apart(places[order], taken, distance)
    return apart


@kernel
def _sorted_apart(places: Points, taken: Points, distance: float) -> NDArray[np.bool_]:
    """Which places (n, 3), from west to east, lie apart from every one that is taken (see `apart`)."""
    apart, east = np.ones(len(places), np.bool_), np.ascontiguousarray(places[:, 0])
    for k in range(len(taken)):
        x, y = taken[k, 0], taken[k, 1]
        # Only those in the same strip from south to north may be near.
        for i in range(np.searchsorted(east, x - distance), np.searchsorted(east, x + distance, "right")):
            if abs(places[i, 1] - y) <= distance and abs(places[i, 0] - x) <= distance:
                apart[i] = False
    return apart


def _scatter(
    free: Sequence[tuple[int, Points]],
    rng: np.random.Generator,
    *,
    spacing: float,
    nearest: float,
    reach: float,
    clumps: float,
) -> Points:
    """Random places next to free sides, where a slowly changing density lets them stand."""
    groups = [np.zeros((0, 3))]
    for side, line in free:
        count = rng.poisson(arc_length(line)[-1] / spacing)
        here = at_distance(line, rng.uniform(0.0, arc_length(line)[-1], count))
        direction = np.arctan2(*(line[-1, 1::-1] - line[0, 1::-1])) + side * np.pi / 2
        away = nearest + reach * rng.beta(1.0, 1.8, count)
        groups.append(here + np.column_stack((away * np.cos(direction), away * np.sin(direction), np.zeros(count))))
    places = np.concatenate(groups)
    return places[_clumps(places[:, :2], clumps, rng) > -0.35]


def _clumps(places: NDArray[np.float64], wavelength: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Slowly changing random value −1 … 1 at places (n, 2): a sum of plane waves."""
    angle, phase = rng.uniform(0, 2 * np.pi, (2, 6))
    number = 2 * np.pi / (wavelength * rng.uniform(0.6, 1.8, 6))
    waves = np.stack((np.cos(angle), np.sin(angle))) * number
    return np.asarray(np.sin(matrix_product(places, waves) + phase).mean(axis=1) * 1.8, np.float64)


def _planted(
    places: Points,
    kinds: Sequence[str],
    terrain: Terrain,
    rng: np.random.Generator,
    *,
    height: tuple[float, float],
    slender: float,
    clear_of: LaneIndex | None = None,
) -> list[Batch]:
    standing = np.column_stack((places[:, :2], terrain.height(places) - 0.05))
    kind = rng.integers(len(kinds), size=len(places))
    tall = rng.uniform(*height, len(places))
    wide = tall * slender * rng.uniform(0.85, 1.2, len(places))
    size = np.column_stack((wide, np.minimum(wide, 1.5 * tall), tall))
    turn = rng.uniform(0, 2 * np.pi, len(places))
    fits = np.ones(len(places), np.bool_) if clear_of is None else _fitting(standing, turn, wide, clear_of)
    chosen = [(name, fits & (kind == i)) for i, name in enumerate(kinds)]
    return [placed(name, standing[own], turn[own], size[own]) for name, own in chosen if np.any(own)]


def _fitting(
    places: Points, turn: NDArray[np.float64], wide: NDArray[np.float64], index: LaneIndex
) -> NDArray[np.bool_]:
    """Which woods, as wide as given [m], stand clear of every lane from end to end."""
    along = np.column_stack((np.cos(turn), np.sin(turn), np.zeros(len(turn)))) * wide[:, None]
    fits = np.ones(len(places), np.bool_)
    for share in np.linspace(-0.5, 0.5, 9).tolist():
        fits &= index.clearance(places + share * along) > _TREE_CLEARANCE
    return fits
