"""Where the lamps of a shape are, and rectangles that take their place in levels of detail."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.scene.solids import Material, merge, quad
from fogsim.values.scene import Mesh, Surface

LAMP_SURFACES = (
    Surface.LAMP_POSITION_REAR,
    Surface.LAMP_STOP,
    Surface.LAMP_REAR_FOG,
    Surface.LAMP_INDICATOR_LEFT,
    Surface.LAMP_INDICATOR_RIGHT,
    Surface.LAMP_HEAD,
)
"""Surfaces of the lamps of vehicles."""

_THIRD = 0.4  # area of the third stop lamp, in the middle, in terms of the others'
_END = 0.04  # lamps this near to an end of the box are at it [units of the shape]
_APART = 0.001  # a panel that reaches less far over the middle lies on one side of it [units of the shape]


@dataclass(frozen=True, slots=True)
class Patch:
    """One lamp of a shape."""

    surface: Surface  # which lamp
    centre: NDArray[np.float64]  # its middle, weighted by area
    low: NDArray[np.float64]  # corners of its bounding box
    high: NDArray[np.float64]
    area: float  # area as seen from straight ahead or behind, in units of the box's width times its height
    front: bool  # true if it shines forwards, else backwards
    side: int  # 1 on the left, −1 on the right, 0 if in the middle
    reflectance: NDArray[np.float64]  # colour of its lens
    vertices: NDArray[np.int64]  # its vertices in the shape


def lamp_patches(shape: Mesh) -> list[Patch]:
    """Lamps of a shape in a unit box whose front lies at x = 0: each kind on the left, in the middle and right."""
    return _patches(shape, _side(shape), -0.5)


def _patches(shape: Mesh, side: NDArray[np.int64], middle_x: float) -> list[Patch]:
    corners = shape.positions[shape.faces].astype(np.float64)
    kind, middle = shape.surface[shape.faces[:, 0]], corners.mean(axis=1)
    double = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    weight, seen = np.linalg.norm(double, axis=1), 0.5 * np.abs(double[:, 0])
    patches = []
    for surface, front, which in product(LAMP_SURFACES, (False, True), (-1, 0, 1)):
        chosen = (kind == surface) & (side == which) & ((middle[:, 0] > middle_x) == front)
        if chosen.any():
            vertices = np.unique(shape.faces[chosen])
            patches.append(
                Patch(
                    surface=surface,
                    centre=matrix_product(weight[chosen], middle[chosen]) / weight[chosen].sum(),
                    low=corners[chosen].min(axis=(0, 1)),
                    high=corners[chosen].max(axis=(0, 1)),
                    area=float(seen[chosen].sum()),
                    front=front,
                    side=which,
                    reflectance=shape.reflectance[vertices[0]].astype(np.float64),
                    vertices=vertices,
                )
            )
    return patches


def _panels(shape: Mesh) -> NDArray[np.int64]:
    """For each vertex the number of the panel that it belongs to: what hangs together by triangles."""
    panel = np.arange(len(shape.positions))
    while True:
        joined = panel.copy()
        np.minimum.at(joined, shape.faces, panel[shape.faces].min(axis=1)[:, None])
        if np.array_equal(joined, panel):
            return joined
        panel = joined


def _side(shape: Mesh) -> NDArray[np.int64]:
    """For each triangle 1 if the panel that it belongs to lies on the left, −1 on the right, 0 if in the middle."""
    panel = _panels(shape)
    low, high = np.full(len(panel), np.inf), np.full(len(panel), -np.inf)
    np.minimum.at(low, panel, shape.positions[:, 1])
    np.maximum.at(high, panel, shape.positions[:, 1])
    side = np.where(low > -_APART, 1, np.where(high < _APART, -1, 0))
    return np.asarray(side[panel[shape.faces[:, 0]]], np.int64)


def with_lit_areas(body: Mesh, areas: Mapping[Surface, float]) -> Mesh:
    """Body in metres, x backwards, whose lamps are lit in the middle of their lenses only, in real areas [m²]."""
    shape = replace(body, positions=body.positions * np.array([-1.0, 1.0, 1.0], np.float32))
    lens, core = body.surface.copy(), body.positions.astype(np.float64)
    panel, side = _panels(body), _side(shape)
    middle_x = -0.5 * float(np.ptp(body.positions[:, 0]))
    patches = _patches(shape, side, middle_x)
    stops = sum(patch.surface is Surface.LAMP_STOP for patch in patches)
    for patch in patches:
        lens[patch.vertices] = Surface.MATT
        third = stops == 3 and patch.surface is Surface.LAMP_STOP and patch.low[1] < 0.0 < patch.high[1]
        share = min(np.sqrt(areas[patch.surface] * (_THIRD if third else 1.0) / patch.area), 1.0)
        for one in np.unique(panel[patch.vertices]):
            members = np.flatnonzero(panel == one)
            centre = core[members].mean(axis=0)
            core[members] = centre + share * (core[members] - centre)
    lamps = np.isin(body.surface, LAMP_SURFACES)
    core += 0.006 * body.normals
    lit = replace(body, positions=core.astype(np.float32), faces=body.faces[lamps[body.faces[:, 0]]])
    return merge((replace(body, surface=lens), drop_unused(lit)))


def drop_unused(part: Mesh) -> Mesh:
    """The mesh without the vertices that no triangle has."""
    used, renumbered = np.unique(part.faces, return_inverse=True)
    return Mesh(
        positions=part.positions[used],
        normals=part.normals[used],
        reflectance=part.reflectance[used],
        surface=part.surface[used],
        road=part.road[used],
        instance=part.instance[used],
        faces=renumbered.reshape(-1, 3).astype(np.uint32),
    )


def lamp_quads(shape: Mesh) -> Mesh:
    """One rectangle for each lamp of a shape, facing straight forwards or backwards, and the lenses of the rear."""
    patches = lamp_patches(shape)
    parts = [_rectangle(patch, *_lit_box(patch), patch.surface, 0.0) for patch in patches]
    for which in (-1, 1):
        red = [p for p in patches if p.surface in _RED and not p.front and p.side == which and _at_end(p)]
        if red:
            low, high = np.min([p.low for p in red], axis=0), np.max([p.high for p in red], axis=0)
            parts.append(_rectangle(red[0], low, high, Surface.MATT, 0.002))
    return merge(parts)


_RED = (Surface.LAMP_POSITION_REAR, Surface.LAMP_STOP)


def _at_end(patch: Patch) -> bool:
    return not _END < -patch.centre[0] < 1.0 - _END


def _lit_box(patch: Patch) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Bounding box shrunk about its middle to the lamp's area."""
    middle, half = 0.5 * (patch.low + patch.high), 0.5 * (patch.high - patch.low)
    share = np.sqrt(min(patch.area / (4.0 * half[1] * half[2]), 1.0))
    return middle - share * half, middle + share * half


def _rectangle(
    patch: Patch, low: NDArray[np.float64], high: NDArray[np.float64], surface: Surface, behind: float
) -> Mesh:
    toward = 1.0 if patch.front else -1.0
    # Simple bodies end a little inside their box.
    x = (0.0 if patch.front else -1.0) if _at_end(patch) else float(patch.high[0] if patch.front else patch.low[0])
    x -= toward * behind
    corners = [(x, low[1], low[2]), (x, high[1], low[2]), (x, high[1], high[2]), (x, low[1], high[2])]
    red, green, blue = patch.reflectance.tolist()
    return quad(corners, Material((red, green, blue), surface), (toward, 0.0, 0.0))
