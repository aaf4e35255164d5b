"""Geometry to linear radiance, distance along the ray and instance ids."""

from collections.abc import Callable

from fogsim.core.registry import Registry
from fogsim.errors import InputError
from fogsim.render.protocol import FARTHEST, Renderer, RenderError, best_renderer
from fogsim.render.pyrender_scene import to_pyrender
from fogsim.values.scene import Scene

__all__ = [
    "FARTHEST",
    "LIMITED",
    "RENDERERS",
    "ROLES",
    "RenderError",
    "Renderer",
    "best_renderer",
    "gl_report",
    "make_renderer",
    "to_pyrender",
]


def _opengl(scene: Scene, illuminance: float) -> Renderer:
    # OpenGL is loaded by the process that draws, when it first draws: not by every one that imports FogSim.
    from fogsim.render.opengl.rasteriser import GLRasteriser  # noqa: PLC0415
    from fogsim.render.renderer import SceneRenderer  # noqa: PLC0415

    return SceneRenderer(scene, illuminance, GLRasteriser)


def _cpu(scene: Scene, illuminance: float) -> Renderer:
    # So is numba.
    from fogsim.render.cpu.rasteriser import CPURasteriser  # noqa: PLC0415
    from fogsim.render.renderer import SceneRenderer  # noqa: PLC0415

    return SceneRenderer(scene, illuminance, CPURasteriser)


def _pyrender(scene: Scene, illuminance: float) -> Renderer:
    # So is pyrender.
    from fogsim.render.pyrender_reference import PyrenderReference  # noqa: PLC0415

    return PyrenderReference(scene, illuminance)


RENDERERS: Registry[Callable[[Scene, float], Renderer]] = Registry(
    "renderer", {"opengl": _opengl, "cpu": _cpu, "pyrender": _pyrender}
)
"""Factories of renderers by name, each called with the scene and the horizontal illuminance [lx]."""


ROLES = ("auto", "reference")
"""Names that stand for a renderer: for the best one here, and for the independent reference, which is pyrender."""


LIMITED = ("auto", "cpu", "opengl")
"""Names of those that draw nothing of what stands still beyond a depth of `FARTHEST`."""


def make_renderer(name: str, scene: Scene, illuminance: float) -> Renderer:
    """Make a renderer (`illuminance` [lx])."""
    if not 0.0 <= illuminance < float("inf"):
        raise InputError(f"illuminance must be a finite number of lux ≥ 0, got {illuminance!r}")
    if name in ROLES:
        name = best_renderer()[0] if name == "auto" else "pyrender"
    return RENDERERS[name](scene, illuminance)


def gl_report() -> str:
    """Say which OpenGL draws here."""
    from fogsim.render.opengl.context import context  # noqa: PLC0415 - OpenGL is loaded only where it is used

    return context().description
