"""The child process of a hosted simulation: ``python -m fogsim_envs.host FD`` answers requests until the pipe ends."""

import sys
from multiprocessing.connection import Connection
from typing import Any

from fogsim.errors import FogSimError, SimulationError
from fogsim.loop import ClosedLoop
from fogsim.values import Step


def serve(connection: "Connection[Any, Any]") -> None:
    """Answer requests, each a verb and its argument, with the result or the error.

    Parameters
    ----------
    connection : Connection
        The pipe to the parent; its end ends the simulation.
    """
    loop: ClosedLoop | None = None
    answer: Step | FogSimError | None
    try:
        while True:
            verb, argument = connection.recv()
            try:
                if verb == "open":
                    loop, answer = ClosedLoop(argument), None
                elif loop is None:
                    answer = SimulationError("the host was asked for a run before it got a scenario")
                else:
                    answer = loop.start(argument) if verb == "start" else loop.advance(argument)
            except FogSimError as error:
                answer = error
            connection.send(answer)
    except EOFError:
        return
    finally:
        if loop is not None:
            loop.close()


if __name__ == "__main__":
    serve(Connection(int(sys.argv[1])))
