"""What ``fogsim reproduce`` shows while it works: a bar on a terminal, nothing elsewhere, one line after Ctrl-C."""

import io
import re

import numpy as np
import pytest
from rich.console import Console

from fogsim.cli import progress
from fogsim.reproduce import REPRODUCTIONS, Reproduction
from tests.helpers.command import run_command
from tests.test_interruption import raise_as_numba_does

DONE = Reproduction("negru2013", ({"paper": "negru2013"},), (("a",), ("1",)), (), np.zeros((2, 2, 3), np.uint8))


def evaluation(quick, table, watch) -> Reproduction:
    for step in range(5):
        watch(step, 4)
    return DONE


@pytest.fixture
def reproduce(monkeypatch, capsys):
    """Run the command in this process with an evaluation of ours: exit code, stdout and stderr."""

    def run(evaluation, *, terminal: bool) -> tuple[int, str, str]:
        drawn = io.StringIO()
        monkeypatch.setattr(progress, "stderr", Console(file=drawn, force_terminal=terminal, width=100))
        monkeypatch.setattr(REPRODUCTIONS, "_entries", {"negru2013": evaluation})
        code = run_command("reproduce", "negru2013", "--json")
        return code, capsys.readouterr().out, drawn.getvalue()

    return run


def test_a_terminal_shows_how_many_steps_of_how_many_are_done(reproduce) -> None:
    code, out, err = reproduce(evaluation, terminal=True)
    assert (code, out) == (0, '{"paper": "negru2013"}\n')
    assert "negru2013: 4 of 4 steps" in err
    assert "100%" in err


def test_elsewhere_nothing_is_shown(reproduce) -> None:
    assert reproduce(evaluation, terminal=False) == (0, '{"paper": "negru2013"}\n', "")


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("in_kernel", [True, False])
def test_an_interruption_ends_in_one_line(reproduce, *, terminal: bool, in_kernel: bool) -> None:
    def interrupted(quick, table, watch) -> Reproduction:
        watch(0, 4)
        watch(1, 4)
        if in_kernel:
            raise_as_numba_does()
        raise KeyboardInterrupt

    code, out, err = reproduce(interrupted, terminal=terminal)
    assert (code, out) == (130, "")
    # What the bar drew and wiped again is control sequences and what stands between them and a carriage return.
    lines = [line for line in re.sub(r"\x1b\[[0-9;?]*[A-Za-z]|.*\r", "", err).split("\n") if line.strip()]
    assert lines[-1] == "interrupted: negru2013 after 1 of 4 steps; nothing of it is printed or written"
    assert terminal or len(lines) == 1
