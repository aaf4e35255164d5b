"""What bodies are put together from besides what roads and signs are: materials, round solids, mirror images."""

import math
from dataclasses import replace

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from fogsim.scene.solids import Material, facetted, merge
from fogsim.values.scene import Mesh, Surface

PAINT = Material((0.5, 0.5, 0.5), Surface.PAINT)
TYRE = Material((0.025, 0.025, 0.027))
BLACK_PLASTIC = Material((0.03, 0.03, 0.032))
UNDERBODY = Material((0.012, 0.012, 0.013))
STEEL = Material((0.33, 0.34, 0.35))
CHROME = Material((0.40, 0.41, 0.42))


def cylinder(start: ArrayLike, end: ArrayLike, radius: float, material: Material, *, sides: int = 12) -> Mesh:
    """Closed facetted cylinder between the middles of its two ends."""
    # trimesh's own is turned by singular vectors, which LAPACK rounds as the processor has it.
    ends = np.stack((np.asarray(start, float), np.asarray(end, float)))
    along = (ends[1] - ends[0]) / math.dist(*ends)
    across, angle = _perpendicular(along), np.linspace(0.0, 2 * np.pi, sides, endpoint=False)[:, None]
    rim = radius * (np.cos(angle) * across + np.sin(angle) * np.cross(along, across))
    below, above = ends[:, None] + rim
    next_below, next_above = np.roll(below, -1, axis=0), np.roll(above, -1, axis=0)
    low, high = (np.broadcast_to(end, rim.shape) for end in ends)
    triangles = (
        (below, next_below, next_above),
        (below, next_above, above),
        (low, next_below, below),
        (high, above, next_above),
    )
    return facetted(np.concatenate([np.stack(corners, axis=1) for corners in triangles]), material)


def _perpendicular(along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vector at right angles to a unit vector: where Householder's reflection of that to x takes z."""
    x, y, z = along.tolist()
    share = math.copysign(1.0 / (1.0 + abs(x)), x)
    return np.array([z, share * y * z, share * z * z - math.copysign(1.0, x)])


def ball(centre: ArrayLike, radius: float, material: Material) -> Mesh:
    """Facetted ball of 80 triangles."""
    solid = trimesh.creation.icosphere(subdivisions=1, radius=radius)
    solid.apply_translation(centre)
    return facetted(np.asarray(solid.triangles, np.float64), material)


def mirrored(part: Mesh) -> Mesh:
    """Mirror image on the other side of the plane y = 0."""
    flip = np.array([1, -1, 1], np.float32)
    return replace(part, positions=part.positions * flip, normals=part.normals * flip, faces=part.faces[:, ::-1].copy())


def both_sides(part: Mesh) -> Mesh:
    """Join a part with its mirror image."""
    return merge((part, mirrored(part)))
