"""The renderer: what may show, which triangle each pixel sees, and how bright it is."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.render.culling import Selection, cells_of, copies_of, select_copies, shapes_of, with_room
from fogsim.render.drawing import RECORD, Drawing, MeshTable, Rasteriser
from fogsim.render.lens import lens_of
from fogsim.render.protocol import RenderError
from fogsim.render.shading import Shading
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.fog import EVEN_LIGHT, SideLight
from fogsim.values.image import View
from fogsim.values.scene import GROUND_SQUARE, LEVELS_OF_DETAIL, Batch, Mesh, Scene, Surface


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
        self._copies, self._cells = cells_of(copies_of(shape, record, place, self._shapes), _CELL)
        self._still = len(shape)
        self._chosen = _room(0)

    def set_daylight(self, illuminance: float, sides: SideLight = EVEN_LIGHT) -> None:
        """Draw by another daylight from now on (`illuminance` [lx])."""
        self._shading.set_daylight(illuminance, sides)

    def render(self, vehicles: Sequence[Batch], camera: Camera, pose: CameraPose, lamplight: bool = False) -> View:
        """Draw the scene and the vehicles (see `Renderer.render`)."""
        if self._rasteriser is None:
            raise RenderError("this renderer is closed; make a new one")
        drawing = self._drawing(vehicles, camera, pose)
        triangle_ids = self._rasteriser.triangle_ids(drawing, camera, pose)
        return self._shading.view(triangle_ids, drawing, camera, pose, lamplight)

    def close(self) -> None:
        """Give back what the rasteriser holds."""
        if self._rasteriser is not None:
            self._rasteriser.close()
        self._rasteriser = None

    def _drawing(self, vehicles: Sequence[Batch], camera: Camera, pose: CameraPose) -> Drawing:
        """What a picture may show."""
        end = self._place(vehicles)
        lens = lens_of(camera, pose)
        count = select_copies(
            self._shapes, self._copies, self._cells, end, lens.planes, lens.eye, camera.focal_length, self._chosen
        )
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
        shape = np.repeat(np.array([self._number(batch) for batch in scenery], np.int64), counts)
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
            self._copies = with_room(self._copies, end + 64 - len(self._copies.shape))
            self._chosen = _room(len(self._copies.shape))
        if vehicles:
            record = self._copies.record[self._still : end]
            integers, upper = record.view(np.int32), record[:, :12].reshape(-1, 3, 4)
            np.concatenate([batch.transforms[:, :3] for batch in vehicles], out=upper)
            np.concatenate([batch.paint for batch in vehicles], out=record[:, 12:15])
            np.concatenate([batch.lamps for batch in vehicles], out=integers[:, 15])
            np.concatenate([batch.instance for batch in vehicles], out=integers[:, 16])
            begin = self._still
            for batch, count in zip(vehicles, counts, strict=True):
                self._copies.shape[begin : begin + count] = self._number(batch)
                begin += count
            self._copies.place[self._still : end] = record[:, 3:12:4]
        return end

    def _number(self, batch: Batch) -> int:
        if batch.shape not in self._table.numbers:
            known = sorted(self._table.numbers)
            raise InputError(f"a batch names the shape {batch.shape!r}, which the scene does not have: {known}")
        return self._table.numbers[batch.shape]


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
