"""Programs in this process, since one of their own would spend its time on imports, and in processes of their own."""

import contextlib
import functools
import io
import os
import runpy
import signal
import subprocess
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import pytest

from fogsim.cli import app
from fogsim.core.interruption import SIGNALS


class Ran(NamedTuple):
    """What a program left."""

    returncode: int
    stdout: str
    stderr: str


Command = Callable[..., Ran]
"""The fixture `command`: takes arguments, and `cwd`."""


@contextlib.contextmanager
def restored_handlers() -> Iterator[None]:
    """Undo a program's handlers of signals and of lost exceptions, which it keeps until its process ends."""
    signals = (*SIGNALS, signal.SIGALRM)
    handlers, hook = [signal.getsignal(signum) for signum in signals], sys.unraisablehook
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for signum, handler in zip(signals, handlers, strict=True):
            signal.signal(signum, handler)


def run_command(*arguments: str) -> int:
    """Run fogsim's command line, which may be in a fixture of any scope; gives its exit code."""
    with restored_handlers(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["fogsim", *arguments])
        patch.setenv("COLUMNS", "300")
        with pytest.raises(SystemExit) as ended:
            app.main()
    return int(ended.value.code or 0)


def run_script(script: Path, *arguments: str | Path) -> Ran:
    """Run a script of benchmarks/ or docs/."""
    out, err, code = io.StringIO(), io.StringIO(), None
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        for folder in ("docs", "benchmarks"):
            patch.syspath_prepend(Path(__file__).parents[2] / folder)
        patch.setattr(sys, "argv", [str(script), *map(str, arguments)])
        try:
            runpy.run_path(str(script), run_name="__main__")
        except SystemExit as end:
            code = end.code
    # What is no number is a program's last words.
    words = f"{code}\n" if isinstance(code, str) else ""
    return Ran(1 if words else int(code or 0), out.getvalue(), err.getvalue() + words)


def run_program(
    *command: str | Path,
    environment: Mapping[str, str] | None = None,
    without: Collection[str] = (),
    cwd: Path | None = None,
    check: bool = True,
    timeout: float | None = None,
) -> Ran:
    """Run a program in a process of its own, with changes to the environment, and without some of its variables."""
    kept = {name: value for name, value in os.environ.items() if name not in without} | dict(environment or {})
    done = subprocess.run(
        list(command), cwd=cwd, env=kept, capture_output=True, text=True, timeout=timeout, check=False
    )
    assert not (check and done.returncode), f"{command}\n{done.stdout}\n{done.stderr}"
    return Ran(done.returncode, done.stdout, done.stderr)


OTHERS_PACKAGES = "PYTHONPATH", "VIRTUAL_ENV"
"""Variables that show an environment of its own the packages of this one."""

run_python = functools.partial(run_program, sys.executable, timeout=250.0)
"""Run Python in a process of its own."""
