"""How a SUMO simulation is reached: in this process, or over a connection. Both offer the same calls."""

import contextlib
from collections.abc import Iterator, Sequence
from types import ModuleType
from typing import Any, Protocol

from fogsim.errors import SimulationError

Api = Any
"""The domains of SUMO's TraCI (``vehicle``, ``simulation``, ``lane``, …), as libsumo and traci both offer them.

Neither has types; every use is inside the traffic stage.
"""


class SumoLink(Protocol):
    """A SUMO simulation that can be begun, stepped and ended.

    Attributes
    ----------
    distant : bool
        True where every call is a message to another process, so that few calls must do.
    shared : bool
        True where others may command the simulation too, and take vehicles away between two calls.
    """

    @property
    def distant(self) -> bool:
        """See the class."""

    @property
    def shared(self) -> bool:
        """See the class."""

    def begin(self, arguments: Sequence[str]) -> Api:
        """Start SUMO with arguments of its command line, or load it anew if this link has begun it before.

        Raises
        ------
        SimulationError
            If SUMO refuses, or cannot be reached.
        """

    def step(self) -> None:
        """Move the simulation by one step."""

    def end(self) -> None:
        """End the simulation, or leave it; ending twice is allowed."""

    def watched(self) -> contextlib.AbstractContextManager[None]:
        """Block in which a simulation that is lost or refuses a call becomes a `SimulationError`."""


@contextlib.contextmanager
def told_errors(library: ModuleType, where: str) -> Iterator[None]:
    """Block in which the errors of libsumo or traci become a `SimulationError`.

    Parameters
    ----------
    library : module
        libsumo or traci.
    where : str
        Where the simulation runs, for the message.
    """
    try:
        yield
    except (library.FatalTraCIError, ConnectionError) as error:
        raise SimulationError(
            f"SUMO {where} is lost: {str(error).rstrip('.')}; it has ended, was closed, or the connection broke"
        ) from error
    except library.TraCIException as error:
        raise SimulationError(f"SUMO {where} refused: {error}") from error
