"""The one OpenGL context of this process."""

import ctypes.util
import functools
import os
import warnings
from dataclasses import dataclass
from typing import Any, Protocol

from fogsim.errors import MissingDependencyError
from fogsim.render.protocol import RenderError

_OLDEST = (3, 3)
"""Oldest version of OpenGL that will do: copies of shapes, integer pictures."""

_LIBRARIES = {"egl": ("EGL", "GL"), "osmesa": ("OSMesa",)}
"""Libraries that each way to an off-screen context needs, the better way first."""

_NAMES = {"egl": "EGL", "osmesa": "OSMesa"}
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software rasterizer")
_ADVICE = "on Debian or Ubuntu: sudo apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri"


class Platform(Protocol):
    """Holder of a context."""

    def make_current(self) -> None:
        """Make the context the current one of this thread."""
        ...


@dataclass(frozen=True, slots=True)
class Context:
    """An OpenGL context and the process it belongs to."""

    platform: Platform  # Holder of the context
    process: int  # Id of the process that made it
    version: tuple[int, int]  # Major and minor version of OpenGL
    software: bool  # True if the processor draws, for want of a graphics card
    description: str  # Way, version and renderer, for reports

    @property
    def is_of_this_process(self) -> bool:
        """False in a process that was forked from the one that made the context."""
        return os.getpid() == self.process

    def activate(self) -> None:
        """Make the context the current one of this thread."""
        if not self.is_of_this_process:
            raise RenderError(
                f"process {os.getpid()} was forked from process {self.process} after that had drawn; an OpenGL context "
                "does not survive a fork: start workers before the parent draws, or with the start method 'spawn'"
            )
        self.platform.make_current()

    def restore(self) -> None:
        """Set what pyrender changes of the state back to what `GLRasteriser` takes for granted."""
        from OpenGL import GL  # noqa: PLC0415 - must come after the context has chosen its platform

        for switch in (GL.GL_CULL_FACE, GL.GL_BLEND):
            GL.glDisable(switch)
        GL.glEnable(GL.GL_MULTISAMPLE)
        GL.glDepthMask(GL.GL_TRUE)
        GL.glDepthFunc(GL.GL_LESS)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, 0)


def context() -> Context:
    """Make the process's context at the first call, and make it current at every call."""
    only = _only_context()
    only.activate()
    return only


@functools.cache
def _only_context() -> Context:
    # Deleting any EGL context of pyrender's terminates the display that all share, so there is one and it stays.
    way = choose_platform()
    try:
        platform = _egl_platform() if way == "egl" else _osmesa_platform()
        from OpenGL import GL  # noqa: PLC0415
    except MissingDependencyError:
        raise
    except Exception as error:  # whatever it is: a missing library shows as ImportError, OSError or AttributeError
        raise MissingDependencyError(f"OpenGL or EGL could not be loaded ({_one_line(error)}); {_ADVICE}") from error
    version = (int(GL.glGetIntegerv(GL.GL_MAJOR_VERSION)), int(GL.glGetIntegerv(GL.GL_MINOR_VERSION)))
    renderer, text = (GL.glGetString(name).decode("ascii", "replace") for name in (GL.GL_RENDERER, GL.GL_VERSION))
    if version < _OLDEST:
        wanted = ".".join(map(str, _OLDEST))
        raise MissingDependencyError(f"OpenGL {wanted} or newer is needed, {renderer} offers {text}; {_ADVICE}")
    software = any(name in renderer.lower() for name in _SOFTWARE)
    return Context(platform, os.getpid(), version, software, f"OpenGL ({_NAMES[way]}) {text}, {renderer}")


def choose_platform() -> str:
    """Choose the way to a context; PyOpenGL reads it from the environment when it is first imported."""
    way = os.environ["PYOPENGL_PLATFORM"] = _way()
    return way


def _way() -> str:
    """The way to a context that was asked for, else the first whose libraries are here, else the first."""
    asked = os.environ.get("PYOPENGL_PLATFORM")
    if asked:
        if asked not in _LIBRARIES:
            known = " or ".join(map(repr, _LIBRARIES))
            raise MissingDependencyError(f"PYOPENGL_PLATFORM is {asked!r}; FogSim draws with {known}: unset it")
        return asked
    present = (way for way, names in _LIBRARIES.items() if all(map(ctypes.util.find_library, names)))
    return next(present, "egl")


def _egl_platform() -> Platform:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # pyrender and pyglet are old; their deprecations are not the user's
        from pyrender.platforms import egl  # noqa: PLC0415
    return _working_platform(egl)


def _osmesa_platform() -> Platform:
    from fogsim.render.opengl.osmesa import OSMesaPlatform  # noqa: PLC0415 - loads the library

    platform = OSMesaPlatform()
    platform.make_current()
    return platform


def _working_platform(egl: Any) -> Platform:
    """Context on the first device that gives one: a graphics card may be listed and yet not be allowed."""
    failures: list[str] = []
    try:
        devices = egl.query_devices() or [egl.get_default_device()]
    except Exception as error:  # noqa: BLE001 - without the device extension there is still the default display
        failures.append(_one_line(error))
        devices = [egl.EGLDevice(None)]
    for device in devices:
        platform: Any = egl.EGLPlatform(1, 1, device=device)
        try:
            platform.init_context()
            platform.make_current()
        except Exception as error:  # noqa: BLE001 - PyOpenGL raises its own errors, pyrender AssertionError
            failures.append(_one_line(error))
        else:
            chosen: Platform = platform
            return chosen
    raise MissingDependencyError(f"no OpenGL context could be made with EGL ({'; '.join(failures)}); {_ADVICE}")


def _one_line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"[:200]
