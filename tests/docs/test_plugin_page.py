"""Mistakes in what the page on the plug-in prints are told in one line."""

import re
import socket
import time
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

pytestmark = pytest.mark.nightly

CHECKOUT = Path(__file__).resolve().parents[2]
PAGE = (CHECKOUT / "docs" / "how_to" / "plugin.md").read_text(encoding="utf-8")
(CONNECT,) = (block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "fogsim.connect" in block)

Run = Callable[..., "CompletedProcess[str]"]

MISTAKES = [
    ('"veh18"', '"veh81"', r"InputError: my/town.sumocfg: traffic.ego: .*no vehicle 'veh81' .*mean 'veh18'"),
    ("town.sumocfg", "toun.sumocfg", r"InputError: my/toun.sumocfg: .*no file 'toun.sumocfg' .*mean 'town.sumocfg'"),
]


@pytest.mark.parametrize(("right", "wrong", "told"), MISTAKES)
def test_mistakes_are_told_in_one_line(python: Run, listening: int, right: str, wrong: str, told: str) -> None:
    done = python(CONNECT.replace("8813", str(listening)).replace(right, wrong))
    assert done.returncode == 1
    assert re.search(told, done.stderr.splitlines()[-1])


def test_a_port_that_nobody_listens_on_is_told_in_one_line(python: Run, free_port: Callable[[], int]) -> None:
    port = free_port()
    began = time.monotonic()
    done = python(CONNECT.replace("8813", str(port)).replace("port=", "retries=4, port="))
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port))
    assert done.returncode == 1
    assert f"SimulationError: no SUMO answers at localhost:{port}" in done.stderr.splitlines()[-1]
    assert time.monotonic() - began < 30.0
