"""Parameters of methods: types and ranges stand in the constructors' annotations and are checked at every call."""

import functools
import inspect
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from fogsim.errors import InputError, nearest, shown, suggest

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Range:
    """Numbers that a parameter may have, both ends included: ``Annotated[float, Range(0.0, 60.0, "s")]``.

    Attributes
    ----------
    least, most : float
        The ends, in the unit.
    unit : str
        The unit, as it is to appear in messages; empty for a pure number.
    """

    least: float = -sys.float_info.max
    most: float = sys.float_info.max
    unit: str = ""

    def __contains__(self, value: Any) -> bool:
        return bool(self.least <= value <= self.most)

    def __str__(self) -> str:
        return f"{self.least:g} … {self.most:g} {self.unit}".rstrip()


FINITE = Range()


def checked_parameters(cls: type[T]) -> type[T]:
    """Class decorator: the constructor refuses arguments that its annotations do not allow.

    Checked are ``float`` (finite, of any type of real number), ``int``, ``bool``, ``str``, ``Literal`` and the names of
    a ``StrEnum``, with a `Range` in ``Annotated``, unions and sequences of them; arguments of other types are left to
    the class. The constructor then raises InputError.
    """
    construct = cls.__init__
    signature = inspect.signature(construct, eval_str=True)

    @functools.wraps(construct)
    def checked(self: T, *arguments: Any, **options: Any) -> None:
        for name, value in signature.bind(self, *arguments, **options).arguments.items():
            expected = mismatch(signature.parameters[name].annotation, value)
            if expected is not None:
                raise InputError(f"{cls.__name__}: {name} must be {expected}, got {shown(value)}")
        construct(self, *arguments, **options)

    type.__setattr__(cls, "__init__", checked)
    return cls


def accepted_parameters(factory: Callable[..., object], given_elsewhere: Collection[str] = ()) -> dict[str, Any]:
    """`inspect.Parameter` by name of all that a factory takes by keyword.

    Parameters
    ----------
    factory : callable
        A class or function.
    given_elsewhere : collection of str
        Those that are left out.
    """
    return {
        name: parameter
        for name, parameter in inspect.signature(factory, eval_str=True).parameters.items()
        if name not in given_elsewhere and parameter.kind in (parameter.KEYWORD_ONLY, parameter.POSITIONAL_OR_KEYWORD)
    }


def parameter_mistakes(
    factory: Callable[..., object], given: Mapping[str, object], given_elsewhere: Collection[str] = ()
) -> Iterator[tuple[str, str]]:
    """Name and mistake of every parameter that does not fit a factory's signature.

    Parameters
    ----------
    factory : callable
        What would be called.
    given : mapping
        Its parameters by name.
    given_elsewhere : collection of str
        Those that it is given by its caller, and that are none of the user's.
    """
    known = accepted_parameters(factory, given_elsewhere)
    for name, value in given.items():
        if name not in known:
            yield name, f"unknown parameter; {suggest(name, known)}"
        elif (expected := mismatch(known[name].annotation, value)) is not None:
            yield name, f"must be {expected}, got {shown(value)}"
    for name, parameter in known.items():
        if parameter.default is parameter.empty and name not in given:
            yield name, "this parameter is missing; it is required"


def mismatch(annotation: object, value: object) -> str | None:
    """What a value had to be by an annotation; None if it is, or if the annotation is none of those that are checked.

    Parameters
    ----------
    annotation : object
        Of a parameter: a type, a StrEnum, a union, a Literal, a Sequence of one of them, or Annotated with a `Range`.
    value : object
        What was given.

    Examples
    --------
    >>> mismatch(Annotated[float, Range(0.0, 1.0)], 7)
    'a number 0 … 1'
    """
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin in (Union, UnionType):
        expected = [mismatch(part, value) for part in parts]
        wrong = [one for one in expected if one is not None]
        return None if len(wrong) < len(expected) else " or ".join(wrong)
    if origin is Literal:
        fits = any(type(value) is type(part) and value == part for part in parts)
        return None if fits else " or ".join(map(repr, parts))
    if origin is Sequence:
        entries = value if isinstance(value, list | tuple) else ()
        wrong = [one for one in (mismatch(parts[0], entry) for entry in entries or [object()]) if one is not None]
        return f"a list, each {wrong[0]}" if wrong else None
    if isinstance(annotation, type) and issubclass(annotation, StrEnum):
        return _unknown_name(annotation, value)
    interval = next((part for part in parts if isinstance(part, Range)), FINITE)
    return _plain_mismatch(parts[0] if origin is Annotated else annotation, interval, value)


def _unknown_name(names: type[StrEnum], value: object) -> str | None:
    known = [one.value for one in names]
    if isinstance(value, str) and value in known:
        return None
    near = nearest(value, known) if isinstance(value, str) else None
    return f"one of {', '.join(known)}" + (f" (did you mean {near!r}?)" if near else "")


def _plain_mismatch(kind: object, interval: Range, value: Any) -> str | None:
    number = not isinstance(value, bool)
    within = "" if interval is FINITE else f" {interval}"
    if kind is float:
        return None if isinstance(value, Real) and number and value in interval else f"a number{within or ', finite'}"
    if kind is int:
        return None if isinstance(value, Integral) and number and value in interval else f"a whole number{within}"
    if kind is bool:
        return None if isinstance(value, bool) else "true or false"
    if kind is str:
        return None if isinstance(value, str) else "text"
    if kind is NoneType:
        return None if value is None else "nothing"
    return None
