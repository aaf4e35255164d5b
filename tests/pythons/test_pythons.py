"""The wheel, installed with all that it asks for into an empty environment of each Python here (``make pythons``).

It is built with kernels, so that runs compile none. Minutes for each: a gigabyte is downloaded, and all is compiled.
`WHEELS` names a folder in which the wheels stay (``make release``).
"""

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fogsim.core.compiling.shipped_code import usable_kind
from tests.helpers.command import OTHERS_PACKAGES, run_program

CHECKOUT = Path(__file__).resolve().parents[2]
VERSIONS = ("3.11", "3.12", "3.13")
SHORT = ("--seed", "1", "--set", "duration_s=3", "--set", "camera.width=160", "--set", "camera.height=120")
TRAINS = (
    "import gymnasium, fogsim_envs; e = gymnasium.make('fogsim/FogAdvisoryFast-v2'); "
    "e.reset(seed=1); e.step(e.action_space.sample()); e.close()"
)

DRIVES = """
from itertools import islice
import fogsim
from fogsim.scenario.loading import catalogue
for name in catalogue():
    for _ in islice(fogsim.run(fogsim.load_scenario(name, ["duration_s=3", "expect={}"]), seed=1), 10):
        pass
"""
"""The beginning of every scenario that comes with FogSim."""

pytestmark = pytest.mark.timeout(1800)

Run = Callable[..., None]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pythons")


@pytest.fixture(scope="module")
def run(folder: Path) -> Run:
    """Run a command away from the checkout, by a user who has nothing yet."""
    (folder / "home").mkdir()

    def call(*command: str | Path, **environment: str) -> None:
        setting = {"HOME": str(folder / "home"), **environment}
        run_program(*command, cwd=folder, environment=setting, without=OTHERS_PACKAGES)

    return call


def interpreter_of(version: str) -> Path | None:
    """Program of a version of Python that works: pyenv has names for those, too, that it does not let run."""
    for program in (shutil.which(f"python{version}"), *Path.home().glob(f".pyenv/versions/{version}.*/bin/python")):
        if program and subprocess.run([program, "-c", ""], capture_output=True, check=False).returncode == 0:
            return Path(program)
    return None


@pytest.mark.parametrize("version", VERSIONS)
def test_the_wheel_runs_in_an_empty_environment(version: str, folder: Path, run: Run) -> None:
    interpreter = interpreter_of(version)
    if interpreter is None:
        pytest.skip(f"no Python {version} here")
    place = folder / version
    run(interpreter, "-m", "venv", place)
    python, dist = place / "bin" / "python", Path(os.environ.get("WHEELS", folder / "dist"))
    pip = (python, "-m", "pip", "--quiet", "--disable-pip-version-check")
    run(*pip, "wheel", "--no-deps", "--wheel-dir", dist, CHECKOUT, HATCH_BUILD_HOOK_ENABLE_CUSTOM="true")
    run(*pip, "install", max(dist.glob("fogsim-*.whl"), key=lambda wheel: wheel.stat().st_mtime))
    run(place / "bin" / "fogsim", "run", "motorway_fog_bank", *SHORT, "--out", f"runs-{version}")
    run(python, "-W", "error", "-c", TRAINS)
    run(python, "-c", DRIVES)
    assert usable_kind() is None or not list(folder.rglob("__pycache__/*.nbc"))
    found = [path / "metrics.json" for path in sorted(folder.glob("runs-*"))]
    # Every version of Python makes the same numbers.
    assert len({path.read_bytes() for path in found}) == 1
    shutil.rmtree(place)
