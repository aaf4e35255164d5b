"""Standard streams of a process that was started without them, such as a daemon or a command with ``>&-``."""

import io
import os
import sys


def open_standard_streams() -> None:
    """Open /dev/null for each closed descriptor 0, 1 and 2, and as ``sys.stdin`` and so on.

    Otherwise the next file or pipe gets the number and receives what libraries print.
    """
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(descriptor)
        except OSError:
            # This is the lowest free number; children inherit it like any standard stream.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
        if getattr(sys, name) is None:
            mode = "w" if descriptor else "r"
            setattr(sys, name, open(descriptor, mode, encoding="utf-8", closefd=False))  # noqa: SIM115 - for the process's life


def print_any_text() -> None:
    """Let stdout and stderr print characters that the locale's encoding lacks as escapes; Python raises an error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
