"""Vertices, copies and pictures in the memory of the graphics system; all need the context to be current."""

import ctypes
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL
from OpenGL.raw.GL.VERSION import GL_1_1

from fogsim.render.copies import RECORD
from fogsim.render.protocol import RenderError
from fogsim.values.camera import Camera
from fogsim.values.image import View
from fogsim.values.scene import Mesh

_VERTEX = np.dtype(
    [
        ("position", "<f4", (3,)),
        ("normal", "<f4", (3,)),
        ("reflectance", "<f4", (3,)),
        ("road", "<f4", (4,)),
        ("surface", "<i4"),
        ("instance", "<i4"),
    ]
)
_COMMAND = np.dtype([(name, "<u4") for name in ("count", "copies", "first", "vertex", "copy")])

# Location in the shader, numbers, whether they are integers, and offset in the vertex or the record [bytes].
_VERTEX_LAYOUT = ((0, 3, False, 0), (1, 3, False, 12), (2, 3, False, 24), (3, 4, False, 36), (4, 2, True, 52))
_RECORD_LAYOUT = ((5, 4, False, 0), (6, 4, False, 16), (7, 4, False, 32), (8, 3, False, 48), (9, 2, True, 60))


class MeshStore:
    """All meshes of a scene in one vertex array, drawn in any number of copies by one call.

    Parameters
    ----------
    meshes : sequence of Mesh
        The meshes; they are drawn by their number in it.
    """

    def __init__(self, meshes: Sequence[Mesh]) -> None:
        vertices, indices = [_vertices(mesh) for mesh in meshes], [mesh.faces.ravel() for mesh in meshes]
        self._vertex = np.cumsum([0, *map(len, vertices)])
        self._first = np.cumsum([0, *map(len, indices)])
        self._array = GL.glGenVertexArrays(1)
        self._buffers = [int(name) for name in GL.glGenBuffers(4)]
        vertex_buffer, index_buffer, self._record_buffer, self._command_buffer = self._buffers
        GL.glBindVertexArray(self._array)
        _upload(GL.GL_ARRAY_BUFFER, vertex_buffer, np.concatenate(vertices), GL.GL_STATIC_DRAW)
        _attributes(_VERTEX_LAYOUT, _VERTEX.itemsize, divisor=0)
        _upload(GL.GL_ELEMENT_ARRAY_BUFFER, index_buffer, np.concatenate(indices), GL.GL_STATIC_DRAW)
        _upload(GL.GL_ARRAY_BUFFER, self._record_buffer, np.zeros(1, RECORD), GL.GL_STREAM_DRAW)
        _attributes(_RECORD_LAYOUT, RECORD.itemsize, divisor=1)
        GL.glBindVertexArray(0)

    def draw(self, shape: NDArray[np.int64], record: NDArray[np.void]) -> None:
        """Draw copies, shapes with low numbers first.

        Parameters
        ----------
        shape : (n,) int64
            Number of each copy's mesh.
        record : (n,) `RECORD`
            What is drawn of it.
        """
        if not len(shape):
            return
        order = np.argsort(shape, kind="stable")
        kinds, first, counts = np.unique(shape[order], return_index=True, return_counts=True)
        commands = np.empty(len(kinds), _COMMAND)
        commands["count"] = self._first[kinds + 1] - self._first[kinds]
        commands["copies"], commands["copy"] = counts, first
        commands["first"], commands["vertex"] = self._first[kinds], self._vertex[kinds]
        GL.glBindVertexArray(self._array)
        _upload(GL.GL_ARRAY_BUFFER, self._record_buffer, record[order], GL.GL_STREAM_DRAW)
        _upload(GL.GL_DRAW_INDIRECT_BUFFER, self._command_buffer, commands, GL.GL_STREAM_DRAW)
        GL.glMultiDrawElementsIndirect(GL.GL_TRIANGLES, GL.GL_UNSIGNED_INT, ctypes.c_void_p(0), len(commands), 0)

    def draw_background(self) -> None:
        """Draw one triangle without attributes."""
        GL.glBindVertexArray(self._array)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)

    def delete(self) -> None:
        """Free the buffers."""
        GL.glDeleteVertexArrays(1, [self._array])
        GL.glDeleteBuffers(len(self._buffers), self._buffers)


def _vertices(mesh: Mesh) -> NDArray[np.void]:
    vertices = np.empty(len(mesh.positions), _VERTEX)
    vertices["position"], vertices["normal"] = mesh.positions, mesh.normals
    vertices["reflectance"], vertices["road"] = mesh.reflectance, mesh.road
    vertices["surface"], vertices["instance"] = mesh.surface, mesh.instance
    return vertices


