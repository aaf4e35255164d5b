"""Values of a name in the cases of a file: a list, a range, seeds, or draws from a distribution."""

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import scipy

from fogsim.core.randomness import named_generator
from fogsim.errors import shown, suggest
from fogsim.units.quantities import split_quantity

_MOST_VALUES = 100_000
"""Maximum number of values of one name."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_SEEDS = re.compile(r"\s*([0-9]{1,9})\s+seeds?\s*\Z")
_RANGE = ("from", "to", "step")
_DISTRIBUTIONS = {
    "uniform": "its lower and upper end",
    "loguniform": "its lower and upper end, above 0",
    "normal": "mean and standard deviation",
    "lognormal": "median and standard deviation of the logarithm",
}
_LIMITS = ("at_least", "at_most")
_EXPECTED = "expected a list, {from, to, step}, 20 seeds, or {uniform: [low, high]}"
_MOST_DRAWS = 10_000
_LARGEST_EXPONENT = 709.0  # of a floating-point number

Value = str | float | int | bool
"""Value of a name in one case."""


def value_text(value: Value) -> str:
    """A value as labels and files show it."""
    if isinstance(value, float):
        short = f"{value:g}"
        return short if float(short) == value else repr(value)
    return str(value).lower() if isinstance(value, bool) else str(value)


class LevelsError(ValueError):
    """What is wrong with the values of a name, and at which key or index below it."""

    def __init__(self, message: str, *below: str | int) -> None:
        super().__init__(message)
        self.below = below


@dataclass(frozen=True, slots=True)
class Levels:
    """Values that are all used, one after another."""

    values: tuple[Value, ...]
    is_drawn = False
    is_divisible = True

    def __len__(self) -> int:
        return len(self.values)

    def __iter__(self) -> Iterator[Value]:
        return iter(self.values)

    @property
    def is_numeric(self) -> bool:
        """Whether all are numbers, with or without a unit."""
        return all(not isinstance(one, bool) and _number_and_unit(one) is not None for one in self.values)

    def value(self, _: int) -> Value:
        """First of the values, whatever the seed."""
        return self.values[0]


@dataclass(frozen=True, slots=True)
class SeedLevels(Levels):
    """Seeds, which also seed the runs."""

    is_divisible = False


@dataclass(frozen=True, slots=True)
class FileLevels(Levels):
    """Values of a parameter in the cases of an OpenSCENARIO file, which has no others."""

    is_divisible = is_numeric = False


@dataclass(frozen=True, slots=True)
class Draws:
    """A value per seed from a distribution with `parameters` in `unit`; values outside `limits` are drawn again."""

    name: str
    distribution: str
    parameters: tuple[float, float]
    limits: tuple[float, float]
    unit: str
    is_drawn = True
    is_numeric = is_divisible = False

    def __len__(self) -> int:
        return 1

    def __iter__(self) -> Iterator[Value]:
        yield self.value(0)

    def value(self, seed: int) -> Value:
        """Value of a seed; LevelsError if ten thousand draws are all outside the limits."""
        generator = named_generator(seed, self.name)
        low, high = self.limits
        for _ in range(_MOST_DRAWS):
            drawn = self._shaped(float(generator.random()), float(generator.standard_normal()))
            if math.isfinite(drawn) and low <= drawn <= high:
                return number_with_unit(drawn, self.unit)
        raise LevelsError(f"none of {_MOST_DRAWS} draws of {self.name} lies between its limits, {low:g} and {high:g}")

    def _shaped(self, uniform: float, normal: float) -> float:
        first, second = self.parameters
        if self.distribution == "uniform":
            return first + (second - first) * uniform
        if self.distribution == "loguniform":
            return float(first * (second / first) ** uniform)
        if self.distribution == "normal":
            return first + second * normal
        return first * math.exp(second * normal) if second * normal < _LARGEST_EXPONENT else math.inf

    @property
    def is_logarithmic(self) -> bool:
        """Whether its axis is logarithmic."""
        return self.distribution in ("loguniform", "lognormal")

    def quantile(self, share: float) -> float:
        """Value below which a share of the distribution between the limits lies, in `unit`."""
        low, high = (self._share_below(limit) for limit in self.limits)
        inner = min(max(low + share * (high - low), 0.0), 1.0)
        return self._shaped(inner, float(scipy.special.ndtri(inner)))

    def _share_below(self, value: float) -> float:
        first, second = self.parameters
        if self.distribution == "normal":
            return float(scipy.special.ndtr((value - first) / second))
        if self.is_logarithmic and value <= 0.0:
            return 0.0
        if self.distribution == "lognormal":
            return float(scipy.special.ndtr(math.log(value / first) / second))
        if self.distribution == "loguniform":
            first, second, value = math.log(first), math.log(second), math.log(value)
        return min(max((value - first) / (second - first), 0.0), 1.0)

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of its axis in `unit`: those of the distribution, or its outermost thousandths where it has none."""
        tail = 0.001 if self.distribution in ("normal", "lognormal") else 0.0
        return self.quantile(tail), self.quantile(1.0 - tail)

    def on_axis(self, place: float) -> float:
        """Value at a place 0 … 1 on the axis, in `unit`."""
        low, high = self.ends
        return low * (high / low) ** place if self.is_logarithmic else low + (high - low) * place

    def place(self, value: float) -> float:
        """Place of a value on the axis, 0 … 1."""
        low, high = self.ends
        if self.is_logarithmic:
            low, high, value = math.log(low), math.log(high), math.log(value)
        return (value - low) / (high - low)


