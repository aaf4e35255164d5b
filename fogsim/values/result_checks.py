"""Checks of what users' methods return; errors name method, field and value."""

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.errors import InputError, shown
from fogsim.values import (
    Belief,
    Command,
    Control,
    DenserFog,
    Display,
    DriverWarning,
    EgoControl,
    Estimate,
    FogProfile,
    Lamp,
    LampChoice,
    OpticalDepths,
    SpeedAdvice,
    Stretch,
    StretchAdvice,
)
from fogsim.values.estimate import ExtinctionBounds
from fogsim.values.light import ALL_LAMPS

T = TypeVar("T")

_SUM_TOLERANCE = 1e-6
"""Tolerance of the sum of a belief's probabilities."""


_ESTIMATED = {
    "extinction": " [1/m]; return Estimate.invalid if there is no estimate",
    "standard_deviation": " [1/m]",
    "common_deviation": " [-]",
    "scale_deviation": " [-]",
}
"""Numbers of an estimate, with what a message adds to them."""


def checked_estimate(method: str, value: object) -> Estimate:
    """An estimator's result; InputError unless it is an `Estimate` of that method with valid numbers.

    NumPy's numbers become Python's: short ones, which networks give, overflow in the fusion, and JSON has none.
    """
    who = f"estimator {method!r}: update()"
    estimate = _of_type(who, value, Estimate)
    if estimate.method != method:
        raise InputError(f"{who}: method must be its name in the registry, {method!r}; got {shown(estimate.method)}")
    if estimate.valid not in (True, False):
        raise InputError(f"{who}: valid must be True or False, got {shown(estimate.valid)}")
    if not isinstance(estimate.diagnostics, Mapping):
        raise InputError(f"{who}: diagnostics must be a mapping, got {shown(estimate.diagnostics)}")
    plain: dict[str, Any] = {}
    for name, unit in _ESTIMATED.items() if estimate.valid else ():
        number = getattr(estimate, name)
        if type(number) is not float or not 0.0 <= number < math.inf:
            _check_number(who, name, number, unit)
            plain[name] = float(number)
    if not (_is_number(estimate.reach) and estimate.reach >= 0.0):
        raise InputError(f"{who}: reach must be at least 0 [m], or inf; got {shown(estimate.reach)}")
    _check_part(who, "bounds", estimate.bounds, ExtinctionBounds)
    _check_part(who, "denser", estimate.denser, DenserFog)
    if (curve := estimate.optical_depths) is not None:
        _check_kind(who, "optical_depths", curve, OpticalDepths, "of type fogsim.values.OpticalDepths, or None")
        _check_curve(f"{who}: optical_depths", curve)
    if plain or type(estimate.valid) is not bool:
        return replace(estimate, valid=bool(estimate.valid), **plain)
    return estimate


def _check_curve(who: str, curve: OpticalDepths) -> None:
    columns = (curve.distance, curve.depth, curve.standard_deviation)
    try:
        fits = len(set(map(len, columns))) == 1 and math.isfinite(sum(map(sum, columns)))
        ascends = [*curve.distance] == sorted({*curve.distance}) != []
    except (TypeError, ValueError):
        fits = ascends = False
    if not (fits and ascends and curve.distance[0] > 0.0):
        raise InputError(
            f"{who} must have as many depths and deviations as distances, which ascend from more than 0 [m], all finite"
            f"; got {shown(curve)}"
        )


def checked_belief(method: str, value: object) -> Belief:
    """A fusion's result; InputError unless it is a `Belief` with a distribution over ascending, finite ln k."""
    who = f"fusion {method!r}: update()"
    belief = _of_type(who, value, Belief)
    cells, probability = belief.log_extinction, belief.probability
    arrays: tuple[tuple[str, Any], ...] = (("log_extinction", cells), ("probability", probability))
    for name, array in arrays:
        if not isinstance(array, np.ndarray) or array.ndim != 1 or array.dtype.kind != "f" or not array.size:
            given = f"shape {array.shape} of {array.dtype}" if isinstance(array, np.ndarray) else shown(array)
            raise InputError(f"{who}: {name} must be an array (n,) of floats, got {given}")
    if cells.size != probability.size:
        raise InputError(
            f"{who}: log_extinction and probability must be of one length, got {len(cells)} and {len(probability)}"
        )
    # Copies have one type, for which the kernel is compiled.
    is_ascending, least, total = _distribution_of(np.array(cells, float), np.array(probability, float))
    if not (is_ascending and math.isfinite(cells[0]) and math.isfinite(cells[-1])):
        raise InputError(f"{who}: log_extinction must be finite and ascending, got {shown(cells)}")
    if not (least >= 0.0 and abs(total - 1.0) <= _SUM_TOLERANCE):
        raise InputError(
            f"{who}: probability must be at least 0 and add up to 1, got from {least:.6g} on and a sum of {total:.6g}"
        )
    _check_part(who, "denser", belief.denser, DenserFog)
    if belief.profile is not None:
        _check_kind(who, "profile", belief.profile, FogProfile, "of type fogsim.values.FogProfile, or None")
    if not (_is_number(belief.age) and belief.age >= 0.0):
        raise InputError(f"{who}: age must be at least 0 [s], or inf; got {shown(belief.age)}")
    return belief


