"""FogSim's scenes in pyrender's viewer, or as the picture that it would show first."""

import os
import sys
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.render.opengl.context import context
from fogsim.render.protocol import RenderError
from fogsim.render.pyrender_reference import offscreen_renderer
from fogsim.render.pyrender_scene import load_pyrender

if TYPE_CHECKING:
    import pyrender

_AHEAD = 20.0  # how far before the camera lies what the viewer turns about [m]


def require_display() -> None:
    """Make sure that there is a display to open a window on."""
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise InputError(
            "there is no display here to open a window on (DISPLAY is not set): --out FILE.png writes what the window "
            "would show, and `ssh -X` or `xvfb-run` give a display"
        )


def open_viewer(scene: "pyrender.Scene", size: tuple[int, int], title: str) -> None:
    """Open a scene in pyrender's viewer; comes back when the window is closed (`size` [px])."""
    require_display()
    eye = scene.get_pose(scene.main_camera_node)
    try:
        load_pyrender().Viewer(
            scene,
            viewport_size=size,
            view_center=eye[:3, 3] - _AHEAD * eye[:3, 2],
            window_title=title,
            cull_faces=False,
        )
    except Exception as error:  # pyglet and PyOpenGL raise their own
        display = os.environ.get("DISPLAY", "this one")
        text = " ".join(str(error).split())[:200]
        raise RenderError(
            f"pyrender's viewer does not open on the display {display} ({type(error).__name__}: {text}); --out "
            "FILE.png writes what it would show"
        ) from error


def first_picture(scene: "pyrender.Scene", size: tuple[int, int]) -> NDArray[np.uint8]:
    """Draw what the viewer shows first, without a display.

    Returns colours, encoded with 1/2.2 (rows, cols, 3) uint8. Takes `size` [px].
    """
    shared = context()
    drawer = offscreen_renderer(load_pyrender(), shared, *size)
    try:
        colour, _ = drawer.render(scene)
    finally:
        drawer.delete()
        shared.restore()
    return np.ascontiguousarray(colour, np.uint8)
