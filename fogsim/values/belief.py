"""What is believed about the fog after many estimates."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY, extinction_from_visibility
from fogsim.values.estimate import DenserFog

WIDEST = 0.7
"""Standard deviation of ln k above which a belief says too little to act on [-]."""

OLDEST = 60.0
"""Age of the last evidence beyond which a belief says too little to act on [s]: nearly 2 km on a motorway."""

NO_FOG = 1000.0
"""Visibility from which on there is no fog (WMO) [m]; how clear the air is beyond that changes no decision."""

_LOG_NO_FOG = math.log(extinction_from_visibility(NO_FOG))


@dataclass(frozen=True, slots=True)
class FogProfile:
    """Normal distributions of ln k at places along the way, behind a vehicle and ahead of it.

    Attributes
    ----------
    distance : (n,) float64
        Distance ahead of the vehicle [m], ascending; negative behind it.
    log_extinction : (n,) float64
        Mean, and median, of ln k with k in 1/m.
    standard_deviation : (n,) float64
        Of ln k [-].
    """

    distance: NDArray[np.float64]
    log_extinction: NDArray[np.float64]
    standard_deviation: NDArray[np.float64]

    def at(self, distance: float) -> tuple[float, float]:
        """Mean and standard deviation of ln k at a place; beyond either end those of the end [-].

        Parameters
        ----------
        distance : float
            Distance ahead [m].
        """
        mean, deviation = (
            float(np.interp(distance, self.distance, values))
            for values in (self.log_extinction, self.standard_deviation)
        )
        return mean, deviation

    def visibility_quantile(self, distance: float, share: float) -> float:
        """Visibility below which the truth lies at a place with a given probability [m].

        Parameters
        ----------
        distance : float
            Distance ahead [m].
        share : float
            Probability, above 0 and below 1.
        """
        mean, deviation = self.at(distance)
        return OPTICAL_DEPTH_AT_VISIBILITY * math.exp(NormalDist().inv_cdf(share) * deviation - mean)

    def known_visibility(self, distance: float, share: float, widest: float = WIDEST) -> float | None:
        """Quantile of the visibility at a place to act on [m]; None where the profile says too little.

        Parameters
        ----------
        distance, share : float
            See `visibility_quantile`.
        widest : float
            Largest standard deviation of ln k to act on [-].
        """
        mean, deviation = self.at(distance)
        if deviation > widest:
            return None
        return OPTICAL_DEPTH_AT_VISIBILITY * math.exp(NormalDist().inv_cdf(share) * deviation - mean)

    def known_visibilities(self, share: float, widest: float = WIDEST) -> NDArray[np.float64]:
        """Quantiles of the visibility at all its places to act on [m]; NaN where the profile says too little.

        Parameters
        ----------
        share, widest : float
            See `known_visibility`.
        """
        deviate = NormalDist().inv_cdf(share)
        visibilities = OPTICAL_DEPTH_AT_VISIBILITY * np.exp(deviate * self.standard_deviation - self.log_extinction)
        return np.where(self.standard_deviation > widest, np.nan, visibilities)


@dataclass(frozen=True, slots=True)
class Belief:
    """A distribution over the logarithm of the extinction coefficient.

    Attributes
    ----------
    log_extinction : (n,) float64
        Centres of the cells, ln k with k in 1/m, evenly spaced and ascending.
    probability : (n,) float64
        Probability of each cell; sums to 1.
    denser : DenserFog or None
        Denser fog ahead that several estimates have reported.
    profile : FogProfile or None
        Belief about places along the way, from fusions that provide one.
    age : float
        Time since the last estimate or report with information on the fog [s]; ``inf`` if none has.
    """

    log_extinction: NDArray[np.float64]
    probability: NDArray[np.float64]
    denser: DenserFog | None = None
    profile: FogProfile | None = None
    age: float = 0.0
    # Quantiles that were asked for; for None the deviation that `is_informed` needs. Several decisions ask for the same
    _known: dict[float | None, float] = field(default_factory=dict, init=False, repr=False, compare=False)

    def is_informed(self, widest: float = WIDEST) -> bool:
        """Whether the belief says enough to act on: recent evidence has narrowed it down.

        "At least 400 m" is enough: visibilities above 1 km count as 1 km.

        Parameters
        ----------
        widest : float
            Largest standard deviation of ln k to act on [-].
        """
        if self.age > OLDEST:
            return False
        if None not in self._known:
            in_fog = np.maximum(np.array(self.log_extinction, float), _LOG_NO_FOG)
            self._known[None] = _moments(in_fog, np.array(self.probability, float))[1]
        return self._known[None] <= widest

    def known_visibility(self, share: float, widest: float = WIDEST) -> float | None:
        """Quantile of the visibility to act on [m]; None if the belief says too little: every decision asks here.

        Parameters
        ----------
        share, widest : float
            See `visibility_quantile` and `is_informed`.
        """
        return self.visibility_quantile(share) if self.is_informed(widest) else None

    def visibility_quantile(self, share: float) -> float:
        """Visibility below which the truth lies with a given probability [m].

        Parameters
        ----------
        share : float
            Probability in 0 … 1; 0.05 is a cautious visibility, 0.5 the median.
        """
        if share not in self._known:
            self._known[share] = self.visibility_quantiles((share,))[0]
        return self._known[share]

    def visibility_quantiles(self, shares: Sequence[float]) -> tuple[float, ...]:
        """Several of these together, which cost hardly more than one [m].

        Parameters
        ----------
        shares : (n,) sequence of float
            Probabilities in 0 … 1.
        """
        log_extinctions = 1.0 - np.array(shares)
        # Copies are of one type, for which the kernel is compiled.
        _put_quantiles(np.array(self.log_extinction, float), np.array(self.probability, float), log_extinctions)
        return tuple((OPTICAL_DEPTH_AT_VISIBILITY / np.exp(log_extinctions)).tolist())

    @property
    def visibility(self) -> float:
        """Median visibility [m]."""
        return self.visibility_quantile(0.5)

    @property
    def log_standard_deviation(self) -> float:
        """Standard deviation of ln k [-]."""
        return self.log_moments()[1]

    def log_moments(self) -> tuple[float, float]:
        """Mean and standard deviation of ln k [ln 1/m, -]."""
        return _moments(np.array(self.log_extinction, float), np.array(self.probability, float))


@kernel
def _moments(values: NDArray[np.float64], probability: NDArray[np.float64]) -> tuple[float, float]:
    """Mean and standard deviation of values with their probabilities."""
    mean = variance = 0.0
    for i in range(len(values)):
        mean += probability[i] * values[i]
    for i in range(len(values)):
        variance += probability[i] * (values[i] - mean) ** 2
    return mean, math.sqrt(variance)


@kernel
def _put_quantiles(values: NDArray[np.float64], probability: NDArray[np.float64], shares: NDArray[np.float64]) -> None:
    """Put quantiles in the place of shares, by straight lines between the middles of cells."""
    last = len(values) - 1
    for i in range(len(shares)):
        share, quantile = shares[i], values[last]
        total = before = 0.0
        for j in range(len(values)):
            total += probability[j]
            middle = total - 0.5 * probability[j]
            if middle > share:
                quantile = values[j]
                if j > 0:
                    slope = (values[j] - values[j - 1]) / (middle - before)
                    quantile = slope * (share - before) + values[j - 1]
                break
            before = middle
        shares[i] = quantile


THINNEST = 1e-6
"""Extinction coefficient of what counts as clear air in a belief, whose cells are logarithms [1/m]."""


def certain_belief(extinction: float) -> Belief:
    """Belief of an observer who knows the fog, as a visibility meter next to the road does (`extinction` [1/m])."""
    return Belief(np.log([max(extinction, THINNEST)]), np.ones(1))
