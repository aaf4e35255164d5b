"""A wheel with kernels compiles none; ``make pythons`` builds one with all kernels, in a minute, and runs it."""

import functools
import platform
import shutil
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from fogsim.core.compiling.shipped_code import usable_kind
from tests.helpers.command import OTHERS_PACKAGES, run_program

CHECKOUT = Path(__file__).resolve().parents[2]
call = functools.partial(run_program, without=OTHERS_PACKAGES, timeout=600.0)


CONVOLVES = """
import numpy as np
from fogsim.core.linear_algebra import convolution
print(convolution(np.ones(2), np.ones(2)), sum(convolution.stats.cache_hits.values()))
"""

COMPILES_ONE = """

def compile_kernels() -> Iterator[str]:
    from fogsim.core.linear_algebra import convolution
    import numpy as np

    convolution(np.ones(3), np.ones(2))
    yield "one"
"""


def built_wheel(project: Path, folder: Path, **environment: str) -> Path:
    command = (sys.executable, "-m", "build", "--no-isolation", "--wheel", "--outdir", folder, project)
    call(*command, cwd=folder, environment=environment)
    (wheel,) = folder.glob("fogsim-*.whl")
    return wheel


def installed_wheel(wheel: Path, place: Path) -> tuple[Path, Path]:
    """Python of a new environment with the wheel in it, and the folder of its packages."""
    venv.create(place)
    python = place / "bin" / "python"
    (packages,) = place.glob("lib/python*/site-packages")
    # The wheel's dependencies are those that are here (test_dependencies.py has that none is missing); an editable
    # installation's own path is not taken along, for paths are read from the environment's own folder alone.
    (packages / "dependencies.pth").write_text(f"{sysconfig.get_path('purelib')}\n", encoding="utf-8")
    install = ("-m", "pip", "--python", python, "install", "--no-deps", "--no-compile", "--quiet")
    call(sys.executable, *install, "--disable-pip-version-check", "--force-reinstall", wheel, cwd=place)
    return python, packages


@pytest.mark.nightly
@pytest.mark.timeout(900)
@pytest.mark.skipif(usable_kind() is None, reason="no kernels are shipped for this processor")
def test_a_wheel_with_kernels_needs_not_compile_them(tmp_path: Path) -> None:
    project = tmp_path / "project"
    names = ("fogsim", "envs", "scenarios", "pyproject.toml", "README.md", "LICENSE", "THIRD_PARTY_NOTICES.md")
    for name in (*names, "tools/ship_kernels.py"):
        (project / name).parent.mkdir(parents=True, exist_ok=True)
        copy = shutil.copytree if (CHECKOUT / name).is_dir() else shutil.copy2
        copy(CHECKOUT / name, project / name)
    with (project / "fogsim" / "cli" / "compile.py").open("a", encoding="utf-8") as file:
        file.write(COMPILES_ONE)
    wheel = built_wheel(project, tmp_path, HATCH_BUILD_HOOK_ENABLE_CUSTOM="true")
    version = f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert wheel.name.endswith(f"-{version}-{version}-manylinux_2_17_{platform.machine()}.whl")
    python, packages = installed_wheel(wheel, tmp_path / "venv")
    kernels = [path.name for path in (packages / "fogsim" / "_kernels").rglob("*.nbc")]
    assert [name.split("-")[0] for name in kernels] == ["linear_algebra.convolution"]
    said = call(python, "-c", CONVOLVES, cwd=tmp_path, environment={"NUMBA_CACHE_DIR": str(tmp_path / "cache")}).stdout
    assert said.split() == ["[1.", "2.", "1.]", "1"]
    assert not list((tmp_path / "cache").rglob("*.nbc"))
