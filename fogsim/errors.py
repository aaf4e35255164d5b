"""Errors that FogSim raises for its users: what was expected, what came, where, and what is allowed."""

import difflib
from collections.abc import Iterable, Mapping
from pathlib import Path

_LONGEST_SHOWN = 80
"""Most characters of a user's value that a message repeats."""


class FogSimError(Exception):
    """Base of every error that a user can cause or mend; the command line prints it and exits with 2."""

    def __str__(self) -> str:
        """Give the message without raw control characters, whatever names and values it repeats."""
        return printable(super().__str__())


class InputError(FogSimError, ValueError):
    """A file, key or argument that does not fit; the message names it, its value and what is allowed."""


class MissingDependencyError(FogSimError, RuntimeError):
    """A library of the operating system or of Python is not there; the message says how to get it."""


class SimulationError(FogSimError, RuntimeError):
    """The traffic simulation refused, ended or was lost."""


class SimulationRunningError(SimulationError):
    """A simulation runs in this process already, and only one can."""


class MethodError(FogSimError, RuntimeError):
    """A method that a user brought failed; the message names it, its error and the line of its code."""


class RenamedWarning(FutureWarning):
    """A value has a new name; the old one still works. The message gives the new name."""


class UnplayedWarning(UserWarning):
    """Events of a scenario were not played, or vehicles that it names were never there."""


class LeftOutWarning(UserWarning):
    """Something of a foreign file has no counterpart in FogSim, and the run goes without it."""


class RecorderError(FogSimError, RuntimeError):
    """Recorders of a run failed; the message names them, and where the others' results are."""

    def __init__(self, failures: Mapping[str, str], directory: Path) -> None:
        reasons = "; ".join(f"the recorder {name} failed: {reason}" for name, reason in failures.items())
        super().__init__(f"{reasons}; what else was recorded is kept in {directory}")


class UnknownNameError(InputError):
    """A name that a registry does not know; the message lists the known ones and the nearest.

    With one argument, that is the message: so processes pass the error on.
    """

    def __init__(self, kind: object, name: object = None, known: Iterable[str] | None = None) -> None:
        super().__init__(
            kind if known is None else f"unknown {kind} {shown(name)}; {suggest(str(name), sorted(known))}"
        )


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
    near = nearest(name, names)
    return f"known: {listing}" if near is None else f"did you mean {near!r}? Known: {listing}"


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Which of the known names was probably meant; None if none is near.

    Parameters
    ----------
    name : str
        What was given.
    known : iterable of str
        What is allowed.
    """
    names = list(known)
    if name in names:
        return name
    return next(iter(difflib.get_close_matches(name, names, n=1, cutoff=0.5)), None)


def nearest_of(name: str, known: Iterable[str], most: int) -> list[str]:
    """The nearest of many known names, the nearest first; however far they are.

    Parameters
    ----------
    name : str
        What was given.
    known : iterable of str
        What is allowed.
    most : int
        How many to give at most.
    """
    return difflib.get_close_matches(name, list(known), n=most, cutoff=0.0)


def shown(value: object) -> str:
    """A user's value as messages repeat it: `repr`, cut short in the middle if it is long.

    Parameters
    ----------
    value : object
        Anything.
    """
    try:
        text = repr(value)
    except RecursionError:
        text = f"a {type(value).__name__} that is nested too deeply"
    if "\n" in text:
        # Arrays are written in several lines.
        text = " ".join(text.split())
    half = _LONGEST_SHOWN // 2
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:half]} … {text[-half:]}"


def printable(text: str, *, in_one_line: bool = False) -> str:
    r"""Escape characters that cannot be seen, as Python writes them.

    Control characters would be obeyed by terminals, and bytes of names that are no text cannot be printed.

    Parameters
    ----------
    text : str
        Any text.
    in_one_line : bool
        Escape line breaks, too.
    """
    kept = "" if in_one_line else "\n"
    if text.isprintable():
        return text
    return "".join(
        one if one.isprintable() or one in kept else one.encode("unicode_escape", "backslashreplace").decode("ascii")
        for one in text
    )


def is_name(text: str) -> bool:
    """Whether a text can name something in files, folders, pages and SUMO: visible, no ``<``, no blank at its ends.

    Parameters
    ----------
    text : str
        Any text.
    """
    return bool(text) and text.isprintable() and text == text.strip() and "<" not in text
