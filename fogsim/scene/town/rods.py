"""Round bars and limbs."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.solids import Material, Vector, grid_faces, merge, mesh
from fogsim.values.scene import Mesh


def rod(points: Sequence[Vector], radii: Sequence[tuple[float, float]], sides: int, material: Material) -> Mesh:
    """Closed tube of oval rings about some points, smooth around; rings are level, or upright along a level tube.

    Takes `points` (3,) [m], `radii` [m].
    """
    middle = np.array(points, np.float64)
    along = middle[-1] - middle[0]
    level = abs(along[2]) < np.hypot(along[0], along[1])
    first = np.array([0.0, 0.0, 1.0]) if level else np.array([1.0, 0.0, 0.0])
    second = np.array([-along[1], along[0], 0.0]) / max(np.hypot(along[0], along[1]), 1e-9) if level else np.eye(3)[1]
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    around = np.cos(angle)[:, None, None] * first, np.sin(angle)[:, None, None] * second
    size = np.array(radii, np.float64)
    rings = np.swapaxes(middle + size[:, 0, None] * around[0] + size[:, 1, None] * around[1], 0, 1)
    # Normals of an oval are those of a circle over its radii.
    ovals = np.maximum(size, 1e-3)
    out = np.swapaxes(around[0] / ovals[:, 0, None] + around[1] / ovals[:, 1, None], 0, 1)
    tube = mesh(rings, grid_faces(len(middle), sides + 1), out, material)
    ends = [_cap(rings[end, :-1], direction * along, material) for end, direction in ((0, -1.0), (-1, 1.0))]
    return merge((tube, *ends))


def _cap(ring: NDArray[np.float64], normal: NDArray[np.float64], material: Material) -> Mesh:
    index = np.arange(1, len(ring) - 1)
    faces = np.stack((np.zeros_like(index), index, index + 1), axis=1)
    return mesh(ring, faces, np.broadcast_to(normal, ring.shape), material)
