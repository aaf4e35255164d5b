"""The renderer that draws with OpenGL."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.pinhole import camera_axes, ray_from_pixel
from fogsim.render.copies import ShapeTable, flattened, pieces, visible
from fogsim.render.gl.context import context
from fogsim.render.photometry import SKY_TINT, lamp_mask, lamp_radiance, zenith_luminance
from fogsim.render.projection import clip_from_offset, highest_terrain_row
from fogsim.render.protocol import RenderError
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.image import View
from fogsim.values.scene import Batch, Mesh, Scene, Surface

_GROUND_SQUARE = 160.0  # side of the pieces in which the ground is culled [m]


@dataclass(frozen=True, slots=True)
class _Terrain:
    """Level ground to the horizon."""

    height: float
    reflectance: NDArray[np.float64]


class GLRenderer:
    """Draws a scene in overcast daylight with one sample a pixel and without clamping.

    Parameters
    ----------
    scene : Scene
        What stands still; its triangles of TERRAIN stand for one level plane without an edge.
    illuminance : float
        Horizontal illuminance E [lx].

    Raises
    ------
    MissingDependencyError
        If OpenGL or EGL is missing or does not work.
    RenderError
        If this process was forked from one that had drawn.
    """

    def __init__(self, scene: Scene, illuminance: float) -> None:
        self._context = context()
        # These import OpenGL, which must come after the context has chosen EGL.
        from fogsim.render.gl.buffers import MeshStore, Target, target_for  # noqa: PLC0415
        from fogsim.render.gl.programs import Program  # noqa: PLC0415

        self._terrain, road, ground = _split(scene.ground)
        parts = {f"ground {number}": part for number, part in enumerate(pieces(ground, _GROUND_SQUARE))}
        paved = {f"road {number}": part for number, part in enumerate(pieces(road, _GROUND_SQUARE))}
        shapes = {**scene.shapes, **parts, **paved}
        self._first_paved = len(shapes) - len(paved)
        self._table = ShapeTable.of(shapes)
        self._still = flattened([*scene.scenery, *map(_standing, (*parts, *paved))], self._table)
        self._illuminance = illuminance
        self._store = MeshStore(list(shapes.values()))
        self._objects, self._road = Program("mesh", "object"), Program("mesh", "road")
        self._grass, self._sky = Program("background", "terrain"), Program("background", "sky")
        self._target: Target | None = None
        self._target_for = target_for
        self._closed = False
        self._set_constants()

    def render(self, vehicles: Sequence[Batch], camera: Camera, pose: CameraPose) -> View:
        """Draw the scene and the vehicles (see `Renderer.render`)."""
        if self._closed:
            raise RenderError("this renderer is closed; make a new one")
        self._context.activate()
        self._target = self._target_for(camera, self._target)
        self._target.begin()
        eye = np.array(pose.position, np.float64)
        self._draw_meshes(vehicles, camera, pose, eye)
        self._draw_background(camera, pose, eye)
        return self._target.read()

    def close(self) -> None:
        """Free this renderer's buffers and programs; the context stays, since other renderers share it."""
        if self._closed:
            return
        self._closed = True
        self._context.activate()
        if self._target is not None:
            self._target.delete()
        for part in (self._store, self._objects, self._road, self._grass, self._sky):
            part.delete()

    def _set_constants(self) -> None:
        masks = np.zeros(12, np.int32)
        masks[: len(Surface)] = [int(lamp_mask(surface)) for surface in Surface]
        for program in (self._objects, self._road):
            program.use()
            program.set("lamp_masks", masks.reshape(3, 4))
            program.set("lamp_radiance", np.array([lamp_radiance(surface) for surface in Surface]))
            program.set("illuminance", float(self._illuminance))
        self._grass.use()
        self._grass.set("illuminance", float(self._illuminance))
        self._grass.set("terrain_reflectance", self._terrain.reflectance)
        self._sky.use()
        self._sky.set("zenith", zenith_luminance(self._illuminance) * np.array(SKY_TINT))

    def _draw_meshes(
        self, vehicles: Sequence[Batch], camera: Camera, pose: CameraPose, eye: NDArray[np.float64]
    ) -> None:
        axes, projection = camera_axes(camera, pose), clip_from_offset(camera, pose)
        copies = (flattened(vehicles, self._table), self._still)
        groups = [visible(group, self._table, camera, axes, eye) for group in copies]
        shape, record = (np.concatenate(parts) for parts in zip(*groups, strict=True))
        paved = shape >= self._first_paved
        self._objects.use()
        self._objects.set("clip_from_offset", projection)
        self._store.draw(shape[~paved], record[~paved])
        self._road.use()
        self._road.set("clip_from_offset", projection)
        self._road.set("eye", eye)
        self._store.draw(shape[paved], record[paved])

    def _draw_background(self, camera: Camera, pose: CameraPose, eye: NDArray[np.float64]) -> None:
        """Fill what nothing covers yet with sky, and below the horizon with grass."""
        rays = ray_from_pixel(camera, pose)
        self._sky.use()
        self._sky.set("ray_from_pixel", rays)
        self._store.draw_background()
        first_row = highest_terrain_row(camera, pose)
        height = float(eye[2] - self._terrain.height)
        if height <= 0.0 or first_row >= camera.height or self._target is None:
            return
        self._target.restrict(first_row)
        self._grass.use()
        self._grass.set("ray_from_pixel", rays)
        self._grass.set("eye", eye)
        self._grass.set("focal_length", float(camera.focal_length))
        self._grass.set("terrain_height", height)
        self._store.draw_background()


def _split(ground: Mesh) -> tuple[_Terrain, Mesh, Mesh]:
    """Take the plane of the terrain, the road and the rest apart; without terrain its plane is infinitely high."""
    surface = ground.surface[ground.faces[:, 0]]
    flat, paved = surface == int(Surface.TERRAIN), surface == int(Surface.ROAD)
    road, rest = replace(ground, faces=ground.faces[paved]), replace(ground, faces=ground.faces[~flat & ~paved])
    if not flat.any():
        return _Terrain(float("inf"), np.zeros(3)), road, rest
    vertices = ground.faces[flat].ravel()
    height = float(ground.positions[vertices, 2].mean())
    return _Terrain(height, ground.reflectance[vertices].mean(axis=0).astype(np.float64)), road, rest


def _standing(shape: str) -> Batch:
    """One copy of a part of the ground where it is; its instance ids are those of its vertices."""
    return Batch(
        shape=shape,
        transforms=np.eye(4, dtype=np.float32)[None],
        paint=np.zeros((1, 3), np.float32),
        lamps=np.zeros(1, np.int32),
        instance=np.zeros(1, np.int32),
    )
