"""How a published finding is written down, and when ours agrees with it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from fogsim.reproduce.drivers.plan import DEFAULT, MEDIUM, SIGNED, Case, Pair
from fogsim.reproduce.drivers.results import Results

NEAR, FACTOR = 0.3, 2.0
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
    """A published number, or a range of them.

    Attributes
    ----------
    low, high : float
        Its ends; the same for one number. Both have the same sign.
    unit : str
        Their unit.
    """

    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        """As a table has it."""
        ends = f"{self.low:.3g}" if self.low == self.high else f"{self.low:.3g} … {self.high:.3g}"
        return f"{ends} {self.unit}"

    def verdict(self, value: float) -> Verdict:
        """How near a value of ours is.

        Parameters
        ----------
        value : float
            In the same unit.
        """
        if self.low <= value <= self.high:
            return Verdict.INSIDE
        ratio = value / min(self.low, self.high, key=lambda end: abs(value - end))
        if abs(ratio - 1.0) <= NEAR:
            return Verdict.INSIDE
        return Verdict.FACTOR_OF_TWO if 1.0 / FACTOR <= ratio <= FACTOR else Verdict.OUTSIDE


@dataclass(frozen=True, slots=True)
class Bound:
    """A published statement that something lies between two numbers.

    Attributes
    ----------
    low, high : float
        The numbers.
    unit : str
        Their unit.
    """

    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        """As a table has it."""
        return f"{self.low:.3g} … {self.high:.3g} {self.unit}"

    def verdict(self, value: float) -> Verdict:
        """Whether a value of ours lies there.

        Parameters
        ----------
        value : float
            In the same unit.
        """
        return Verdict.INSIDE if self.low <= value <= self.high else Verdict.OUTSIDE


@dataclass(frozen=True, slots=True)
class Sign:
    """A published statement that something rises (or falls), without a number.

    Attributes
    ----------
    rises : bool
        Whether it rises.
    unit : str
        Unit of ours.
    origin : float
        What ours is if nothing changes: 0 of a difference, 1 of a ratio.
    """

    rises: bool
    unit: str
    origin: float = 0.0

    def __str__(self) -> str:
        """As a table has it."""
        return f"{'>' if self.rises else '<'} {self.origin:.3g} {self.unit}"

    def verdict(self, value: float) -> Verdict:
        """Whether a value of ours has the published sign.

        Parameters
        ----------
        value : float
            The difference or ratio.
        """
        return Verdict.RIGHT if (value > self.origin) == self.rises and value != self.origin else Verdict.WRONG


@dataclass(frozen=True, slots=True)
class Look:
    """Looks up a population's measures.

    Attributes
    ----------
    results : Results
        All that was measured.
    population : str
        Whose.
    """

    results: Results
    population: str

    def __call__(self, measure: str, visibility: float, demand: float = MEDIUM) -> NDArray[np.float64]:
        """Values of a measure, seed by seed (n,).

        Parameters
        ----------
        measure : str
            A field of `Measures`.
        visibility : float
            V_met [m].
        demand : float
            Vehicles that want to enter [1/h].

        Raises
        ------
        KeyError
            If that was not run.
        """
        return self.results.over_seeds(Case(self.population, demand, visibility), measure)

    def signed(self, measure: str, visibility: float) -> NDArray[np.float64]:
        """Values under the A16's signs (n,), which only the default drivers have.

        Parameters
        ----------
        measure, visibility
            As in a call.

        Raises
        ------
        KeyError
            If that was not run.
        """
        population = SIGNED if self.population == DEFAULT else f"{self.population} {SIGNED}"
        return self.results.over_seeds(Case(population, MEDIUM, visibility), measure)

    def pair(self, measure: str, leader_speed: float, visibility: float) -> NDArray[np.float64]:
        """Values of a measure of drivers behind one leader, seed by seed (n,).

        Parameters
        ----------
        measure : str
            A field of `PairMeasures`.
        leader_speed : float
            Speed of the leaders [m/s].
        visibility : float
            V_met [m].

        Raises
        ------
        KeyError
            If that was not run.
        """
        return self.results.over_seeds(Pair(self.population, leader_speed, visibility), measure)

    def kind(self, name: str, measure: str, leader_speed: float, visibility: float) -> NDArray[np.float64]:
        """Values of a kind of drivers behind one leader (n,), which stand beside the default drivers alone.

        Parameters
        ----------
        name : str
            The kind.
        measure, leader_speed, visibility
            As of `pair`.

        Raises
        ------
        KeyError
            If that was not run.
        """
        who = name if self.population == DEFAULT else f"{self.population} {name}"
        return self.results.over_seeds(Pair(who, leader_speed, visibility), measure)


@dataclass(frozen=True, slots=True)
class Finding:
    """A published finding.

    Attributes
    ----------
    name : str
        Its key in records.
    text : str
        What was found, where.
    source : str
        Where it is published.
    published : Size, Bound or Sign
        What was found, as far as it can be compared.
    ours : callable
        From a `Look` to our values, seed by seed.
    six : bool
        Whether it is one of the six sizes that are to be met within 30 %.
    """

    name: str
    text: str
    source: str
    published: Size | Bound | Sign
    ours: Callable[[Look], NDArray[np.float64]]
    six: bool = False

    def values(self, look: Look) -> NDArray[np.float64]:
        """Ours, seed by seed (n,); none if what it takes was not run.

        Parameters
        ----------
        look : Look
            At a population.
        """
        try:
            return self.ours(look)
        except KeyError:
            return np.empty(0)

    def verdict(self, value: float) -> Verdict:
        """Whether a value of ours agrees.

        Parameters
        ----------
        value : float
            NaN if there is none.
        """
        return Verdict.UNKNOWN if math.isnan(value) else self.published.verdict(value)
