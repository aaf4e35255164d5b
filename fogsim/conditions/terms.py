"""Conditions from Python operators on signals."""

from dataclasses import dataclass

from fogsim.conditions.parsing import parse_condition
from fogsim.conditions.syntax import Condition
from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError, shown


def _parsed(written: str | dict[str, object]) -> Condition:
    try:
        return parse_condition(written)
    except ValueError as error:
        raise InputError(f"condition {shown(written)}: {error}") from None


@checked_parameters
@dataclass(frozen=True, slots=True)
class SignalTerm:
    """A signal of the run, from which conditions are built: ``signal("ego.ttc") >= "1.5 s"``.

    Attributes
    ----------
    text : str
        The signal as in files.
    """

    text: str

    def __str__(self) -> str:
        return self.text

    def __bool__(self) -> bool:
        raise InputError(f"{shown(self.text)} is true or false only in a run; use all_of, any_of and negated")

    def __lt__(self, other: "Comparand") -> Condition:
        return condition(f"{self} < {other}")

    def __le__(self, other: "Comparand") -> Condition:
        return condition(f"{self} <= {other}")

    def __gt__(self, other: "Comparand") -> Condition:
        return condition(f"{self} > {other}")

    def __ge__(self, other: "Comparand") -> Condition:
        return condition(f"{self} >= {other}")

    def is_(self, word: str) -> Condition:
        """The signal is a word, as a lane may be ``right``.

        Parameters
        ----------
        word : str
            The word.
        """
        return condition(f"{self} == {word}")

    def is_not(self, word: str) -> Condition:
        """The signal is not a word.

        Parameters
        ----------
        word : str
            The word.
        """
        return condition(f"{self} != {word}")

    def includes(self, word: str) -> Condition:
        """A word is among the signal's words, as a lamp is among lit ones.

        Parameters
        ----------
        word : str
            The word.
        """
        return condition(f"{self} include {word}")

    def falls_below(self, quantity: str) -> Condition:
        """The signal was not below a quantity one camera period before, and is now.

        Parameters
        ----------
        quantity : str
            With its unit.
        """
        return condition(f"{self} falls below {quantity}")

    def rises_above(self, quantity: str) -> Condition:
        """The signal was not above a quantity one camera period before, and is now.

        Parameters
        ----------
        quantity : str
            With its unit.
        """
        return condition(f"{self} rises above {quantity}")

    def becomes(self, word: str) -> Condition:
        """The signal was not a word one camera period before, and is now.

        Parameters
        ----------
        word : str
            The word.
        """
        return condition(f"{self} becomes {word}")

    def changes(self) -> Condition:
        """The signal differs from its value one camera period before."""
        return condition(f"{self} changes")


Comparand = str | SignalTerm
"""The operand of a comparison: a quantity with its unit, or another signal."""


def signal(text: str) -> SignalTerm:
    """A signal of the run.

    Parameters
    ----------
    text : str
        As in files: ``ego.ttc``, ``gap(ego, slow)``, ``fog.visibility_at_camera``.
    """
    return SignalTerm(text)


def condition(text: str | SignalTerm) -> Condition:
    """A condition from its text, or from a signal that is true or false by itself.

    Parameters
    ----------
    text : str or SignalTerm
        As in files.

    Raises
    ------
    InputError
        If it is not a condition.
    """
    return _parsed(str(text))


def all_of(*conditions: Condition) -> Condition:
    """All conditions hold.

    Parameters
    ----------
    *conditions : Condition
        At least one.
    """
    return _parsed({"all": [str(one) for one in conditions]})


def any_of(*conditions: Condition) -> Condition:
    """At least one of the conditions holds.

    Parameters
    ----------
    *conditions : Condition
        At least one.
    """
    return _parsed({"any": [str(one) for one in conditions]})


def negated(one: Condition) -> Condition:
    """A condition is false.

    Parameters
    ----------
    one : Condition
        The condition.
    """
    return _parsed({"not": str(one)})


def held(one: Condition, time: str) -> Condition:
    """A condition has been true for a time without a break.

    Parameters
    ----------
    one : Condition
        The condition.
    time : str
        With its unit.
    """
    return condition(f"({one}) for {time}")
