"""SUMO in another process, which the user has started, over a TraCI connection."""

import contextlib
import socket
import time
from collections.abc import Sequence
from types import ModuleType

from fogsim.errors import InputError, MissingDependencyError, SimulationError
from fogsim.traffic.road.configuration import is_true
from fogsim.traffic.sumo.link import Api, translated_errors

_WAIT = 0.25
"""Time between two attempts to connect [s]."""

_TIMEOUT = 60.0
"""How long SUMO may leave one message unanswered unless something else is asked for [s]."""

_LONGEST_TIMEOUT = 1e6
"""From here on a time is for ever [s]: sockets cannot count much longer ones."""


def load_traci() -> ModuleType:
    """Import traci."""
    try:
        import traci  # noqa: PLC0415 - importing fogsim must not load SUMO's packages
    except ImportError as error:
        raise MissingDependencyError(f"traci cannot be loaded ({error}); install it with: pip install traci") from error
    module: ModuleType = traci
    return module


class TraciLink:
    """One client of a SUMO or sumo-gui that runs with ``--remote-port`` (`timeout` [s]).

    The simulation is taken as it is at the first `begin`, whatever its arguments; a later one loads the arguments.
    """

    remote = True
    shared = True

    def __init__(
        self,
        host: str = "localhost",
        port: int = 8813,
        order: int | None = None,
        retries: int = 40,
        timeout: float = _TIMEOUT,
    ) -> None:
        if not timeout > 0:
            raise InputError(f"timeout: expected a time of more than 0 s, or inf for ever, got {timeout!r}")
        self._timeout = timeout
        self._host = host
        self._port = port
        self._order = order
        self._retries = retries
        self._connection: Api = None

    @property
    def _where(self) -> str:
        return f"at {self._host}:{self._port}"

    def begin(self, arguments: Sequence[str]) -> Api:
        """Connect, or load the simulation again; see `SumoLink.begin`."""
        if self._connection is None:
            self._connection = self._connect()
        else:
            with self.translated_errors():
                self._load(arguments)
        return self._connection

    def _connect(self) -> Api:
        traci, begun = load_traci(), time.monotonic()
        # A host that swallows what is sent to it lets each attempt last for minutes.
        longest = max(self._timeout, self._retries * _WAIT)
        for attempt in range(self._retries + 1):
            try:
                # Its own retries would print to stdout.
                connection = traci.connect(port=self._port, numRetries=0, host=self._host)
                break
            except (traci.FatalTraCIError, OSError) as error:
                if attempt == self._retries or time.monotonic() - begun > longest:
                    raise SimulationError(self._no_answer(attempt + 1, time.monotonic() - begun, error)) from error
                time.sleep(_WAIT)
        connection._socket = _LimitedSocket(connection._socket, self._timeout, self._where)
        if self._order is not None:
            with self.translated_errors():
                connection.setOrder(self._order)
        return connection

    def _no_answer(self, asked: int, waited: float, error: Exception) -> str:
        """Message that SUMO has not answered, for how long, and what to do."""
        # traci's own words only count the tries of one attempt, which is always one.
        why = f" ({error})" if isinstance(error, OSError) else ""
        return (
            f"no SUMO answers {self._where}{why}, asked {asked} times within {waited:.1f} s: start it with "
            f"--remote-port {self._port}, and --num-clients if it is to have several clients"
        )

    def _load(self, arguments: Sequence[str]) -> None:
        clients = int(self._connection.simulation.getOption("num-clients"))
        if clients > 1:
            raise SimulationError(
                f"SUMO {self._where} has {clients} clients, and a restart would take the simulation away from the "
                "others: start SUMO again for another run"
            )
        # Loaded again, a sumo-gui would wait for its button to be pressed, and forget whether to close at the end.
        closes = is_true(self._connection.simulation.getOption("quit-on-end"))
        self._connection.load([*arguments, "--start", *(("--quit-on-end",) if closes else ())])

    def step(self) -> None:
        """Move by one step, when all other clients have asked for it too; see `SumoLink.step`."""
        self._connection.simulationStep()

    def end(self) -> None:
        """Leave the simulation; SUMO ends when its last client has left. See `SumoLink.end`."""
        connection, self._connection = self._connection, None
        if connection is not None:
            _close(connection)

    def warnings(self) -> tuple[str, ...]:
        """Nothing: the owner of the simulation reads them."""
        return ()

    def translated_errors(self) -> contextlib.AbstractContextManager[None]:
        """Turn the loss of the connection into an error of ours; see `SumoLink.translated_errors`."""
        return translated_errors(load_traci(), self._where)


class _LimitedSocket:
    """A traci socket that raises our error if SUMO is silent (`timeout` [s]), which traci takes for closed."""

    def __init__(self, connected: socket.socket, timeout: float, where: str) -> None:
        self._socket = connected
        self._timeout = timeout
        self._where = where
        # Parts of an answer that are to come: its length, and the rest.
        self._missing = 0
        connected.settimeout(timeout if timeout < _LONGEST_TIMEOUT else None)

    def recv(self, size: int) -> bytes:
        """Wait for up to `size` bytes."""
        try:
            received = self._socket.recv(size)
        except TimeoutError as error:
            raise self._timed_out() from error
        self._missing -= len(received) == size
        return received

    def send(self, message: bytes) -> None:
        """Send a whole message; with a time limit, a plain ``send`` may stop half-way."""
        if self._missing:
            raise SimulationError(f"a message to SUMO {self._where} was broken off before its answer: connect again")
        self._missing = 2
        try:
            self._socket.sendall(message)
        except TimeoutError as error:
            raise self._timed_out() from error

    def _timed_out(self) -> SimulationError:
        # An answer that comes yet would be taken for that to the next message, the farewell too.
        self._socket.close()
        return SimulationError(
            f"SUMO {self._where} has not answered for {self._timeout:g} s: it is stopped, or it waits for its start "
            "button or another client, or needs longer; the time is set by connect(…, timeout=…)"
        )

    def close(self) -> None:
        """Close the socket; closing twice is allowed."""
        self._socket.close()


def _close(connection: Api) -> None:
    # On an error of sending, traci leaves the socket open and keeps nothing that would close it.
    connected = connection._socket
    with contextlib.suppress(load_traci().FatalTraCIError, OSError, SimulationError):
        connection.close(False)
    if connected is not None:
        connected.close()
