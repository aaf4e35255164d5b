"""The renderer: what may show, which triangle each pixel sees, and how bright it is."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.errors import InputError
from fogsim.render.drawing import RECORD, Drawing, MeshTable, Rasteriser
from fogsim.render.projection import Lens, lens_of
from fogsim.render.protocol import FARTHEST, RenderError
from fogsim.render.shading import Shading
from fogsim.render.vectors import Vector, dot, row
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.fog import EVEN_LIGHT, SideLight
from fogsim.values.image import View
from fogsim.values.scene import GROUND_SQUARE, LEVELS_OF_DETAIL, Batch, Mesh, Scene, Surface

_LARGEST = 8.0  # about the radius of what is largest, but for the ground and woods [m]
_SMALLEST, _SMALLEST_PLAIN = 1.0, 3.0  # radius in the picture below which a copy is left out [px]
# Half a square's breadth over the root of its triangles, below which a simpler shape does [px]: in general, and for
# what has neither paint nor lamps nor signs' sheeting, such as trees, of which more is seen than of all else.
_DENSEST, _DENSEST_PLAIN = 1.15, 1.7
_BINS = 64  # of distance, to draw near copies first: four while it doubles
_NUMBERS = 17  # 32-bit numbers of a record

Array = NDArray[np.float32]
Wide = NDArray[np.float64]
Index = NDArray[np.int64]


class Shapes(NamedTuple):
    """Shapes by number."""

    # centre, half_extent (n, 3): middle and half the extents of each shape's bounding box
    centre: Wide
    half_extent: Wide
    coarser: Index  # (n,) int64: The simpler shape that is drawn for each where it is small, −1 if there is none
    detail: Wide  # (n,): Half the breadth in the picture below which it does [px]
    faces: Index  # (n,) int64: Number of triangles
    smallest: Wide  # (n,): Radius in the picture below which a copy is left out [px]


class Copies(NamedTuple):
    """Copies of shapes."""

    shape: Index  # (n,) int64: Number of each copy's shape
    place: Wide  # (n, 3): Last column of its transform: where its origin is [m]
    record: Array  # (n, 17): Its `RECORD`, as numbers
    middle: Wide  # (n, 3): Middle of its bounding sphere [m]
    radius: Wide  # (n,): Its radius [m]
    # (n,): Half of the second largest of its three extents [m], which says how much of it there is to see
    breadth: Wide


class Cells(NamedTuple):
    """Squares of the ground with the copies in them."""

    first: Index  # (k + 1,) int64: First copy of each square, and the number of all copies
    middle: Wide  # (k, 3): Middle of a sphere around all the copies of each square [m]
    radius: Wide  # (k,): Its radius [m]


class Selection(NamedTuple):
    """Memory for what is chosen: the arrays of a `Drawing`, and copies as found, their distance and their order."""

    mesh: Index
    record: Array
    first: Index
    copy: Index
    bin: Index
    order: Index


def shapes_of(
    numbers: Mapping[str, int], low: Wide, high: Wide, faces: Index, plain: NDArray[np.bool_], endings: tuple[str, ...]
) -> Shapes:
    """Measure shapes (`low`, `high` (n, 3), `faces` (n,) int64, `plain` (n,) bool)."""
    coarser = np.full(len(numbers), -1, np.int64)
    for name in numbers:
        if not name.endswith(endings):
            levels = [numbers[level] for level in (name, *(name + ending for ending in endings)) if level in numbers]
            coarser[levels[:-1]] = levels[1:]
    # Where a shape has too many triangles and the simpler one would have too few, the mean of both decides.
    mean = np.sqrt(faces * np.where(coarser < 0, faces, faces[coarser]))
    densest = np.where(plain, _DENSEST_PLAIN, _DENSEST)
    return Shapes(
        0.5 * (low + high),
        0.5 * (high - low),
        coarser,
        densest * np.sqrt(mean),
        faces,
        np.where(plain, _SMALLEST_PLAIN, _SMALLEST),
    )


def _copies_of(shape: Index, record: Array, place: Wide, shapes: Shapes) -> Copies:
    """Measure copies."""
    count = len(shape)
    copies = Copies(shape, place, record, np.empty((count, 3)), np.empty(count), np.empty(count))
    measure(shapes, copies, 0, count)
    return copies


def _with_room(copies: Copies, count: int) -> Copies:
    """Add room for so many more copies."""

    def longer(column: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate((column, np.zeros((count, *column.shape[1:]), column.dtype)))

    return Copies._make(longer(np.asarray(column)) for column in copies)


def cells_of(copies: Copies, side: float) -> tuple[Copies, Cells]:
    """Sort copies by squares of the ground with a side [m] (`side` [m])."""
    square = np.floor(copies.middle[:, :2] / side).astype(np.int64)
    _, number = np.unique(square, axis=0, return_inverse=True)
    order = np.argsort(number.ravel(), kind="stable")
    sorted_copies = Copies._make(np.ascontiguousarray(column[order]) for column in copies)
    first = np.concatenate(([0], np.cumsum(np.bincount(number.ravel())))).astype(np.int64)
    middle, radius = np.zeros((len(first) - 1, 3)), np.zeros(len(first) - 1)
    for cell, (start, end) in enumerate(pairwise(first.tolist())):
        inside = sorted_copies.middle[start:end]
        middle[cell] = 0.5 * (inside.min(axis=0) + inside.max(axis=0))
        reach = np.linalg.norm(inside - middle[cell], axis=1) + sorted_copies.radius[start:end]
        radius[cell] = reach.max()
    return sorted_copies, Cells(first, middle, radius)


@kernel
def measure(shapes: Shapes, copies: Copies, begin: int, end: int) -> None:
    """Set middle, radius and breadth of copies from `begin` to `end`."""
    shape, record, place = copies.shape, copies.record, copies.place
    centre, half_extent = shapes.centre, shapes.half_extent
    for copy in range(begin, end):
        number = shape[copy]
        for axis in range(3):
            total = place[copy, axis]
            for column in range(3):
                total += record[copy, 4 * axis + column] * centre[number, column]
            copies.middle[copy, axis] = total
        x, y, z = 0.0, 0.0, 0.0
        for axis in range(3):
            x += record[copy, 4 * axis] ** 2
            y += record[copy, 4 * axis + 1] ** 2
            z += record[copy, 4 * axis + 2] ** 2
        x, y, z = x * half_extent[number, 0] ** 2, y * half_extent[number, 1] ** 2, z * half_extent[number, 2] ** 2
        copies.radius[copy] = np.sqrt(x + y + z)
        copies.breadth[copy] = np.sqrt(x + y + z - min(x, y, z) - max(x, y, z))


@kernel
def select_copies(
    shapes: Shapes,
    copies: Copies,
    cells: Cells,
    end: int,
    planes: Wide,
    eye: Wide,
    focal: float,
    selection: Selection,
) -> int:
    """Choose the copies that a picture may show, near ones first.

    Returns number of copies selection. Takes `planes` (5, 3), `eye` (3,) [m], `focal` [px].
    """
    middle, radius, first, smallest = copies.middle, copies.radius, cells.first, shapes.smallest
    begin = first[len(first) - 1]
    measure(shapes, copies, begin, end)
    p, q, r, s, ahead = row(planes, 0), row(planes, 1), row(planes, 2), row(planes, 3), row(planes, 4)
    # Farther away nearly all is left out for its size, and the ground lies in a fraction of the row at the horizon.
    farthest = min(FARTHEST, _LARGEST * focal / _SMALLEST)
    count = 0
    for cell in range(len(cells.radius) + 1):
        low, high = begin, end
        if cell < len(cells.radius):
            low, high = first[cell], first[cell + 1]
            x, y, z = cells.middle[cell, 0] - eye[0], cells.middle[cell, 1] - eye[1], cells.middle[cell, 2] - eye[2]
            if _depth((x, y, z), cells.radius[cell], p, q, r, s, ahead) >= farthest:
                continue
        for copy in range(low, high):
            x, y, z = middle[copy, 0] - eye[0], middle[copy, 1] - eye[1], middle[copy, 2] - eye[2]
            # Most are too small, and that is the quickest to see.
            if focal * radius[copy] <= smallest[copies.shape[copy]] * max(dot(ahead, (x, y, z)), radius[copy]):
                continue
            depth = _depth((x, y, z), radius[copy], p, q, r, s, ahead)
            if depth < farthest:
                selection.copy[count] = copy
                selection.bin[count] = _bin(depth)
                count += 1
    _sort(selection, count)
    _write_records(shapes, copies, ahead, eye, focal, selection, count)
    return count


@kernel
def _depth(middle: Vector, radius: float, p: Vector, q: Vector, r: Vector, s: Vector, ahead: Vector) -> float:
    """Depth of the nearest point of a sphere [m], infinite if it is out of view."""
    if min(dot(p, middle), dot(q, middle), dot(r, middle), dot(s, middle)) < -radius:
        return np.inf
    depth = dot(ahead, middle)
    return max(depth - radius, 0.0) if depth > -radius else np.inf


@kernel
def _bin(depth: float) -> int:
    """Bin of a distance [m], from the exponent and the first two bits of the mantissa of a float."""
    bits = np.float32(1.0 + depth).view(np.int32) - np.float32(1.0).view(np.int32)
    return min(int(bits) >> 21, _BINS - 1)


@kernel
def _sort(selection: Selection, count: int) -> None:
    """Set the order in which copies are drawn: by bin of distance."""
    bins, copies, order = selection.bin, selection.copy, selection.order
    place = np.zeros(_BINS + 1, np.int64)
    for i in range(count):
        place[bins[i] + 1] += 1
    for i in range(_BINS):
        place[i + 1] += place[i]
    for i in range(count):
        order[place[bins[i]]] = copies[i]
        place[bins[i]] += 1


@kernel
def _write_records(
    shapes: Shapes, copies: Copies, ahead: Vector, eye: Wide, focal: float, selection: Selection, count: int
) -> None:
    """Write what is drawn of the chosen copies."""
    mesh, record, first, order = selection.mesh, selection.record, selection.first, selection.order
    first[0] = 0
    for i in range(count):
        copy = order[i]
        x, y, z = copies.middle[copy, 0] - eye[0], copies.middle[copy, 1] - eye[1], copies.middle[copy, 2] - eye[2]
        depth, shape = dot(ahead, (x, y, z)), copies.shape[copy]
        while shapes.coarser[shape] >= 0 and focal * copies.breadth[copy] < shapes.detail[shape] * depth:
            shape = shapes.coarser[shape]
        mesh[i] = shape
        first[i + 1] = first[i] + shapes.faces[shape]
        for number in range(_NUMBERS):
            record[i, number] = copies.record[copy, number]
        for axis in range(3):
            record[i, 4 * axis + 3] = copies.place[copy, axis] - eye[axis]


@dataclass(frozen=True, slots=True)
class Ground:
    """Level ground to the horizon, and what lies on it."""

    height: float  # Height of the terrain [m], −inf if there is none
    reflectance: NDArray[np.float64]  # (3,): Its reflectance
    pieces: Mapping[str, Mesh]  # All else by names of its own, each piece in coordinates from its place
    places: NDArray[np.float64]  # (k, 3): Where the origin of each piece is [m]


def _split_ground(ground: Mesh) -> Ground:
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


_CELL = 120.0  # side of the squares in which copies are culled together [m]


class SceneRenderer:
    """Draws a scene in overcast daylight, with one sample a pixel and without clamping (`illuminance` [lx])."""

    def __init__(self, scene: Scene, illuminance: float, make_rasteriser: Callable[[MeshTable], Rasteriser]) -> None:
        ground = _split_ground(scene.ground)
        meshes = {**scene.shapes, **ground.pieces}
        # Levels of detail are drawn where they are small, and so from outside.
        self._table = MeshTable.of(meshes, lambda name: name.endswith(LEVELS_OF_DETAIL))
        self._rasteriser: Rasteriser | None = make_rasteriser(self._table)
        self._shading = Shading(self._table, illuminance, ground.height, ground.reflectance, scene.pavement)
        plain = np.array([bool(np.all(mesh.surface == int(Surface.MATT))) for mesh in meshes.values()])
        faces = np.diff(self._table.first_face)
        self._shapes = shapes_of(self._table.numbers, *self._table.extremes(), faces, plain, LEVELS_OF_DETAIL)
        shape, record, place = self._standing(scene.scenery, ground)
        self._copies, self._cells = cells_of(_copies_of(shape, record, place, self._shapes), _CELL)
        self._still = len(shape)
        self._chosen = _room(0)

    def set_daylight(self, illuminance: float, sides: SideLight = EVEN_LIGHT) -> None:
        """Draw by another daylight from now on (`illuminance` [lx])."""
        self._shading.set_daylight(illuminance, sides)

    def render(self, vehicles: Sequence[Batch], camera: Camera, pose: CameraPose, lamplight: bool = False) -> View:
        """Draw the scene and the vehicles (see `Renderer.render`)."""
        if self._rasteriser is None:
            raise RenderError("this renderer is closed; make a new one")
        lens = lens_of(camera, pose)
        drawing = self._drawing(vehicles, lens)
        triangle_ids = self._rasteriser.triangle_ids(drawing, camera, pose)
        return self._shading.view(triangle_ids, drawing, lens, lamplight=lamplight)

    def close(self) -> None:
        """Give back what the rasteriser holds."""
        if self._rasteriser is not None:
            self._rasteriser.close()
        self._rasteriser = None

    def _drawing(self, vehicles: Sequence[Batch], lens: Lens) -> Drawing:
        """What a picture may show."""
        end, focal = self._place(vehicles), float(lens.lens[0])
        count = select_copies(self._shapes, self._copies, self._cells, end, lens.planes, lens.eye, focal, self._chosen)
        return Drawing(
            self._chosen.mesh[:count],
            self._chosen.record.view(RECORD)[:count, 0],
            self._chosen.first[: count + 1],
        )

    def _standing(
        self, scenery: Sequence[Batch], ground: Ground
    ) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float64]]:
        """Shapes, records and places of all that stands still."""
        counts = [len(batch.transforms) for batch in scenery]
        shape = np.repeat(self._numbers(scenery), counts)
        record = np.concatenate([np.zeros((0, 17), np.float32), *map(_records, scenery)])
        place = record[:, 3:12:4].astype(np.float64)
        pieces = np.zeros((len(ground.pieces), 17), np.float32)
        pieces[:, [0, 5, 10]] = 1.0
        numbers = [self._table.numbers[name] for name in ground.pieces]
        return (
            np.concatenate([shape, np.array(numbers, np.int64)]),
            np.concatenate([record, pieces]),
            np.concatenate([place, ground.places]),
        )

    def _place(self, vehicles: Sequence[Batch]) -> int:
        """Put the vehicles behind what stands still, and count all."""
        counts = [len(batch.transforms) for batch in vehicles]
        end = self._still + sum(counts)
        if end > len(self._chosen.mesh):
            self._copies = _with_room(self._copies, end + 64 - len(self._copies.shape))
            self._chosen = _room(len(self._copies.shape))
        if vehicles:
            record = self._copies.record[self._still : end]
            integers, upper = record.view(np.int32), record[:, :12].reshape(-1, 3, 4)
            np.concatenate([batch.transforms[:, :3] for batch in vehicles], out=upper)
            np.concatenate([batch.paint for batch in vehicles], out=record[:, 12:15])
            np.concatenate([batch.lamps for batch in vehicles], out=integers[:, 15])
            np.concatenate([batch.instance for batch in vehicles], out=integers[:, 16])
            self._copies.shape[self._still : end] = self._numbers(vehicles).repeat(counts)
            self._copies.place[self._still : end] = record[:, 3:12:4]
        return end

    def _numbers(self, batches: Sequence[Batch]) -> NDArray[np.int64]:
        numbers = self._table.numbers
        try:
            return np.array([numbers[batch.shape] for batch in batches], np.int64)
        except KeyError as error:
            known = sorted(numbers)
            raise InputError(f"a batch names the shape {error}, which the scene does not have: {known}") from None


def _records(batch: Batch) -> NDArray[np.float32]:
    record = np.zeros(len(batch.transforms), RECORD)
    record["transform"], record["paint"] = batch.transforms[:, :3], batch.paint
    record["lamps"], record["instance"] = batch.lamps, batch.instance
    return record.view(np.float32).reshape(-1, 17)


def _room(count: int) -> Selection:
    return Selection(
        mesh=np.zeros(count, np.int64),
        record=np.zeros((count, 17), np.float32),
        first=np.zeros(count + 1, np.int64),
        copy=np.zeros(count, np.int64),
        bin=np.zeros(count, np.int64),
        order=np.zeros(count, np.int64),
    )
