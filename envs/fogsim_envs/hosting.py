"""Simulations in this process or in one of their own.

libsumo holds one simulation in a process, but scripts hold several environments: one to train and one to evaluate,
say. The first environment runs its simulation here; a further one runs it in a child process, and nobody notices.
"""

import contextlib
import os
import subprocess
import sys
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any, Protocol, cast

from fogsim.errors import SimulationError, SimulationRunningError
from fogsim.loop import ClosedLoop
from fogsim.scenario import Scenario
from fogsim.values import Command, Step

_CLOSE_TIMEOUT = 10.0


class Simulation(Protocol):
    """What an environment needs of a closed loop, wherever it runs."""

    def start(self, seed: int) -> Step:
        """Begin a run; see `fogsim.loop.ClosedLoop.start`."""

    def advance(self, command: Command) -> Step:
        """Move by one camera period; see `fogsim.loop.ClosedLoop.advance`."""

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""


def begin(scenario: Scenario, seed: int) -> tuple[Simulation, Step]:
    """Start a scenario here, or in a child process if another simulation runs here."""
    here = ClosedLoop(scenario)
    try:
        return here, here.start(seed)
    except SimulationRunningError:
        hosted = HostedLoop(scenario)
        return hosted, hosted.start(seed)
    except BaseException:
        here.close()
        raise


class HostedLoop:
    """A closed loop in a child process.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    """

    def __init__(self, scenario: Scenario) -> None:
        ours, theirs = Pipe()
        self._connection: Connection[Any, Any] = ours
        # A fresh interpreter, not a fork (which a GL context does not survive) and not multiprocessing's spawn (which
        # runs the user's script again). Its own session keeps Ctrl-C for this process; it ends when the pipe does.
        self._child = subprocess.Popen(  # noqa: S603 - our own module
            [sys.executable, "-m", "fogsim_envs.host", str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        theirs.close()
        self._ask("open", scenario)

    def _ask(self, verb: str, argument: object) -> object:
        try:
            self._connection.send((verb, argument))
            answer = self._connection.recv()
        except (EOFError, OSError) as error:
            raise SimulationError("the child process that ran the simulation has ended") from error
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def start(self, seed: int) -> Step:
        """Begin a run; see `fogsim.loop.ClosedLoop.start`."""
        return cast("Step", self._ask("start", seed))

    def advance(self, command: Command) -> Step:
        """Move by one camera period; see `fogsim.loop.ClosedLoop.advance`."""
        return cast("Step", self._ask("advance", command))

    def close(self) -> None:
        """End the child process."""
        with contextlib.suppress(OSError):
            self._connection.close()
        try:
            self._child.wait(_CLOSE_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
