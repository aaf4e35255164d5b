"""sumo-gui, which the user has started, on a display that nobody looks at."""

import contextlib
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sumo
from early_motorway import EARLY

from fogsim.scenario import build, load_scenario
from fogsim.traffic import TraciLink, Traffic, traci_traffic
from fogsim.traffic.sumo_traffic import command_line
from fogsim.values import Command, SpeedAdvice, TrafficSnapshot
from tests.traffic.common import driven, running

SETUP = replace(build.traffic_setup(load_scenario("motorway_fog_bank", [EARLY])), reading_radius=500.0)
HOST = "127.0.0.1"
GUI = Path(sumo.SUMO_HOME, "bin", "sumo-gui")
REQUIRED = os.environ.get("CI") == "true"
"""Continuous integration must not pass without having run this."""


def missing() -> str:
    """What this machine lacks for these tests; nothing if it lacks nothing."""
    if not GUI.is_file():
        return f"sumo-gui is not at {GUI}: pip install eclipse-sumo"
    if shutil.which("Xvfb") is None:
        return "Xvfb, a display without a screen, is not on the PATH: apt-get install xvfb"
    return ""


pytestmark = pytest.mark.skipif(bool(missing()) and not REQUIRED, reason=missing())


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """Name of a display of this test's own, whose number Xvfb chooses."""
    assert not missing(), missing()
    receive, send = os.pipe()
    command = ["Xvfb", "-displayfd", str(send), "-screen", "0", "640x480x24", "-nolisten", "tcp"]
    with subprocess.Popen(command, pass_fds=(send,), stderr=subprocess.DEVNULL) as server:
        os.close(send)
        with os.fdopen(receive) as number:
            name = f":{number.readline().strip()}"
        try:
            yield name
        finally:
            server.terminate()


@pytest.fixture
def gui(display: str, free_port: Callable[[], int]) -> Iterator[tuple[int, "subprocess.Popen[bytes]"]]:
    """A sumo-gui that begins by itself and closes its window at the end: its port and process."""
    port = free_port()
    options = ["--remote-port", str(port), "--start", "--quit-on-end", "--window-size", "320,240"]
    with subprocess.Popen(
        [GUI, *command_line(SETUP, 1), *options],
        env={**os.environ, "DISPLAY": display},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            yield port, process
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.kill()


def drive(traffic: Traffic) -> list[TrafficSnapshot]:
    return [one for speed in (25.0, 18.0) for one in driven(traffic, 15, Command(SpeedAdvice(speed)))]


def alike(one: list[TrafficSnapshot], other: list[TrafficSnapshot]) -> bool:
    return len(one) == len(other) and all(
        a.state.ids == b.state.ids and np.array_equal(a.state.position, b.state.position) and a.leader == b.leader
        for a, b in zip(one, other, strict=True)
    )


def test_sumo_gui_runs_the_same_traffic_begins_anew_and_closes_at_the_end(
    gui: tuple[int, "subprocess.Popen[bytes]"],
) -> None:
    port, process = gui
    link = TraciLink(HOST, port, retries=120)
    traffic = traci_traffic(SETUP, link)
    traffic.start(1)
    # Only a SUMO with a window has views.
    assert link._connection.gui.getIDList() == ("View #0",)
    first = drive(traffic)
    traffic.start(1)
    again = drive(traffic)
    traffic.close()
    assert process.wait(60) == 0
    with running(SETUP) as here:
        expected = drive(here)
    assert alike(first, expected)
    assert alike(again, expected)
