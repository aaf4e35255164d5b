"""Evaluates a condition over the steps of a run: true, false, or unknown."""

import math
from collections import deque
from collections.abc import Mapping

from fogsim.conditions.logic import combined, compared, passed
from fogsim.conditions.moment import History, Moment
from fogsim.conditions.signal import LanePlace, Value
from fogsim.conditions.signals import SIGNALS
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
    parts_of,
    signals_of,
)
from fogsim.units.quantities import parse_quantity
from fogsim.values import TrafficStep

_TICK = 1e-6
"""Rounding of times [s]."""


class Watch:
    """Evaluates one condition step by step, with the state that it needs of earlier steps.

    A comparison with a missing value (the vehicle is not on the road, the estimate is invalid) is unknown, and so is
    the condition unless its other parts decide it: ``false and unknown`` is false.
    """

    def __init__(self, condition: Condition) -> None:
        self.condition = condition
        self._parts = tuple(dict.fromkeys(parts_of(condition)))
        self._signals = signals_of(condition)
        self._before: dict[Edge, tuple[Value, Value]] = {}
        self._since: dict[Held, float] = {}
        self._earlier: dict[Delayed, deque[tuple[float, bool | None]]] = {}
        self._history = History()
        self._units = _shown_units(self._parts)
        self.values: Mapping[Reference, Value] = {}

    def update(self, step: TrafficStep) -> bool | None:
        """Add the next step and return whether the condition holds there; None if unknown."""
        return self.look(self._history.moment(step))

    def look(self, moment: Moment) -> bool | None:
        """Do the same for a moment of a `History` that is shared with other watches."""
        self.values = {signal: SIGNALS[signal.signal].read(moment, signal.arguments) for signal in self._signals}
        results: dict[Condition, bool | None] = {}
        for part in self._parts:
            results[part] = self._evaluate(part, results, moment.step.time)
        return results[self.condition]

    def operands(self, comparison: Comparison) -> tuple[Value, Value]:
        """The two values that a comparison compared at the last step; None if unknown."""
        return self.values[comparison.left], self._operand(comparison.right)

    def readings(self) -> str:
        """Values of the condition's signals at the last step: ``gap(ego, slow) = 83.2 m``."""
        return ", ".join(
            f"{signal} = {shown_value(signal, v, self._units[signal])}" for signal, v in self.values.items()
        )

    def _evaluate(self, part: Condition, results: Mapping[Condition, bool | None], time: float) -> bool | None:
        match part:
            case Comparison(left, relation, right):
                return compared(self.values[left], relation, self._operand(right))
            case Flag(left):
                return compared(self.values[left], "==", "true")
            case Edge():
                return self._passed(part)
            case Held(inner, duration):
                return self._held(part, results[inner], time, duration.value)
            case Delayed(inner, duration):
                return self._delayed(part, results[inner], time - duration.value)
            case _:
                return combined(part, results.__getitem__)

    def _operand(self, right: Operand) -> Value:
        match right:
            case Quantity():
                return right.value
            case Word():
                return right.word
            case Reference():
                return self.values[right]

    def _passed(self, edge: Edge) -> bool | None:
        now = self.values[edge.left], None if edge.right is None else self._operand(edge.right)
        before, self._before[edge] = self._before.get(edge, now), now
        return passed(before, now, edge.how)

    def _held(self, part: Held, inside: bool | None, time: float, duration: float) -> bool | None:
        if not inside:
            self._since.pop(part, None)
            return inside
        return time - self._since.setdefault(part, time) >= duration - _TICK

    def _delayed(self, part: Delayed, inside: bool | None, then: float) -> bool | None:
        """What a condition was at a time [s]; false before the first step."""
        earlier = self._earlier.setdefault(part, deque([(-math.inf, False)]))
        earlier.append((then + part.duration.value, inside))
        while len(earlier) > 1 and earlier[1][0] <= then + _TICK:
            earlier.popleft()
        return earlier[0][1]


def _shown_units(parts: tuple[Condition, ...]) -> dict[Reference, str]:
    """Units in which signals are shown: those of the condition's comparisons, otherwise their own."""
    units: dict[Reference, str] = {}
    for part in parts:
        if isinstance(part, Comparison | Edge | Flag):
            right = None if isinstance(part, Flag) else part.right
            written = right.unit if isinstance(right, Quantity) else ""
            units[part.left] = written or units.get(part.left, "") or SIGNALS[part.left.signal].stated_in
            if isinstance(right, Reference):
                units.setdefault(right, units[part.left])
    return units


def shown_value(signal: Reference, value: Value, unit: str = "") -> str:
    """A signal's value (SI) as messages show it, in `unit` ("" for the signal's own)."""
    if value is None:
        return "unknown"
    if isinstance(value, LanePlace):
        return str(value.number)
    if isinstance(value, frozenset):
        return " ".join(sorted(value)) or "none"
    if isinstance(value, bool | str):
        return str(value).lower() if isinstance(value, bool) else value
    kind = SIGNALS[signal.signal]
    unit = unit or kind.stated_in
    number = value if unit == kind.unit else value / parse_quantity(f"1 {unit}", kind.unit)
    return "inf" if math.isinf(number) else f"{number:.4g} {unit}".strip()
