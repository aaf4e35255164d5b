"""Which cases a campaign draws: batches that depend only on the seed, the batch and earlier results."""

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp, ndtr
from scipy.stats import qmc

from fogsim.core.linear_algebra import cholesky_factor, matrix_product, solved_lower
from fogsim.core.randomness import named_generator
from fogsim.scenario.variation import Draws, SeedLevels, Value, number_with_unit
from fogsim.testing.campaign.boundary import Boundary, fit_boundary
from fogsim.testing.judgement import rate_bounds
from fogsim.testing.results import CaseResult
from fogsim.units.quantities import split_quantity

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


Sequencing = Literal["sobol", "latin_hypercube"]
"""How the first cases fill the space."""

_FIRST_PER_PARAMETER = 8
"""Cases that fill the space, for each parameter; a power of two of them."""

_BATCH = 16
"""Cases near the boundary between two fits."""

_MOST_FOR_BOUNDARY = 200
_CANDIDATES = 4096

_LEAST_FOR_RATE = 200
"""Cases below which a search for the rate is not begun."""

_LEVELS = 8
"""Share of the cases for the rate that each level has: one in so many; all levels together have at most half."""

_PASSING = 1e-9
"""Margin of a case that passed, at the least [-]."""


class Purpose(StrEnum):
    """What a case was drawn for; only cases of `RATE` enter the failure rate."""

    SPACE = "space"
    BOUNDARY = "boundary"
    LEVEL = "level"
    RATE = "rate"


@dataclass(frozen=True, slots=True)
class Drawn:
    """A case to run: its values as text with units, and what it is for."""

    purpose: Purpose
    values: Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Space:
    """The parameters of a space, those with a distribution, in the file's order."""

    axes: Mapping[str, Draws]

    @classmethod
    def of(cls, declared: Mapping[str, Draws | SeedLevels]) -> "Space":
        """Space of a file."""
        return cls({name: one for name, one in declared.items() if isinstance(one, Draws)})

    def by_quantiles(self, shares: NDArray[np.float64]) -> list[dict[str, Value]]:
        """Values at quantiles (n, d)."""
        return [self._values(row, [one.quantile for one in self.axes.values()]) for row in shares.tolist()]

    def by_places(self, places: NDArray[np.float64]) -> list[dict[str, Value]]:
        """Values at places on the axes (n, d)."""
        return [self._values(row, [one.on_axis for one in self.axes.values()]) for row in places.tolist()]

    def _values(self, row: Sequence[float], functions: Sequence[object]) -> dict[str, Value]:
        values = [function(one) for function, one in zip(functions, row, strict=True)]  # type: ignore[operator]
        return {
            name: number_with_unit(value, axis.unit)
            for value, (name, axis) in zip(values, self.axes.items(), strict=True)
        }

    def places(self, results: Sequence[CaseResult]) -> NDArray[np.float64]:
        """Places of cases on the axes (n, d), 0 … 1 each."""
        rows = [[axis.place(number_of(one.run.levels[name])) for name, axis in self.axes.items()] for one in results]
        return np.array(rows, float).reshape(len(rows), len(self.axes))


def number_of(level: str) -> float:
    """Number in a value, without its unit."""
    found = split_quantity(level)
    return float(level) if found is None else found[0]


@dataclass(frozen=True, slots=True)
class PlainRate:
    """Failures among cases drawn from the declared distributions alone, wherever they are: the 90 % interval."""

    failed: int
    drawn: int

    @property
    def bounds(self) -> tuple[float, float]:
        """Lower and upper bound of the failure rate."""
        low, high = rate_bounds(self.drawn - self.failed, self.drawn, 0.95)
        return 1.0 - high, 1.0 - low


@dataclass(slots=True)
class Findings:
    """What a campaign has found: its cases in order, the boundary, and the failure rate."""

    drawn: list[Drawn] = field(default_factory=list)
    results: list[CaseResult] = field(default_factory=list)
    boundary: Boundary | None = None
    rate: FailureRate | None = None
    plain: PlainRate = field(default_factory=lambda: PlainRate(0, 0))
    why_no_rate: str = ""

    @property
    def rate_interval(self) -> tuple[float, float]:
        """90 % interval of the failure rate: a kind of failure that the search has missed only adds to its rate."""
        return (0.0 if self.rate is None else self.rate.low), self.plain.bounds[1]


