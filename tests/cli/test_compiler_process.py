"""A first run compiles in two processes, and nothing but its time differs by that."""

import time
from pathlib import Path

import pytest

from fogsim.core.jit import CompilerProcess, processors
from tests.helpers.command import run_python

START = """
import os, subprocess, sys
import fogsim
from fogsim.cli import compiler_process

started = []
class Told(subprocess.Popen):
    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        started.append(self)
compiler_process.subprocess.Popen = Told
settings = ["estimators=[huang2015_lead]", "camera.width=160", "camera.height=120"]
scenario = fogsim.load_scenario("motorway_fog_bank", settings)
"""

READ = """
with compiler_process.compiling_in_background() as compile_for:
    compile_for(scenario)
    from fogsim.cli.compile import fuse_estimates, read_foggy_road
    from fogsim.fusion.grid_filter import _folded
    from fogsim.vision.light.pixel_kernels import colour_luminance
    said = read_foggy_road("huang2015_lead", {}, (160, 120))
    fuse_estimates(scenario.fusion.method, scenario.fusion.parameters, [said])
    for stats in (colour_luminance.stats, _folded.stats):
        print(len(started), sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
print(len(started), all(one.poll() is not None for one in started))
"""

FAIL = """
try:
    with compiler_process.compiling_in_background() as compile_for:
        compile_for(scenario)
        raise KeyboardInterrupt
except KeyboardInterrupt:
    print(len(started), started[-1].poll() is not None)
"""

UNTOLD = """
try:
    with compiler_process.compiling_in_background():
        raise ValueError("a mistake in the scenario")
except ValueError:
    print(len(started), started[-1].poll() is not None)
"""

NO_METHODS = """
with compiler_process.compiling_in_background() as compile_for:
    compile_for(fogsim.load_scenario("motorway_fog_bank", ["renderer=none", "estimators=[]"]))
    print(len(started), started[-1].poll() is not None)
"""

DEAD = """
with compiler_process.compiling_in_background() as compile_for:
    started[0].kill()
    started[0].wait()
    compile_for(scenario)
    from fogsim.cli.compile import read_foggy_road
    print(len(read_foggy_road("huang2015_lead", {}, (160, 120))))
"""

NO_ROOM = """
def refuse(*_, **__):
    raise BlockingIOError(11, "Resource temporarily unavailable")
compiler_process.subprocess.Popen = refuse
with compiler_process.compiling_in_background() as compile_for:
    compile_for(scenario)
    print("alone")
"""

DIE = """
compiler_process.compiling_in_background().__enter__()(scenario)
print(started[0].pid, flush=True)
os._exit(1)
"""

pytestmark = pytest.mark.skipif(processors() < 2, reason="one processor compiles by itself")


def run(code: str, kept: Path) -> list[str]:
    done = run_python("-c", START + code, environment={"NUMBA_CACHE_DIR": str(kept)}, check=False)
    assert "Traceback" not in done.stderr, done.stderr
    return done.stdout.split()


@pytest.mark.nightly
def test_what_the_other_process_compiles_is_loaded_and_a_second_run_needs_none(tmp_path: Path) -> None:
    assert run(READ, tmp_path) == ["1", "1", "0", "1", "1", "0", "1", "True"]
    assert run(READ, tmp_path) == ["0", "1", "0", "0", "1", "0", "0", "True"]


def test_the_other_process_ends_where_nothing_is_to_compile_and_with_an_interrupted_run(tmp_path: Path) -> None:
    """Where no process can be started, a run compiles alone."""
    said = run(UNTOLD + NO_METHODS + FAIL + NO_ROOM, tmp_path)
    assert said == ["1", "True", "2", "True", "3", "True", "alone"]


@pytest.mark.nightly
def test_where_the_other_process_dies_a_run_compiles_alone(tmp_path: Path) -> None:
    assert run(DEAD, tmp_path) == ["4"]


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks a process up in /proc")
def test_a_killed_run_leaves_no_process(tmp_path: Path) -> None:
    (number,) = run(DIE, tmp_path)
    command = Path("/proc", number, "cmdline")
    until = time.monotonic() + 60.0
    while command.exists() and b"read_pictures" in command.read_bytes():
        assert time.monotonic() < until
        time.sleep(0.2)


def test_one_looks_again_while_the_other_process_runs_and_once_when_it_has_ended() -> None:
    over = iter((False, False, True))
    beside = CompilerProcess()
    assert not beside.may_bring("fogsim.vision.light")
    with beside.compiles(lambda: next(over), ("fogsim.vision.",)):
        assert not beside.may_bring("fogsim.render.cpu")
        assert [beside.may_bring("fogsim.vision.light") for _ in range(5)] == [True, True, True, False, False]
    with beside.compiles(lambda: False, ("fogsim.vision.",)):
        assert beside.may_bring("fogsim.vision.light")
    assert not beside.may_bring("fogsim.vision.light")


def test_the_first_wait_begins_with_work_within_which_nothing_is_waited_for() -> None:
    module, waits, other = "fogsim.vision.light", list[bool](), CompilerProcess()
    with other.compiles(lambda: False, ("fogsim.vision.",), lambda: waits.append(other.may_bring(module))):
        assert all(other.may_bring(module) for _ in range(2))
    assert waits == [False]
