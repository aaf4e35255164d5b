"""Arguments: types and ranges are in the annotations of constructors and functions, and checked at every call."""

import functools
import inspect
import math
import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, cast, get_args, get_origin

import numpy as np

from fogsim.errors import InputError, nearest, shown, suggest

C = TypeVar("C", bound=Callable[..., Any])
FileName = Annotated[str, "a file"]
"""Name of a file; in a scenario it is relative to the scenario's folder."""
Check = Callable[[Any], str | None]
"""From a value to what was expected; None if the value fits."""

_Checks = list[tuple[str, tuple[type, ...], Check | None]]
"""Names of arguments, classes whose instances need no check, and checks."""


@dataclass(frozen=True, slots=True)
class _InstanceCheck:
    """Check that a value is an instance of one of some classes."""

    kinds: tuple[type, ...]
    expected: str

    def __call__(self, value: object) -> str | None:
        return None if isinstance(value, self.kinds) else self.expected


_NOTHING = object()
"""A value that fits no checked annotation; its check says what is expected."""

_ANYTHING: tuple[Any, ...] = (inspect.Parameter.empty, Any, object)

_WORDS: Mapping[Any, str] = {Path: "a path", Callable: "callable", np.ndarray: "an array"}

_COLLECTIONS: Mapping[Any, tuple[type, ...]] = {
    Sequence: (list, tuple),
    tuple: (list, tuple, np.ndarray),
    Iterable: (Iterable,),
}
"""Accepted types for each type of collection."""


@dataclass(frozen=True, slots=True)
class Range:
    """Range of a parameter, both ends included: ``Annotated[float, Range(0.0, 60.0, "s")]``.

    The ends are in the unit, which messages show; `or_nan` also allows NaN, for an unknown value.
    """

    least: float = -sys.float_info.max
    most: float = sys.float_info.max
    unit: str = ""
    or_nan: bool = False

    def __str__(self) -> str:
        ends = f"≥ {self.least:g}" if math.isinf(self.most) else f"{self.least:g} … {self.most:g}"
        return f"{ends} {self.unit}".rstrip()


_FINITE = Range()
NUMBER = Range(-math.inf, math.inf)
NUMBER_OR_NAN = Range(-math.inf, math.inf, or_nan=True)

_UNNAMED_RANGES = {_FINITE: ", finite", NUMBER: "", NUMBER_OR_NAN: ""}


def checked_parameters(target: C) -> C:
    """Decorator of a class or function: arguments that its annotations do not allow raise InputError.

    Checked are numbers (``float`` is finite unless a `Range` in ``Annotated`` allows more), ``bool``, ``str``,
    ``Literal``, the names of a ``StrEnum``, arrays by their type, instances of classes, callables, and unions,
    sequences, iterables, tuples and mappings of all these. Unknown, missing and surplus arguments raise InputError too.

    Parameters
    ----------
    target : class or function
        What is decorated.
    """
    call: Callable[..., Any] = target.__init__ if isinstance(target, type) else target  # type: ignore[misc]
    who = target.__name__ if isinstance(target, type) else f"{target.__name__}()"

    @functools.cache
    def checks() -> tuple[_Checks, _Checks]:
        # Not before the first call: annotations may name later definitions.
        return _argument_checks(inspect.signature(call, eval_str=True))

    @functools.wraps(call)
    def checked(*arguments: Any, **options: Any) -> Any:
        by_place, by_name = checks()
        for (name, kinds, check), value in zip(by_place, arguments, strict=False):
            # Classes are looked at here: a call for each argument would cost more than the rest.
            if check and value.__class__ not in kinds and (expected := check(value)) is not None:
                raise InputError(f"{who}: {name} must be {expected}, got {_given(value)}")
        for name, kinds, check in by_name if options else ():
            if check and name in options and (value := options[name]).__class__ not in kinds and (why := check(value)):
                raise InputError(f"{who}: {name} must be {why}, got {_given(value)}")
        try:
            return call(*arguments, **options)
        except TypeError:
            mistake = _call_mistake(inspect.signature(call), arguments, options)
            if mistake is None:
                raise
        raise InputError(f"{who}: {mistake}")

    if not isinstance(target, type):
        return cast("C", checked)
    type.__setattr__(target, "__init__", checked)
    return target


def _given(value: object) -> str:
    """A value as messages show it; for an array, its type and shape."""
    return f"an array of {value.dtype}, shape {value.shape}" if isinstance(value, np.ndarray) else shown(value)


def _argument_checks(signature: inspect.Signature) -> tuple[_Checks, _Checks]:
    """Checks of a signature's positional arguments in order, and of all its named ones."""
    kinds = {name: one.kind for name, one in signature.parameters.items()}
    checks = {
        name: check_of(one.annotation, classes=True)
        for name, one in signature.parameters.items()
        if one.kind not in (one.VAR_POSITIONAL, one.VAR_KEYWORD)
    }
    named = [(name, one.kinds if isinstance(one, _InstanceCheck) else (), one) for name, one in checks.items()]
    return [one for one in named if kinds[one[0]] is not inspect.Parameter.KEYWORD_ONLY], named