def _upload(target: int, name: int, data: NDArray[np.generic], usage: int) -> None:
    GL.glBindBuffer(target, name)
    GL.glBufferData(target, data.nbytes, np.ascontiguousarray(data).view(np.uint8), usage)


def _attributes(layout: Sequence[tuple[int, int, bool, int]], stride: int, divisor: int) -> None:
    for location, numbers, integer, offset in layout:
        GL.glEnableVertexAttribArray(location)
        if integer:
            GL.glVertexAttribIPointer(location, numbers, GL.GL_INT, stride, ctypes.c_void_p(offset))
        else:
            GL.glVertexAttribPointer(location, numbers, GL.GL_FLOAT, GL.GL_FALSE, stride, ctypes.c_void_p(offset))
        GL.glVertexAttribDivisor(location, divisor)


class Target:
    """Framebuffer for one size of picture: radiance with distance, instance ids, depth; one sample a pixel.

    Parameters
    ----------
    width, height : int
        Size [px].

    Raises
    ------
    RenderError
        If the graphics system cannot draw to such a framebuffer.
    """

    def __init__(self, width: int, height: int) -> None:
        self.size = (width, height)
        self._framebuffer = int(GL.glGenFramebuffers(1))
        self._renderbuffers = [int(name) for name in GL.glGenRenderbuffers(3)]
        kinds = (
            (GL.GL_RGBA32F, GL.GL_COLOR_ATTACHMENT0),
            (GL.GL_R32I, GL.GL_COLOR_ATTACHMENT1),
            (GL.GL_DEPTH_COMPONENT32F, GL.GL_DEPTH_ATTACHMENT),
        )
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._framebuffer)
        for name, (kind, place) in zip(self._renderbuffers, kinds, strict=True):
            GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, name)
            GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, kind, width, height)
            GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, place, GL.GL_RENDERBUFFER, name)
        GL.glDrawBuffers(2, [GL.GL_COLOR_ATTACHMENT0, GL.GL_COLOR_ATTACHMENT1])
        status = GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER)
        if status != GL.GL_FRAMEBUFFER_COMPLETE:
            self.delete()
            raise RenderError(f"OpenGL cannot draw to 32-bit floats at {width} × {height} px (status {int(status):#x})")

    def begin(self) -> None:
        """Draw into this from now on; the background will cover what nothing else does, so only depth is cleared."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._framebuffer)
        GL.glViewport(0, 0, *self.size)
        GL.glDisable(GL.GL_SCISSOR_TEST)
        GL.glEnable(GL.GL_DEPTH_TEST)
        GL.glDepthFunc(GL.GL_LEQUAL)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)

    def restrict(self, first_row: int) -> None:
        """Draw only into rows from this one on, until the next picture begins."""
        GL.glEnable(GL.GL_SCISSOR_TEST)
        GL.glScissor(0, first_row, self.size[0], self.size[1] - first_row)

    def read(self) -> View:
        """Copy the finished picture to arrays of its own; its first row is the first that was drawn."""
        width, height = self.size
        radiance = np.empty((height, width, 3), np.float32)
        distance = np.empty((height, width), np.float32)
        instance = np.empty((height, width), np.int32)
        # Three reads that the driver packs take a third of the time of one read that numpy takes apart.
        GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT0)
        _read(self.size, GL.GL_RGB, GL.GL_FLOAT, radiance)
        _read(self.size, GL.GL_ALPHA, GL.GL_FLOAT, distance)
        GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT1)
        _read(self.size, GL.GL_RED_INTEGER, GL.GL_INT, instance)
        return View(radiance, distance, instance)

    def delete(self) -> None:
        """Free the framebuffer."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, 0)
        GL.glDeleteFramebuffers(1, [self._framebuffer])
        GL.glDeleteRenderbuffers(len(self._renderbuffers), self._renderbuffers)


def _read(size: tuple[int, int], channels: int, kind: int, into: NDArray[np.float32] | NDArray[np.int32]) -> None:
    GL_1_1.glReadPixels(0, 0, *size, channels, kind, into.ctypes.data_as(ctypes.c_void_p))


def target_for(camera: Camera, old: Target | None) -> Target:
    """Keep the target if it has a camera's size, else replace it."""
    if old is not None and old.size == (camera.width, camera.height):
        return old
    if old is not None:
        old.delete()
    return Target(camera.width, camera.height)