@kernel
def _distribution_of(cells: NDArray[np.float64], probability: NDArray[np.float64]) -> tuple[bool, float, float]:
    """Whether cells ascend, and the minimum and sum of their probabilities; NaN if one of them is NaN."""
    ascends, least, total = True, probability[0], probability[0]
    for i in range(1, len(cells)):
        ascends &= cells[i] > cells[i - 1]
        least, total = min(least, probability[i]), total + probability[i]
    return ascends, least, total


def checked_advice(method: str, value: object) -> SpeedAdvice:
    """An adviser's result; InputError unless it is a `SpeedAdvice` of at least 0, or `inf` for no advice."""
    who = f"adviser {method!r}: advise()"
    advice = _of_type(who, value, SpeedAdvice)
    _check_speed(who, "speed", advice.speed)
    if advice.raise_since is not None and not (_is_number(advice.raise_since) and math.isfinite(advice.raise_since)):
        raise InputError(f"{who}: raise_since must be a finite time [s] or None, got {shown(advice.raise_since)}")
    return advice


def checked_speed(choice: str, speed: float) -> float:
    """A speed choice's result; InputError unless it is a speed of at least 0 [m/s], or `inf` for no limit."""
    if not (_is_number(speed) and speed >= 0.0):
        raise InputError(f"speed choice {choice!r} must return at least 0 [m/s], or inf; got {shown(speed)}")
    return float(speed)


def checked_share(choice: str, share: float) -> float:
    """A speed choice's share; InputError unless it is a finite number of at least 0 [-]."""
    if not (_is_number(share) and 0.0 <= share < math.inf):
        raise InputError(f"speed choice {choice!r}: share() must return at least 0 [-]; got {shown(share)}")
    return float(share)


def checked_lamps(method: str, value: object) -> Lamp:
    """A lighting policy's result; InputError unless it is a valid `Lamp`."""
    who = f"lighting policy {method!r}: lamps()"
    return _real_lamps(who, _of_type(who, value, Lamp))


def checked_lamp_choice(method: str, value: object) -> LampChoice:
    """Result of a lighting policy that uses sensors; InputError unless it is a valid `LampChoice`."""
    who = f"lighting policy {method!r}: choose_lamps()"
    choice = _of_type(who, value, LampChoice)
    _real_lamps(who, _of_type(f"{who}: lamps", choice.lamps, Lamp))
    return choice


def _real_lamps(who: str, lamps: Lamp) -> Lamp:
    unknown = int(lamps) & ~int(ALL_LAMPS)
    if unknown:
        raise InputError(
            f"{who}: no lamp has the bits {unknown}; there are {', '.join(str(lamp.name) for lamp in Lamp)}"
        )
    return lamps


def checked_control(controller: str, value: object) -> Control:
    """A controller's request; InputError unless it is a `Control` with finite numbers, not both of them."""
    who = f"controller {controller!r}"
    control = _of_type(who, value, Control)
    for name in ("acceleration", "speed"):
        number = getattr(control, name)
        if number is not None and not (_is_number(number) and math.isfinite(number)):
            raise InputError(f"{who}: {name} must be finite or None, got {shown(number)}")
    if control.acceleration is not None and control.speed is not None:
        raise InputError(f"{who}: expected an acceleration or a speed, got both: {shown(control)}")
    if control.lamps is not None:
        _real_lamps(who, _of_type(f"{who}: lamps", control.lamps, Lamp))
    if control.warning is not None:
        _of_type(f"{who}: warning", control.warning, DriverWarning)
    return control


def checked_command(value: object) -> Command:
    """A user policy's command; InputError unless it is a `Command` with valid speeds and stretches."""
    command = _of_type("the command", value, Command)
    _of_type("the command's advice", command.advice, SpeedAdvice)
    _of_type("the command's lamps", command.lamps, Lamp)
    _check_speed("the command", "advice.speed", command.advice.speed)
    _check_kind("the command", "lamps_of", command.lamps_of, Mapping, "a mapping from vehicle ids to lamps")
    for vehicle, lit in command.lamps_of.items():
        _of_type(f"the command's lamps_of[{vehicle!r}]", lit, Lamp)
    _check_kind(
        "the command", "advised_speeds", command.advised_speeds, Mapping, "a mapping from vehicle ids to speeds"
    )
    for vehicle, speed in command.advised_speeds.items():
        _check_speed("the command", f"advised_speeds[{vehicle!r}]", speed)
    if not (_is_number(command.advice_reach) and command.advice_reach >= 0.0):
        raise InputError(f"the command: advice_reach must be at least 0 [m], got {shown(command.advice_reach)}")
    if command.control is not None:
        control = _of_type("the command's control", command.control, EgoControl)
        if not (_is_number(control.acceleration) and math.isfinite(control.acceleration)):
            raise InputError(f"the command: control.acceleration must be finite, got {shown(control.acceleration)}")
        _check_kind("the command", "control.lanes", control.lanes, int, "a whole number of lanes to the left")
        _check_kind("the command", "control.brakes_with_driver", control.brakes_with_driver, bool, "true or false")
    if command.warning is not None:
        _of_type("the command's warning", command.warning, DriverWarning)
    _check_kind("the command", "stretches", command.stretches, tuple, "a tuple of StretchAdvice")
    for place, advice in enumerate(command.stretches):
        _check_stretch_advice(f"the command's stretches[{place}]", advice)
    return command