Values = Levels | Draws
"""All values of a name."""


def parse_levels(name: str, written: object) -> Values:
    """Values of a name, from the forms that a file can give.

    A list; ``{from, to, step}``; ``20 seeds`` or ``{seeds: [3, 5]}``; ``{uniform: [low, high]}``, ``{normal: [mean,
    deviation]}`` or ``{lognormal: [median, deviation]}``, optionally with ``at_least`` and ``at_most``.
    """
    if not _NAME.match(name):
        raise LevelsError("a name consists of letters, digits and _, and begins with no digit")
    if isinstance(written, str) and (found := _SEEDS.match(written)):
        return _seeds(int(found[1]))
    if isinstance(written, list):
        return _listed(written)
    if not isinstance(written, dict) or not written:
        raise LevelsError(f"{_EXPECTED}; got {shown(written)}")
    known = ("seeds", *_RANGE, *_DISTRIBUTIONS, *_LIMITS)
    for key in written:
        if key not in known:
            raise LevelsError(f"unknown key; {suggest(str(key), known)}", key)
    if "seeds" in written:
        _refuse_others(written, ("seeds",))
        return _seeds(written["seeds"])
    kind = next((key for key in _DISTRIBUTIONS if key in written), None)
    if kind is None:
        _refuse_others(written, _RANGE)
        return _range(written)
    _refuse_others(written, (kind, *_LIMITS))
    return _draws(name, kind, written)


def parse_space(name: str, written: object) -> Draws | SeedLevels:
    """Declared distribution of a name of ``space``, or ``seeds`` for a seed of its own in each case."""
    if written == "seeds":
        return SeedLevels((0,))
    values = parse_levels(name, written)
    if not isinstance(values, Draws):
        raise LevelsError(f"expected seeds or a distribution ({', '.join(_DISTRIBUTIONS)}), got {shown(written)}")
    return values


def _refuse_others(written: dict[str, object], allowed: tuple[str, ...]) -> None:
    for key in written:
        if key not in allowed:
            raise LevelsError(f"does not go with {next(one for one in written if one in allowed)}", key)


def _seeds(written: object) -> SeedLevels:
    if isinstance(written, int) and not isinstance(written, bool):
        if not 1 <= written <= _MOST_VALUES:
            raise LevelsError(f"expected 1 … {_MOST_VALUES} seeds, got {written}")
        return SeedLevels(tuple(range(written)))
    listed = written if isinstance(written, list) else []
    if not listed or any(isinstance(one, bool) or not isinstance(one, int) or one < 0 for one in listed):
        raise LevelsError(f"expected how many, or a list of whole numbers from 0 on; got {shown(written)}", "seeds")
    _refuse_repeated(listed, "seeds")
    return SeedLevels(tuple(listed))


def _listed(written: list[object]) -> Levels:
    if not written:
        raise LevelsError("needs at least one value")
    for place, one in enumerate(written):
        if not isinstance(one, str | int | float | bool):
            raise LevelsError(f"a value is a number, text, true or false; got {shown(one)}", place)
        if isinstance(one, str) and not one.isprintable():
            raise LevelsError(f"a text names its case and is one line of visible characters; got {shown(one)}", place)
    levels = Levels(tuple(one for one in written if isinstance(one, str | int | float | bool)))
    _refuse_repeated(levels.values)
    return levels


