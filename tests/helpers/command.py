"""The command line in this process, since one of its own would spend its time on imports."""

import sys
from collections.abc import Callable
from subprocess import CompletedProcess

import pytest

from fogsim.cli import app

Command = Callable[..., "CompletedProcess[str]"]
"""The fixture `command`: takes arguments, and `cwd`."""


def run_command(*arguments: str) -> int:
    """Run a command line, which may be in a fixture of any scope; gives its exit code."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["fogsim", *arguments])
        patch.setenv("COLUMNS", "300")
        with pytest.raises(SystemExit) as ended:
            app.main()
    return int(ended.value.code or 0)
