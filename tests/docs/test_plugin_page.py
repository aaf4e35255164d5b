"""What the page on the plug-in prints runs as it is printed, on a small town of one short trip."""

import re
import shlex
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import sumo

CHECKOUT = Path(__file__).resolve().parents[2]
PAGE = (CHECKOUT / "docs" / "plugin.md").read_text(encoding="utf-8")
PYTHON = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
COMMANDS = re.findall(r"^    ((?:fogsim|sumo|sumo-gui|xvfb-run) .*)$", PAGE, re.MULTILINE)
CAMERA = ("--set", "camera.width=64", "--set", "camera.height=48")

TRIPS = """<routes>
    <trip id="veh17" depart="0" departPos="50" from="B0A0" to="B0A0"/>
    <trip id="veh18" depart="1" departPos="20" from="B0A0" to="B0A0" departSpeed="8"/>
</routes>
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of the user's, with my/town.sumocfg."""
    shutil.copytree(CHECKOUT / "tests" / "data" / "grid", tmp_path / "my")
    (tmp_path / "my" / "grid.sumocfg").rename(tmp_path / "my" / "town.sumocfg")
    (tmp_path / "my" / "grid.trips.xml").write_text(TRIPS, encoding="utf-8")
    return tmp_path


def python(folder: Path, code: str, *arguments: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=200, check=False)


@pytest.fixture
def listening(folder: Path, free_port: Callable[[], int]) -> Iterator[int]:
    """Port of the SUMO that the page lets the user start."""
    (line,) = (c for c in COMMANDS if c.startswith("sumo -c"))
    port = free_port()
    arguments = shlex.split(line.replace("8813", str(port)))[1:]
    program = Path(sumo.SUMO_HOME, "bin", "sumo")
    with subprocess.Popen([program, *arguments], cwd=folder, stdout=subprocess.DEVNULL) as process:
        try:
            yield port
        finally:
            process.kill()


@pytest.mark.parametrize("line", [c for c in COMMANDS if c.startswith("fogsim ")])
def test_command_lines(folder: Path, line: str) -> None:
    arguments = shlex.split(line)[1:]
    code = "import sys; from fogsim.cli import main; sys.exit(main())"
    # A small camera, put first so that what the page sets overrides it.
    done = python(folder, code, arguments[0], *CAMERA, "--no-video", *arguments[1:])
    assert done.returncode == 0, done.stderr
    assert "arrived" in done.stderr + done.stdout
    assert list((folder / "runs").glob("town*/steps.parquet"))


def test_a_simulation_that_the_user_has_started(folder: Path, listening: int) -> None:
    (block,) = (b for b in PYTHON if "fogsim.connect" in b)
    done = python(folder, block.replace("8813", str(listening)))
    assert done.returncode == 0, done.stderr
    time_of_last, visibility, _ = map(float, done.stdout.splitlines()[-1].split())
    assert time_of_last > 1.0
    assert visibility == pytest.approx(120.0, rel=0.3)


def test_a_loop_of_the_users(folder: Path) -> None:
    (block,) = (b for b in PYTHON if "fogsim.attach" in b)
    done = python(folder, block)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.splitlines()[-1].split()[0]) > 4.0


MISTAKES = [
    ('"veh18"', '"veh81"', r"SimulationError: the ego 'veh81' did not appear within .*: veh18, veh17"),
    ("town.sumocfg", "toun.sumocfg", r"InputError: my/toun.sumocfg: .*no file 'toun.sumocfg' .*mean 'town.sumocfg'"),
]


@pytest.mark.parametrize(("right", "wrong", "told"), MISTAKES)
def test_mistakes_are_told_in_one_line(folder: Path, listening: int, right: str, wrong: str, told: str) -> None:
    (block,) = (b for b in PYTHON if "fogsim.connect" in b)
    done = python(folder, block.replace("8813", str(listening)).replace(right, wrong))
    assert done.returncode == 1
    assert re.search(told, done.stderr.splitlines()[-1])


def test_a_port_that_nobody_listens_on_is_told_in_one_line(folder: Path, free_port: Callable[[], int]) -> None:
    (block,) = (b for b in PYTHON if "fogsim.connect" in b)
    port = free_port()
    began = time.monotonic()
    done = python(folder, block.replace("8813", str(port)))
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port))
    assert done.returncode == 1
    assert f"SimulationError: no SUMO answers at localhost:{port}" in done.stderr.splitlines()[-1]
    assert time.monotonic() - began < 30.0
