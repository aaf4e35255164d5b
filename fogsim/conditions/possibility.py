"""Whether a condition can be true at all, and whether it can be false: by the values that its signals can have."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence

from fogsim.conditions.logic import combined, compared
from fogsim.conditions.signal import Kind, LanePlace, Signal, Value
from fogsim.conditions.signals import SIGNALS
from fogsim.conditions.syntax import (
    Comparison,
    Condition,
    Edge,
    Flag,
    Held,
    Operand,
    Quantity,
    Reference,
    Word,
    comparisons_of,
    parts_of,
)

MOST_CASES = 20_000
"""Cases that are gone through; a condition of more is held to be able to be true and false."""

_OTHER = "\0"
"""A word that stands for all that are not named."""


def outcomes(condition: Condition) -> frozenset[bool]:
    """What a condition can be in some run: true, false or both.

    Every signal takes each value that makes a difference to the condition; signals are held to be independent.

    Parameters
    ----------
    condition : Condition
        The condition.
    """
    asked = comparisons_of(condition)
    values = {signal: list(_values(signal, asked)) for signal in _measured(asked)}
    free = {part: list(_free(part)) for part in parts_of(condition) if _is_free(part)}
    sizes = [*(len(those) for those in values.values()), *(len(those) for those in free.values())]
    if math.prod(sizes) > MOST_CASES:
        return frozenset({True, False})
    return frozenset(
        _evaluated(condition, dict(zip(values, case, strict=True)), dict(zip(free, known, strict=True)))
        for case in itertools.product(*values.values())
        for known in itertools.product(*free.values())
    )


def _measured(asked: Sequence[Comparison | Edge | Flag]) -> tuple[Reference, ...]:
    """Signals that are compared with what is written."""
    return tuple(dict.fromkeys(one.left for one in asked if not _is_free(one)))


def _is_free(part: Condition) -> bool:
    """Whether a part's outcome is not that of a signal's value alone."""
    return isinstance(part, Edge | Held) or (isinstance(part, Comparison) and isinstance(part.right, Reference))


def _free(part: Condition) -> Iterator[bool]:
    match part:
        case Held(inner):
            yield from outcomes(inner)
        case Comparison(left, relation, right) if left == right:
            yield relation in ("<=", ">=", "==")
        case Edge(left, how, Quantity(value)):
            signal = SIGNALS[left.signal]
            beyond = value > signal.most if how != "rises above" else value >= signal.most
            below = value < signal.least if how != "falls below" else value <= signal.least
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


def _values(reference: Reference, asked: Sequence[Comparison | Edge | Flag]) -> Iterator[Value]:
    """Values of a signal that make all the differences that there are."""
    signal = SIGNALS[reference.signal]
    written = [_plain(one.right) for one in asked if isinstance(one, Comparison) and one.left == reference]
    numbers = sorted({one for one in written if isinstance(one, float)})
    words = [one for one in dict.fromkeys(written) if isinstance(one, str)]
    match signal.kind:
        case Kind.FLAG:
            yield from (True, False)
        case Kind.NUMBER:
            yield from _numbers(signal, numbers)
        case Kind.LANE:
            most = int(max([*numbers, 0.0])) + 2
            yield from (LanePlace(n, count) for n in range(most) for count in (n + 1, n + 2))
        case Kind.WORD:
            yield from words
            if not signal.words or len(words) < len(signal.words):
                yield _OTHER
        case Kind.WORDS:
            chosen = itertools.product((False, True), repeat=len(words))
            yield from (frozenset(itertools.compress(words, lit)) for lit in chosen)


def _numbers(signal: Signal, thresholds: Sequence[float]) -> Iterator[float]:
    """Each threshold, what lies between them and beyond, and the ends of the range."""
    finite = [one for one in thresholds if math.isfinite(one)]
    beyond = [finite[0] - 1.0, finite[-1] + 1.0] if finite else [0.0]
    between = [0.5 * (one + other) for one, other in itertools.pairwise(finite)]
    every = {*thresholds, *beyond, *between, signal.least, signal.most}
    yield from (value for value in sorted(every) if signal.least <= value <= signal.most)
