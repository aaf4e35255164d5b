"""The child process of a hosted simulation: ``python -m fogsim_envs.host FD`` answers requests until the pipe ends."""

import contextlib
import sys
import threading
from collections.abc import Iterator
from multiprocessing.connection import Connection
from typing import Any

from fogsim.errors import FogSimError, SimulationError
from fogsim.scenario import Scenario
from fogsim.simulation.loop import ClosedLoop
from fogsim.simulation.traffic_run import TrafficRun
from fogsim.values import Step, TrafficStep

HEARTBEAT_PERIOD = 1.0
"""Time between two signs of life while a request is worked on [s]."""


def serve(connection: "Connection[Any, Any]") -> None:
    """Answer requests, each a verb and its argument, with ``("done", result or error)``, up to "close".

    While one is worked on, which takes minutes where kernels are to be compiled, ``("working", None)`` is sent every
    `HEARTBEAT_PERIOD`.
    """
    loop: ClosedLoop | TrafficRun | None = None
    answer: Step | tuple[TrafficStep, float] | FogSimError | None
    try:
        while True:
            verb, argument = connection.recv()
            if verb == "close":
                return
            try:
                with _heartbeat(connection):
                    if verb == "open":
                        if loop is not None:
                            loop.close()
                        loop, answer = simulation_of(argument), None
                    elif loop is None:
                        answer = SimulationError("the host was asked for a run before it got a scenario")
                    else:
                        answer = loop.start(argument) if verb == "start" else loop.advance(*argument)
            except FogSimError as error:
                answer = error
            connection.send(("done", answer))
    except (EOFError, ConnectionError):
        return
    finally:
        if loop is not None:
            loop.close()


def simulation_of(scenario: Scenario) -> ClosedLoop | TrafficRun:
    """The simulation that a scenario asks for: about its ego, or of traffic alone."""
    return ClosedLoop(scenario) if scenario.traffic.has_ego else TrafficRun(scenario)


@contextlib.contextmanager
def _heartbeat(connection: "Connection[Any, Any]") -> Iterator[None]:
    """Block in which another thread gives signs of life."""
    done = threading.Event()

    def beat() -> None:
        # A parent that is gone is noticed by whoever sends the answer.
        with contextlib.suppress(OSError):
            while not done.wait(HEARTBEAT_PERIOD):
                connection.send(("working", None))

    thread = threading.Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        # Only one thread may send at a time.
        done.set()
        thread.join()


if __name__ == "__main__":
    serve(Connection(int(sys.argv[1])))