def _refuse_repeated(values: Iterable[Value], *below: str) -> None:
    """Refuse values that name the same case, as 1 and 1.0 do."""
    texts: set[str] = set()
    for place, value in enumerate(values):
        if value_text(value) in texts:
            raise LevelsError(f"{shown(value)} stands twice", *below, place)
        texts.add(value_text(value))


def _range(written: dict[str, object]) -> Levels:
    for key in _RANGE:
        if key not in written:
            raise LevelsError(f"{key} is missing; a range has from, to and step")
    (first, last, step), unit = _numbers({key: written[key] for key in _RANGE})
    if step == 0 or (last - first) / step < 0:
        raise LevelsError(f"a step of {shown(written['step'])} does not lead there", "step")
    if not math.isfinite((last - first) / step):
        raise LevelsError(f"more than {_MOST_VALUES} values", "step")
    number = math.floor((last - first) / step + 1e-9) + 1
    if number > _MOST_VALUES:
        raise LevelsError(f"{number} values are more than {_MOST_VALUES}", "step")
    values = tuple(number_with_unit(first + i * step, unit) for i in range(number))
    if len(set(values)) < number:
        raise LevelsError("its values are the same to six digits, which they are rounded to", "step")
    return Levels(values)


def _draws(name: str, kind: str, written: dict[str, object]) -> Draws:
    pair = written[kind]
    if not isinstance(pair, list) or len(pair) != 2:
        raise LevelsError(f"expected two values, {_DISTRIBUTIONS[kind]}; got {shown(pair)}", kind)
    parameters = {"0": pair[0], "1": pair[1]}
    if kind == "lognormal":
        # The deviation of a logarithm has no unit.
        (deviation,), _ = _numbers({kind: pair[1]})
        limits = {key: written[key] for key in _LIMITS if key in written}
        (median, *ends), unit = _numbers({kind: pair[0], **limits})
        numbers, found = [median, deviation], dict(zip(limits, ends, strict=True))
    else:
        limits = {key: written[key] for key in _LIMITS if key in written}
        numbers, unit = _numbers({**parameters, **limits})
        found = dict(zip(limits, numbers[2:], strict=True))
    first, second = numbers[:2]
    if kind == "loguniform" and first <= 0:
        raise LevelsError(f"expected {_DISTRIBUTIONS[kind]}, got {shown(pair)}", kind)
    has_ends = kind in ("uniform", "loguniform")
    wrong = second <= first if has_ends else second <= 0 or (kind == "lognormal" and first <= 0)
    if wrong:
        raise LevelsError(f"expected {_DISTRIBUTIONS[kind]}, got {shown(pair)}", kind)
    draws = Draws(name, kind, (first, second), (found.get("at_least", -math.inf), found.get("at_most", math.inf)), unit)
    draws.value(0)
    return draws


def _numbers(written: dict[str, object]) -> tuple[list[float], str]:
    """Numbers of values with one common unit, and that unit."""
    found: dict[str, tuple[float, str]] = {}
    for key, value in written.items():
        one = _number_and_unit(value)
        if one is None:
            raise LevelsError(f"expected a number, perhaps with a unit; got {shown(value)}", *_below(key))
        found[key] = one
    units = list(dict.fromkeys(unit for _, unit in found.values()))
    if len(units) > 1:
        raise LevelsError(f"all of it must have the same unit, got {' and '.join(one or 'none' for one in units)}")
    return [number for number, _ in found.values()], units[0]


def _below(key: str) -> tuple[str, ...]:
    return () if key.isdecimal() else (key,)


def _number_and_unit(value: object) -> tuple[float, str] | None:
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return (float(value), "") if math.isfinite(value) else None
    return split_quantity(value) if isinstance(value, str) else None


def number_with_unit(number: float, unit: str) -> Value:
    """A number with its unit, rounded to six digits so that it can name a case."""
    rounded = float(f"{number:.6g}")
    plain: float | int = int(rounded) if rounded.is_integer() and abs(rounded) < 1e6 else rounded
    return f"{plain:g} {unit}" if unit else plain
