"""Small meshes to build with: patches, polygons, boxes, discs, and how to put them together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import matrix_product
from fogsim.values.scene import Instance, Mesh, Surface

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Material:
    """What a surface is made of."""

    reflectance: Vector  # Linear diffuse reflectance, red, green, blue, 0 … 1
    surface: Surface = Surface.MATT  # How it gets its radiance


GLASS = Material((0.035, 0.045, 0.055))


def mesh(
    positions: ArrayLike,
    faces: ArrayLike,
    normals: ArrayLike,
    material: Material,
    *,
    reflectance: ArrayLike | None = None,
    road: ArrayLike | None = None,
    instance: int = Instance.ROADSIDE,
) -> Mesh:
    """Mesh of one material (`positions`, `normals` (n, 3) [m], `faces` (m, 3))."""
    points, directions = _rows(positions), _rows(normals)
    colour = np.array(material.reflectance if reflectance is None else reflectance, np.float32, ndmin=2)
    snapped, facing, colours = _vertices(points, directions, colour)
    count = len(points)
    return Mesh(
        positions=snapped,
        normals=facing,
        reflectance=colours,
        surface=np.full(count, int(material.surface), np.int32),
        road=np.zeros((count, 4), np.float32) if road is None else np.asarray(road, np.float32).reshape(-1, 4),
        instance=np.full(count, instance, np.int32),
        faces=np.asarray(faces, np.uint32).reshape(-1, 3),
    )


def _rows(vectors: ArrayLike) -> NDArray[np.float64]:
    """Vectors (n, 3) of any shape, which no one writes to."""
    return np.ascontiguousarray(vectors, np.float64).reshape(-1, 3)


@kernel
def _vertices(
    points: NDArray[np.float64], directions: NDArray[np.float64], colour: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Positions (n, 3) to the nanometre (see `_snapped`), unit normals, and reflectances: one may do for all."""
    count = len(points)
    snapped, facing = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
    colours = np.empty((count, 3), np.float32)
    for i in range(count):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        length = max(np.sqrt(x * x + y * y + z * z), 1e-12)
        for axis in range(3):
            snapped[i, axis] = np.rint(points[i, axis] * 1e9) / 1e9 + 0.0
            facing[i, axis] = directions[i, axis] / length
            colours[i, axis] = colour[i if len(colour) == count else 0, axis]
    return snapped, facing, colours


def _snapped(positions: NDArray[np.float64]) -> NDArray[np.float32]:
    """Positions to the nanometre: what lies in a plane of symmetry does so exactly, however it was computed."""
    return (np.round(positions, 9) + 0.0).astype(np.float32)


@lru_cache(maxsize=256)
def grid_faces(rows: int, columns: int) -> NDArray[np.int64]:
    """Two triangles for each cell of a grid of vertices numbered row by row."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack((corner, corner + 1, corner + columns), axis=1)
    upper = np.stack((corner + 1, corner + columns + 1, corner + columns), axis=1)
    faces = np.concatenate((lower, upper))
    # The same array is given again.
    faces.flags.writeable = False
    return faces


def grid_normals(points: NDArray[np.float64], toward: ArrayLike) -> NDArray[np.float64]:
    """Normals of a grid of points from differences of neighbours.

    Where points coincide, the normal is `toward` itself.

    Takes `points` (n, m, 3) [m], `toward` (3,).
    """
    return _grid_normals(np.ascontiguousarray(points, np.float64), np.array(toward, np.float64))


@kernel
def _grid_normals(points: NDArray[np.float64], toward: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normals (n, m, 3) (see `grid_normals`)."""
    rows, columns = points.shape[0], points.shape[1]
    result, facing = np.empty(points.shape), 0.0
    for i in range(rows):
        up, down = max(i - 1, 0), min(i + 1, rows - 1)
        for j in range(columns):
            west, east = max(j - 1, 0), min(j + 1, columns - 1)
            ax, ay, az = points[down, j] - points[up, j]
            bx, by, bz = points[i, east] - points[i, west]
            x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            share = 1.0 / ((down - up) * (east - west))
            result[i, j, 0], result[i, j, 1], result[i, j, 2] = share * x, share * y, share * z
            facing += share * (x * toward[0] + y * toward[1] + z * toward[2])
    sign = 1.0 if facing >= 0 else -1.0
    for i in range(rows):
        for j in range(columns):
            normal = result[i, j]
            if max(abs(normal[0]), abs(normal[1]), abs(normal[2])) < 1e-9:
                result[i, j] = toward
            else:
                result[i, j] = sign * normal
    return result


