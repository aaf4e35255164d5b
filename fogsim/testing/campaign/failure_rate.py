"""The failure rate under the declared distributions: importance sampling with a proposal found by cross-entropy.

In standard normal coordinates of the quantiles. Source: Papaioannou, Geyer & Straub (2019), Improved cross
entropy-based importance sampling with a flexible mixture model, Reliability Engineering & System Safety 191, 106564:
with one normal distribution, and a share of the declared one, which bounds the weights (Hesterberg 1995, Technometrics
37, 185).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp

from fogsim.core.linear_algebra import cholesky_factor, matrix_product, solved_lower

_DECLARED_SHARE = 0.1
"""Share of the draws of a proposal that comes from the declared distributions [-]."""

_TARGET = 1.5
"""Coefficient of variation of the weights to which a level may go [-]."""

_WIDENING = 1.2
"""Factor of the proposal's deviations, since a narrow proposal is the worse mistake [-]."""

LEAST_EFFECTIVE = 30.0
"""Effective number of failing runs below which no rate is given [-]."""

_HALF_WIDTH = 1.75
"""Half-width of the 90 % interval in standard errors: 1.645, and some for the skewness of the weights [-]."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """Normal distribution from which runs are drawn, mixed with the declared one."""

    mean: NDArray[np.float64]
    factor: NDArray[np.float64]  # Lower triangular, of the covariance
    is_final: bool = False

    def draw(self, generator: np.random.Generator, number: int) -> NDArray[np.float64]:
        """Places in standard normal coordinates (number, d)."""
        normal = generator.standard_normal((number, len(self.mean)))
        is_declared = generator.random(number) < _DECLARED_SHARE
        moved = self.mean + (normal[:, None, :] * self.factor).sum(axis=2)
        return np.asarray(np.where(is_declared[:, None], normal, moved), float)

    def log_weights(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Logarithm of the declared density over that of the proposal (n,)."""
        centred = solved_lower(self.factor, np.ascontiguousarray((places - self.mean).T))
        own = -0.5 * (centred**2).sum(axis=0) - float(np.log(self.factor.diagonal()).sum())
        declared = -0.5 * (places**2).sum(axis=1)
        mixed = np.logaddexp(math.log(1.0 - _DECLARED_SHARE) + own, math.log(_DECLARED_SHARE) + declared)
        return np.asarray(declared - mixed, float)


def first_proposal(width: int) -> Proposal:
    """The declared distributions of `width` parameters."""
    return Proposal(np.zeros(width), np.eye(width))


def next_proposal(proposal: Proposal, places: NDArray[np.float64], margins: NDArray[np.float64]) -> Proposal:
    """Proposal nearer to failure, from runs that were drawn from the one before; margins up to 0 have failed."""
    log_weights, unit = proposal.log_weights(places), float(np.std(margins)) or 1.0
    smooth = np.geomspace(1e-3, 1e2, 101) * unit
    trials = [log_weights + log_ndtr(-margins / one) for one in smooth]
    fitting = [trial for trial in trials if _variation(trial) <= _TARGET]
    chosen = fitting[0] if fitting else trials[-1]
    failed = margins <= 0.0
    ratio = np.where(failed, log_weights, -np.inf) - chosen
    # Weights of failure relative to those of the smoothed limit: once they vary little, the limit is reached.
    is_final = bool(failed.any()) and _variation(ratio) <= _TARGET
    share = np.exp(chosen - logsumexp(chosen))
    mean = (share[:, None] * places).sum(axis=0)
    spread = (places - mean) * np.sqrt(share)[:, None]
    covariance = matrix_product(spread.T, spread) * _WIDENING**2 + 1e-6 * np.eye(len(mean))
    return Proposal(mean, cholesky_factor(covariance), is_final)


def _variation(log_values: NDArray[np.float64]) -> float:
    """Coefficient of variation of values by their logarithms [-]."""
    values = np.exp(log_values - log_values.max())
    return float(values.std() / values.mean())


@dataclass(frozen=True, slots=True)
class FailureRate:
    """Estimate of a failure rate [-], its 90 % interval, and the effective number of failing runs."""

    rate: float
    low: float
    high: float
    effective: float
    runs: int

    @property
    def is_known(self) -> bool:
        """Whether enough runs failed to give a rate."""
        return self.effective >= LEAST_EFFECTIVE


def failure_rate(proposal: Proposal, places: NDArray[np.float64], margins: NDArray[np.float64]) -> FailureRate:
    """Rate from the runs that a proposal gave, by their places and margins."""
    weights = np.where(margins <= 0.0, np.exp(proposal.log_weights(places)), 0.0)
    number, total = len(weights), float(weights.sum())
    if total == 0.0:
        return FailureRate(0.0, 0.0, 1.0, 0.0, number)
    rate, effective = total / number, total**2 / float((weights**2).sum())
    spread = _HALF_WIDTH * float(weights.std(ddof=1)) / (rate * math.sqrt(number))
    return FailureRate(rate, rate * math.exp(-spread), min(rate * math.exp(spread), 1.0), effective, number)
