"""The renderer that draws with OpenGL."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.render.copies import RECORD, Copies, ShapeTable, flattened, pieces, visible
from fogsim.render.gl.context import context
from fogsim.render.photometry import SKY_TINT, lamp_mask, lamp_radiance, zenith_luminance
from fogsim.render.projection import camera_axes, clip_from_offset, ray_from_pixel
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

        self._terrain, ground = _split_terrain(scene.ground)
        parts = {f"ground {number}": part for number, part in enumerate(pieces(ground, _GROUND_SQUARE))}
        shapes = {**scene.shapes, **parts}
        self._table = ShapeTable.of(shapes)
        self._still = flattened([*scene.scenery, *map(_standing, parts)], self._table)
        self._illuminance = illuminance
        self._store = MeshStore(list(shapes.values()))
        self._mesh_program, self._background_program = Program("mesh"), Program("background")
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
        for part in (self._store, self._mesh_program, self._background_program):
            part.delete()

    def _set_constants(self) -> None:
        masks = np.zeros(12, np.int32)
        masks[: len(Surface)] = [int(lamp_mask(surface)) for surface in Surface]
        self._mesh_program.use()
        self._mesh_program.set("lamp_masks", masks.reshape(3, 4))
        self._mesh_program.set("lamp_radiance", np.array([lamp_radiance(surface) for surface in Surface]))
        self._mesh_program.set("illuminance", float(self._illuminance))
        self._background_program.use()
        self._background_program.set("illuminance", float(self._illuminance))
        self._background_program.set("zenith", zenith_luminance(self._illuminance) * np.array(SKY_TINT))
        self._background_program.set("terrain_reflectance", self._terrain.reflectance)

    def _draw_meshes(
        self, vehicles: Sequence[Batch], camera: Camera, pose: CameraPose, eye: NDArray[np.float64]
    ) -> None:
        axes = camera_axes(camera, pose)
        groups = [
            visible(copies, self._table, camera, axes, eye)
            for copies in (flattened(vehicles, self._table), self._still)
        ]
        self._mesh_program.use()
        self._mesh_program.set("clip_from_offset", clip_from_offset(camera, pose))
        self._mesh_program.set("eye", eye)
        self._store.draw(np.concatenate([group[0] for group in groups]), np.concatenate([group[1] for group in groups]))

    def _draw_background(self, camera: Camera, pose: CameraPose, eye: NDArray[np.float64]) -> None:
        self._background_program.use()
        self._background_program.set("ray_from_pixel", ray_from_pixel(camera, pose))
        self._background_program.set("eye", eye)
        self._background_program.set("focal_length", float(camera.focal_length))
        self._background_program.set("terrain_height", float(max(eye[2] - self._terrain.height, 0.0)))
        self._store.draw_background()


def _split_terrain(ground: Mesh) -> tuple[_Terrain, Mesh]:
    """Take the plane of the terrain out of the ground; without one it lies at minus infinity."""
    flat = ground.surface == int(Surface.TERRAIN)
    rest = Mesh(
        positions=ground.positions,
        normals=ground.normals,
        reflectance=ground.reflectance,
        surface=ground.surface,
        road=ground.road,
        instance=ground.instance,
        faces=ground.faces[~flat[ground.faces].any(axis=1)],
    )
    if not flat.any():
        return _Terrain(float("inf"), np.zeros(3)), rest
    height = float(ground.positions[flat, 2].mean())
    return _Terrain(height, ground.reflectance[flat].mean(axis=0).astype(np.float64)), rest


def _standing(shape: str) -> Batch:
    """One copy of a part of the ground where it is; its instance ids are those of its vertices."""
    return Batch(
        shape=shape,
        transforms=np.eye(4, dtype=np.float32)[None],
        paint=np.zeros((1, 3), np.float32),
        lamps=np.zeros(1, np.int32),
        instance=np.zeros(1, np.int32),
    )


__all__ = ["RECORD", "Copies", "GLRenderer"]
