"""Which triangle each pixel sees, by OpenGL."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fogsim.render.drawing import Drawing, MeshTable
from fogsim.render.opengl.context import context
from fogsim.render.opengl.meshes import corners, packed
from fogsim.render.projection import clip_from_offset
from fogsim.render.protocol import RenderError
from fogsim.values.camera import Camera, CameraPose

if TYPE_CHECKING:
    from fogsim.render.opengl.target import Target


class GLRasteriser:
    """Finds visible triangles with a graphics card, or with a library that stands in for one."""

    def __init__(self, table: MeshTable) -> None:
        self._context = context()
        # These import OpenGL, which must come after the context has chosen its platform.
        from OpenGL.GL import glUseProgram  # noqa: PLC0415

        from fogsim.render.opengl.meshes import MeshStore  # noqa: PLC0415
        from fogsim.render.opengl.program import visibility_program  # noqa: PLC0415
        from fogsim.render.opengl.target import Target  # noqa: PLC0415

        self._first_face = table.first_face
        self._program, self._use_program = visibility_program(), glUseProgram
        self._store = MeshStore(corners(table), self._context.version)
        self._make_target = Target
        self._target: Target | None = None
        self._closed = False

    def triangle_ids(self, drawing: Drawing, camera: Camera, pose: CameraPose) -> NDArray[np.int32]:
        """Find the triangle that each pixel sees (see `Rasteriser.triangle_ids`)."""
        if self._closed:
            raise RenderError("this renderer is closed; make a new one")
        self._context.activate()
        target = self._target_of(camera)
        target.begin()
        self._use_program(self._program)
        clip = clip_from_offset(camera, pose)[[0, 1, 3], :3]
        self._store.draw(*packed(drawing, clip, self._first_face))
        return target.read()

    def _target_of(self, camera: Camera) -> "Target":
        """The target, made again if the camera's size is another than the last one's."""
        size = (camera.width, camera.height)
        if self._target is not None and self._target.size != size:
            self._target.delete()
            self._target = None
        if self._target is None:
            self._target = self._make_target(*size)
        return self._target

    def close(self) -> None:
        """Free what this holds; the context stays, since others share it."""
        if self._closed:
            return
        self._closed = True
        if not self._context.is_of_this_process:
            return  # a forked child has nothing to free
        self._context.activate()
        if self._target is not None:
            self._target.delete()
        self._store.delete()
