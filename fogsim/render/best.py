"""Which renderer is the best one here."""

from fogsim.errors import MissingDependencyError
from fogsim.render.protocol import RenderError


def best_renderer() -> tuple[str, str]:
    """Choose the renderer that "auto" stands for.

    Returns
    -------
    tuple of str
        Its name in `RENDERERS`, and why.
    """
    from fogsim.render.gl.context import context  # noqa: PLC0415 - OpenGL is loaded only where it is asked for

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
    return "pyrender", f"there is a graphics card for OpenGL ({found.description})"
