"""Triangles in the memory of the graphics system, and drawing copies of them; importing it needs a context."""

import ctypes
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL

from fogsim.render.opengl.packing import COPY, CORNER

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
        _attributes(_CORNER_LAYOUT, CORNER.itemsize)
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
