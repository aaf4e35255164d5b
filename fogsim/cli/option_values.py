"""What the options of all commands have in common: numbers lie within a range, and paths are not empty."""

import math
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any, get_args

import typer
from typer.models import ArgumentInfo, OptionInfo

from fogsim.errors import InputError, shown

LARGEST = 2**63 - 1
"""Bound of numbers whose option has none, as of seeds in scenario files."""


def check_values(app: typer.Typer) -> None:
    """Let every command refuse numbers outside ``min`` and ``max`` of their option, NaN among them, and empty paths.

    An empty string, as from an unset variable of a shell, would otherwise be the current directory.
    """
    for command in app.registered_commands:
        for parameter in signature(command.callback or check_values).parameters.values():
            types, info = _flat(parameter.annotation), _info(parameter.annotation)
            if info is None or info.parser is not None:
                continue
            if Path in types:
                info.parser = _path
            elif str in types and isinstance(info, ArgumentInfo):
                info.parser = _text
            elif int in types or float in types:
                info.parser = _number(int if int in types else float, info.min, info.max)
    for group in app.registered_groups:
        if group.typer_instance is not None:
            check_values(group.typer_instance)


def _flat(annotation: Any) -> set[Any]:
    """All types that an annotation is made of."""
    return {annotation, *(inner for part in get_args(annotation) for inner in _flat(part))}


def _info(annotation: Any) -> OptionInfo | ArgumentInfo | None:
    metadata = getattr(annotation, "__metadata__", ())
    return next((one for one in metadata if isinstance(one, OptionInfo | ArgumentInfo)), None)


def _path(text: str | Path) -> Path:
    if text == "":
        raise typer.BadParameter("expected a path, got an empty string")
    return Path(text)


def _text(text: str) -> str:
    if text == "":
        raise typer.BadParameter("expected a name or a path, got an empty string")
    return text


def _number(kind: type[int] | type[float], least: float | None, most: float | None) -> Callable[[str], float]:
    """Reader of one number [least, most]."""
    low = -LARGEST if least is None else least
    high = LARGEST if most is None else most
    allowed = f"a whole number from {low} to {high}" if kind is int else f"a number from {low:g} to {high:g}"

    def number(text: str) -> float:
        try:
            value = kind(text)
        except (ValueError, OverflowError):
            value = None
        if value is None or not low <= value <= high:
            raise typer.BadParameter(f"expected {allowed}, got {shown(text)}")
        return value

    number.__name__ = kind.__name__
    return number


def pixel_values(text: str) -> tuple[float, ...]:
    """Value of ``--airlight``: a pixel value, or three with commas between them.

    Raises
    ------
    InputError
        If it is something else.
    """
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) not in (1, 3) or not all(0 <= value < math.inf for value in values):
        raise InputError(f"--airlight: expected a pixel value, or red, green and blue as R,G,B; got {shown(text)}")
    return values
