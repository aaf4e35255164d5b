"""``fogsim`` and ``python -m fogsim``: the command line, prepared for signals before its libraries are imported."""

import atexit
import contextlib
import gc
import os
import sys
import threading

from fogsim.core.files.standard_streams import open_standard_streams, print_any_text
from fogsim.core.interruption import leave_on_signals


def main() -> None:
    """Run the command line."""
    open_standard_streams()
    print_any_text()
    leave_on_signals()
    # Modules leave no cycles: each second of imports would take another tenth to look for them.
    gc.set_threshold(10_000)
    try:
        from fogsim.cli.app import main as run_command_line  # noqa: PLC0415 - after signals are provided for

        run_command_line()
    except SystemExit as end:
        if isinstance(end.code, int | None):
            _end_despite_threads(end.code or 0)
        raise
    except (ImportError, MemoryError) as error:
        # Libraries that find no memory for their code raise an ImportError.
        if isinstance(error, ImportError) and not any(words in str(error).lower() for words in _NO_MEMORY):
            raise
        print("error: too little memory; give FogSim more, or run less at once (-j)", file=sys.stderr)  # noqa: T201
        sys.exit(2)


_NO_MEMORY = ("failed to map segment", "cannot allocate memory")
"""How the loader of libraries words it."""


def _end_despite_threads(code: int) -> None:
    """End at once if a user's method has left threads, which Python would wait for."""
    if all(one.daemon or one is threading.main_thread() for one in threading.enumerate()):
        return
    atexit._run_exitfuncs()  # which Python runs only after those threads
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