def _call_mistake(
    signature: inspect.Signature, arguments: tuple[object, ...], options: Mapping[str, object]
) -> str | None:
    """Why a call does not fit a signature; None if it does."""
    try:
        signature.bind(*arguments, **options)
    except TypeError as error:
        known = [name for name in signature.parameters if name != "self"]
        unknown = next((name for name in options if name not in known), None)
        return str(error) if unknown is None else f"unknown parameter {unknown!r}; {suggest(unknown, known)}"
    return None


def accepted_parameters(factory: Callable[..., object], given_elsewhere: Collection[str] = ()) -> dict[str, Any]:
    """`inspect.Parameter` by name of a factory's keyword parameters, without those `given_elsewhere`."""
    return {
        name: parameter
        for name, parameter in inspect.signature(factory, eval_str=True).parameters.items()
        if name not in given_elsewhere and parameter.kind in (parameter.KEYWORD_ONLY, parameter.POSITIONAL_OR_KEYWORD)
    }


def paths_in(factory: Callable[..., object], given: Mapping[str, Any], folder: Path) -> dict[str, Path]:
    """Paths of the files that parameters of a factory name (`FileName`), relative to a folder."""
    known = accepted_parameters(factory)
    return {
        name: folder / value
        for name, value in given.items()
        if name in known and isinstance(value, str) and _is_file_name(known[name].annotation, value)
    }


def _is_file_name(annotation: Any, value: str) -> bool:
    parts = get_args(annotation)
    is_choice = any(get_origin(part) is Literal and value in get_args(part) for part in parts)
    return FileName in (annotation, *parts) and not is_choice


def parameter_mistakes(
    factory: Callable[..., object],
    given: Mapping[str, object],
    given_elsewhere: Collection[str] = (),
    *,
    classes: bool = False,
) -> Iterator[tuple[str, str]]:
    """Name and mistake of every parameter that does not fit a factory's signature.

    Parameters `given_elsewhere` come from the caller and may not be set; `classes` is as in `check_of`.
    """
    known = accepted_parameters(factory, given_elsewhere)
    for name, value in given.items():
        if name not in known:
            yield name, f"unknown parameter; {suggest(str(name), known)}"
            continue
        check = check_of(known[name].annotation, classes=classes)
        if check is not None and (expected := check(value)) is not None:
            yield name, f"must be {expected}, got {_given(value)}"
    for name, parameter in known.items():
        if parameter.default is parameter.empty and name not in given:
            yield name, "this parameter is missing; it is required"


def mismatch(annotation: object, value: object) -> str | None:
    """What an annotation expects of a value that does not fit; None if it fits or is not checked.

    Classes are not checked, since values from files may be converted: ``mismatch(Annotated[float, Range(0.0, 1.0)],
    7)`` is ``'a number 0 … 1'``.
    """
    check = check_of(annotation, classes=False)
    return None if check is None else check(value)


def check_of(annotation: Any, *, classes: bool) -> Check | None:
    """Function from a value to what an annotation expects, or None if it fits; None if nothing is checked.

    `classes` includes instances of classes, arrays and callables.
    """
    origin, parts = get_origin(annotation), get_args(annotation)
    check = _plain_check(annotation, _FINITE)
    if origin in (Union, UnionType):
        check = _union_check([check_of(part, classes=classes) for part in parts])
    elif origin is Literal:
        check = _literal_check(parts)
    elif annotation == FileName:
        check = _InstanceCheck((str,), parts[1])
    elif origin is Annotated:
        interval = next((part for part in parts if isinstance(part, Range)), None)
        check = check_of(parts[0], classes=classes) if interval is None else _plain_check(parts[0], interval)
    elif origin is tuple and parts[-1] is not Ellipsis:
        check = _tuple_check([check_of(part, classes=classes) for part in parts])
    elif origin in _COLLECTIONS:
        entry = check_of(parts[0], classes=classes)
        check = _entries_check(entry, _COLLECTIONS[origin], may_be_empty=origin is not Sequence)
    elif isinstance(annotation, type) and issubclass(annotation, StrEnum):
        check = functools.partial(_unknown_name, annotation)
    elif check is None and classes:
        check = _class_check(annotation, origin, parts)
    return check


def _union_check(checks: Sequence[Check | None]) -> Check | None:
    known = [check for check in checks if check is not None]
    if len(known) < len(checks):
        return None
    may_be_none = any(check(None) is None for check in known)
    classes = [check for check in known if isinstance(check, _InstanceCheck)]
    if len(classes) == len(known):
        kinds = tuple(kind for one in classes for kind in one.kinds)
        return _InstanceCheck(kinds, " or ".join(one.expected for one in classes))

    def check(value: object) -> str | None:
        if value is None and may_be_none:
            return None
        expected = []
        for one in known:
            wrong = one(value)
            if wrong is None:
                return None
            expected.append(wrong)
        return " or ".join(expected)

    return check


