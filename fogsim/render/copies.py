"""Copies of shapes as flat arrays, and the choice of those that a camera can see."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.render.drawing import RECORD
from fogsim.values.camera import Camera
from fogsim.values.scene import Batch, Mesh

STAND_INS = ((":far", 12.0), (":tiny", 3.5))
"""Endings of the names of shapes that stand in for the one without.

Each goes with half the breadth in the picture below which it does [px].
"""

_FARTHEST = 1600.0  # distance beyond which no copy is drawn [m]
_SMALLEST = 1.0  # radius in the picture below which a copy is left out [px]


@dataclass(frozen=True, slots=True)
class ShapeTable:
    """Shapes by number.

    Attributes
    ----------
    numbers : mapping from str to int
        Number of each shape.
    centre : (n, 3) float64
        Middle of each shape's bounding box.
    half_extent : (n, 3) float64
        Half of each shape's extents along its axes.
    stand_in : (levels, n) int64
        Shapes that are drawn instead where it is small, by the levels of `STAND_INS`.
    """

    numbers: Mapping[str, int]
    centre: NDArray[np.float64]
    half_extent: NDArray[np.float64]
    stand_in: NDArray[np.int64]

    @classmethod
    def of(cls, shapes: Mapping[str, Mesh]) -> "ShapeTable":
        """Measure shapes and number them in their order."""
        numbers = {name: number for number, name in enumerate(shapes)}
        low = np.array([shape.positions.min(axis=0) for shape in shapes.values()], np.float64).reshape(-1, 3)
        high = np.array([shape.positions.max(axis=0) for shape in shapes.values()], np.float64).reshape(-1, 3)
        return cls(
            numbers=numbers,
            centre=0.5 * (low + high),
            half_extent=0.5 * (high - low),
            stand_in=_stand_ins(numbers),
        )


def _stand_ins(numbers: Mapping[str, int]) -> NDArray[np.int64]:
    """Numbers of each shape's stand-ins, one row a level; where a level has none, that of the level before."""
    levels = [np.arange(len(numbers))]
    for ending, _ in STAND_INS:
        own = [numbers.get(name + ending, -1) for name in numbers]
        levels.append(np.where(np.array(own) < 0, levels[-1], own))
    return np.array(levels[1:], np.int64)


@dataclass(frozen=True, slots=True)
class Copies:
    """Copies of many shapes.

    Attributes
    ----------
    shape : (n,) int64
        Number of each copy's shape.
    centre : (n, 3) float64
        Middle of each copy's bounding sphere in the world [m].
    radius : (n,) float64
        Its radius [m].
    breadth : (n,) float64
        Half of the second largest of its three extents [m], which says how much of it there is to see.
    record : (n,) `RECORD`
        What is drawn.
    """

    shape: NDArray[np.int64]
    centre: NDArray[np.float64]
    radius: NDArray[np.float64]
    breadth: NDArray[np.float64]
    record: NDArray[np.void]


def flattened(batches: Sequence[Batch], table: ShapeTable) -> Copies:
    """All copies of batches in one.

    Raises
    ------
    InputError
        If a batch names a shape that the scene does not have.
    """
    unknown = sorted({batch.shape for batch in batches} - set(table.numbers))
    if unknown:
        raise InputError(f"a batch names the shapes {unknown}, which the scene does not have: {sorted(table.numbers)}")
    counts = [len(batch.transforms) for batch in batches]
    numbers = [table.numbers[batch.shape] for batch in batches]
    shape = np.repeat(np.array(numbers, np.int64), counts)
    record = np.zeros(len(shape), RECORD)
    if batches:
        record["transform"] = np.concatenate([batch.transforms for batch in batches])[:, :3]
        record["paint"] = np.concatenate([batch.paint for batch in batches])
        record["lamps"] = np.concatenate([batch.lamps for batch in batches])
        record["instance"] = np.concatenate([batch.instance for batch in batches])
    transform = record["transform"].astype(np.float64)
    centre = np.einsum("nij,nj->ni", transform[:, :, :3], table.centre[shape]) + transform[:, :, 3]
    extent = table.half_extent[shape] * np.sqrt(np.sum(transform[:, :, :3] ** 2, axis=1))
    return Copies(shape, centre, np.linalg.norm(extent, axis=1), np.sort(extent, axis=1)[:, 1], record)


def visible(
    copies: Copies,
    table: ShapeTable,
    camera: Camera,
    axes: NDArray[np.float64],
    eye: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.void]]:
    """Copies that may show in a picture, with their transforms made relative to the camera.

    Parameters
    ----------
    copies, table
        The copies and their shapes.
    camera : Camera
        The pinhole.
    axes : (3, 3) float64
        Its axes in the world as rows: right, down, forward.
    eye : (3,) float64
        Where it is [m].

    Returns
    -------
    shape : (n,) int64
        Numbers of the shapes to draw, stand-ins among them.
    record : (n,) `RECORD`
        What to draw; transforms lead to offsets from the camera in world axes.
    """
    offset = copies.centre - eye
    reach = offset @ (_frustum(camera) @ axes).T + copies.radius[:, None]
    depth = offset @ axes[2]
    seen = (
        np.all(reach > 0, axis=1)
        & (depth < _FARTHEST + copies.radius)
        & (camera.focal_length * copies.radius > _SMALLEST * depth)
    )
    chosen = np.flatnonzero(seen)
    shape = copies.shape[chosen]
    drawn_breadth = camera.focal_length * copies.breadth[chosen]
    for (_, limit), stand_in in zip(STAND_INS, table.stand_in, strict=True):
        shape = np.where(drawn_breadth < limit * depth[chosen], stand_in[copies.shape[chosen]], shape)
    record = copies.record[chosen]
    record["transform"][:, :, 3] = record["transform"][:, :, 3].astype(np.float64) - eye
    return shape, record


def _frustum(camera: Camera) -> NDArray[np.float64]:
    """Inward unit normals (5, 3) of the planes that bound the picture, in camera axes, the forward one last."""
    (u0, v0), focal = camera.principal_point, camera.focal_length
    planes = np.array(
        [
            (focal, 0.0, u0 + 0.5),
            (-focal, 0.0, camera.width - 0.5 - u0),
            (0.0, focal, v0 + 0.5),
            (0.0, -focal, camera.height - 0.5 - v0),
            (0.0, 0.0, 1.0),
        ]
    )
    return np.asarray(planes / np.linalg.norm(planes, axis=1, keepdims=True), np.float64)


def pieces(mesh: Mesh, side: float) -> list[Mesh]:
    """Split a mesh into the parts whose triangles lie in the same square of the ground.

    Parameters
    ----------
    mesh : Mesh
        What to split.
    side : float
        Side of a square [m].
    """
    if not len(mesh.faces):
        return []
    middle = mesh.positions[mesh.faces, :2].mean(axis=1)
    _, square = np.unique(np.floor(middle / side).astype(np.int64), axis=0, return_inverse=True)
    order = np.argsort(square.ravel(), kind="stable")
    groups = np.split(mesh.faces[order], np.cumsum(np.bincount(square.ravel()))[:-1])
    return [_part(mesh, faces) for faces in groups]


def _part(mesh: Mesh, faces: NDArray[np.uint32]) -> Mesh:
    used, renumbered = np.unique(faces, return_inverse=True)
    return Mesh(
        positions=mesh.positions[used],
        normals=mesh.normals[used],
        reflectance=mesh.reflectance[used],
        surface=mesh.surface[used],
        road=mesh.road[used],
        instance=mesh.instance[used],
        faces=renumbered.reshape(-1, 3).astype(np.uint32),
    )
