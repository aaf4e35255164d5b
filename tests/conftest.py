"""What tests of several folders use."""

import contextlib
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
import sumo
from hypothesis import HealthCheck, settings

from tests.helpers.attached import libsumo_in_town, traci_in_town
from tests.helpers.command import Command, Ran, run_command

# How long an example takes says more about the machine than about what is tested.
settings.register_profile("fogsim", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("fogsim")

SumoProcess = Callable[..., contextlib.AbstractContextManager[tuple[int, "subprocess.Popen[bytes]"]]]


@pytest.fixture(autouse=True)
def _no_simulation_left() -> Iterator[None]:
    """Find tests that leave SUMO running: a process has only one, so that whatever test comes next would fail."""
    yield
    library = sys.modules.get("libsumo")
    assert library is None or not library.isLoaded(), "this test has left a SUMO simulation running"


@pytest.fixture(scope="session")
def free_port() -> Callable[[], int]:
    """Ports that the operating system chooses."""

    def choose() -> int:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            return int(probe.getsockname()[1])

    return choose


@pytest.fixture(scope="session")
def sumo_process(free_port: Callable[[], int]) -> SumoProcess:
    """Start a real SUMO on loopback: gives its port and process; killed at the end if it still runs."""
    # The program itself: the one on the path is a script that starts it, and would leave it behind when killed.
    program = Path(sumo.SUMO_HOME, "bin", "sumo.exe" if sys.platform == "win32" else "sumo")

    @contextlib.contextmanager
    def start(arguments: Sequence[str], clients: int = 1) -> Iterator[tuple[int, "subprocess.Popen[bytes]"]]:
        port = free_port()
        options = ["--remote-port", str(port), "--num-clients", str(clients)]
        command = [program, *arguments, *options]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            try:
                yield port, process
            finally:
                process.kill()

    return start


@pytest.fixture
def libsumo() -> Iterator[Any]:
    """A town that a user simulates in this process."""
    with libsumo_in_town() as library:
        yield library


@pytest.fixture(params=["libsumo", "traci"])
def api(request: pytest.FixtureRequest, sumo_process: SumoProcess) -> Iterator[Any]:
    """A town that a user simulates, in this process and over a connection."""
    with libsumo_in_town() if request.param == "libsumo" else traci_in_town(sumo_process) as simulation:
        yield simulation


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Command:
    """Run a command line in this process, in a folder or here, and capture what it prints."""

    def run(*arguments: str, cwd: Path | None = None) -> Ran:
        capsys.readouterr()
        with contextlib.chdir(cwd or "."):
            code = run_command(*arguments)
        told = capsys.readouterr()
        return Ran(code, told.out, told.err)

    return run


def pytest_configure() -> None:
    """Let signals reach children also where they are ignored here: in the background of a script, and by nohup.

    What is ignored is so in children too; a handler is not, even one that does nothing.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda *_: None)


@pytest.fixture(autouse=True)
def _own_signal_handlers() -> Iterator[None]:
    """Take back the handlers that the command line's `main` leaves, as a program's last."""
    found = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield
    for number, handler in found.items():
        if signal.getsignal(number) is not handler:
            signal.signal(number, handler)
