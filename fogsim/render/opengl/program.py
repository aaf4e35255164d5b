"""The shader program, one for all renderers of a process; importing it needs a context."""

import functools
from pathlib import Path

from OpenGL import GL
from OpenGL.GL import shaders

from fogsim.render.drawing import NEAR

_FOLDER = Path(__file__).parent / "shaders"


@functools.cache
def visibility_program() -> int:
    """Name of the program that writes triangle_ids; compiled at the first call, and kept as long as the context."""
    # Linking validates, and in a core profile that needs some vertex array to be bound.
    vertex_array = GL.glGenVertexArrays(1)
    GL.glBindVertexArray(vertex_array)
    stages = (("visibility.vert", GL.GL_VERTEX_SHADER), ("visibility.frag", GL.GL_FRAGMENT_SHADER))
    program = shaders.compileProgram(*(shaders.compileShader(_source(name), stage) for name, stage in stages))
    GL.glBindVertexArray(0)
    GL.glDeleteVertexArrays(1, [vertex_array])
    return int(program)


def _source(name: str) -> str:
    text = (_FOLDER / name).read_text(encoding="utf-8")
    # Some compilers refuse what is not ASCII even in comments.
    return f"#version 330 core\n#define NEAR {NEAR!r}\n{text}".encode("ascii", "replace").decode("ascii")
