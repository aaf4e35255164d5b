"""Checks of command-line options: numbers must be within a range, and paths must not be empty."""

import math
from collections.abc import Callable
from enum import StrEnum
from inspect import signature
from pathlib import Path
from typing import Any, NoReturn, get_args

import typer
from typer.models import ArgumentInfo, OptionInfo

from fogsim.cli.printing import BAD_INPUT, print_error
from fogsim.errors import InputError, shown

_LARGEST = 2**63 - 1
"""Bound of numbers whose option has none, as for seeds in scenario files."""


def check_values(app: typer.Typer) -> None:
    """Make every command refuse empty paths, and numbers outside ``min`` and ``max`` of their option, NaN included.

    An empty string, as from an unset shell variable, would be the current directory.
    """
    for command in app.registered_commands:
        for parameter in signature(command.callback or check_values).parameters.values():
            info = _info(parameter.annotation)
            if info is not None and info.parser is None:
                info.parser = _parser(_name(parameter.name, info), _flat(parameter.annotation), info)
    for group in app.registered_groups:
        if group.typer_instance is not None:
            check_values(group.typer_instance)


def _info(annotation: Any) -> OptionInfo | ArgumentInfo | None:
    metadata = getattr(annotation, "__metadata__", ())
    return next((one for one in metadata if isinstance(one, OptionInfo | ArgumentInfo)), None)


def _name(parameter: str, info: OptionInfo | ArgumentInfo) -> str:
    """Name of an option as users write it, or of an argument as in the help."""
    if isinstance(info, ArgumentInfo):
        return info.metavar or parameter.upper()
    # typer treats the first name of an annotation as the default.
    names = [one for one in (info.default, *(info.param_decls or ())) if str(one).startswith("--")]
    return str(names[0]) if names else "--" + parameter.replace("_", "-")


def _flat(annotation: Any) -> set[Any]:
    """All types in an annotation."""
    return {annotation, *(inner for part in get_args(annotation) for inner in _flat(part))}


def _parser(name: str, types: set[Any], info: OptionInfo | ArgumentInfo) -> Callable[[Any], Any] | None:
    """Reader of a value; None for typer's own."""
    for kind in types:
        if isinstance(kind, type) and issubclass(kind, StrEnum):
            return _choice_parser(kind, name)
    if Path in types:
        return _text_parser(Path, name, "a path")
    if str in types and isinstance(info, ArgumentInfo):
        return _text_parser(str, name, "a name or a path")
    if int in types:
        return _number_parser(int, name, info)
    return _number_parser(float, name, info) if float in types else None


def _text_parser(kind: type[Path] | type[str], name: str, expected: str) -> Callable[[Any], Any]:
    def parse(given: Any) -> Any:
        if given == "":
            _refuse(name, expected, given)
        return kind(given)

    parse.__name__ = kind.__name__
    return parse


def _choice_parser(kind: type[StrEnum], name: str) -> Callable[[Any], Any]:
    def parse(given: Any) -> Any:
        try:
            return kind(given)
        except ValueError:
            _refuse(name, " or ".join(kind), given)

    parse.__name__ = "|".join(kind)
    return parse


def _number_parser(kind: type[int] | type[float], name: str, info: OptionInfo | ArgumentInfo) -> Callable[[Any], float]:
    least = -_LARGEST if info.min is None else info.min
    most = _LARGEST if info.max is None else info.max
    expected = f"a whole number from {least} to {most}" if kind is int else f"a number from {least:g} to {most:g}"

    def parse(given: Any) -> float:
        try:
            value = kind(given)
        except (ValueError, OverflowError):
            _refuse(name, expected, given)
        # 1e999 is a mistake, inf is meant.
        if not least <= value <= most or (math.isinf(value) and "inf" not in str(given).lower()):
            _refuse(name, expected, given)
        return value

    parse.__name__ = kind.__name__
    return parse


def _refuse(name: str, expected: str, given: object) -> NoReturn:
    print_error(f"{name}: expected {expected}, got {shown(given)}")
    raise typer.Exit(BAD_INPUT)


def pixel_values(text: str) -> tuple[float, ...]:
    """Value of ``--airlight``: a pixel value, or three separated by commas."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) not in (1, 3) or not all(0 <= value < math.inf for value in values):
        raise InputError(f"--airlight: expected a pixel value, or red, green and blue as R,G,B; got {shown(text)}")
    return values
