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
        """Draw by another daylight from now on.

        Parameters
        ----------
        illuminance : float
            Horizontal illuminance of the sky [lx], not negative.
        sides : SideLight
            What of it reaches surfaces that are not level.
        """
        ...

    def render(self, vehicles: Sequence[Batch], camera: Camera, pose: CameraPose, lamplight: bool = False) -> View:
        """Draw the scene and the vehicles as they are now.

        Parameters
        ----------
        vehicles : sequence of Batch
            What moves.
        camera : Camera
            The pinhole.
        pose : CameraPose
            Where it is.
        lamplight : bool
            Whether `View.lamp_response` is wanted.

        Returns
        -------
        View
            Arrays of its own that later frames do not touch.

        Raises
        ------
        RenderError
            If the renderer is closed or belongs to another process.
        """
        ...

    def close(self) -> None:
        """Give back what the renderer holds; a second call does nothing."""
        ...
