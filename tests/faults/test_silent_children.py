"""Processes that run environments, and stand still or are gone."""

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from fogsim.errors import SimulationError
from fogsim.scenario import scenario_from_config
from fogsim.values import Command
from fogsim_envs import host
from fogsim_envs.hosting import HostedLoop
from fogsim_envs.vector import make_vector

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no signal there stops a process and lets it go on")

TOWN = Path(__file__).resolve().parents[1] / "data" / "grid" / "grid.sumocfg"
BLIND = scenario_from_config(TOWN, "veh0", ["fog.visibility_m=inf", "renderer=none", "estimators=[]"])


@pytest.fixture(scope="module")
def hosted() -> Iterator[HostedLoop]:
    """A child that may be silent for 1 s, since none is waited for that works."""
    loop = HostedLoop(BLIND)
    loop.start(1)
    loop._timeout = 1.0
    yield loop
    loop.close()


def test_a_child_that_is_stopped_is_told_and_ended_and_the_next_run_has_another(hosted: HostedLoop) -> None:
    child = hosted._child
    os.kill(child.pid, signal.SIGSTOP)
    with pytest.raises(SimulationError, match="no sign of life for 1 s, and was ended: it was stopped"):
        hosted.advance(Command())
    assert child.returncode == -signal.SIGKILL
    with pytest.raises(SimulationError, match="has ended"):
        hosted.advance(Command())
    hosted._timeout = None
    assert hosted.start(2).index == 0
    assert hosted._child is not child


def test_a_child_that_is_killed_is_told(hosted: HostedLoop) -> None:
    hosted._child.kill()
    with pytest.raises(SimulationError, match="the child process that ran the simulation has ended"):
        hosted.advance(Command())


def test_a_child_that_begins_has_longer_for_its_imports() -> None:
    HostedLoop(BLIND, timeout=0.01).close()


def test_neither_the_working_directory_nor_forks_touch_a_child(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "contextlib.py").write_text("raise ImportError('of the working directory')")
    monkeypatch.chdir(tmp_path)
    loop = HostedLoop(BLIND)
    inherited = os.dup(loop._connection.fileno())
    loop.close()
    os.close(inherited)
    assert loop._child.returncode == 0


def test_a_fork_neither_asks_nor_ends_a_child_of_its_parent() -> None:
    loop = HostedLoop(BLIND)
    loop.start(1)
    fork = os.fork()
    if not fork:
        code = 1
        try:
            with pytest.raises(SimulationError, match=f"belongs to the process {os.getppid()}"):
                loop.advance(Command())
            loop.close()
            loop.start(1)
            loop.advance(Command())
            loop.close()
            code = 0
        finally:
            os._exit(code)
    assert os.waitpid(fork, 0)[1] == 0
    assert loop.advance(Command()).index == 1
    loop.close()


class _Pipe:
    """Asks for one thing, and keeps what is said."""

    def __init__(self) -> None:
        self.said: list[tuple[str, Any]] = []
        self._requests = iter([("open", None)])

    def recv(self) -> tuple[str, Any]:
        try:
            return next(self._requests)
        except StopIteration:
            raise EOFError from None

    def send(self, message: tuple[str, Any]) -> None:
        self.said.append(message)


def test_a_child_that_works_gives_signs_of_life(monkeypatch: pytest.MonkeyPatch) -> None:
    pipe = _Pipe()

    class Busy:
        def __init__(self, _: None) -> None:
            while len(pipe.said) < 3:
                time.sleep(0.001)

        def close(self) -> None:
            pipe.said.append(("closed", None))

    monkeypatch.setattr(host, "HEARTBEAT_PERIOD", 0.01)
    monkeypatch.setattr(host, "simulation_of", Busy)
    host.serve(pipe)  # type: ignore[arg-type]  # of a connection, only these two methods are used
    assert pipe.said[:3] == [("working", None)] * 3
    assert pipe.said[-2:] == [("done", None), ("closed", None)]


@pytest.mark.parametrize(("fault", "message"), [("SIGSTOP", "have not answered for 1 s"), ("SIGKILL", "has ended")])
def test_a_worker_of_a_vector_environment_that_is_lost_is_told(fault: str, message: str) -> None:
    envs: Any = make_vector("fogsim/FogAdvisoryFast-v1", num_envs=2, overrides=["duration_s=5"])
    worker, other = envs.processes
    envs._timeout = 1.0
    os.kill(worker.pid, getattr(signal, fault))
    if fault == "SIGKILL":
        worker.join()
    with pytest.raises(SimulationError, match=message):
        envs.reset(seed=1)
    assert not worker.is_alive()
    assert not other.is_alive()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        envs.step(np.array([[0, 0], [0, 0]]))
    envs.close()
