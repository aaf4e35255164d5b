"""Simulations in this process or in one of their own.

libsumo holds one simulation in a process, but scripts hold several environments: one to train and one to evaluate,
say. The first environment runs its simulation here; a further one runs it in a child process, and no one notices.
"""

import contextlib
import functools
import math
import os
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterable
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Annotated, Any, Protocol, TypeVar, cast

import gymnasium

from fogsim.core.files.standard_streams import open_standard_streams
from fogsim.core.parameters import Range
from fogsim.errors import InputError, LeftOutWarning, SimulationError, SimulationRunningError
from fogsim.scenario import Scenario
from fogsim.scenario.loading import load_cases
from fogsim.scenario.variation import first_of_several
from fogsim.simulation.loop import ClosedLoop
from fogsim.simulation.traffic_run import TrafficRun
from fogsim.values import Command, Step, TrafficStep

M = TypeVar("M", bound=Callable[..., Any])

TIMEOUT = 60.0
"""How long a child process may give no sign of life unless something else is asked for [s]."""

Timeout = Annotated[float, Range(0.0, math.inf, "s")]
"""Time that a child process may give no sign of life [s]; `checked_timeout` refuses 0."""

_START_TIMEOUT = 600.0
"""The same, at least, for one that begins: it imports everything before it gives a sign [s]."""

_CLOSE_TIMEOUT = 10.0
_LONGEST_TIMEOUT = 1e6


class Simulation(Protocol):
    """What an environment needs of a closed loop, wherever it runs."""

    def start(self, seed: int) -> Step:
        """Begin a run; see `fogsim.simulation.loop.ClosedLoop.start`."""

    def advance(self, command: Command, periods: int = 1) -> Step:
        """Move by some camera periods; see `fogsim.simulation.loop.ClosedLoop.advance`."""

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""


def load_first(scenario: str | Path, settings: Iterable[str]) -> Scenario:
    """Load a scenario, the first case of a file that varies, and warn if other cases are left out."""
    loaded = load_cases(scenario, settings)
    if note := first_of_several(loaded.document):
        warnings.warn(note, LeftOutWarning, stacklevel=2)
    return loaded.cases[0][1]


def refuse_controller(scenario: Scenario) -> None:
    """Refuse a scenario whose ego has a controller: here, an agent decides."""
    if scenario.controller is not None:
        raise InputError(
            f"controller: {scenario.controller.method!r} would drive the ego, and in an environment the agent does; "
            "leave controller out"
        )


def begin(scenario: Scenario, seed: int, timeout: float = TIMEOUT) -> tuple[Simulation, Step]:
    """Start a scenario here, or in a child process if another simulation runs here (`timeout` [s])."""
    refuse_controller(scenario)
    try:
        return _begun(ClosedLoop(scenario), seed)
    except SimulationRunningError:
        return _begun(HostedLoop(scenario, timeout), seed)


def restart(simulation: Simulation, scenario: Scenario, seed: int, timeout: float = TIMEOUT) -> tuple[Simulation, Step]:
    """Start another scenario where a simulation runs, which is over then (`timeout` [s])."""
    refuse_controller(scenario)
    if not isinstance(simulation, HostedLoop):
        simulation.close()
        return begin(scenario, seed, timeout)
    try:
        simulation.change(scenario)
    except BaseException:
        simulation.close()
        raise
    return _begun(simulation, seed)


def _begun(simulation: Simulation, seed: int) -> tuple[Simulation, Step]:
    try:
        return simulation, simulation.start(seed)
    except BaseException:
        simulation.close()
        raise


def refuse_copies(was_reset: bool) -> None:
    """Refuse to pickle or copy an environment that has begun an episode."""
    if was_reset:
        raise InputError("an environment can be pickled or copied only before its first reset()")


def needs_completion(method: M) -> M:
    """Decorator of `reset` and `step`: what is interrupted, by Ctrl-C for example, must be followed by a reset."""

    @functools.wraps(method)
    def complete(self: Any, *arguments: Any, **options: Any) -> Any:
        try:
            return method(self, *arguments, **options)
        except (InputError, gymnasium.error.ResetNeeded):
            # Refused before anything was done.
            raise
        except BaseException:
            self._step = None
            raise

    return cast("M", complete)


class TrafficSimulation(Protocol):
    """What an environment needs of traffic without an ego, wherever it runs."""

    def start(self, seed: int) -> tuple[TrafficStep, float]:
        """Begin a run; see `fogsim.simulation.traffic_run.TrafficRun.start`."""

    def advance(self, command: Command) -> tuple[TrafficStep, float]:
        """Move by one camera period; see `fogsim.simulation.traffic_run.TrafficRun.advance`."""

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""