def _check_stretch_advice(who: str, value: object) -> None:
    advice = _of_type(who, value, StretchAdvice)
    _check_speed(who, "speed", advice.speed)
    _check_kind(who, "display", advice.display, Display, "a fogsim.values.Display")
    stretch = _of_type(f"{who}.stretch", advice.stretch, Stretch)
    if not (_is_number(stretch.start) and math.isfinite(stretch.start) and stretch.start >= 0.0):
        raise InputError(
            f"{who}: stretch.start must be a finite position of at least 0 [m], got {shown(stretch.start)}"
        )
    if not (_is_number(stretch.end) and stretch.end > stretch.start):
        raise InputError(
            f"{who}: stretch.end must lie behind its start at {stretch.start!r} [m], got {shown(stretch.end)}"
        )
    _check_kind(who, "stretch.edges", stretch.edges, tuple, "a tuple of ids of edges, empty for the ego's route")
    for edge in stretch.edges:
        _check_kind(who, "stretch.edges", edge, str, "a tuple of ids of edges")


def _check_kind(who: str, field: str, value: object, kind: type, expected: str) -> None:
    if not isinstance(value, kind):
        raise InputError(f"{who}: {field} must be {expected}; got {shown(value)}")


def _check_part(who: str, field: str, value: object, kind: type[ExtinctionBounds | DenserFog]) -> None:
    if value is None:
        return
    _check_kind(who, field, value, kind, f"of type {kind.__module__}.{kind.__name__}, or None")
    for part in fields(kind):
        number = getattr(value, part.name)
        if not (_is_number(number) and number >= 0.0):
            raise InputError(f"{who}: {field}.{part.name} must be a number of at least 0; got {shown(number)}")


def checked_values(metric: str, value: object) -> Mapping[str, Any]:
    """A metric's result in Python's numbers; InputError unless it nests names of None, words and finite numbers."""
    who = f"metric {metric!r}: result()"
    if not isinstance(value, Mapping):
        raise InputError(f"{who} must return a mapping of keys to values, got {shown(value)}")
    return {key: _checked_entry(who, key, entry) for key, entry in value.items()}


def checked_recorder(name: str, value: T) -> T:
    """A recorder from a factory; InputError if it lacks a method of `fogsim.recorders.Recorder`."""
    missing = [f"{method}()" for method in ("record", "close") if not callable(getattr(value, method, None))]
    if missing:
        raise InputError(
            f"recorder {name!r}: its factory must return an object with {' and '.join(missing)}; got {shown(value)}"
        )
    return value


def _checked_entry(who: str, key: object, entry: Any) -> Any:
    if not isinstance(key, str):
        raise InputError(f"{who}: keys must be words, got {shown(key)}")
    if isinstance(entry, Mapping):
        return {inner: _checked_entry(who, f"{key}.{inner}", value) for inner, value in entry.items()}
    if _is_number(entry):
        if not math.isfinite(entry):
            raise InputError(f"{who}: {key} must be a finite number, or None where it is undefined; got {shown(entry)}")
        return int(entry) if isinstance(entry, Integral) else float(entry)
    if entry is not None and not isinstance(entry, str):
        raise InputError(f"{who}: {key} must be None, a word, a finite number or a mapping of such; got {shown(entry)}")
    return entry


def _of_type(who: str, value: object, kind: type[T]) -> T:
    if not isinstance(value, kind):
        raise InputError(f"{who} must be of type fogsim.values.{kind.__name__}, got {shown(value)}")
    return value


def _is_number(value: object) -> bool:
    # The abstract class is asked last: it is slow.
    return isinstance(value, float) or (isinstance(value, Real) and not isinstance(value, bool))


def _check_number(who: str, field: str, value: float, hint: str) -> None:
    if not (_is_number(value) and 0.0 <= value < math.inf):
        raise InputError(f"{who}: {field} must be a finite number of at least 0{hint}; got {shown(value)}")


def _check_speed(who: str, field: str, speed: float) -> None:
    if not (_is_number(speed) and speed >= 0.0):
        raise InputError(f"{who}: {field} must be at least 0 [m/s], or inf for no advice; got {shown(speed)}")