def batches(
    space: Space, seed: int, budget: int, sequencing: Sequencing, found: Findings
) -> Generator[list[Drawn], list[CaseResult], None]:
    """Batches of cases; each is sent its results, and `found` has what they show."""
    yield from _fill(space, seed, budget, sequencing, found)
    for_boundary = budget if budget < 2 * _LEAST_FOR_RATE else min(_MOST_FOR_BOUNDARY, budget // 2)
    yield from _search_boundary(space, seed, for_boundary, found)
    found.boundary = fitted(space, found.results)
    yield from _search_rate(space, seed, budget - len(found.drawn), found)


_Batches = Generator[list[Drawn], list[CaseResult], None]


def _run(
    purpose: Purpose, values: Sequence[dict[str, Value]], found: Findings
) -> Generator[list[Drawn], list[CaseResult], list[CaseResult]]:
    return (yield from run_batch([Drawn(purpose, one) for one in values], found))


def run_batch(drawn: list[Drawn], found: Findings) -> Generator[list[Drawn], list[CaseResult], list[CaseResult]]:
    """One batch of cases: it is sent their results, and `found` gets both."""
    results = yield drawn
    found.drawn += drawn
    found.results += results
    return results


def _fill(space: Space, seed: int, budget: int, sequencing: Sequencing, found: Findings) -> _Batches:
    width, generator = len(space.axes), named_generator(seed, "space")
    number = min(2 ** int(np.ceil(np.log2(_FIRST_PER_PARAMETER * width))), budget)
    if sequencing == "sobol":
        shares = qmc.Sobol(width, rng=generator).random_base2(int(np.ceil(np.log2(number))))[:number]
    else:
        shares = qmc.LatinHypercube(width, rng=generator).random(number)
    yield from _run(Purpose.SPACE, space.by_quantiles(shares), found)


def _search_boundary(space: Space, seed: int, until: int, found: Findings) -> _Batches:
    boundary = None
    while len(found.drawn) < until:
        generator = named_generator(seed, f"boundary {len(found.drawn)}")
        candidates = qmc.Sobol(len(space.axes), rng=generator).random_base2(int(np.log2(_CANDIDATES)))
        number = min(_BATCH, until - len(found.drawn))
        boundary = fitted(space, found.results, boundary)
        # While all cases have one outcome, others may be anywhere.
        chosen = candidates[:number] if boundary is None else candidates[boundary.choose(candidates, number)]
        yield from _run(Purpose.BOUNDARY, space.by_places(chosen), found)


def fitted(space: Space, results: Sequence[CaseResult], near: Boundary | None = None) -> Boundary | None:
    """Boundary of cases with both outcomes; cases that are inconclusive or went wrong do not count."""
    decided = [one for one in results if one.is_passed or (one.message is None and one.has_failed)]
    failed = np.array([one.has_failed for one in decided])
    return fit_boundary(space.places(decided), failed, near) if failed.any() and not failed.all() else None


VERDICTS = ("passed", "failed", "inconclusive", "error")
"""Words for the outcome of a case."""


def verdict_of(result: CaseResult) -> str:
    """Word for the outcome of a case."""
    passed, failed, inconclusive, error = VERDICTS
    if result.message is not None:
        return error
    return failed if result.has_failed else passed if result.is_passed else inconclusive


def margin_of(result: CaseResult) -> float | None:
    """Signed distance to failure as a share of the nearest limit; None if no number was compared."""
    known = [one.margin for one in result.findings if one.margin is not None]
    if result.message is not None or not known:
        return None
    return min(*known, 0.0) if result.has_failed else max(min(known), _PASSING)


def _search_rate(space: Space, seed: int, left: int, found: Findings) -> _Batches:
    if left < _LEAST_FOR_RATE:
        found.why_no_rate = f"a failure rate needs a budget of {2 * _LEAST_FOR_RATE} cases"
        return
    proposal, size = first_proposal(len(space.axes)), max(left // _LEVELS, 50)
    for level in range(left // (2 * size)):
        places, results = yield from _drawn_from(proposal, Purpose.LEVEL, size, f"level {level}", space, seed, found)
        if level == 0:
            found.plain = _plain_rate(found)
        margins = _margins(results)
        if margins is None:
            found.why_no_rate = "no expectation compares a number, such as always: ego.ttc >= 0.5 s"
            return
        proposal = next_proposal(proposal, places, margins)
        left -= size
        if proposal.is_final:
            break
    places, results = yield from _drawn_from(proposal, Purpose.RATE, left, "rate", space, seed, found)
    if wrong := sum(one.message is not None for one in results):
        found.why_no_rate = f"{wrong} runs for the rate went wrong"
        return
    failed = np.array([one.has_failed for one in results])
    found.rate = failure_rate(proposal, places, np.where(failed, -1.0, 1.0))
    if not found.rate.is_known:
        found.why_no_rate = f"too few cases failed: effectively {found.rate.effective:.0f} of {left}"
        return
    low, high = found.plain.bounds
    if found.rate.high < low or high < found.rate.low:
        found.why_no_rate = (
            f"the search gives {found.rate.low:.2g} … {found.rate.high:.2g}, but cases drawn from the distributions "
            f"alone {low:.2g} … {high:.2g}"
        )
        found.rate = None


def _plain_rate(found: Findings) -> PlainRate:
    """From the cases so far: those that fill the space, and those of the first level."""
    plain = [
        one
        for drawn, one in zip(found.drawn, found.results, strict=True)
        if drawn.purpose in (Purpose.SPACE, Purpose.LEVEL) and one.message is None
    ]
    return PlainRate(sum(one.has_failed for one in plain), len(plain))


def _drawn_from(
    proposal: Proposal, purpose: Purpose, number: int, name: str, space: Space, seed: int, found: Findings
) -> Generator[list[Drawn], list[CaseResult], tuple[NDArray[np.float64], list[CaseResult]]]:
    places = proposal.draw(named_generator(seed, name), number)
    results = yield from _run(purpose, space.by_quantiles(ndtr(places)), found)
    return places, results


def _margins(results: Sequence[CaseResult]) -> NDArray[np.float64] | None:
    """Margins of cases, None if all are unknown; unknown ones are 0 for a failure, or else the largest known."""
    margins = [margin_of(one) for one in results]
    known = [one for one in margins if one is not None]
    if not known:
        return None
    largest = max(*known, _PASSING)
    unknown = [0.0 if one.message is None and one.has_failed else largest for one in results]
    return np.array([other if one is None else one for one, other in zip(margins, unknown, strict=True)])
