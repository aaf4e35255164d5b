"""Which renderer is the best one here."""

import sys
from pathlib import Path

from fogsim.errors import MissingDependencyError
from fogsim.render.protocol import RenderError


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
