"""The independent reference: pyrender's own off-screen renderer draws, all shapes in full detail and none left out."""

import os
import sys
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.render.opengl.context import context
from fogsim.render.protocol import RenderError
from fogsim.render.pyrender_scene import load_pyrender

if TYPE_CHECKING:
    import pyrender

from collections.abc import Sequence
from typing import Any

from fogsim.core.linear_algebra import matrix_product
from fogsim.render.opengl.context import Context
from fogsim.render.photometry import SKY_TINT, zenith_luminance
from fogsim.render.pyrender_scene import (
    GAMMA,
    Part,
    camera_matrix,
    copied_parts,
    empty_scene,
    pinhole,
    still_parts,
)
from fogsim.render.shading.pavement import reflectance_by_sine
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.fog import EVEN_LIGHT, SideLight
from fogsim.values.image import View
from fogsim.values.pinhole import ray_from_pixel
from fogsim.values.scene import Batch, Scene


class PyrenderReference:
    """Draws a scene by daylight with `pyrender.OffscreenRenderer` (see `Renderer`).

    Distance is pyrender's depth; instance ids are its segmentation; radiance is its colours, 8 bits of them, taken back
    to linear. FogSim's own is the radiance of the sky and of lit lamps, which are brighter than pyrender's white.

    Takes `illuminance` [lx].
    """

    def __init__(self, scene: Scene, illuminance: float) -> None:
        self._context = context()
        self._pyrender = load_pyrender()
        self._scene: Scene | None = scene
        self._pavement = scene.pavement
        self.set_daylight(illuminance)
        self._nodes = empty_scene(self._pyrender, illuminance, self._white)
        self._still = list(still_parts(self._pyrender, scene, self._white))
        for part in self._still:
            self._nodes.add_node(part.node)
        self._drawer: Any = None

    def set_daylight(self, illuminance: float, sides: SideLight = EVEN_LIGHT) -> None:  # noqa: ARG002 - see below
        """Draw by another daylight from now on; what pyrender draws is a share of it (`illuminance` [lx])."""
        self._white = max(illuminance / np.pi, 1e-6)
        self._zenith = zenith_luminance(illuminance) * np.array(SKY_TINT)

    def render(self, vehicles: Sequence[Batch], camera: Camera, pose: CameraPose, lamplight: bool = False) -> View:
        """Draw the scene and the vehicles (see `Renderer.render`)."""
        if self._scene is None:
            raise RenderError("this renderer is closed; make a new one")
        if lamplight:
            raise InputError(
                "the renderer pyrender draws by daylight only (1000 lx or more); at night use opengl or cpu"
            )
        self._context.activate()
        moving = list(copied_parts(self._pyrender, self._scene, vehicles, self._white, "vehicle"))
        for part in moving:
            self._nodes.add_node(part.node)
        eye = self._nodes.add(pinhole(self._pyrender, camera), pose=camera_matrix(camera, pose))
        self._nodes.main_camera_node = eye
        try:
            return self._view([*self._still, *moving], camera, pose)
        finally:
            for node in (eye, *(part.node for part in moving)):
                self._nodes.remove_node(node)

    def _view(self, parts: list[Part], camera: Camera, pose: CameraPose) -> View:
        """What pyrender draws of these parts."""
        flags, drawer = self._pyrender.RenderFlags, self._drawer_of(camera)
        numbers = np.arange(1, len(parts) + 1)
        codes = (numbers[:, None] >> np.array((16, 8, 0))) & 255
        nodes = [part.node for part in parts]
        try:
            colour, _ = drawer.render(self._nodes, flags.NONE)
            code, depth = drawer.render(self._nodes, flags.SEG, dict(zip(nodes, codes, strict=True)))
        finally:
            self._context.restore()
        seen = matrix_product(code.astype(np.int64), np.array((1 << 16, 1 << 8, 1)))
        rays = _rays(camera, pose)
        length = np.linalg.norm(rays, axis=-1)
        sky = seen == 0
        radiance = self._white * (colour / 255.0) ** GAMMA
        sine = np.maximum(rays[sky, 2] / length[sky], 0.0)
        radiance[sky] = self._zenith * ((1.0 + 2.0 * sine) / 3.0)[:, None]
        for number, part in enumerate(parts, 1):
            if part.radiance is not None:
                radiance[seen == number] = part.radiance
            if part.is_asphalt:
                # As of level road, whose part of the picture grades hardly change.
                road = seen == number
                radiance[road] *= self._by_angle(np.maximum(-rays[road, 2] / length[road], 0.0))[:, None]
        instance = np.array([0, *(part.instance for part in parts)], np.int32)
        distance = np.where(sky, np.inf, depth * length)
        return View(radiance.astype(np.float32), distance.astype(np.float32), instance[seen])

    def _by_angle(self, sine: NDArray[np.float64]) -> NDArray[np.float64]:
        """Reflectance of the road over that of dry asphalt seen from above, by the sine of the eye's elevation."""
        table = reflectance_by_sine(self._pavement.surface)
        return np.interp(np.sqrt(sine), np.linspace(0.0, 1.0, len(table)), table)

    def _drawer_of(self, camera: Camera) -> Any:
        """Pyrender's renderer, made again if the camera's size is another than the last one's."""
        if self._drawer is None:
            self._drawer = _offscreen_renderer(self._pyrender, self._context, camera.width, camera.height)
        self._drawer.viewport_width, self._drawer.viewport_height = camera.width, camera.height
        return self._drawer

    def close(self) -> None:
        """Free what pyrender holds; the context stays, since others share it."""
        drawer, self._drawer, self._scene = self._drawer, None, None
        if drawer is not None and self._context.is_of_this_process:
            drawer.delete()


def _offscreen_renderer(library: Any, shared: Context, width: int, height: int) -> Any:
    """Make pyrender's renderer in this process's context: the end of one of its own would end all others.

    Takes `width`, `height` [px].
    """

    class Renderer(library.OffscreenRenderer):  # type: ignore[misc]  # pyrender has no types
        def _create(self) -> None:
            self._platform = _SharedPlatform(shared, width, height)
            self._platform.make_current()
            self._renderer = library.renderer.Renderer(width, height)

        def delete(self) -> None:
            if self._renderer is not None:
                self._platform.make_current()
                self._renderer.delete()
                self._renderer = None

    return Renderer(width, height)


class _SharedPlatform:
    """What pyrender asks of a platform."""

    def __init__(self, shared: Context, width: int, height: int) -> None:
        self._context = shared
        self.viewport_width, self.viewport_height = width, height

    def make_current(self) -> None:
        self._context.activate()

    def make_uncurrent(self) -> None:
        pass

    def supports_framebuffers(self) -> bool:
        return True


def _rays(camera: Camera, pose: CameraPose) -> NDArray[np.float64]:
    """Viewing rays (rows, cols, 3) in the world, 1 long along the optical axis."""
    v, u = np.mgrid[: camera.height, : camera.width]
    pixels = np.stack((u, v, np.ones_like(u)), axis=-1).astype(np.float64)
    return matrix_product(pixels, ray_from_pixel(camera, pose).T)


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
    drawer = _offscreen_renderer(load_pyrender(), shared, *size)
    try:
        colour, _ = drawer.render(scene)
    finally:
        drawer.delete()
        shared.restore()
    return np.ascontiguousarray(colour, np.uint8)