def _literal_check(allowed: tuple[object, ...]) -> Check:
    def check(value: object) -> str | None:
        if any(type(value) is type(one) and value == one for one in allowed):
            return None
        near = nearest(value, [one for one in allowed if isinstance(one, str)]) if isinstance(value, str) else None
        return " or ".join(map(repr, allowed)) + (f" (did you mean {near!r}?)" if near else "")

    return check


def _tuple_check(checks: Sequence[Check | None]) -> Check:
    def check(value: object) -> str | None:
        if isinstance(value, list | tuple | np.ndarray) and len(value) == len(checks):
            wrong = [one(entry) for one, entry in zip(checks, value, strict=True) if one is not None]
            if not any(wrong):
                return None
        first = None if checks[0] is None else checks[0](_NOTHING)
        return f"{len(checks)} values" + ("" if first is None else f", each {first}")

    return check


def _entries_check(entry: Check | None, kinds: tuple[type, ...], *, may_be_empty: bool) -> Check:
    def check(value: Any) -> str | None:
        each = None
        # A text is one value.
        if isinstance(value, kinds) and not isinstance(value, str | bytes | Mapping):
            # The values of a generator are known only after it is exhausted.
            if entry is None or not isinstance(value, list | tuple | np.ndarray):
                return None
            each = next((wrong for wrong in map(entry, value) if wrong is not None), None)
            if each is None and (may_be_empty or len(value)):
                return None
        each = each or (entry(_NOTHING) if entry is not None else None)
        return "a list" if each is None else f"a list, each {each}"

    return check


def _unknown_name(names: type[StrEnum], value: object) -> str | None:
    known = [one.value for one in names]
    if isinstance(value, str) and value in known:
        return None
    near = nearest(value, known) if isinstance(value, str) else None
    return f"one of {', '.join(known)}" + (f" (did you mean {near!r}?)" if near else "")


def _plain_check(kind: object, interval: Range) -> Check | None:
    """Check of a number, boolean, text or None; None for any other type."""
    within = _UNNAMED_RANGES.get(interval, f" {interval}")
    if kind is float:
        return _number_check(float, Real, interval, f"a number{within}")
    if kind is int:
        return _number_check(int, Integral, interval, f"a whole number{'' if interval is _FINITE else within}")
    for plain, expected in ((bool, "true or false"), (str, "text"), (NoneType, "nothing")):
        if kind is plain:
            return _InstanceCheck((plain, np.bool_) if plain is bool else (plain,), expected)
    return None


def _number_check(usual: Any, kind: Any, interval: Range, expected: str) -> Check:
    least, most, or_nan = interval.least, interval.most, interval.or_nan

    def check(value: Any) -> str | None:
        if type(value) is not usual:  # the abstract class would be slower
            if isinstance(value, bool) or not isinstance(value, kind):
                return expected
            # A bound would overflow in a narrower type of numpy's.
            value = value.item() if isinstance(value, np.generic) else value
        return None if least <= value <= most or (or_nan and math.isnan(value)) else expected

    return check


def _class_check(annotation: Any, origin: Any, parts: tuple[Any, ...]) -> Check | None:
    """Check of an array, mapping, callable, path or instance; None for other annotations."""
    kind: Any = origin if isinstance(origin, type) else annotation
    if kind in _ANYTHING or not isinstance(kind, type):
        return None
    plain = f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"
    named: str = getattr(kind, "EXPECTED", _WORDS.get(kind, plain))
    check: Check = _InstanceCheck((os.PathLike if kind is Path else kind,), named)
    if kind is np.ndarray and parts:
        check = _array_check(get_args(parts[1])[0])
    elif kind in (Mapping, dict) and parts:
        check = _mapping_check(*(check_of(part, classes=True) for part in parts))
    elif getattr(kind, "_is_protocol", False):
        check = _protocol_check([one for base in kind.__mro__[:-1] for one in vars(base) if one[0] != "_"], named)
    return check


def _protocol_check(attributes: Sequence[str], expected: str) -> Check:
    return lambda value: None if all(hasattr(value, name) for name in attributes) else expected


def _array_check(scalar: type[np.generic]) -> Check:
    scalar = get_origin(scalar) or scalar
    # Any precision of floating point fits; integers would wrap.
    kind = np.floating if issubclass(scalar, np.floating) else scalar
    expected = f"an array of {'whole numbers' if scalar is np.integer else np.dtype(scalar)}"

    def check(value: object) -> str | None:
        return None if isinstance(value, np.ndarray) and issubclass(value.dtype.type, kind) else expected

    return check


def _mapping_check(key: Check | None, entry: Check | None) -> Check:
    def check(value: object) -> str | None:
        if not isinstance(value, Mapping):
            return "a mapping"
        wrong_key = next((one for one in map(key, value) if one is not None), None) if key else None
        wrong = next((one for one in map(entry, value.values()) if one is not None), None) if entry else None
        if wrong_key is None and wrong is None:
            return None
        return f"a mapping, each key {wrong_key}" if wrong_key else f"a mapping, each value {wrong}"

    return check
