"""What was measured over seeds, and how sure it is."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.reproduce.drivers.pairs import PairMeasures
from fogsim.reproduce.drivers.passages import Measures
from fogsim.reproduce.drivers.plan import Case, Pair

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
