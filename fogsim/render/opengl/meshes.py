"""Triangles in the memory of the graphics system, and drawing copies of them; importing it needs a context."""

import ctypes
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL

from fogsim.core.jit import kernel
from fogsim.render.drawing import Drawing, MeshTable

_CORNER = np.dtype([("position", "<f4", (3,)), ("triangle", "<i4")])
"""A corner of a triangle, and the triangle's number in its mesh."""

COPY = np.dtype([("clip", "<f4", (3, 4)), ("first", "<i4")])
"""A copy of a mesh: its transform to the clip coordinates x, y and w, and the id of its first triangle."""

COMMAND = np.dtype([(name, "<u4") for name in ("count", "copies", "first", "copy")])
"""Copies of one mesh, in the layout of glMultiDrawArraysIndirect: how many and the first of corners and copies."""


def corners(table: MeshTable) -> NDArray[np.void]:
    """Three corners for each triangle of a table, none of them shared.

    A graphics system could share them and count triangles itself (gl_PrimitiveID), but software ones then copy each
    triangle's vertices all the same and take longer: 2.6 ms instead of 1.7 ms for 20,000 triangles in llvmpipe.

    Returns the corners.
    """
    result = np.empty(table.faces.size, _CORNER)
    result["position"] = table.positions[table.faces.ravel()]
    number = np.arange(len(table.faces)) - np.repeat(table.first_face[:-1], np.diff(table.first_face))
    result["triangle"] = np.repeat(number, 3)
    return result