def grid(
    points: ArrayLike,
    material: Material,
    toward: ArrayLike,
    *,
    reflectance: ArrayLike | None = None,
    road: ArrayLike | None = None,
    instance: int = Instance.ROADSIDE,
) -> Mesh:
    """Smooth patch through a grid of points (`points` (n, m, 3) [m], `toward` (3,))."""
    array = np.asarray(points, np.float64)
    rows, columns = array.shape[:2]
    normals = grid_normals(array, toward)
    return mesh(
        array,
        grid_faces(rows, columns),
        normals,
        material,
        reflectance=reflectance,
        road=road,
        instance=instance,
    )


def folds(rows: NDArray[np.float64], materials: Sequence[Material], toward: NDArray[np.float64]) -> Mesh:
    """Strips between neighbouring lines, with an edge where two of them meet.

    Takes `rows` (k + 1, n, 3) [m], `toward` (k, 3).
    """
    strips, count = len(materials), 2 * rows.shape[1]
    points = np.stack((rows[:-1], rows[1:]), axis=2)
    normals = np.stack([grid_normals(strip, facing) for strip, facing in zip(points, toward, strict=True)])
    colours = np.repeat(np.array([material.reflectance for material in materials], np.float32), count, axis=0)
    faces = grid_faces(rows.shape[1], 2) + count * np.arange(strips)[:, None, None]
    return mesh(points, faces, normals, materials[0], reflectance=colours)


def quad(corners: ArrayLike, material: Material, toward: ArrayLike) -> Mesh:
    """Rectangle or any flat convex quadrilateral (`corners` (4, 3) [m], `toward` (3,))."""
    a, b, c, d = np.asarray(corners, np.float64)
    return grid([[a, b], [d, c]], material, toward)


def polygon(corners: ArrayLike, material: Material, toward: ArrayLike, instance: int = Instance.ROADSIDE) -> Mesh:
    """Flat convex polygon (`corners` (n, 3) [m], `toward` (3,))."""
    points = np.asarray(corners, np.float64)
    index = np.arange(1, len(points) - 1)
    faces = np.stack((np.zeros_like(index), index, index + 1), axis=1)
    normals = np.broadcast_to(np.asarray(toward, np.float64), points.shape)
    return mesh(points, faces, normals, material, instance=instance)


def concave_faces(outline: NDArray[np.float64]) -> NDArray[np.int64]:
    """Triangles (m, 3) of a flat polygon that may be concave, by cutting off one ear after the other.

    Takes `outline` (n, 2).
    """
    return _triangles(np.ascontiguousarray(outline, np.float64))


@kernel
def _triangles(outline: NDArray[np.float64]) -> NDArray[np.int64]:
    """Triangles (m, 3) of a polygon (see `concave_faces`)."""
    left, count = np.arange(len(outline)), len(outline)
    faces = np.empty((count - 2, 3), np.int64)
    for number in range(count - 3):
        # An outline that crosses itself has no ear left; what remains is closed as if it were convex.
        ear = 1
        for place in range(count):
            if _is_ear(outline, left[:count], place):
                ear = place
                break
        faces[number, 0], faces[number, 1] = left[(ear - 1) % count], left[ear]
        faces[number, 2] = left[(ear + 1) % count]
        for place in range(ear, count - 1):
            left[place] = left[place + 1]
        count -= 1
    faces[-1] = left[:3]
    return faces


