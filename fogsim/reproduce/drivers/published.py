"""How a published finding is written down, and when ours agrees with it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fogsim.reproduce.drivers.plan import DEFAULT, MEDIUM, SIGNED, Case, Pair, Results

NEAR, _FACTOR = 0.3, 2.0
"""Relative error of a size up to which ours is inside, and factor up to which it is not outside [-]."""


class Verdict(StrEnum):
    """Whether ours agrees."""

    INSIDE = "inside"
    FACTOR_OF_TWO = "within factor 2"
    OUTSIDE = "outside"
    RIGHT = "right sign"
    WRONG = "wrong sign"
    UNKNOWN = "not measured"


@dataclass(frozen=True, slots=True)
class Size:
    """A published number, or a range of them, of one sign."""

    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        """As a table has it."""
        ends = f"{self.low:.3g}" if self.low == self.high else f"{self.low:.3g} … {self.high:.3g}"
        return f"{ends} {self.unit}"

    def verdict(self, value: float) -> Verdict:
        """How near a value of ours is."""
        if self.low <= value <= self.high:
            return Verdict.INSIDE
        ratio = value / min(self.low, self.high, key=lambda end: abs(value - end))
        if abs(ratio - 1.0) <= NEAR:
            return Verdict.INSIDE
        return Verdict.FACTOR_OF_TWO if 1.0 / _FACTOR <= ratio <= _FACTOR else Verdict.OUTSIDE


@dataclass(frozen=True, slots=True)
class Bound:
    """A published statement that something lies between two numbers."""

    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        """As a table has it."""
        return f"{self.low:.3g} … {self.high:.3g} {self.unit}"

    def verdict(self, value: float) -> Verdict:
        """Whether a value of ours lies there."""
        return Verdict.INSIDE if self.low <= value <= self.high else Verdict.OUTSIDE


@dataclass(frozen=True, slots=True)
class Sign:
    """A published statement that something rises or falls from an origin: 0 for a difference, 1 for a ratio."""

    rises: bool
    unit: str
    origin: float = 0.0

    def __str__(self) -> str:
        """As a table has it."""
        return f"{'>' if self.rises else '<'} {self.origin:.3g} {self.unit}"

    def verdict(self, value: float) -> Verdict:
        """Whether a value of ours has the published sign."""
        return Verdict.RIGHT if (value > self.origin) == self.rises and value != self.origin else Verdict.WRONG


@dataclass(frozen=True, slots=True)
class Look:
    """Looks up a population's measures; KeyError where they were not run."""

    results: Results
    population: str

    def __call__(self, measure: str, visibility: float, demand: float = MEDIUM) -> NDArray[np.float64]:
        """Values of a measure, seed by seed (n,), by visibility [m] and demand [1/h]."""
        return self.results.over_seeds(Case(self.population, demand, visibility), measure)

    def signed(self, measure: str, visibility: float) -> NDArray[np.float64]:
        """Values under the A16's signs (n,), which only the default drivers have."""
        population = SIGNED if self.population == DEFAULT else f"{self.population} {SIGNED}"
        return self.results.over_seeds(Case(population, MEDIUM, visibility), measure)

    def pair(self, measure: str, leader_speed: float, visibility: float) -> NDArray[np.float64]:
        """Values of a measure of drivers behind one leader (n,), by the leader's speed [m/s] and visibility [m]."""
        return self.results.over_seeds(Pair(self.population, leader_speed, visibility), measure)

    def kind(self, name: str, measure: str, leader_speed: float, visibility: float) -> NDArray[np.float64]:
        """Values of one type of drivers behind one leader (n,), compared with the default drivers alone."""
        who = name if self.population == DEFAULT else f"{self.population} {name}"
        return self.results.over_seeds(Pair(who, leader_speed, visibility), measure)


@dataclass(frozen=True, slots=True)
class Finding:
    """A published finding, and how to get ours, seed by seed; `six` are those to be met within 30 %."""

    name: str
    text: str
    source: str
    published: Size | Bound | Sign
    ours: Callable[[Look], NDArray[np.float64]]
    six: bool = False

    def values(self, look: Look) -> NDArray[np.float64]:
        """Ours, seed by seed (n,); none if what it takes was not run."""
        try:
            return self.ours(look)
        except KeyError:
            return np.empty(0)

    def verdict(self, value: float) -> Verdict:
        """Whether a value of ours agrees; NaN stands for none."""
        return Verdict.UNKNOWN if math.isnan(value) else self.published.verdict(value)
