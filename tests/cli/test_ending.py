"""How the program ends when memory is short, and when a user's method has left threads."""

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
