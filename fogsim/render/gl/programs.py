"""Shader programs and their uniforms."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL
from OpenGL.GL import shaders

from fogsim.render.protocol import RenderError

_FOLDER = Path(__file__).parent / "shaders"


class Program:
    """A vertex and a fragment shader, linked; needs the context to be current.

    Parameters
    ----------
    vertex, fragment : str
        Stems of the files in ``shaders/``.
    """

    def __init__(self, vertex: str, fragment: str) -> None:
        self._name = fragment
        # Linking validates, and in a core profile that needs some vertex array to be bound.
        vertex_array = GL.glGenVertexArrays(1)
        GL.glBindVertexArray(vertex_array)
        stages = ((GL.GL_VERTEX_SHADER, f"{vertex}.vert"), (GL.GL_FRAGMENT_SHADER, f"{fragment}.frag"))
        self._program = shaders.compileProgram(*(shaders.compileShader(_source(name), stage) for stage, name in stages))
        GL.glBindVertexArray(0)
        GL.glDeleteVertexArrays(1, [vertex_array])
        self._locations: dict[str, int] = {}

    def use(self) -> None:
        """Draw with this program from now on."""
        GL.glUseProgram(self._program)

    def set(self, name: str, value: float | NDArray[np.float64] | NDArray[np.int32]) -> None:
        """Set a uniform of the program in use: a number, vectors (count, 2 … 4) or a square matrix.

        Raises
        ------
        RenderError
            If the program has no such uniform.
        """
        location = self._location(name)
        if isinstance(value, float):
            GL.glUniform1f(location, value)
        elif value.dtype.kind == "i":
            GL.glUniform4iv(location, len(value), np.ascontiguousarray(value, np.int32))
        elif value.ndim == 1:
            GL.glUniform3fv(location, 1, np.ascontiguousarray(value, np.float32))
        elif value.shape == (4, 4):
            GL.glUniformMatrix4fv(location, 1, GL.GL_TRUE, np.ascontiguousarray(value, np.float32))
        elif value.shape == (3, 3):
            GL.glUniformMatrix3fv(location, 1, GL.GL_TRUE, np.ascontiguousarray(value, np.float32))
        else:
            GL.glUniform3fv(location, len(value), np.ascontiguousarray(value, np.float32))

    def _location(self, name: str) -> int:
        if name not in self._locations:
            location = GL.glGetUniformLocation(self._program, name)
            if location < 0:
                raise RenderError(f"the shader {self._name!r} has no uniform {name!r}")
            self._locations[name] = location
        return self._locations[name]

    def delete(self) -> None:
        """Free the program."""
        GL.glUseProgram(0)  # what is in use is not freed
        GL.glDeleteProgram(self._program)


def _source(name: str) -> str:
    parts = ["#version 410 core"]
    if name.endswith(".frag"):
        parts.append((_FOLDER / "noise.glsl").read_text(encoding="utf-8"))
    text = "\n".join([*parts, (_FOLDER / name).read_text(encoding="utf-8")])
    # Some compilers refuse what is not ASCII even in comments.
    return text.encode("ascii", "replace").decode("ascii")
