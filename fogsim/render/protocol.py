"""What every renderer does, whatever it draws with."""

from collections.abc import Sequence
from typing import Protocol

from fogsim.errors import FogSimError
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
