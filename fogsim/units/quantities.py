"""Quantities as people write them, a number and a unit: pint reads them, in the unit that is asked for."""

import functools
import math
import re
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pint

UNIT_OF_SUFFIX = {
    "m": "m",
    "km": "km",
    "s": "s",
    "kmh": "km/h",
    "mps": "m/s",
    "mps2": "m/s^2",
    "deg": "deg",
    "percent": "%",
    "lx": "lx",
    "cd": "cd",
    "cdpm2": "cd/m^2",
    "vph": "veh/h",
    "pph": "persons/h",
}
"""Units of keys of files by the end of their name: ``speed_kmh`` is in km/h."""

_WRITTEN = re.compile(r"\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?|[-+]?inf)\s*([^\d\s].*?)?\s*\Z")

_UNIT = re.compile(r"[^\W\d_][^\W_]*(?:\s?[/*·^]?\s?-?[^\W_]+)*\Z|%\Z|°\Z")


def is_quantity(text: object) -> bool:
    """Whether something is text that begins like a number."""
    return isinstance(text, str) and _WRITTEN.match(text) is not None


def split_quantity(text: str) -> tuple[float, str] | None:
    """Number and unit of text as it is written: 10 and ``m`` of ``10 m``; None if it is no finite quantity."""
    match = _WRITTEN.match(text)
    if match is None or not math.isfinite(float(match[1])) or not (match[2] is None or _UNIT.match(match[2])):
        return None
    return float(match[1]), match[2] or ""


def parse_quantity(text: str, unit: str) -> float:
    """Number of a quantity in a unit: ``parse_quantity("90 km/h", "m/s")`` is 25."""
    match = _WRITTEN.match(text)
    if match is None:
        raise ValueError(f"expected a number and a unit such as {example_of(unit)!r}, got {text!r}")
    number, written = float(match[1]), match[2] or ""
    is_endless = match[1].endswith("inf")
    if not written:
        if unit and number != 0.0 and not is_endless:
            raise ValueError(f"{text!r} has no unit; expected one such as in {example_of(unit)!r}")
        larger, smaller = 1.0, 1.0
    else:
        larger, smaller = _factors(written, unit)
    # Divided by a whole number or a short fraction, 95 % is 0.95 and 90 km/h is 25 m/s, and not a neighbour of it.
    value = number * larger if larger >= 1.0 else number / smaller
    if not (is_endless or math.isfinite(value)):
        raise ValueError(f"expected a number of at most {sys.float_info.max:.3g}, or inf, got {text!r}")
    return value


def example_of(unit: str) -> str:
    """A quantity of a unit, for messages."""
    return f"10 {unit}" if unit else "10"


@functools.cache
def _factors(written: str, unit: str) -> tuple[float, float]:
    """How many of a unit are in one that is written, and the other way round."""
    import pint  # noqa: PLC0415 - takes 0.3 s, and most files have plain numbers

    units = _units()
    try:
        # pint's parser stumbles over what is no unit at all in many ways.
        source = units.parse_units(written) if _UNIT.match(written) else None
    except (pint.PintError, ValueError, TypeError, AttributeError):
        source = None
    if source is None:
        raise ValueError(f"unknown unit {written!r}; expected one such as in {example_of(unit)!r}")
    try:
        target = units.parse_units(unit)
        there, back = units.Quantity(1.0, source).to(target), units.Quantity(1.0, target).to(source)
        # To pint, angles, vehicles and persons are plain numbers.
        fits = units.get_root_units(source)[1] == units.get_root_units(target)[1]
    except pint.PintError:
        fits = False
    if not fits:
        raise ValueError(f"the unit {written!r} does not fit; expected one such as in {example_of(unit)!r}")
    return float(there.magnitude), float(back.magnitude)


@functools.cache
def _units() -> "pint.UnitRegistry[float]":
    import pint  # noqa: PLC0415 - as above

    units: pint.UnitRegistry[float] = pint.UnitRegistry()
    units.define("vehicle = [] = veh = vehicles")
    units.define("person = [] = pers = persons")
    return units
