"""A context of Mesa's off-screen library, for machines that have no EGL; importing it needs PYOPENGL_PLATFORM=osmesa.

pyrender has a class for it, which needs a newer PyOpenGL than the one that pyrender itself demands.
"""

import ctypes

import OpenGL.platform

_FORMAT, _PROFILE, _CORE_PROFILE, _MAJOR, _MINOR, _DEPTH_BITS = 0x22, 0x33, 0x34, 0x36, 0x37, 0x30
_RGBA, _UNSIGNED_BYTE = 0x1908, 0x1401


class OSMesaPlatform:
    """An off-screen context that draws with the processor."""

    def __init__(self) -> None:
        self._library = OpenGL.platform.PLATFORM.OSMesa
        # PyOpenGL keeps its notes by context, and takes it for a structure, which cannot be a key.
        OpenGL.platform.PLATFORM.GetCurrentContext.restype = ctypes.c_void_p
        create = self._library.OSMesaCreateContextAttribs
        create.restype, create.argtypes = ctypes.c_void_p, [ctypes.c_void_p, ctypes.c_void_p]
        self._library.OSMesaMakeCurrent.argtypes = [ctypes.c_void_p, ctypes.c_void_p, *[ctypes.c_int] * 3]
        wanted = (_FORMAT, _RGBA, _DEPTH_BITS, 24, _PROFILE, _CORE_PROFILE, _MAJOR, 3, _MINOR, 3, 0)
        self._context = create((ctypes.c_int * len(wanted))(*wanted), None)
        if not self._context:
            raise RuntimeError("OSMesa gives no core context of OpenGL 3.3")
        self._pixel = (ctypes.c_ubyte * 4)()  # pictures are drawn to framebuffers; the window is one pixel

    def make_current(self) -> None:
        """Make the context the current one of this thread."""
        if not self._library.OSMesaMakeCurrent(self._context, self._pixel, _UNSIGNED_BYTE, 1, 1):
            raise RuntimeError("OSMesa does not make its context current")
