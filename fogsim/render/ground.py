"""The ground of a scene taken apart: the plane of the terrain, and pieces that can be left out where out of view."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.values.scene import GROUND_SQUARE, Mesh, Surface


@dataclass(frozen=True, slots=True)
class Ground:
    """Level ground to the horizon, and what lies on it."""

    height: float  # Height of the terrain [m], −inf if there is none
    reflectance: NDArray[np.float64]  # (3,): Its reflectance
    pieces: Mapping[str, Mesh]  # All else by names of its own, each piece in coordinates from its place
    places: NDArray[np.float64]  # (k, 3): Where the origin of each piece is [m]


def split_ground(ground: Mesh) -> Ground:
    """Take a ground apart."""
    flat = ground.surface[ground.faces[:, 0]] == int(Surface.TERRAIN)
    height, reflectance = -np.inf, np.zeros(3)
    if flat.any():
        vertices = ground.faces[flat].ravel()
        height = float(ground.positions[vertices, 2].mean())
        reflectance = ground.reflectance[vertices].mean(axis=0).astype(np.float64)
    groups = _groups(ground, ground.faces[~flat])
    places = np.array([np.round(ground.positions[faces[:, 0]].mean(axis=0)) for faces in groups]).reshape(-1, 3)
    pieces = [_piece(ground, faces, place) for faces, place in zip(groups, places, strict=True)]
    names = (f"ground {number}" for number in range(len(pieces)))
    return Ground(height, reflectance, dict(zip(names, pieces, strict=True)), places.astype(np.float64))


def _groups(ground: Mesh, faces: NDArray[np.uint32]) -> list[NDArray[np.uint32]]:
    """Triangles that lie in the same square of the ground; those of roads apart from the rest."""
    if not len(faces):
        return []
    middle = ground.positions[faces, :2].mean(axis=1)
    paved = ground.surface[faces[:, 0]] == int(Surface.ROAD)
    key = np.column_stack((np.floor(middle / GROUND_SQUARE).astype(np.int64), paved))
    _, group = np.unique(key, axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    return np.split(faces[order], np.cumsum(np.bincount(group.ravel()))[:-1])


def _piece(ground: Mesh, faces: NDArray[np.uint32], place: NDArray[np.float64]) -> Mesh:
    """Some triangles of the ground; whole metres are subtracted exactly, so that neighbouring pieces still meet."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return replace(
        ground,
        positions=ground.positions[used] - place.astype(np.float32),
        normals=ground.normals[used],
        reflectance=ground.reflectance[used],
        surface=ground.surface[used],
        road=ground.road[used],
        instance=ground.instance[used],
        faces=renumbered.reshape(-1, 3).astype(np.uint32),
    )
