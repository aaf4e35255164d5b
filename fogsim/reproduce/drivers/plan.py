"""What of the evaluation of drivers in fog is run: who drives, how many, in which fog, with which seeds."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fogsim.reproduce.drivers.road import Measures, PairMeasures

CALIBRATION_SEEDS = tuple(range(101, 111))
"""Seeds with which constants of the drivers were calibrated. None of them is reported."""

REPORT_SEEDS = tuple(range(1, 11))
"""Seeds that are reported. Nothing was calibrated with them."""

DEFAULT, SEEING, SIGNED = "default", "see_through_fog", "with signs"

_POPULATIONS: Mapping[str, tuple[str, ...]] = {
    DEFAULT: (),
    SEEING: ("drivers.see_through_fog=true", "drivers.speed_choice=observed"),
}
"""Who drives, by what is set in their scenario."""

CAREFUL, MISJUDGING = "careful", "misjudging, by night"

_KINDS: Mapping[str, tuple[str, ...]] = {
    CAREFUL: ("drivers.following=careful",),
    MISJUDGING: ("light.illuminance_lx=0", "drivers.distance_misjudgement=0.45"),
}
"""Kinds of drivers who follow one slow leader each, and nothing else."""

SPARSE, MEDIUM, DENSE = 600.0, 1200.0, 1800.0
"""Demands on both lanes [vehicles/h]."""

CLEAR = math.inf
"""Visibility of clear air [m]."""

SLOW, FAST = 13.4, 22.4
"""Speeds of leaders in the simulator of Broughton, Switzer & Scott (2007) [m/s]."""

PAIRS_IN = 40.0
"""V_met in which drivers follow one leader each [m]; the excerpts that we have seen do not give the study's fogs."""

SIGNS: Mapping[float, float] = {100.0: 80.0, 50.0: 60.0, 30.0: 60.0}
"""What the A16's signs show [km/h] by V_met [m]: 80 from 70 to 140 m, 60 below (Hogema & van der Horst 1997)."""

_SIGNED_COMPLIANCE = "drivers.compliance.like=speed_limit_sign"
"""How the default drivers follow them."""


@dataclass(frozen=True, slots=True)
class Case:
    """Traffic of a population of the plan, or of `SIGNED`, the default drivers under the A16's signs, in one fog."""

    population: str
    demand: float  # on both lanes [vehicles/h]
    visibility: float  # [m]; inf in clear air


@dataclass(frozen=True, slots=True)
class Pair:
    """Drivers of a population who follow one leader each."""

    population: str
    leader_speed: float  # [m/s]
    visibility: float  # [m]; inf in clear air


@dataclass(frozen=True, slots=True)
class Plan:
    """Which part of the evaluation is run; populations and types of drivers by the scenario's keys that are set."""

    seeds: tuple[int, ...] = REPORT_SEEDS
    demands: tuple[float, ...] = (SPARSE, MEDIUM, DENSE)  # on both lanes [vehicles/h]
    visibilities: tuple[float, ...] = (CLEAR, 300.0, 200.0, 150.0, 100.0, 70.0, 50.0, 30.0)  # [m]
    populations: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: _POPULATIONS)
    seconds: float = 600.0  # watched [s]
    leader_speeds: tuple[float, ...] = (SLOW, FAST)  # [m/s]
    followers: int = 20  # in a run
    kinds: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: _KINDS)

    @property
    def cases(self) -> tuple[Case, ...]:
        """Every case once."""
        own = tuple(
            Case(population, demand, visibility)
            for population in self.populations
            for demand in self.demands
            for visibility in self.visibilities
        )
        signed = tuple(Case(SIGNED, MEDIUM, v) for v in self.visibilities if v in SIGNS and MEDIUM in self.demands)
        return own + (signed if DEFAULT in self.populations else ())

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Every case of drivers behind one leader once."""
        followers = [(population, speed) for population in self.populations for speed in self.leader_speeds]
        followers += [(kind, self.leader_speeds[0]) for kind in self.kinds if self.leader_speeds]
        return tuple(Pair(who, speed, visibility) for who, speed in followers for visibility in (CLEAR, PAIRS_IN))

    def overrides(self, case: Case | Pair) -> tuple[str, ...]:
        """What is set in the scenario of a case's drivers."""
        if case.population == SIGNED:
            return (*self.populations[DEFAULT], _SIGNED_COMPLIANCE)
        return {**self.kinds, **self.populations}[case.population]


_RESAMPLES = 4000
"""Bootstrap samples of an interval."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A mean over seeds with its 95 % interval, by bootstrap over seeds; NaN where no run gave a value."""

    mean: float
    low: float
    high: float


def interval(values: NDArray[np.float64]) -> Interval:
    """Mean over seeds (n,) and its interval; runs without a value do not count."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return Interval(np.nan, np.nan, np.nan)
    means = np.random.default_rng(0).choice(finite, (_RESAMPLES, finite.size)).mean(axis=1)
    low, high = np.percentile(means, (2.5, 97.5))
    return Interval(float(finite.mean()), float(low), float(high))


@dataclass(frozen=True, slots=True)
class Results:
    """Measures of each case and pair, one for each seed in the same order."""

    runs: Mapping[Case | Pair, tuple[Measures | PairMeasures, ...]]

    def over_seeds(self, case: Case | Pair, measure: str) -> NDArray[np.float64]:
        """One measure of a case, seed by seed (n,)."""
        return np.array([getattr(run, measure) for run in self.runs[case]], np.float64)
