"""What every renderer does, whatever it draws with."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from fogsim.errors import FogSimError, MissingDependencyError
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.fog import EVEN_LIGHT, SideLight
from fogsim.values.image import View
from fogsim.values.scene import Batch

FARTHEST = 1600.0
"""Depth beyond which FogSim's own renderers draw no copy and no ground but the plain, nearer in small pictures [m]."""


class RenderError(FogSimError, RuntimeError):
    """A renderer cannot be used here or any more; the message says why and what to do."""


class Renderer(Protocol):
    """Draws one scene for any camera."""

    def set_daylight(self, illuminance: float, sides: SideLight = EVEN_LIGHT) -> None:
        """Draw by another daylight from now on (`illuminance` [lx])."""
        ...

    def render(self, vehicles: Sequence[Batch], camera: Camera, pose: CameraPose, lamplight: bool = False) -> View:
        """Draw the scene and the vehicles as they are now.

        Returns arrays of its own that later frames do not touch.
        """
        ...

    def close(self) -> None:
        """Give back what the renderer holds; a second call does nothing."""
        ...


def best_renderer() -> tuple[str, str]:
    """Choose the renderer that "auto" stands for.

    Returns Its name in `RENDERERS`, and why.
    """
    if not _may_have_card():
        return "cpu", "OpenGL would be drawn by software: there is no graphics card (/dev/dri/render*, /dev/nvidia*)"
    from fogsim.render.opengl.context import context  # noqa: PLC0415 - OpenGL is loaded only where it is asked for

    try:
        found = context()
    except MissingDependencyError as error:
        return "cpu", f"OpenGL does not work here: {error}"
    except RenderError as error:
        return "cpu", f"OpenGL cannot be used in this process: {error}"
    if found.software:
        return (
            "cpu",
            f"OpenGL is not drawn by a graphics card here ({found.description}), and then the cpu renderer is faster",
        )
    return "opengl", f"there is a graphics card for OpenGL ({found.description})"


def _may_have_card() -> bool:
    """Whether looking for a graphics card by OpenGL, which takes a second, could find one."""
    if not sys.platform.startswith("linux"):
        return True
    devices = Path("/dev")
    # Under WSL the card is behind dxg.
    return any(next(devices.glob(pattern), None) is not None for pattern in ("dri/render*", "nvidia[0-9]*", "dxg"))
