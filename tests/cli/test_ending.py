"""How the program ends when memory is short, and when a user's method has left threads."""

import os
import subprocess
import sys

import pytest

from fogsim import __main__
from fogsim.cli import app
from tests.helpers.command import restored_handlers, run_python

LEFT = """
import sys, threading, time
from fogsim import __main__
threading.Thread(target=time.sleep, args=(600,)).start()
sys.argv = ["fogsim", "--version"]
__main__.main()
"""


@pytest.mark.parametrize("error", [MemoryError(), ImportError("libx.so: failed to map segment from shared object")])
def test_too_little_memory_ends_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: Exception
) -> None:
    def fail() -> None:
        raise error

    monkeypatch.setattr(app, "main", fail)
    with restored_handlers(), pytest.raises(SystemExit) as ended:
        __main__.main()
    assert ended.value.code == 2
    assert capsys.readouterr().err == "error: too little memory; give FogSim more, or run less at once (-j)\n"


def test_threads_that_were_left_do_not_keep_the_program() -> None:
    done = run_python("-c", LEFT)
    assert (done.returncode, done.stdout[:7]) == (0, "fogsim ")


@pytest.mark.parametrize(("name", "code"), [("motorway_fog_bank", 0), ("nowhere", 2)])
def test_a_reader_that_has_gone_changes_no_exit_code(name: str, code: int) -> None:
    ours, theirs = os.pipe()
    os.close(ours)
    try:
        command = [sys.executable, "-m", "fogsim", "validate", "motorway_fog_bank", name]
        done = subprocess.run(command, stdout=theirs, stderr=subprocess.PIPE, text=True, check=False)
    finally:
        os.close(theirs)
    assert done.returncode == code
    assert ("nowhere" in done.stderr) == bool(code)
    assert "roken" not in done.stderr
