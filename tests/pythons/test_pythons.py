"""The wheel, installed with all that it asks for into an empty environment of each Python here (``make pythons``).

Minutes for each: it downloads more than a gigabyte and compiles every kernel of a run.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
VERSIONS = ("3.11", "3.12", "3.13")
SHORT = ("--seed", "1", "--set", "duration_s=3", "--set", "camera.width=160", "--set", "camera.height=120")
TRAINS = (
    "import gymnasium, fogsim_envs; e = gymnasium.make('fogsim/FogAdvisoryFast-v1'); "
    "e.reset(seed=1); e.step(e.action_space.sample()); e.close()"
)

pytestmark = pytest.mark.timeout(1800)

Run = Callable[..., str]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pythons")


@pytest.fixture(scope="module")
def run(folder: Path) -> Run:
    """Run a command away from the checkout, by a user who has nothing yet."""
    (folder / "home").mkdir()
    kept = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}

    def call(*command: str | Path) -> str:
        done = subprocess.run(
            list(map(str, command)),
            cwd=folder,
            env={**kept, "HOME": str(folder / "home")},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    return call


@pytest.fixture(scope="module")
def wheel(folder: Path, run: Run) -> Path:
    run(sys.executable, "-m", "build", "--no-isolation", "--wheel", "--outdir", folder, CHECKOUT)
    (built,) = folder.glob("fogsim-*.whl")
    return built


def interpreter(version: str) -> Path | None:
    """Program of a version of Python that works: pyenv has names for those, too, that it does not let run."""
    for program in (shutil.which(f"python{version}"), *Path.home().glob(f".pyenv/versions/{version}.*/bin/python")):
        if program and subprocess.run([program, "-c", ""], capture_output=True, check=False).returncode == 0:
            return Path(program)
    return None


@pytest.mark.parametrize("version", VERSIONS)
def test_the_wheel_runs_in_an_empty_environment(version: str, folder: Path, wheel: Path, run: Run) -> None:
    python = interpreter(version)
    if python is None:
        pytest.skip(f"no Python {version} here")
    place = folder / version
    run(python, "-m", "venv", place)
    run(place / "bin" / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel)
    run(place / "bin" / "fogsim", "run", "motorway_fog_bank", *SHORT, "--out", f"runs-{version}")
    run(place / "bin" / "python", "-W", "error", "-c", TRAINS)
    found = [path / "metrics.json" for path in sorted(folder.glob("runs-*"))]
    # Every version of Python makes the same numbers.
    assert len({path.read_bytes() for path in found}) == 1
    shutil.rmtree(place)
