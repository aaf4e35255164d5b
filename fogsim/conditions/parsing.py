"""The syntax of conditions: ``ego.speed > 90 km/h and gap(ego, slow) falls below 80 m``."""

import math
import re
from collections import deque
from collections.abc import Mapping, Sequence

from fogsim.conditions.signal import Kind, Place, Signal
from fogsim.conditions.signals import SIGNALS
from fogsim.conditions.syntax import (
    AllOf,
    AnyOf,
    Comparison,
    Condition,
    Delayed,
    Edge,
    Flag,
    Held,
    Not,
    Operand,
    Quantity,
    Reference,
    Word,
)
from fogsim.errors import shown, suggest
from fogsim.units.quantities import example_of, parse_quantity

_NUMBER = re.compile(r"[-+]?(?:(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?|inf\b)")
_UNIT_PART = r"(?!(?:and|or|not|for|delayed)\b)[^\W\d_]+(?:\^?-?\d+)?"
_UNIT = re.compile(rf"\s*(%|°|{_UNIT_PART}(?:\s*[/*·]\s*{_UNIT_PART})*)")
_NAME = re.compile(r"[^\W\d][\w:#@.\-]*")
_QUOTED = re.compile(r"\"([^\"]+)\"|'([^']+)'")
_OF_QUOTED = re.compile(rf"(?:{_QUOTED.pattern})\.")
_ARGUMENT = re.compile(r"[^\s,()\"'][^,()\"']*")
_OPERATOR = re.compile(r"<=|>=|==|!=|<|>|is\s+not\b|is\b")
_SPELLED = {"is": "==", "is not": "!="}
_HOW = re.compile(r"(falls\s+below|rises\s+above|becomes|changes|includes?)\b")
_NOT, _FOR = re.compile(r"not\b"), re.compile(r"(for|delayed)\b")
_AGAIN = re.compile(r"(and|or|not|for|delayed)\b")

OPERATORS = ("<", "<=", ">", ">=", "==", "!=")
"""Operators of comparisons."""

_MOST_CHARACTERS = 10_000
"""Longest condition that is read."""

DEEPEST = 20
"""Maximum depth of brackets."""


def parse_condition(written: object) -> Condition:
    """Parse a condition; ValueError with what is allowed or nearest if it is malformed.

    Text; or a mapping from signals to the rest (``{"ego.speed": "> 90 km/h"}``), which must all hold; or ``all:``,
    ``any:`` with a list of conditions, ``not:`` with one. A list stands for all of its conditions.
    """
    return _read(written, 0)


def parse_signal(text: str) -> Reference:
    """Parse the name of one signal with its arguments; ValueError with what is nearest if there is none."""
    return _Text(text).signal()


def _read(written: object, depth: int) -> Condition:
    if depth > DEEPEST:
        raise ValueError(f"conditions may be {DEEPEST} deep inside one another")
    if isinstance(written, str):
        return _Text(written).condition()
    if isinstance(written, Mapping) and written:
        return _joined(AllOf, [_entry(key, value, depth) for key, value in mended(written).items()])
    if isinstance(written, Sequence) and written:
        return _joined(AllOf, [_read(one, depth + 1) for one in written])
    raise ValueError(f"expected a condition such as 'ego.speed > 90 km/h', got {shown(written)}")


def _entry(key: object, value: object, depth: int) -> Condition:
    if key in ("all", "any") and isinstance(value, Sequence) and value and not isinstance(value, str):
        return _joined(AllOf if key == "all" else AnyOf, [_read(one, depth + 1) for one in value])
    if key == "not":
        return Not(_read(value, depth + 1))
    if value is None or isinstance(value, bool):
        condition = _Text(str(key)).condition()
        return Not(condition) if value is False else condition
    # Anything other than text or a number is refused with its own message when it is parsed as text.
    rest = str(value).strip()
    relation = "" if _OPERATOR.match(rest) or _HOW.match(rest) else "== "
    return _Text(f"{key} {relation}{rest}").condition()


def mended(written: Mapping[object, object]) -> dict[object, object]:
    """A mapping with the entries joined that YAML split at commas.

    In ``{gap(ego, slow): "< 80 m"}`` YAML reads the comma as one between two entries, and also in ``{always: gap(ego,
    slow) > 5 m}``.
    """
    result: dict[object, object] = {}
    pending = deque(written.items())
    while pending:
        key, value = pending.popleft()
        while pending and value is None and not _is_closed(str(key)):
            further, value = pending.popleft()
            key = f"{key}, {further}"
        while pending and isinstance(value, str) and not _is_closed(value) and pending[0][1] is None:
            value = f"{value}, {pending.popleft()[0]}"
        result[key] = value
    return result


def _is_closed(text: str) -> bool:
    return text.count("(") <= text.count(")")


