"""Parsed conditions: plain values whose text is the condition as written."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from fogsim.errors import InputError, shown


@dataclass(frozen=True, slots=True)
class Reference:
    """A signal of a run, such as ``ego.speed``: its key in `SIGNALS` (``X.speed``) and arguments."""

    signal: str
    arguments: tuple[str, ...] = ()

    def __str__(self) -> str:
        head, bracket, tail = self.signal.partition("(")
        if bracket:
            return f"{head}({', '.join(map(_quoted, self.arguments))}){tail.partition(')')[2]}"
        subject, dot, attribute = self.signal.rpartition(".")
        if not (subject and self.arguments):
            return self.signal
        vehicle = self.arguments[0]
        return f"{_quoted(vehicle) if vehicle[0].isalpha() else _always_quoted(vehicle)}{dot}{attribute}"


_PLAIN = re.compile(r"[\w:#@.\-]+")


def _quoted(name: str) -> str:
    """A name as conditions need it, in quotation marks if necessary."""
    return name if _PLAIN.fullmatch(name) else _always_quoted(name)


def _always_quoted(name: str) -> str:
    return f"'{name}'" if '"' in name else f'"{name}"'


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number to compare with: its SI value, and its number and unit as written."""

    value: float
    number: str
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.number} {self.unit}".strip()


@dataclass(frozen=True, slots=True)
class Word:
    """A word to compare with, such as ``red``."""

    word: str

    def __str__(self) -> str:
        return _quoted(self.word)


Operand = Quantity | Word | Reference


class _OnlyInARun:
    __slots__ = ()

    def __bool__(self) -> bool:
        raise InputError(f"{shown(str(self))} is true or false only in a run; use all_of, any_of and negated")


@dataclass(frozen=True, slots=True)
class Comparison(_OnlyInARun):
    """A signal against a number, a word or another signal; `relation` is one of ``< <= > >= == != include``."""

    left: Reference
    relation: str
    right: Operand

    def __str__(self) -> str:
        return f"{self.left} {self.relation} {self.right}"


@dataclass(frozen=True, slots=True)
class Edge(_OnlyInARun):
    """A signal that passes a value now: ``falls below``, ``rises above``, ``becomes``, or ``changes`` (no value)."""

    left: Reference
    how: str
    right: Operand | None = None

    def __str__(self) -> str:
        return f"{self.left} {self.how}" + ("" if self.right is None else f" {self.right}")


@dataclass(frozen=True, slots=True)
class Flag(_OnlyInARun):
    """A signal that is true or false by itself, such as ``ego.collision``."""

    left: Reference

    def __str__(self) -> str:
        return str(self.left)


@dataclass(frozen=True, slots=True)
class Held(_OnlyInARun):
    """A condition that has been true without a break for a time [s]."""

    part: "Condition"
    duration: Quantity

    def __str__(self) -> str:
        inside = f"({self.part})" if isinstance(self.part, Not) else _bracketed(self.part)
        return f"{inside} for {self.duration}"


@dataclass(frozen=True, slots=True)
class Delayed(_OnlyInARun):
    """A condition that was true a time [s] ago."""

    part: "Condition"
    duration: Quantity

    def __str__(self) -> str:
        inside = f"({self.part})" if isinstance(self.part, Not) else _bracketed(self.part)
        return f"{inside} delayed {self.duration}"


@dataclass(frozen=True, slots=True)
class Not(_OnlyInARun):
    """A condition that is not true."""

    part: "Condition"

    def __str__(self) -> str:
        return f"not {_bracketed(self.part)}"


@dataclass(frozen=True, slots=True)
class AllOf(_OnlyInARun):
    """Conditions that are all true."""

    parts: tuple["Condition", ...]

    def __str__(self) -> str:
        return " and ".join(map(_bracketed, self.parts))


@dataclass(frozen=True, slots=True)
class AnyOf(_OnlyInARun):
    """Conditions, true if at least one is."""

    parts: tuple["Condition", ...]

    def __str__(self) -> str:
        return " or ".join(map(_bracketed, self.parts))


Condition = Comparison | Edge | Flag | Held | Delayed | Not | AllOf | AnyOf
"""A condition on a run."""


def _bracketed(part: Condition) -> str:
    return f"({part})" if isinstance(part, AllOf | AnyOf | Held | Delayed) else str(part)


def parts_of(condition: Condition) -> Iterator[Condition]:
    """A condition and all its parts, innermost first."""
    match condition:
        case AllOf(parts) | AnyOf(parts):
            for part in parts:
                yield from parts_of(part)
        case Not(part) | Held(part) | Delayed(part):
            yield from parts_of(part)
    yield condition


def comparisons_of(condition: Condition) -> tuple[Comparison | Edge | Flag, ...]:
    """Comparisons, edges and flags in a condition, each once, in written order."""
    asked = (part for part in parts_of(condition) if isinstance(part, Comparison | Edge | Flag))
    return tuple(dict.fromkeys(asked))


def signals_of(condition: Condition) -> tuple[Reference, ...]:
    """Signals in a condition, each once, in written order."""
    found: dict[Reference, None] = {}
    for asked in comparisons_of(condition):
        found[asked.left] = None
        if isinstance(asked, Comparison | Edge) and isinstance(asked.right, Reference):
            found[asked.right] = None
    return tuple(found)
