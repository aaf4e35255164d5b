"""The libsumo library: imported on first use, and asked whether a simulation runs in this process already."""

import contextlib
import io
import os
import sys
import tempfile
from collections.abc import Iterator
from types import ModuleType

from fogsim.errors import MissingDependencyError, SimulationError, SimulationRunningError


def load_libsumo() -> ModuleType:
    """Import libsumo without the lines that it prints on the way.

    Raises
    ------
    MissingDependencyError
        If libsumo or a library of the system that it needs is missing.
    """
    try:
        # libsumo prints a remark about other packages' versions to stdout, which may carry JSON of ours.
        with contextlib.redirect_stdout(io.StringIO()):
            import libsumo  # noqa: PLC0415 - importing fogsim must not load SUMO
    except ImportError as error:
        raise MissingDependencyError(
            f"libsumo cannot be loaded ({error}); install it with: pip install libsumo, "
            "and on Debian/Ubuntu: sudo apt-get install libgl1 libxrender1 libatomic1"
        ) from error
    module: ModuleType = libsumo
    return module


def start_simulation(libsumo: ModuleType, arguments: list[str], running_here: bool) -> None:
    """Start SUMO in this process, or load it anew if this caller runs it already.

    Parameters
    ----------
    libsumo : module
        The library.
    arguments : list of str
        SUMO's command line without the program's name.
    running_here : bool
        True if the simulation that runs in this process is the caller's own.

    Raises
    ------
    SimulationRunningError
        If another simulation runs in this process.
    SimulationError
        If SUMO refuses its input; the message holds SUMO's own words.
    """
    if libsumo.isLoaded() and not running_here:
        raise SimulationRunningError(
            "another SUMO simulation runs in this process, and libsumo can hold only one: close the other one first, "
            "or run this one in its own process (gymnasium.make_vec and AsyncVectorEnv do that for environments)"
        )
    with captured_stderr() as words:
        try:
            if running_here:
                libsumo.load(arguments)
            else:
                libsumo.start(["sumo", *arguments])
        except libsumo.TraCIException as error:
            failure = error
        else:
            return
    if libsumo.isLoaded():
        libsumo.close()
    said = " ".join(line.strip() for line in words if line.strip()) or str(failure)
    raise SimulationError(f"SUMO cannot load the scenario: {said}")


@contextlib.contextmanager
def captured_stderr() -> Iterator[list[str]]:
    """Collect what native code writes to the process's stderr; the list is filled on leaving."""
    lines: list[str] = []
    sys.stderr.flush()
    saved = os.dup(2)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), 2)
        try:
            yield lines
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            file.seek(0)
            lines += file.read().decode(errors="replace").splitlines()
