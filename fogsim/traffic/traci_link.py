"""SUMO in another process, which the user has started, over a TraCI connection."""

import contextlib
import time
from collections.abc import Sequence
from types import ModuleType

from fogsim.errors import MissingDependencyError, SimulationError
from fogsim.traffic.link import Api, told_errors

WAIT = 0.25
"""Time between two attempts to connect [s]."""


def load_traci() -> ModuleType:
    """Import traci.

    Raises
    ------
    MissingDependencyError
        If it is not installed.
    """
    try:
        import traci  # noqa: PLC0415 - importing fogsim must not load SUMO's packages
    except ImportError as error:
        raise MissingDependencyError(f"traci cannot be loaded ({error}); install it with: pip install traci") from error
    module: ModuleType = traci
    return module


class TraciLink:
    """One client of a SUMO or sumo-gui that runs with ``--remote-port``.

    The simulation is taken as it is at the first `begin`, whatever its arguments; a later one loads the arguments.

    Parameters
    ----------
    host : str
        Where SUMO runs.
    port : int
        Its ``--remote-port``.
    order : int or None
        This client's place among several (SUMO's ``--num-clients``); each needs another one.
    retries : int
        How often to try again, every 0.25 s, while SUMO does not listen yet.
    """

    distant = True
    shared = True

    def __init__(self, host: str = "localhost", port: int = 8813, order: int | None = None, retries: int = 40) -> None:
        self._host = host
        self._port = port
        self._order = order
        self._retries = retries
        self._connection: Api = None

    @property
    def _where(self) -> str:
        return f"at {self._host}:{self._port}"

    def begin(self, arguments: Sequence[str]) -> Api:
        """Connect, or load the simulation anew; see `SumoLink.begin`.

        Raises
        ------
        SimulationError
            If SUMO cannot be reached or refuses, or other clients would lose their simulation by loading another.
        """
        if self._connection is None:
            self._connection = self._connect()
        else:
            with self.watched():
                self._load(arguments)
        return self._connection

    def _connect(self) -> Api:
        traci, begun = load_traci(), time.monotonic()
        for attempt in range(self._retries + 1):
            try:
                # Its own retries would print to stdout.
                connection = traci.connect(port=self._port, numRetries=0, host=self._host)
                break
            except (traci.FatalTraCIError, OSError) as error:
                if attempt == self._retries:
                    raise SimulationError(self._silence(time.monotonic() - begun, error)) from error
                time.sleep(WAIT)
        if self._order is not None:
            with self.watched():
                connection.setOrder(self._order)
        return connection

    def _silence(self, waited: float, error: Exception) -> str:
        """Say that nobody has answered, for how long, and what to do."""
        # traci's own words only count the tries of one attempt, which is always one.
        why = f" ({error})" if isinstance(error, OSError) else ""
        return (
            f"no SUMO answers {self._where}{why}, asked {self._retries + 1} times within {waited:.1f} s: start it with "
            f"--remote-port {self._port}, and --num-clients if it is to have several clients"
        )

    def _load(self, arguments: Sequence[str]) -> None:
        clients = int(self._connection.simulation.getOption("num-clients"))
        if clients > 1:
            raise SimulationError(
                f"SUMO {self._where} has {clients} clients, and beginning anew would take the simulation away from the "
                "others: start SUMO again for another run"
            )
        # Loaded anew, a sumo-gui would wait for its button to be pressed, and forget whether to close at the end.
        closes = self._connection.simulation.getOption("quit-on-end") == "true"
        self._connection.load([*arguments, "--start", *(("--quit-on-end",) if closes else ())])

    def step(self) -> None:
        """Move by one step, when all other clients have asked for it too; see `SumoLink.step`."""
        self._connection.simulationStep()

    def end(self) -> None:
        """Leave the simulation; SUMO ends when its last client has left. See `SumoLink.end`."""
        connection, self._connection = self._connection, None
        if connection is not None:
            _hang_up(connection)

    def watched(self) -> contextlib.AbstractContextManager[None]:
        """Turn the loss of the connection into an error of ours; see `SumoLink.watched`."""
        return told_errors(load_traci(), self._where)


def _hang_up(connection: Api) -> None:
    # On an error of sending, traci leaves the socket open and keeps nothing that would close it.
    socket = connection._socket
    with contextlib.suppress(load_traci().FatalTraCIError, OSError):
        connection.close(False)
    if socket is not None:
        socket.close()