@kernel
def _is_ear(outline: NDArray[np.float64], left: NDArray[np.int64], place: int) -> bool:
    before, here, after = left[place - 1], left[place], left[(place + 1) % len(left)]
    a, b, c = outline[before], outline[here], outline[after]
    if _turn(a, b, c) <= 1e-12:
        return False
    for k in left:
        if k not in (before, here, after):
            other = outline[k]
            if _turn(a, b, other) >= 0 and _turn(b, c, other) >= 0 and _turn(c, a, other) >= 0:
                return False
    return True


@kernel
def _turn(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> float:
    """Twice the area of the triangle a, b, c, positive if it turns left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def facetted(triangles: NDArray[np.float64], material: Material) -> Mesh:
    """Mesh of triangles that each have their own normal (`triangles` (n, 3, 3) [m])."""
    a, b, c = triangles.transpose(1, 0, 2)
    normals = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    return mesh(triangles, np.arange(3 * len(triangles)).reshape(-1, 3), normals, material)


_BOX_CORNERS = np.array(list(product((0.0, 1.0), repeat=3)))
_BOX_FACES = np.array(
    [
        *((1, 3, 0), (4, 1, 0), (0, 3, 2), (2, 4, 0), (1, 7, 3), (5, 1, 4)),
        *((5, 7, 1), (3, 7, 2), (6, 4, 2), (2, 7, 6), (6, 5, 4), (7, 5, 6)),
    ]
)


def box(low: ArrayLike, high: ArrayLike, material: Material) -> Mesh:
    """Box, facetted (`low`, `high` (3,) [m])."""
    start, end = np.sort(np.stack((np.asarray(low, float), np.asarray(high, float))), axis=0)
    return facetted(_BOX_CORNERS[_BOX_FACES] * (end - start) + start, material)


def disc(
    centre: ArrayLike,
    radius: float,
    right: ArrayLike,
    up: ArrayLike,
    material: Material,
    *,
    sides: int = 24,
    hole: float = 0.0,
    instance: int = Instance.ROADSIDE,
) -> Mesh:
    """Disc or ring (`centre` (3,) [m], `radius`, `hole` [m], `right`, `up` (3,))."""
    angle = np.linspace(0.0, 2 * np.pi, sides + 1)
    rim = np.cos(angle)[:, None] * np.asarray(right, float) + np.sin(angle)[:, None] * np.asarray(up, float)
    rings = np.asarray(centre, float) + np.stack((hole * rim, radius * rim), axis=1)
    faces = grid_faces(sides + 1, 2)
    normal = np.broadcast_to(np.cross(np.asarray(right, float), np.asarray(up, float)), (2 * (sides + 1), 3))
    return mesh(rings, faces if hole else faces[sides:], normal, material, instance=instance)


def merge(parts: Sequence[Mesh]) -> Mesh:
    """One mesh of many."""
    offsets = np.cumsum([0, *(len(part.positions) for part in parts)])
    names = ("positions", "normals", "reflectance", "surface", "road", "instance")
    if not parts:
        return mesh(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)), GLASS)
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    faces = [part.faces + np.uint32(offset) for part, offset in zip(parts, offsets, strict=False)]
    return Mesh(**arrays, faces=np.concatenate(faces))


def moved(part: Mesh, matrix: NDArray[np.float64]) -> Mesh:
    """Place a part by a rigid transform (4, 4) (`matrix` (4, 4))."""
    rotation = matrix[:3, :3]
    positions = matrix_product(part.positions, rotation.T) + matrix[:3, 3]
    return replace(
        part,
        positions=_snapped(positions),
        normals=matrix_product(part.normals, rotation.T).astype(np.float32),
    )