def packed(
    drawing: Drawing, clip: NDArray[np.float64], first_face: NDArray[np.int64]
) -> tuple[NDArray[np.void], NDArray[np.void]]:
    """Copies by mesh, and what to draw of each mesh (`clip` (3, 3) [m], `first_face` (k + 1,) int64)."""
    number = len(drawing.mesh)
    words = np.empty((number, COPY.itemsize // 4), np.float32)
    commands = np.empty((len(first_face) - 1, COMMAND.itemsize // 4), np.uint32)
    used = _pack(drawing.mesh, drawing.record["transform"], drawing.first, clip, first_face, words, commands)
    return words.view(COPY)[:, 0], commands.view(COMMAND)[:used, 0]


@kernel
def _pack(
    mesh: NDArray[np.int64],
    transform: NDArray[np.float32],
    first: NDArray[np.int64],
    clip: NDArray[np.float64],
    first_face: NDArray[np.int64],
    words: NDArray[np.float32],
    commands: NDArray[np.uint32],
) -> int:
    """Fill `COPY` and `COMMAND`, given as words; the number of commands."""
    counts = np.zeros(len(first_face) - 1, np.int64)
    for copy in range(len(mesh)):
        counts[mesh[copy]] += 1
    place, used = np.empty_like(counts), 0
    begin = 0
    for number in range(len(counts)):
        place[number] = begin
        if counts[number] > 0:
            commands[used, 0] = 3 * (first_face[number + 1] - first_face[number])
            commands[used, 1] = counts[number]
            commands[used, 2] = 3 * first_face[number]
            commands[used, 3] = begin
            begin += counts[number]
            used += 1
    triangle_ids = words.view(np.int32)
    for copy in range(len(mesh)):
        row = place[mesh[copy]]
        place[mesh[copy]] += 1
        triangle_ids[row, 12] = first[copy]
        own = transform[copy]
        for i in range(3):
            x, y, z = clip[i, 0], clip[i, 1], clip[i, 2]
            for j in range(4):
                words[row, 4 * i + j] = x * own[0, j] + y * own[1, j] + z * own[2, j]
    return used


_INDIRECT = (4, 3)
"""Version of OpenGL from which on all meshes are drawn by one call."""

_AT_ONCE = 20_000
"""Triangles after which drawing begins.

A library that draws with the processor then fills pixels of one part while it works out corners of the next, and its
lists stay in the cache: 48,000 triangles take a fifth less time.
"""

# Location in the shader, numbers, whether they are integers, and offset [bytes].
_CORNER_LAYOUT = ((0, 3, False, 0), (1, 1, True, 12))
_COPY_LAYOUT = ((2, 4, False, 0), (3, 4, False, 16), (4, 4, False, 32), (5, 1, True, 48))


class MeshStore:
    """All meshes of a scene in one vertex array, drawn in any number of copies."""

    def __init__(self, corners: NDArray[np.void], version: tuple[int, int]) -> None:
        self._at_once = version >= _INDIRECT
        self._array = int(GL.glGenVertexArrays(1))
        self._buffers = [int(name) for name in GL.glGenBuffers(3)]
        fixed, self._copies, self._commands = self._buffers
        GL.glBindVertexArray(self._array)
        _upload(GL.GL_ARRAY_BUFFER, fixed, corners, GL.GL_STATIC_DRAW)
        _attributes(_CORNER_LAYOUT, _CORNER.itemsize)
        GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._copies)
        _attributes(_COPY_LAYOUT, COPY.itemsize)
        for location, *_ in _COPY_LAYOUT:
            GL.glVertexAttribDivisor(location, 1)
        GL.glBindVertexArray(0)

    def draw(self, copies: NDArray[np.void], commands: NDArray[np.void]) -> None:
        """Draw copies with the program in use."""
        if not len(commands):
            return
        GL.glBindVertexArray(self._array)
        _upload(GL.GL_ARRAY_BUFFER, self._copies, copies, GL.GL_STREAM_DRAW)
        if self._at_once:
            self._draw_at_once(commands)
        else:
            self._draw_one_by_one(commands)

    def _draw_at_once(self, commands: NDArray[np.void]) -> None:
        _upload(GL.GL_DRAW_INDIRECT_BUFFER, self._commands, commands, GL.GL_STREAM_DRAW)
        for begin, end in _parts(commands):
            place = ctypes.c_void_p(commands.itemsize * begin)
            GL.glMultiDrawArraysIndirect(GL.GL_TRIANGLES, place, end - begin, 0)
            GL.glFlush()

    def _draw_one_by_one(self, commands: NDArray[np.void]) -> None:
        for count, copies, first, copy in commands.tolist():
            _attributes(_COPY_LAYOUT, COPY.itemsize, COPY.itemsize * copy)
            GL.glDrawArraysInstanced(GL.GL_TRIANGLES, first, count, copies)

    def delete(self) -> None:
        """Free the buffers."""
        GL.glDeleteVertexArrays(1, [self._array])
        GL.glDeleteBuffers(len(self._buffers), self._buffers)


def _parts(commands: NDArray[np.void]) -> list[tuple[int, int]]:
    """First and last commands of the parts in which they are drawn."""
    corners = np.cumsum(commands["count"].astype(np.int64) * commands["copies"])
    begins = np.flatnonzero(np.diff(corners // (3 * _AT_ONCE), prepend=-1))
    return list(itertools.pairwise([*begins.tolist(), len(commands)]))


def _upload(target: int, name: int, data: NDArray[Any], usage: int) -> None:
    GL.glBindBuffer(target, name)
    GL.glBufferData(target, data.nbytes, np.ascontiguousarray(data).view(np.uint8), usage)


def _attributes(layout: Sequence[tuple[int, int, bool, int]], stride: int, start: int = 0) -> None:
    """Describe what lies in the bound buffer from a place [bytes] on."""
    for location, numbers, integer, offset in layout:
        GL.glEnableVertexAttribArray(location)
        place = ctypes.c_void_p(start + offset)
        if integer:
            GL.glVertexAttribIPointer(location, numbers, GL.GL_INT, stride, place)
        else:
            GL.glVertexAttribPointer(location, numbers, GL.GL_FLOAT, GL.GL_FALSE, stride, place)
