"""Which renderer is the best one here."""

from fogsim.errors import MissingDependencyError
from fogsim.render.protocol import RenderError

_BY_PROCESSOR = ("llvmpipe", "softpipe", "swr", "swrast", "software rasterizer", "osmesa")


def best_renderer() -> tuple[str, str]:
    """Choose the renderer that "auto" stands for.

    Returns
    -------
    tuple of str
        Its name in `RENDERERS`, and why.
    """
    from fogsim.render import gl_report  # noqa: PLC0415 - it is defined after this module has been imported

    try:
        report = gl_report()
    except MissingDependencyError as error:
        return "cpu", f"OpenGL does not work here: {error}"
    except RenderError as error:
        return "cpu", f"OpenGL cannot be used in this process: {error}"
    if any(name in report.lower() for name in _BY_PROCESSOR):
        return "cpu", f"OpenGL is not drawn by a graphics card here ({report}), and then the cpu renderer is faster"
    return "pyrender", f"there is a graphics card for OpenGL ({report})"
