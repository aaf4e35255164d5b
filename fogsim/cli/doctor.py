"""``fogsim doctor``: check what works on this machine, and how to install what is missing."""

import platform
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Annotated

import typer

from fogsim.cli.compile import compile_command
from fogsim.cli.printing import escape, stdout
from fogsim.errors import FogSimError

_PACKAGES = (
    "fogsim",
    "libsumo",
    "pyrender",
    "PyOpenGL",
    "numpy",
    "numba",
    "opencv-python-headless",
    "gymnasium",
    "highway-env",
    "pyarrow",
    "imageio-ffmpeg",
)


@dataclass(frozen=True, slots=True)
class _Finding:
    """Result of one check; `detail` is the version, or the problem and its fix."""

    subject: str
    works: bool
    detail: str


def doctor_command(
    ahead: Annotated[
        bool, typer.Option("--compile", help="Also compile the kernels of a first run, like `fogsim compile`.")
    ] = False,
) -> None:
    """List what works on this machine, what is missing, and how to install it."""
    findings = examine()
    width = max(len(finding.subject) for finding in findings)
    for finding in findings:
        mark = "[green]fine   [/]" if finding.works else "[red]missing[/]"
        stdout.print(f"{mark} {finding.subject:<{width}} {escape(finding.detail)}", soft_wrap=True)
    if not all(finding.works for finding in findings):
        raise typer.Exit(1)
    if ahead:
        compile_command()


def examine() -> list[_Finding]:
    """Check Python, packages, SUMO, the renderers and the video encoder."""
    findings = [_Finding("Python", True, f"{platform.python_version()} on {platform.platform()}")]
    findings += [_package(name) for name in _PACKAGES]
    findings += [_try("SUMO", _sumo), _try("renderer opengl", _gl), _try("renderer cpu", _cpu)]
    findings += [_try("renderer auto", _auto), _try("video encoder", _ffmpeg)]
    return findings


def _package(name: str) -> _Finding:
    try:
        return _Finding(name, True, version(name))
    except PackageNotFoundError:
        return _Finding(name, False, f"not installed: pip install {name}")


def _try(subject: str, check: Callable[[], str]) -> _Finding:
    try:
        return _Finding(subject, True, check())
    except (FogSimError, ImportError, OSError) as error:  # a library may be missing or incomplete
        return _Finding(subject, False, str(error))


def _sumo() -> str:
    from fogsim.traffic.sumo.libsumo_link import load_libsumo

    return f"{load_libsumo().getVersion()[1]} in process"


def _gl() -> str:
    from fogsim.render import gl_report

    return gl_report()


def _cpu() -> str:
    return f"numba {version('numba')}; needs no OpenGL"


def _auto() -> str:
    from fogsim.render import best_renderer

    name, reason = best_renderer()
    return f"draws with {name}: {reason}"


def _ffmpeg() -> str:
    from fogsim.recorders import encoder_report

    return encoder_report()
