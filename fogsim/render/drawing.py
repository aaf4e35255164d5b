"""What the two ways to draw share: all triangles in one table, what a picture may show of them, and what they answer.

A picture is made in three steps: choose the copies that may show (`fogsim.render.renderer`), find the triangle that
each pixel sees (a `Rasteriser`), and shade what is seen (`fogsim.render.shading`). Only the second is done twice, by
numba and by OpenGL, so where both see the same triangle they give the same picture to the bit.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera, CameraPose
from fogsim.values.scene import Mesh


@lru_cache(maxsize=512)
def in_solids(mesh: Mesh) -> NDArray[np.bool_]:
    """Find the triangles that belong to closed solids; remembered, since most shapes are in every scene.

    Returns for each triangle whether every edge of it and of all that hang together with it has one other triangle on
    its other side, and they enclose what lies behind them (m,) bool.
    """
    if not len(mesh.faces):
        return np.zeros(0, np.bool_)
    # Corners at the same place are one, whatever else is known of them.
    _, corner = np.unique(mesh.positions, axis=0, return_inverse=True)
    faces = corner.reshape(-1)[mesh.faces].astype(np.int64)
    count = int(faces.max()) + 1
    start, end = faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()
    edges, number, times = np.unique(start * count + end, return_inverse=True, return_counts=True)
    twin = np.isin(end * count + start, edges) & (times[number] == 1) & (start != end)
    part = _least_connected(start, end, count)[faces[:, 0]]
    gaps = np.bincount(np.tile(part, 3), ~twin, count)
    a, b, c = mesh.positions[mesh.faces].astype(np.float64).transpose(1, 0, 2)
    volume = np.bincount(part, np.einsum("ij,ij->i", a, np.cross(b, c)), count)
    solid = np.asarray(((gaps == 0) & (volume > 0))[part], np.bool_)
    solid.flags.writeable = False
    return solid


def _least_connected(start: NDArray[np.int64], end: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """The least of all the corners that each of so many corners hangs together with, over edges."""
    least, before = np.arange(count), np.full(count, -1)
    while not np.array_equal(least, before):
        before = least.copy()
        low = np.minimum(before[start], before[end])
        np.minimum.at(least, start, low)
        np.minimum.at(least, end, low)
    return least


NEAR = 0.4
"""Depth before which nothing is seen [m]."""

NOTHING = -1
"""Id of a pixel that sees no triangle."""

RECORD = np.dtype([("transform", "<f4", (3, 4)), ("paint", "<f4", (3,)), ("lamps", "<i4"), ("instance", "<i4")])
"""One copy of a mesh: the upper rows of its transform, paint, lit lamps and instance id (0: that of the vertices)."""


@dataclass(frozen=True, slots=True)
class MeshTable:
    """All meshes of a scene one after another."""

    numbers: Mapping[str, int]  # Number of each mesh by its name
    # positions, normals, reflectance (n, 3): as in `Mesh`
    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    reflectance: NDArray[np.float32]
    # surface, instance (n,) int32: as in `Mesh`
    surface: NDArray[np.int32]
    instance: NDArray[np.int32]
    road: NDArray[np.float32]  # (n, 4): As in `Mesh`
    faces: NDArray[np.int32]  # (m, 3) int32: Vertices of each triangle, numbered through all meshes
    # (m,) bool: Whether a triangle is part of a closed solid that no camera is in: its inner side need not be drawn
    in_solid: NDArray[np.bool_]
    # first_vertex, first_face (k + 1,) int64: where the vertices and triangles of each of the k meshes begin, and their
    # numbers n and m at the end
    first_vertex: NDArray[np.int64]
    first_face: NDArray[np.int64]

    @classmethod
    def of(cls, meshes: Mapping[str, Mesh], never_inside: Callable[[str], bool] = lambda _: False) -> "MeshTable":
        """Put meshes one after another and number them in their order."""
        parts = list(meshes.values())
        first_vertex = np.cumsum([0, *(len(part.positions) for part in parts)], dtype=np.int64)
        in_solid = [
            in_solids(part) if never_inside(name) else np.zeros(len(part.faces)) for name, part in meshes.items()
        ]
        faces = [part.faces.astype(np.int64) + first for part, first in zip(parts, first_vertex, strict=False)]
        return cls(
            numbers={name: number for number, name in enumerate(meshes)},
            positions=_joined([part.positions for part in parts], np.float32, 3),
            normals=_joined([part.normals for part in parts], np.float32, 3),
            reflectance=_joined([part.reflectance for part in parts], np.float32, 3),
            surface=_joined([part.surface for part in parts], np.int32),
            instance=_joined([part.instance for part in parts], np.int32),
            road=_joined([part.road for part in parts], np.float32, 4),
            faces=_joined(faces, np.int32, 3),
            in_solid=_joined(in_solid, np.bool_),
            first_vertex=first_vertex,
            first_face=np.cumsum([0, *map(len, faces)], dtype=np.int64),
        )

    def extremes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and greatest coordinates (k, 3) of each mesh [m]; zero for one without vertices."""
        ends = np.zeros((2, len(self.numbers), 3))
        for number, (start, end) in enumerate(pairwise(self.first_vertex.tolist())):
            if end > start:
                own = self.positions[start:end]
                ends[0, number], ends[1, number] = own.min(axis=0), own.max(axis=0)
        return ends[0], ends[1]


def _joined(parts: list[NDArray[Any]], kind: type[np.generic], columns: int = 0) -> NDArray[Any]:
    shape = (0, columns) if columns else (0,)
    return np.ascontiguousarray(np.concatenate([np.empty(shape, kind), *parts]), kind)


@dataclass(frozen=True, slots=True)
class Drawing:
    """The copies of meshes that a picture may show, the nearest first as far as that is cheap."""

    mesh: NDArray[np.int64]  # (c,) int64: Number of each copy's mesh in the `MeshTable`
    # Each copy; its transform leads from coordinates of the mesh to offsets from the camera in world axes [m]
    record: NDArray[np.void]
    # (c + 1,) int64: Id of the first triangle of each copy, and the number of all ids at the end: triangle i of the
    # mesh of copy j has id ``first[j] + i``
    first: NDArray[np.int64]


class Rasteriser(Protocol):
    """Finds which triangle each pixel sees; made for one `MeshTable`."""

    def triangle_ids(self, drawing: Drawing, camera: Camera, pose: CameraPose) -> NDArray[np.int32]:
        """Find the nearest triangle for the ray through the centre of each pixel.

        Both sides of a triangle are seen; nothing nearer than a depth of `NEAR` is.

        Returns Id of the triangle, `NOTHING` where there is none; valid until the next call (rows, cols) int32.
        """
        ...

    def close(self) -> None:
        """Give back what it holds; a second call does nothing."""
        ...
