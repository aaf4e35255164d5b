"""A SUMO that stands still, in another process."""

import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import fogsim
from fogsim.errors import InputError, SimulationError
from fogsim.scenario import Scenario, scenario_from_config

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no signal there stops a process and lets it go on")

GRID = Path(__file__).resolve().parents[1] / "data" / "grid" / "grid.sumocfg"
ARGUMENTS = ["-c", str(GRID), "--step-length", "0.1", "--no-step-log"]
HOST = "127.0.0.1"


def town(ego: str = "veh0") -> Scenario:
    return scenario_from_config(GRID, ego, ["fog.visibility_m=120", "camera.width=32", "camera.height=24"])


def test_a_sumo_that_is_stopped_on_the_way_is_told_and_left(sumo_process: Callable) -> None:
    with sumo_process(ARGUMENTS) as (port, process):
        steps = fogsim.run(town(), traffic=fogsim.connect(town(), HOST, port, timeout=2.0))
        next(steps)
        os.kill(process.pid, signal.SIGSTOP)
        begun = time.monotonic()
        with pytest.raises(SimulationError, match=rf"SUMO at {HOST}:{port} has not answered for 2 s: it is stopped"):
            next(steps)
        # The farewell to it does not wait again, nor for ever.
        assert time.monotonic() - begun < 30.0


def test_a_sumo_that_waits_for_another_client_is_told(sumo_process: Callable) -> None:
    with sumo_process(ARGUMENTS, clients=2) as (port, _):
        traffic = fogsim.connect(town(), HOST, port, order=1, timeout=0.3)
        with pytest.raises(SimulationError, match=r"has not answered for 0\.3 s.*or another client"):
            traffic.start(1)
        traffic.close()


def test_a_limit_that_is_none_and_those_that_are_no_time(sumo_process: Callable) -> None:
    with sumo_process(ARGUMENTS) as (port, _):
        traffic = fogsim.connect(town(), HOST, port, timeout=float("inf"))
        traffic.start(1)
        assert traffic.observe() is not None
        traffic.close()
    for timeout in [0.0, -1.0, float("nan")]:
        with pytest.raises(InputError, match=r"timeout.*(more than|≥) 0 s|timeout must be a number"):
            fogsim.connect(town(), timeout=timeout)
