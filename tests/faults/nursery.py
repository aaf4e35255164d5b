"""``fogsim`` on drawn steps in processes of one import: commands read from stdin are run by forks and told to end.

A line is a JSON list of commands that run at once; each has "arguments", "signals" ([seconds, number], …) to be sent so
long after its start or, where the steps "hold" at a number, after that; and a "log" for what it says; the number of the
step that is next stands beside it. The answer is a list of exit codes.
"""

import json
import os
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import fogsim.simulation.recording
from fogsim.cli import app
from fogsim.core.interruption import SIGNALS, leave_on_signals
from fogsim.recorders import RECORDERS, TableRecorder
from fogsim.recorders.protocol import RunInformation
from fogsim.scenario import load_scenario
from fogsim.simulation.recording import record_run
from tests.faults.steps import drawn_run


def _table(information: RunInformation) -> TableRecorder:
    """Table with a clock of 0.1 s a row, so that what is lost is counted in rows and not in the machine's speed."""
    ticks = iter(range(10**9))
    return TableRecorder(information.directory.file("table"), information.methods, clock=lambda: 0.1 * next(ticks))


def _command(command: dict[str, Any]) -> None:
    """Be ``fogsim`` with arguments."""
    log = os.open(command["log"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 1)
    os.dup2(log, 2)
    seen = Path(command["log"]).with_suffix(".seen")
    fogsim.simulation.recording.run = lambda *_, **__: drawn_run(pause=0.002, seen=seen, hold=command["hold"])
    leave_on_signals()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    sys.argv = ["fogsim", *command["arguments"]]
    try:
        app.main()
    except SystemExit as end:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(int(end.code or 0))
    os._exit(99)


def _attempt(commands: list[dict[str, Any]]) -> list[int]:
    children = []
    # None is lost before a child has come to where the program begins.
    signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    for command in commands:
        child = os.fork()
        if child == 0:
            _command(command)
        children.append(child)
    _send(children[0], commands[0])
    return [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]


def _send(child: int, command: dict[str, Any]) -> None:
    """Send a process the signals that are meant for it."""
    seen, held = Path(command["log"]).with_suffix(".seen"), str(command["hold"])
    while command["hold"] is not None and not (seen.exists() and seen.read_text(encoding="utf-8") == held):
        time.sleep(0.005)
    started = time.monotonic()
    for after, number in command["signals"]:
        time.sleep(max(0.0, started + after - time.monotonic()))
        os.kill(child, number)


if __name__ == "__main__":
    RECORDERS._entries["table"] = _table
    # Whatever a run imports on its way is imported once.
    fogsim.simulation.recording.run = lambda *_, **__: drawn_run(2)
    with tempfile.TemporaryDirectory() as folder:
        record_run(load_scenario("motorway_fog_bank"), 0, Path(folder), recorders=("table",))
    for line in sys.stdin:
        sys.stdout.write(json.dumps(_attempt(json.loads(line))) + "\n")
        sys.stdout.flush()