def begin_traffic(
    simulation: TrafficSimulation | None, scenario: Scenario, seed: int, timeout: float = TIMEOUT
) -> tuple[TrafficSimulation, TrafficStep]:
    """Start a scenario without an ego, here or in a child process if another simulation runs here (`timeout` [s])."""
    begun: TrafficSimulation
    if isinstance(simulation, _HostedTraffic):
        simulation.change(scenario)
        begun = simulation
    else:
        if simulation is not None:
            simulation.close()
        begun = TrafficRun(scenario)
    try:
        return begun, begun.start(seed)[0]
    except SimulationRunningError:
        begun = _HostedTraffic(scenario, timeout)
        return begun, begun.start(seed)[0]
    except BaseException:
        begun.close()
        raise


class _Host:
    """A simulation in a child process; one that is lost is replaced when a run is begun (`timeout` [s])."""

    def __init__(self, scenario: Scenario, timeout: float = TIMEOUT) -> None:
        self._scenario = scenario
        self._timeout = checked_timeout(timeout)
        self._open()

    def _open(self) -> None:
        open_standard_streams()
        ours, theirs = Pipe()
        self._connection: Connection[Any, Any] = ours
        self._owner = os.getpid()
        # A fresh interpreter, not a fork (which a GL context does not survive) and not multiprocessing's spawn (which
        # runs the user's script again). Its own session keeps Ctrl-C for this process; it ends when the pipe does.
        self._child = subprocess.Popen(  # noqa: S603 - our own module
            [sys.executable, "-P", "-m", "fogsim_envs.host", str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        theirs.close()
        self._ask("open", self._scenario, _START_TIMEOUT)

    def _ask(self, verb: str, argument: object, least_timeout: float = 0.0) -> object:
        if self._owner != os.getpid():
            # Two processes would take each other's answers.
            raise SimulationError(
                f"the simulation belongs to the process {self._owner}, and this one was forked from it: make an "
                "environment in each process, or close() this one here before reset()"
            )
        try:
            self._connection.send((verb, argument))
            answer = self._hear(None if self._timeout is None else max(self._timeout, least_timeout))
        except (EOFError, OSError) as error:
            self._abandon()
            raise SimulationError("the child process that ran the simulation has ended") from error
        except BaseException:
            # Whoever asks next must not get the answer to this.
            self._abandon()
            raise
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def _hear(self, timeout: float | None) -> object:
        """Wait for an answer as long as there are signs of life (`timeout` [s])."""
        while self._connection.poll(timeout):
            sign, answer = self._connection.recv()
            if sign == "done":
                return answer
        raise SimulationError(
            f"the child process that runs the simulation has given no sign of life for {timeout:g} s, and was "
            "ended: it was stopped, or the computer has no time for it; the time is set by timeout=…"
        )

    def _abandon(self) -> None:
        self._connection.close()
        self._child.kill()
        self._child.wait()

    def change(self, scenario: Scenario) -> None:
        """Let the next run be of another scenario, in the same child process."""
        self._scenario = scenario
        if not self._connection.closed:
            self._ask("open", scenario)

    def _start(self, seed: int) -> object:
        if self._connection.closed:
            self._open()
        return self._ask("start", seed)

    def close(self) -> None:
        """End the child process; closing twice is allowed."""
        if self._owner != os.getpid():
            self._connection.close()
            return
        # A process that was forked since then keeps the pipe open, so the child does not see it end.
        with contextlib.suppress(OSError):
            self._connection.send(("close", None))
        self._connection.close()
        try:
            self._child.wait(_CLOSE_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._abandon()


class HostedLoop(_Host):
    """A closed loop in a child process; see `_Host` for parameters."""

    def start(self, seed: int) -> Step:
        """Begin a run; see `fogsim.simulation.loop.ClosedLoop.start`."""
        return cast("Step", self._start(seed))

    def advance(self, command: Command, periods: int = 1) -> Step:
        """Move by some camera periods; see `fogsim.simulation.loop.ClosedLoop.advance`."""
        return cast("Step", self._ask("advance", (command, periods)))


class _HostedTraffic(_Host):
    """Traffic without an ego in a child process; see `_Host` for parameters."""

    def start(self, seed: int) -> tuple[TrafficStep, float]:
        """Begin a run; see `fogsim.simulation.traffic_run.TrafficRun.start`."""
        return cast("tuple[TrafficStep, float]", self._start(seed))

    def advance(self, command: Command) -> tuple[TrafficStep, float]:
        """Move by one camera period; see `fogsim.simulation.traffic_run.TrafficRun.advance`."""
        return cast("tuple[TrafficStep, float]", self._ask("advance", (command,)))


def checked_timeout(timeout: float) -> float | None:
    """A time limit as the standard library takes it: None for ever (`timeout` [s])."""
    if not timeout > 0:
        raise InputError(f"timeout: expected a time of more than 0 s, or inf for ever, got {timeout!r}")
    return timeout if timeout < _LONGEST_TIMEOUT else None
