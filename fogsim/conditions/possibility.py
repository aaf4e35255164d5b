"""Whether a condition can be true, and whether it can be false, given the possible values of its signals."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fogsim.conditions.logic import combined, compared
from fogsim.conditions.moment import EGO
from fogsim.conditions.signal import Kind, LanePlace, Need, Place, Value
from fogsim.conditions.signals import NO_LEADER, SIGNALS
from fogsim.conditions.syntax import (
    Comparison,
    Condition,
    Delayed,
    Edge,
    Flag,
    Held,
    Operand,
    Quantity,
    Reference,
    Word,
    comparisons_of,
    parts_of,
    signals_of,
)
from fogsim.conditions.watching import shown_value
from fogsim.errors import shown, suggest

_LEADER = Reference("ego.leader")


@dataclass(frozen=True, slots=True)
class RunContent:
    """What conditions can refer to in a run: its needs, estimators, number of fog banks, and script entries."""

    needs: frozenset[Need]
    methods: tuple[str, ...] = ()
    banks: int = 0
    events: tuple[str, ...] = ()


def condition_mistakes(condition: Condition, content: RunContent) -> Iterator[str]:
    """Parts of a condition that a run cannot evaluate."""
    for reference in signals_of(condition):
        signal = SIGNALS[reference.signal]
        lacking = signal.needs - content.needs
        if EGO in vehicles_of(reference) and Need.EGO not in content.needs:
            lacking |= {Need.EGO}
        if lacking:
            yield f"{reference} needs {' and '.join(sorted(lacking))}, and this run has none"
            continue
        for place, argument in zip(signal.places, reference.arguments, strict=True):
            if place is Place.BANK and int(argument) >= content.banks:
                yield f"{reference}: there is no fog.banks.{argument}; the fog has {content.banks or 'no'} banks"
            known = {Place.METHOD: content.methods, Place.EVENT: content.events}.get(place)
            if known is not None and argument not in known:
                yield f"{reference}: unknown {place.value} {shown(argument)}; {suggest(argument, known)}"


def vehicles_of(reference: Reference) -> tuple[str, ...]:
    """Vehicles that a signal refers to."""
    return _names(reference, Place.VEHICLE)


def vehicles_in(condition: Condition) -> tuple[str, ...]:
    """Vehicles that a condition names: those of its signals, and those that are compared with ``ego.leader``."""
    named = [name for reference in signals_of(condition) for name in vehicles_of(reference)]
    for one in comparisons_of(condition):
        if one.left == _LEADER and isinstance(one, Comparison | Edge) and isinstance(one.right, Word):
            named += [one.right.word] * (one.right.word != NO_LEADER)
    return tuple(dict.fromkeys(named))


def lights_of(condition: Condition) -> tuple[str, ...]:
    """Traffic lights that a condition refers to."""
    return tuple(name for reference in signals_of(condition) for name in _names(reference, Place.SIGNAL))


def _names(reference: Reference, kind: Place) -> tuple[str, ...]:
    places = SIGNALS[reference.signal].places
    return tuple(name for place, name in zip(places, reference.arguments, strict=True) if place is kind)


Limits = Mapping[str, tuple[float, float]]
"""Least and greatest possible values of signals in one run, by their keys in `SIGNALS`, in SI units."""

_NO_LIMITS: Limits = {}

_MOST_CASES = 20_000
"""Maximum number of combinations; a condition with more counts as possibly true and possibly false."""

_OTHER = "\0"
"""A word that represents all unnamed ones."""


def outcomes(condition: Condition, limits: Limits = _NO_LIMITS) -> frozenset[bool]:
    """Values that a condition can have in some run: true, false or both; `limits` narrow the ranges of signals.

    Each signal takes every value that makes a difference to the condition; signals are assumed to be independent.
    """
    asked = comparisons_of(condition)
    values = {signal: list(_values(signal, asked, limits)) for signal in _measured(asked)}
    free = {part: list(_free(part, limits)) for part in parts_of(condition) if _is_free(part)}
    sizes = [*(len(those) for those in values.values()), *(len(those) for those in free.values())]
    if math.prod(sizes) > _MOST_CASES:
        return frozenset({True, False})
    return frozenset(
        _evaluated(condition, dict(zip(values, case, strict=True)), dict(zip(free, known, strict=True)))
        for case in itertools.product(*values.values())
        for known in itertools.product(*free.values())
    )


def pointless_parts(condition: Condition, limits: Limits = _NO_LIMITS, ego: str = EGO) -> Iterator[str]:
    """Parts of a condition that compare a signal with itself or can never be true, with the reason."""
    for reference in signals_of(condition):
        vehicles = [EGO if name == ego else name for name in vehicles_of(reference)]
        if len(set(vehicles)) < len(vehicles):
            yield f"{reference} names the same vehicle twice"
    for part in parts_of(condition):
        match part:
            case Comparison(left, _, right) | Edge(left, _, right) if left == right:
                yield f"{part} compares {left} with itself"
            case Held(_, duration) | Delayed(_, duration) if not 0.0 < duration.value < math.inf:
                word = "for" if isinstance(part, Held) else "delayed"
                yield f"{part}: the time after '{word}' must be longer than 0 s and finite"
            case Held(_, duration) | Delayed(_, duration) if duration.value > _range(_TIME, limits)[1]:
                yield f"{part} is never true: {_range_text(_TIME, limits)}"
            case Comparison() | Edge() if outcomes(part, limits) == {False}:
                yield f"{part} is never true: {_range_text(part.left, limits)}"


_TIME = Reference("time")


def _range(reference: Reference, limits: Limits) -> tuple[float, float]:
    """Least and greatest value of a signal in a run."""
    signal = SIGNALS[reference.signal]
    return limits.get(reference.signal, (signal.least, signal.most))


def _range_text(reference: Reference, limits: Limits) -> str:
    ends = zip(("at least", "at most"), _range(reference, limits), strict=True)
    bounds = [f"{word} {shown_value(reference, end)}" for word, end in ends if math.isfinite(end)]
    return f"{reference} is {' and '.join(bounds)}"


def _measured(asked: Sequence[Comparison | Edge | Flag]) -> tuple[Reference, ...]:
    """Signals that are compared with constants."""
    return tuple(dict.fromkeys(one.left for one in asked if not _is_free(one)))


def _is_free(part: Condition) -> bool:
    """Whether a part's outcome depends on more than a signal's current value."""
    return isinstance(part, Edge | Held | Delayed) or (
        isinstance(part, Comparison) and isinstance(part.right, Reference)
    )


def _free(part: Condition, limits: Limits) -> Iterator[bool]:
    match part:
        case Held(inner, duration) | Delayed(inner, duration):
            yield from (False,) if duration.value > _range(_TIME, limits)[1] else outcomes(inner, limits)
        case Comparison(left, relation, right) if left == right:
            yield relation in ("<=", ">=", "==")
        case Edge(left, _, right) if left == right:
            yield False
        case Edge(left, how, Quantity(value)):
            least, most = _range(left, limits)
            beyond = value > most if how != "rises above" else value >= most
            below = value < least if how != "falls below" else value <= least
            yield from (False,) if beyond or below else (False, True)
        case _:
            yield from (False, True)


def _evaluated(part: Condition, signals: Mapping[Reference, Value], free: Mapping[Condition, bool]) -> bool:
    if part in free:
        return free[part]
    if isinstance(part, Comparison):
        return bool(compared(signals[part.left], part.relation, _plain(part.right)))
    if isinstance(part, Flag):
        return signals[part.left] is True
    return bool(combined(part, lambda inner: _evaluated(inner, signals, free)))


def _plain(operand: Operand) -> Value:
    return operand.value if isinstance(operand, Quantity) else operand.word if isinstance(operand, Word) else None


def _values(reference: Reference, asked: Sequence[Comparison | Edge | Flag], limits: Limits) -> Iterator[Value]:
    """Values of a signal that cover all distinguishable outcomes."""
    signal = SIGNALS[reference.signal]
    least, most = _range(reference, limits)
    written = [_plain(one.right) for one in asked if isinstance(one, Comparison) and one.left == reference]
    numbers = sorted({one for one in written if isinstance(one, float)})
    words = [one for one in dict.fromkeys(written) if isinstance(one, str)]
    match signal.kind:
        case Kind.FLAG:
            yield from (True, False)
        case Kind.NUMBER:
            yield from (value for value in _numbers(numbers, least, most) if least <= value <= most)
        case Kind.LANE:
            near = {0, 1, *(int(number) + step for number in numbers if math.isfinite(number) for step in (-1, 0, 1))}
            lanes = [lane for lane in sorted(near) if least <= lane <= most]
            yield from (LanePlace(lane, count) for lane in lanes for count in (lane + 1, lane + 2))
        case Kind.WORD:
            yield from words
            if not signal.words or len(words) < len(signal.words):
                yield _OTHER
        case Kind.WORDS:
            chosen = itertools.product((False, True), repeat=len(words))
            yield from (frozenset(itertools.compress(words, lit)) for lit in chosen)


def _numbers(thresholds: Sequence[float], least: float, most: float) -> set[float]:
    """Each threshold, values between and beyond them, and the ends of the range."""
    finite = sorted({one for one in (*thresholds, least, most) if math.isfinite(one)}) or [0.0]
    between = {0.5 * (one + other) for one, other in itertools.pairwise(finite)}
    return {*thresholds, *between, finite[0] - 1.0, finite[-1] + 1.0, least, most}
