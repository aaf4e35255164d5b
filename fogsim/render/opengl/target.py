"""What is drawn into; importing it needs a context."""

import ctypes

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL
from OpenGL.raw.GL.VERSION import GL_1_1

from fogsim.render.drawing import NOTHING
from fogsim.render.protocol import RenderError

_BACKGROUND = np.array([NOTHING, 0, 0, 0], np.int32)


class Target:
    """Framebuffer of triangle ids for one size of picture, one sample a pixel (`width`, `height` [px])."""

    def __init__(self, width: int, height: int) -> None:
        self.size = (width, height)
        # Rows lie apart, as those that the processor draws do: for others the shading would be compiled again.
        self._rows = np.empty((height, width + 1), np.int32)
        self._framebuffer = int(GL.glGenFramebuffers(1))
        self._renderbuffers = [int(name) for name in GL.glGenRenderbuffers(2)]
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._framebuffer)
        triangle_ids, depth = self._renderbuffers
        _attach(triangle_ids, GL.GL_R32I, GL.GL_COLOR_ATTACHMENT0, self.size)
        _attach(depth, GL.GL_DEPTH_COMPONENT32F, GL.GL_DEPTH_ATTACHMENT, self.size)
        status = GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER)
        if status != GL.GL_FRAMEBUFFER_COMPLETE:
            self.delete()
            raise RenderError(f"OpenGL cannot draw to integers at {width} × {height} px (status {int(status):#x})")

    def begin(self) -> None:
        """Draw into this from now on, and forget what was drawn."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._framebuffer)
        GL.glViewport(0, 0, *self.size)
        GL.glEnable(GL.GL_DEPTH_TEST)
        GL.glClearBufferiv(GL.GL_COLOR, 0, _BACKGROUND)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)

    def read(self) -> NDArray[np.int32]:
        """The finished picture, its first row the first that was drawn; valid until the next is read."""
        # PyOpenGL's own function would make a new array at each call.
        place = self._rows.ctypes.data_as(ctypes.c_void_p)
        GL.glPixelStorei(GL.GL_PACK_ROW_LENGTH, self._rows.shape[1])
        GL_1_1.glReadPixels(0, 0, *self.size, GL.GL_RED_INTEGER, GL.GL_INT, place)
        GL.glPixelStorei(GL.GL_PACK_ROW_LENGTH, 0)
        return self._rows[:, :-1]

    def delete(self) -> None:
        """Free the framebuffer."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, 0)
        GL.glDeleteFramebuffers(1, [self._framebuffer])
        GL.glDeleteRenderbuffers(len(self._renderbuffers), self._renderbuffers)


def _attach(name: int, kind: int, place: int, size: tuple[int, int]) -> None:
    GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, name)
    GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, kind, *size)
    GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, place, GL.GL_RENDERBUFFER, name)