def _joined(kind: type[AllOf] | type[AnyOf], parts: Sequence[Condition]) -> Condition:
    """Conditions joined into one, with nested ones of the same type merged."""
    if len(parts) == 1:
        return parts[0]
    return kind(tuple(inner for part in parts for inner in (part.parts if isinstance(part, kind) else (part,))))


class _Text:
    """Parses one text."""

    def __init__(self, text: str) -> None:
        if len(text) > _MOST_CHARACTERS:
            raise ValueError(f"a condition has at most {_MOST_CHARACTERS} characters, got {shown(text)}")
        self._text, self._at, self._depth = text, 0, 0

    def condition(self) -> Condition:
        """Parse all of it."""
        result = self._any()
        if self._rest():
            raise self._wrong("'and', 'or', 'for', 'delayed' or the end")
        return result

    def signal(self) -> Reference:
        """Parse all of it as the name of a signal."""
        result = self._reference()
        if self._rest():
            raise self._wrong("the end of the signal's name")
        return result

    def _any(self) -> Condition:
        parts = [self._all()]
        while self._take(re.compile(r"or\b")):
            parts.append(self._all())
        return _joined(AnyOf, parts)

    def _all(self) -> Condition:
        parts = [self._held()]
        while self._take(re.compile(r"and\b")):
            parts.append(self._held())
        return _joined(AllOf, parts)

    def _held(self) -> Condition:
        if self._take(_NOT):
            part = self._held() if _NOT.match(self._rest()) else self._single()
            if time := self._take(_FOR):
                raise ValueError(f"{shown(self._text)}: write '(not …) {time} …' or 'not (… {time} …)'")
            return Not(part)
        part = self._single()
        if self._take(re.compile(r"for\b")):
            return Held(part, self._quantity("s"))
        if self._take(re.compile(r"delayed\b")):
            return Delayed(part, self._quantity("s"))
        return part

    def _single(self) -> Condition:
        if not self._take(re.compile(r"\(")):
            return self._test()
        self._depth += 1
        if self._depth > DEEPEST:
            raise ValueError(f"brackets may be {DEEPEST} deep inside one another")
        inside = self._any()
        if not self._take(re.compile(r"\)")):
            raise self._wrong("')'")
        self._depth -= 1
        return inside

    def _test(self) -> Condition:
        left = self._reference()
        kind = SIGNALS[left.signal].kind
        operator, how = self._take(_OPERATOR), self._take(_HOW)
        relation = " ".join((operator or how).split())
        relation = _SPELLED.get(relation, relation)
        if relation == "changes":
            return Edge(left, relation)
        if not relation:
            if kind is not Kind.FLAG:
                raise self._wrong(f"{_relations(kind)} after {left}")
            return Flag(left)
        if relation not in _allowed(kind):
            raise ValueError(f"{shown(self._text)}: {left} goes with {_relations(kind)}, not with {relation!r}")
        right = self._operand(left, operator or how)
        relation = relation.removesuffix("s") if relation == "includes" else relation
        return Comparison(left, relation, right) if operator or relation == "include" else Edge(left, relation, right)

    def _reference(self) -> Reference:
        subject = self._take(_QUOTED)
        name = self._take(re.compile(r"\.[A-Za-z_]\w*")) if subject else self._take(_NAME)
        if not name:
            raise self._wrong("a signal such as ego.speed or gap(ego, slow)")
        if subject:
            return self._found(f"X{name}", (subject,), f'"{subject}"{name}')
        if self._rest().startswith("("):
            arguments = self._arguments()
            attribute = self._take(re.compile(r"\.[A-Za-z_]\w*"))
            return self._call(name, arguments, attribute)
        if name in SIGNALS and not SIGNALS[name].places:
            return Reference(name)
        vehicle, _, attribute = name.rpartition(".")
        return self._found(f"X.{attribute}", (vehicle,), name) if vehicle else self._unknown(name)

    def _arguments(self) -> tuple[str, ...]:
        self._take(re.compile(r"\("))
        found = []
        while True:
            argument = self._take(_QUOTED) or self._take(_ARGUMENT).strip()
            if not argument:
                raise self._wrong("a name")
            found.append(argument)
            if self._take(re.compile(r"\)")):
                return tuple(found)
            if not self._take(re.compile(r",")):
                raise self._wrong("',' or ')'")

    def _call(self, name: str, arguments: tuple[str, ...], attribute: str) -> Reference:
        for signal in SIGNALS:
            head, bracket, tail = signal.partition("(")
            inside, _, end = tail.partition(")")
            if bracket and (head, end) == (name, attribute) and len(inside.split(",")) == len(arguments):
                return self._found(signal, arguments, "")
        return self._unknown(f"{name}({', '.join(arguments)}){attribute}")

    def _found(self, signal: str, arguments: tuple[str, ...], written: str) -> Reference:
        if signal not in SIGNALS:
            return self._unknown(written)
        for place, argument in zip(SIGNALS[signal].places, arguments, strict=True):
            if place is Place.BANK and not argument.isdecimal():
                raise ValueError(f"{shown(self._text)}: a fog bank is named by its number, from 0; got {argument!r}")
            if place is Place.LENGTH:
                try:
                    parse_quantity(argument, "m")
                except ValueError as error:
                    raise ValueError(f"{shown(self._text)}: {error}") from None
        return Reference(signal, arguments)

    def _unknown(self, written: str) -> Reference:
        subject, dot, _ = written.rpartition(".")
        known = list(SIGNALS)
        if dot and "(" not in written:
            # Signals of one vehicle are likelier to be meant than all others.
            of_vehicle = {key.partition(".")[2] for key in SIGNALS if key.startswith(("X.", f"{subject}."))}
            known = [f"{subject}.{name}" for name in sorted(of_vehicle)]
            if subject in ("fog", "belief"):
                known = [key for key in SIGNALS if key.startswith(f"{subject}.")]
            return _refuse(f"{shown(self._text)}: unknown signal {shown(written)}; {suggest(written, known)}")
        name = written.partition("(")[0]
        same = [key for key in SIGNALS if key.partition("(")[0] == name]
        hint = f"it is {' or '.join(same)}" if same else suggest(written, known)
        return _refuse(f"{shown(self._text)}: unknown signal {shown(written)}; {hint}")

    def _operand(self, left: Reference, relation: str) -> Operand:
        signal = SIGNALS[left.signal]
        if signal.kind in (Kind.NUMBER, Kind.LANE) and _NUMBER.match(self._rest()):
            return self._checked(left, signal, self._quantity(signal.unit))
        if signal.kind is Kind.NUMBER:
            if not (_NAME.match(self._rest()) or _OF_QUOTED.match(self._rest())):
                raise self._wrong(f"a quantity such as {example_of(signal.stated_in)!r} after {relation}")
            right = self._reference()
            other = SIGNALS[right.signal]
            if other.kind is not Kind.NUMBER or other.unit != signal.unit:
                raise ValueError(
                    f"{shown(self._text)}: {left} [{signal.unit or '-'}] does not compare with {right} "
                    f"[{other.unit or '-' if other.kind is Kind.NUMBER else other.kind.value}]"
                )
            return right
        word = self._take(_QUOTED) or self._take(re.compile(r"[\w:#@.\-]+"))
        if not word or _AGAIN.fullmatch(word):
            raise self._wrong(f"a word after {relation}")
        allowed = ("true", "false") if signal.kind is Kind.FLAG else signal.words
        if allowed and word not in allowed:
            raise ValueError(f"{shown(self._text)}: unknown value {word!r} of {left}; {suggest(word, allowed)}")
        return Word(word)

    def _checked(self, left: Reference, signal: Signal, quantity: Quantity) -> Quantity:
        if signal.kind is Kind.LANE and not quantity.value.is_integer():
            raise ValueError(f"{shown(self._text)}: {left} is a whole number, right or left; got {quantity}")
        return quantity

    def _quantity(self, unit: str) -> Quantity:
        number = self._take(_NUMBER)
        if not number:
            raise self._wrong(f"a quantity such as {example_of(unit)!r}")
        match = _UNIT.match(self._rest())
        written = match[1] if match else ""
        self._at += 0 if match is None else match.end() + len(self._text[self._at :]) - len(self._rest())
        try:
            value = parse_quantity(f"{number} {written}".strip(), unit)
        except ValueError as error:
            raise ValueError(f"{shown(self._text)}: {error}") from None
        if math.isnan(value):
            raise self._wrong("a number")
        return Quantity(value, number, written)

    def _rest(self) -> str:
        return self._text[self._at :].lstrip()

    def _take(self, pattern: re.Pattern[str]) -> str:
        """The next token that matches a pattern; empty if none does."""
        match = pattern.match(self._rest())
        if match is None:
            return ""
        self._at = len(self._text) - len(self._rest()) + match.end()
        return next((group for group in match.groups() if group is not None), match[0])

    def _wrong(self, expected: str) -> ValueError:
        rest = self._rest()
        return ValueError(f"{shown(self._text)}: expected {expected}, got {shown(rest) if rest else 'the end'}")


def _refuse(message: str) -> Reference:
    raise ValueError(message)


def _allowed(kind: Kind) -> tuple[str, ...]:
    """Relations that fit a type of signal."""
    return {
        Kind.NUMBER: (*OPERATORS, "falls below", "rises above", "becomes"),
        Kind.LANE: (*OPERATORS, "falls below", "rises above", "becomes"),
        Kind.FLAG: ("==", "!=", "becomes"),
        Kind.WORD: ("==", "!=", "becomes"),
        Kind.WORDS: ("include", "includes", "becomes")[:2],
    }[kind]


def _relations(kind: Kind) -> str:
    return ", ".join((*_allowed(kind), "changes"))
