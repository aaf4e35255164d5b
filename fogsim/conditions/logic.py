"""Three-valued logic (Kleene): true, false and unknown; and comparisons of values."""

import operator
from collections.abc import Callable, Mapping

from fogsim.conditions.signal import LanePlace, Value
from fogsim.conditions.syntax import AllOf, AnyOf, Condition, Not

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


def passed(before: tuple[Value, Value], now: tuple[Value, Value], how: str) -> bool | None:
    """Whether a signal, against its operand at either step, ``falls below``, ``changes`` …; None if unknown."""
    if how == "changes":
        earlier, later = _without_count(before[0]), _without_count(now[0])
        return None if earlier is None or later is None else earlier != later
    relation = {"falls below": "<", "rises above": ">", "becomes": "=="}[how]
    earlier, later = compared(before[0], relation, before[1]), compared(now[0], relation, now[1])
    return None if earlier is None or later is None else later and not earlier


def _without_count(value: Value) -> Value:
    """A lane's number alone, which is the same lane on a wider road."""
    return value.number if isinstance(value, LanePlace) else value
