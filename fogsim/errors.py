"""Errors that FogSim raises for its users: what was expected, what came, where, and what is allowed."""

import difflib
from collections.abc import Iterable, Mapping
from pathlib import Path


class FogSimError(Exception):
    """Base of every error that a user can cause or mend; the command line prints it and exits with 2."""


class InputError(FogSimError, ValueError):
    """A file, key or argument that does not fit; the message names it, its value and what is allowed."""


class MissingDependencyError(FogSimError, RuntimeError):
    """A library of the operating system or of Python is not there; the message says how to get it."""


class SimulationError(FogSimError, RuntimeError):
    """The traffic simulation refused, ended or was lost."""


class SimulationRunningError(SimulationError):
    """A simulation runs in this process already, and only one can."""


class RecorderError(FogSimError, RuntimeError):
    """Recorders of a run failed; the message names them, and where the others' results are."""

    def __init__(self, failures: Mapping[str, str], directory: Path) -> None:
        told = "; ".join(f"the recorder {name} failed: {reason}" for name, reason in failures.items())
        super().__init__(f"{told}; what else was recorded is kept in {directory}")


class UnknownNameError(InputError):
    """A name that a registry does not know; the message lists the known ones and the nearest."""

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        names = sorted(known)
        super().__init__(f"unknown {kind} {name!r}; {suggest(str(name), names)}")


def suggest(name: str, known: Iterable[str]) -> str:
    """Say which names are allowed and, where one is near, which was probably meant.

    Parameters
    ----------
    name : str
        What was given.
    known : iterable of str
        What is allowed.

    Returns
    -------
    str
        ``"did you mean 'x'? Known: x, y, z"`` or ``"known: x, y, z"``.
    """
    names = list(known)
    listing = ", ".join(names) if names else "none"
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    return f"did you mean {near[0]!r}? Known: {listing}" if near else f"known: {listing}"
