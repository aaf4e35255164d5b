"""Signals that come while libraries are imported."""

import signal
from pathlib import Path

import pytest

from tests.helpers.command import run_python

PROGRAM = """
import os, runpy, sys

module, number, *sys.argv = sys.argv[1:]

class Sender:
    def find_spec(self, name, path=None, target=None):
        if name == module:
            os.kill(os.getpid(), int(number))

sys.meta_path.insert(0, Sender())
runpy.run_module("fogsim", run_name="__main__")
"""
"""FogSim's command line, which gets a signal when it begins to import a module."""


@pytest.mark.parametrize(
    ("module", "number", "command"),
    [
        ("rich.console", signal.SIGINT, ["--version"]),
        ("numpy", signal.SIGHUP, ["validate", "motorway_fog_bank"]),
        ("numba", signal.SIGTERM, ["run", "motorway_fog_bank"]),
        ("pyarrow", signal.SIGINT, ["run", "motorway_fog_bank"]),
    ],
)
def test_they_end_in_one_line(tmp_path: Path, module: str, number: int, command: list[str]) -> None:
    done = run_python("-c", PROGRAM, module, str(int(number)), "fogsim", *command, cwd=tmp_path, check=False)
    assert done == (128 + number, "", "interrupted\n")
    assert not list(tmp_path.iterdir())
