"""On-board units in a process of their own."""

import contextlib
import multiprocessing
import signal
from collections.abc import Sequence
from multiprocessing.connection import Connection

from fogsim.core.files.standard_streams import open_standard_streams
from fogsim.errors import SimulationError
from fogsim.scenario import Scenario
from fogsim.simulation.fleet.on_board_unit import Instant, Lookout, UnitPool
from fogsim.values import EquippedVehicle, RoadNetwork, SignMap
from fogsim.values.script import Actions

LONGEST_END = 5.0
"""Time that a process is given to end by itself [s]."""


class UnitProcess:
    """A `UnitPool` in another process, which is asked and answers when it is done."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._process: multiprocessing.process.BaseProcess | None = None
        self._link: Connection | None = None
        self._is_asked = False

    def start_run(self, seed: int, network: tuple[RoadNetwork, SignMap]) -> None:
        """Begin a run; see `UnitPool.start_run`."""
        if self._process is None:
            open_standard_streams()
            # None of this process's simulation, threads and contexts in it.
            context = multiprocessing.get_context("forkserver")
            self._link, theirs = context.Pipe()
            self._process = context.Process(target=_serve, args=(theirs, self._scenario), daemon=True)
            self._process.start()
            theirs.close()
        if self._is_asked:
            self.answer()
        self._call("start_run", seed, network)

    def begin(self, actions: Actions, time: float, first_time: float) -> None:
        """Let begin what a script asks for; see `UnitPool.begin`."""
        self._call("begin", actions, time, first_time)

    def ask(self, lookouts: Sequence[Lookout], now: Instant) -> None:
        """Begin to let vehicles look; `answer` must follow."""
        self._send("look", lookouts, now)
        self._is_asked = True

    def answer(self) -> list[EquippedVehicle]:
        """What they have seen."""
        if self._link is None:
            raise SimulationError("the run has not been started, or is closed")
        self._is_asked = False
        try:
            found = self._link.recv()
        except (EOFError, OSError) as error:
            raise SimulationError("a process that draws for equipped vehicles has died") from error
        if isinstance(found, Exception):
            raise found
        return list(found or ())

    def _call(self, what: str, *arguments: object) -> None:
        self._send(what, *arguments)
        self.answer()

    def _send(self, what: str, *arguments: object) -> None:
        if self._link is None:
            raise SimulationError("the run has not been started, or is closed")
        try:
            self._link.send((what, arguments))
        except OSError as error:
            raise SimulationError("a process that draws for equipped vehicles has died") from error

    def close(self) -> None:
        """End the process; closing twice is allowed."""
        if self._link is not None:
            self._link.close()
        if self._process is not None:
            self._process.join(LONGEST_END)
            if self._process.is_alive():
                self._process.terminate()
                self._process.join()
        self._process, self._link, self._is_asked = None, None, False


def _serve(link: Connection, scenario: Scenario) -> None:
    """Do what is asked over a link until it is closed."""
    # Ctrl-C, which a terminal sends to all, ends the process that asks, and that this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    pool = UnitPool(scenario)
    with contextlib.suppress(EOFError, OSError), contextlib.closing(pool):
        while True:
            what, arguments = link.recv()
            try:
                answer = getattr(pool, what)(*arguments)
            except Exception as error:  # noqa: BLE001 - whatever it is, who has asked is to raise it
                answer = error
            link.send(answer)
