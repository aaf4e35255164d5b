"""Compiling is announced, and what is compiled ahead is what a run needs."""

from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from fogsim import Camera, Frame, Observation
from fogsim.cli.compile import _foggy_road, compile_kernels
from fogsim.core import jit
from fogsim.errors import FogSimError
from fogsim.estimators import ESTIMATORS
from fogsim.study import pool
from tests.helpers.command import run_python

COMPILE = """
import numpy as np
import fogsim.core.jit
from fogsim.vision.light.medians import median_of_few
fogsim.core.jit._PATIENCE = 0.0
numbers = np.arange(5, dtype=np.float32)
for kind in (np.float32, np.float64, np.int64):
    median_of_few(numbers.astype(kind), np.empty(5, kind))
"""


@pytest.mark.nightly
def test_a_first_run_says_once_that_it_compiles(tmp_path: Path) -> None:
    """On stderr, since stdout is for results; a process that finds everything compiled says nothing."""
    told = []
    for _ in range(2):
        done = run_python("-c", COMPILE, environment={"NUMBA_CACHE_DIR": str(tmp_path)})
        assert done.stdout == ""
        told.append(done.stderr)
    assert told[0].count("compiling for this processor") == 1
    assert told[1] == ""


@pytest.mark.parametrize("method", ["negru2013", "joint_road"])
@pytest.mark.parametrize("size", [(160, 120), (640, 480)])
def test_methods_can_read_the_picture_that_they_are_compiled_with(method: str, size: tuple[int, int]) -> None:
    """A method that turned it down at once would not be compiled."""
    width, height = size
    camera = Camera(width, height, 0.9 * width, (width / 2, height / 2), 1.4, pitch=0.03)
    estimate = ESTIMATORS[method](camera=camera).update(Observation(Frame(0.0, _foggy_road(camera, 40.0), camera)))
    assert estimate.valid
    assert estimate.visibility == pytest.approx(120.0, rel=0.15)


def test_it_says_how_far_compiling_has_come() -> None:
    told: list[str] = []
    times = iter([0.0, 1.0, 1.0, 6.0, 6.0, 13.0, 13.0, 14.0])
    announcement = jit.Announcement(told.append, lambda: next(times))
    compiled = SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=jit.kernel)})
    announcement.on_start(None)
    announcement.on_end(compiled)
    assert not told
    for _ in range(3):
        announcement.on_start(None)
        announcement.on_end(compiled)
    assert len(told) == 2
    assert "compiling for this processor" in told[0]
    assert told[1] == "fogsim: compiled 3 functions in 13 s"


def test_a_compiling_process_that_dies_ends_it_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are a study's processes, which also end with this one."""

    def killed(*_: object) -> Future[None]:
        dead: Future[None] = Future()
        dead.set_exception(BrokenProcessPool("killed"))
        return dead

    monkeypatch.setattr(pool, "worker_pool", lambda *_: nullcontext(SimpleNamespace(submit=killed)))
    with pytest.raises(FogSimError, match="a process that compiles died"):
        list(compile_kernels())
