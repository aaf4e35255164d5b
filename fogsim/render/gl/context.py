"""The one OpenGL context of this process."""

import functools
import os
import warnings
from dataclasses import dataclass
from typing import Any

from fogsim.errors import MissingDependencyError
from fogsim.render.protocol import RenderError

OLDEST = (4, 3)
"""Oldest version of OpenGL that will do: indirect drawing of many shapes in one call."""

_ADVICE = "on Debian or Ubuntu: sudo apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri"


@dataclass(frozen=True, slots=True)
class Context:
    """An OpenGL context and the process it belongs to.

    Attributes
    ----------
    platform : pyrender.platforms.egl.EGLPlatform
        Holder of the display and the context.
    process : int
        Id of the process that made it.
    description : str
        Renderer and version, for reports.
    """

    platform: Any
    process: int
    description: str

    def activate(self) -> None:
        """Make the context the current one of this thread.

        Raises
        ------
        RenderError
            If another process made it: a context does not survive a fork.
        """
        if os.getpid() != self.process:
            raise RenderError(
                f"process {os.getpid()} was forked from process {self.process} after that had drawn; an OpenGL context "
                "does not survive a fork: start workers before the parent draws, or with the start method 'spawn'"
            )
        self.platform.make_current()


def context() -> Context:
    """Make the process's context at the first call, and make it current at every call.

    Raises
    ------
    MissingDependencyError
        If OpenGL or EGL is missing, too old or does not work; the message names the packages.
    RenderError
        If this process was forked from one that had drawn.
    """
    only = _only_context()
    only.activate()
    return only


@functools.cache
def _only_context() -> Context:
    # Deleting any EGL context of pyrender's terminates the display that all share, so there is one and it stays.
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pyrender and pyglet are old; their deprecations are not the user's
            from OpenGL import GL  # noqa: PLC0415
            from pyrender.platforms import egl  # noqa: PLC0415
    except Exception as error:  # whatever it is: a missing library shows as ImportError, OSError or AttributeError
        raise MissingDependencyError(f"OpenGL or EGL could not be loaded ({_one_line(error)}); {_ADVICE}") from error
    platform = _working_platform(egl)
    description = _describe(GL)
    return Context(platform, os.getpid(), description)


def _working_platform(egl: Any) -> Any:
    """Context on the first device that gives one: a graphics card may be listed and yet not be allowed."""
    failures: list[str] = []
    try:
        devices = egl.query_devices() or [egl.get_default_device()]
    except Exception as error:  # noqa: BLE001 - without the device extension there is still the default display
        failures.append(_one_line(error))
        devices = [egl.EGLDevice(None)]
    for device in devices:
        platform = egl.EGLPlatform(1, 1, device=device)
        try:
            platform.init_context()
            platform.make_current()
        except Exception as error:  # noqa: BLE001 - PyOpenGL raises its own errors, pyrender AssertionError
            failures.append(_one_line(error))
        else:
            return platform
    raise MissingDependencyError(f"no OpenGL context could be made with EGL ({'; '.join(failures)}); {_ADVICE}")


def _describe(gl: Any) -> str:
    version = (int(gl.glGetIntegerv(gl.GL_MAJOR_VERSION)), int(gl.glGetIntegerv(gl.GL_MINOR_VERSION)))
    renderer, text = (gl.glGetString(name).decode("ascii", "replace") for name in (gl.GL_RENDERER, gl.GL_VERSION))
    if version < OLDEST:
        wanted = ".".join(map(str, OLDEST))
        raise MissingDependencyError(f"OpenGL {wanted} or newer is needed, {renderer} offers {text}; {_ADVICE}")
    return f"{renderer}, OpenGL {text}"


def _one_line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"[:200]
