"""Conditions from Python operators on signals."""

import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum

from fogsim.conditions.moment import Moment
from fogsim.conditions.parsing import parse_condition
from fogsim.conditions.syntax import AllOf, AnyOf, Condition, Not
from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError, shown


class Kind(Enum):
    """Type of a signal."""

    NUMBER = "number"
    FLAG = "true or false"
    WORD = "word"
    WORDS = "words"
    LANE = "lane"


class Need(StrEnum):
    """What a run must have for a signal to have a value."""

    EGO = "an ego"
    FRAMES = "frames"
    """A camera and estimators, which also need an ego."""
    ROUTE = "a route (traffic.along)"
    """The ego's, or ``traffic.along``."""


@dataclass(frozen=True, slots=True)
class LanePlace:
    """A lane by its number from the right, from 0, and the number of lanes (None if unknown)."""

    number: int
    count: int | None

    @property
    def names(self) -> frozenset[str] | None:
        """Which of "right" and "left" it is; None if the left one is unknown."""
        if self.count is None:
            return frozenset({"right"}) if self.number == 0 else None
        return frozenset(name for name, at in (("right", 0), ("left", self.count - 1)) if self.number == at)


Value = float | bool | str | frozenset[str] | LanePlace | None
"""Current value of a signal; None if it has none."""


class Place(Enum):
    """Type of an argument in a signal's name."""

    VEHICLE = "vehicle"
    BANK = "fog bank"
    METHOD = "estimator"
    SIGNAL = "traffic light"
    EVENT = "event"
    LENGTH = "length"


@dataclass(frozen=True, slots=True)
class Signal:
    """A quantity of a run that conditions can refer to.

    `value` reads it from a moment and the arguments of its place holders. `unit` is SI, and `shown_unit` the one in
    messages ("" for the SI one). Values outside `least` … `most` cannot occur; `words` are the possible words (empty
    for any).
    """

    meaning: str
    value: Callable[..., Value]
    kind: Kind = Kind.NUMBER
    unit: str = ""
    shown_unit: str = ""
    least: float = -math.inf
    most: float = math.inf
    words: tuple[str, ...] = ()
    places: tuple[Place, ...] = ()
    needs: frozenset[Need] = frozenset()

    @property
    def stated_in(self) -> str:
        """Unit in messages."""
        return self.shown_unit or self.unit

    def read(self, moment: Moment, arguments: tuple[str, ...]) -> Value:
        """Value at a moment; None if it has none."""
        value: Value = self.value(moment, *arguments)
        return None if isinstance(value, float) and math.isnan(value) else value


_COMPARE: Mapping[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}


def combined(condition: Condition, inside: Callable[[Condition], bool | None]) -> bool | None:
    """Value of ``and``, ``or`` or ``not`` from the values of its parts; None if unknown."""
    match condition:
        case Not(part):
            return _not(inside(part))
        case AllOf(parts):
            return _all([inside(part) for part in parts])
        case AnyOf(parts):
            return _not(_all([_not(inside(part)) for part in parts]))
    raise TypeError(f"expected and, or, or not; got {condition}")


def _not(part: bool | None) -> bool | None:
    return None if part is None else not part


def _all(parts: list[bool | None]) -> bool | None:
    return False if False in parts else None if None in parts else True


def compared(value: Value, relation: str, operand: Value) -> bool | None:
    """Compare a signal's value by ``<``, ``<=``, ``>``, ``>=``, ``==``, ``!=`` or ``include``; None if unknown."""
    if value is None or operand is None:
        return None
    if isinstance(value, frozenset):
        return operand in value
    if isinstance(value, LanePlace) and isinstance(operand, str):
        names = value.names
        return None if names is None else (operand in names) == (relation == "==")
    if isinstance(value, bool | str):
        word = str(value).lower() if isinstance(value, bool) else value
        return (operand == word) == (relation == "==")
    number = float(value.number) if isinstance(value, LanePlace) else value
    return _COMPARE[relation](number, operand) if isinstance(operand, int | float) else None


def passed(before: Value, now: Value, how: str, operand: Value) -> bool | None:
    """Whether a signal ``falls below``, ``rises above``, ``becomes`` or ``changes`` between steps; None if unknown."""
    if how == "changes":
        return _without_count(before) != _without_count(now)
    relation = {"falls below": "<", "rises above": ">", "becomes": "=="}[how]
    earlier, later = compared(before, relation, operand), compared(now, relation, operand)
    return None if earlier is None or later is None else later and not earlier


def _without_count(value: Value) -> Value:
    """A lane's number alone, which is the same lane on a wider road."""
    return value.number if isinstance(value, LanePlace) else value


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
