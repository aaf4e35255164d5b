"""Bayesian filter on a grid over the logarithm of the extinction coefficient."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import convolution
from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY, extinction_from_visibility
from fogsim.values.belief import Belief
from fogsim.values.estimate import DenserFog, Estimate, ExtinctionBounds
from fogsim.values.observation import FogReport

_FEWEST = 2
"""Fewest images that must report denser fog."""

_MOST, _LEAST = 0.7, 0.3
"""Shares of the last images that must report denser fog for it to be announced, and to stay so [-]."""

_FASTEST = 70.0
"""Speed beyond which nothing ahead comes nearer [m/s]."""

_NEARER, _FARTHER = 0.35, 0.2
"""How much nearer than expected, and how much farther than before, a later image may report the same fog, in shares
of its distance [-]. What seems to be fog beyond a crest recedes."""


class _Announcements:
    """Follows what estimates say of denser fog ahead, which they must report within a `time` [s] to be `announced`.

    A bank stands, or comes nearer as one drives; what one picture takes for fog and the next does not, or elsewhere, is
    none: a vehicle, a crest, the shade of a wood.
    """

    def __init__(self, time: float) -> None:
        self._window = time
        self._reports: deque[tuple[float, DenserFog | None]] = deque()
        self.announced = False

    def reset(self) -> None:
        """Forget all reports."""
        self._reports.clear()
        self.announced = False

    def update(self, estimates: Sequence[Estimate], time: float) -> DenserFog | None:
        """Add the estimates of an instant [s]; return what most images report, if it is to be announced."""
        telling = [one for one in estimates if one.valid and one.optical_depths is not None]
        if telling:
            self._reports.append((time, next((one.denser for one in telling if one.denser is not None), None)))
        while self._reports and self._reports[0][0] < time - self._window - 1e-9:
            self._reports.popleft()
        denser_fogs = [(when, denser) for when, denser in self._reports if denser is not None]
        if not denser_fogs:
            self.announced = False
            return None
        likely = [
            (sum(_is_same(one, other) or _is_same(other, one) for one in denser_fogs), other) for other in denser_fogs
        ]
        agreeing, last = max(likely, key=lambda pair: (pair[0], pair[1][0]))
        share = agreeing / len(self._reports)
        enough = agreeing >= _FEWEST and share >= (_LEAST if self.announced else _MOST)
        spans = self.announced or time - denser_fogs[0][0] >= 0.5 * self._window
        self.announced = bool(enough and spans)
        return last[1] if self.announced else None


def _is_same(earlier: tuple[float, DenserFog], later: tuple[float, DenserFog]) -> bool:
    """Whether the later one reports the same fog; the vehicle may have come nearer meanwhile."""
    way = later[0] - earlier[0]
    nearest = earlier[1].distance - _FASTEST * way
    return way >= 0.0 and (1.0 - _NEARER) * nearest <= later[1].distance <= (1.0 + _FARTHER) * earlier[1].distance


Floats = NDArray[np.float64]

CELLS = 240
_NEAREST, FARTHEST = 10.0, 10_000.0  # [m] visibilities at the ends of the grid
LOG_LOW, LOG_HIGH = (math.log(extinction_from_visibility(v)) for v in (FARTHEST, _NEAREST))
_LOG_RANGE = LOG_HIGH - LOG_LOW
_MOST_STEPS = 64

_MOST_COMMON, COMMON_TIME = 3.0, 5.0
"""Largest common deviation that counts [-]: a wider one leaves nothing known either; and the time over which that of
worse estimates comes to count [s]."""

_SLOW, _STILL = 15.0, 0.1
"""Speed below which fog changes in proportion to the way [m/s]; and the least share, since wind moves fog, too [-]."""

LEAST_UNBOUND = 0.2
"""Least share of bounds that are taken for wrong [-]: signs that bound the fog may be missing or hidden."""


@checked_parameters
class GridFilter:
    """Bayes' rule over 240 cells of ln k between 10 km and 10 m of visibility.

    Between two instants ln k walks at random, and now and then leaps: the edge of a fog bank is driven through in a
    second. An estimate k̂ ± σ has the likelihood N(k̂; k, σ) in k, so that "no fog seen", k̂ = 0, pushes toward thin
    fog without claiming any particular visibility; a share of estimates is taken for outliers that could be anything.
    Neighbouring frames share their errors (road texture, pitch), so an estimate counts only for the share of
    `correlation_time` that has passed since the one before: the likelihood is raised to that power. What all images
    share (`Estimate.common_deviation`) widens the belief, whatever their number. Invalid estimates
    change nothing but by their bounds, beyond which k is as unlikely as bounds are wrong. Time widens the belief, at a
    place that hardly changes (`update_at`) more slowly.
    Before the first estimate every ln k on the grid is equally likely.

    An estimate speaks of the fog up to its `reach`. Where that is nearer than the visibility that it gives, the fog
    beyond may be another, and it counts for less the less of the way it has seen. Denser fog ahead is believed once
    most estimates of the last `announcement_time` report it; estimates that do not reach as far then say nothing.

    Parameters
    ----------
    drift : float
        Standard deviation of the random walk of ln k over one second [1/√s].
    leap_rate : float
        Expected leaps a second [1/s].
    leap_scale : float
        Mean size of a leap in ln k, exponentially distributed either way [-].
    relative_floor : float
        Smallest standard deviation of an estimate relative to k that is believed [-].
    outlier_share : float
        Share of estimates that say nothing, above 0 and below 1 [-].
    correlation_time : float
        Time after which the errors of an estimator are new ones [s].
    unseen_deviation : float
        Standard deviation of ln k over the way to the visibility if an estimate has seen none of that way [-].
    announcement_time : float
        Time over which estimates must report denser fog ahead [s].
    announced_leap_rate : float
        Expected leaps a second while denser fog is announced, in place of `leap_rate` where that is less [1/s].

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    def __init__(
        self,
        drift: Annotated[float, Range(1e-9, 100.0, "1/√s")] = 0.05,
        leap_rate: Annotated[float, Range(0.0, 1000.0, "1/s")] = 0.05,
        leap_scale: Annotated[float, Range(0.001, 1000.0)] = 1.0,
        relative_floor: Annotated[float, Range(1e-4, 100.0)] = 0.05,
        outlier_share: Annotated[float, Range(1e-12, 0.999)] = 0.07,
        correlation_time: Annotated[float, Range(1e-3, 1e6, "s")] = 0.5,
        unseen_deviation: Annotated[float, Range(0.0, 100.0)] = 0.1,
        announcement_time: Annotated[float, Range(0.0, 1000.0, "s")] = 1.0,
        announced_leap_rate: Annotated[float, Range(0.0, 1000.0, "1/s")] = 2.0,
    ) -> None:
        self._drift, self._leap_scale = drift, leap_scale
        self._relative_floor, self._outlier_share = relative_floor, outlier_share
        self._correlation_time, self._unseen_deviation = correlation_time, unseen_deviation
        self._announcements = _Announcements(announcement_time)
        self._leap_rates = leap_rate, max(leap_rate, announced_leap_rate)
        self._log_extinction = np.linspace(LOG_LOW, LOG_HIGH, CELLS)
        self._log_extinction.flags.writeable = False
        self._extinction = np.exp(self._log_extinction)
        self._offset = (self._log_extinction[1] - self._log_extinction[0]) * np.arange(-(CELLS - 1), CELLS)
        self._steps: dict[tuple[float, bool], Floats] = {}
        self._common_walk = 0.0, np.zeros(0)
        self.reset()

    def reset(self) -> None:
        """Forget everything: all visibilities are equally likely again."""
        self._probability = np.full(CELLS, 1.0 / CELLS)
        self._announcements.reset()
        self._time: float | None = None
        self._weight = 1.0
        self._common, self._elapsed = 0.0, math.inf
        self._place, self._moving = math.nan, 1.0

    def update_at(
        self,
        estimates: Sequence[Estimate],
        time: float,
        place: float,
        reports: Sequence[FogReport] = (),  # noqa: ARG002 - the protocol's; they say nothing of here and now
    ) -> Belief:
        """Take in the estimates of one instant at a place along the way; see `LocatedFusion.update_at`.

        Slower than 15 m/s the belief widens more slowly.
        """
        elapsed = math.nan if self._time is None else time - self._time
        share = abs(place - self._place) / (_SLOW * elapsed) if elapsed > 0.0 else math.nan
        # In tenths, for the distributions over steps are kept.
        self._moving = 1.0 if math.isnan(share) else min(max(round(share, 1), _STILL), 1.0)
        self._place = place
        return self.update(estimates, time)

    def update(self, estimates: Sequence[Estimate], time: float) -> Belief:
        """Learn from the estimates of one instant [s]; those of the same instant in two calls count as in one.

        Invalid estimates and such with numbers that are not finite are left out. InputError if the time goes backward.
        """
        self._advance(time)
        denser = self._announcements.update(estimates, time)
        farthest = 0.0 if denser is None else denser.distance
        log_likelihood = np.zeros(CELLS)
        reaching = [estimate for estimate in estimates if estimate.reach >= farthest]
        self._update_common([one for one in reaching if _is_measured(one)])
        for estimate in reaching:
            if _is_measured(estimate):
                log_likelihood += self._weight * self._log_likelihood(estimate)
            elif not estimate.valid and estimate.bounds is not None:
                log_likelihood += self._weight * self._log_likelihood_within(estimate.bounds)
        # The largest exponent is zero: no product of densities can overflow, and the sum cannot vanish.
        posterior = self._probability * np.exp(log_likelihood - log_likelihood.max())
        self._probability = posterior / posterior.sum()
        return Belief(self._log_extinction, self._with_common_errors(), denser)

    def _update_common(self, measured: Sequence[Estimate]) -> None:
        """Follow the common deviation of estimates, by their precisions; better images stay known for some seconds."""
        if not measured:
            return
        relative = [one.standard_deviation / max(one.extinction, float(self._extinction[0])) for one in measured]
        precisions = [min(max(deviation, self._relative_floor), 1e6) ** -2 for deviation in relative]
        common = sum(p * one.common_deviation for p, one in zip(precisions, measured, strict=True)) / sum(precisions)
        worse = min(max(common - self._common, 0.0), _MOST_COMMON)
        self._common = min(common, self._common + worse * min(self._elapsed / COMMON_TIME, 1.0))

    def _with_common_errors(self) -> Floats:
        """The probability, spread by what all images of the methods in use have wrong in common."""
        if self._common == 0.0:
            return self._probability.copy()
        if self._common != self._common_walk[0]:
            self._common_walk = self._common, self._walk(self._common)
        return _folded(convolution(self._probability, self._common_walk[1]))

    def _advance(self, time: float) -> None:
        if not math.isfinite(time):
            raise InputError(f"grid_filter: the time of an update must be finite, got {time!r}")
        if self._time is not None and time < self._time:
            raise InputError(
                f"grid_filter: time went back from {self._time!r} to {time!r} s; call reset() to start again"
            )
        if self._time is not None and time > self._time:
            elapsed = self._elapsed = time - self._time
            self._weight = min(1.0, elapsed / self._correlation_time)
            self._probability = self._diffused(elapsed * self._moving)
        self._time = time

    def _diffused(self, elapsed: float) -> Floats:
        """Spread the probability over what may have happened in between, folding back at both ends of the grid."""
        return _folded(convolution(self._probability, self._step(elapsed)))

    def _step(self, elapsed: float) -> Floats:
        """Distribution over offsets in cells after some time; clocks round it to one of few numbers."""
        announced = self._announcements.announced
        known = self._steps.get((elapsed, announced))
        if known is not None:
            return known
        walk = self._walk(self._drift * math.sqrt(elapsed))
        leap = np.exp(-np.abs(self._offset) / self._leap_scale)
        leaps = -math.expm1(-self._leap_rates[announced] * elapsed)
        step = np.asarray((1.0 - leaps) * walk + leaps * leap / leap.sum())
        if len(self._steps) == _MOST_STEPS:
            self._steps.clear()
        self._steps[elapsed, announced] = step
        return step

    def _walk(self, deviation: float) -> Floats:
        """Distribution over offsets in cells after a random walk of a given standard deviation in ln k."""
        cell = float(self._offset[CELLS] - self._offset[CELLS - 1])
        if deviation >= cell:
            walk = np.exp(-0.5 * (self._offset / deviation) ** 2)
            return np.asarray(walk / walk.sum())
        # Finer than the grid, a sampled bell would stand still: three cells of the same variance do not.
        walk = np.zeros(2 * CELLS - 1)
        aside = 0.5 * (deviation / cell) ** 2
        walk[CELLS - 2 : CELLS + 1] = aside, 1.0 - 2.0 * aside, aside
        return walk

    def _log_likelihood(self, estimate: Estimate) -> Floats:
        """Logarithm of the likelihood of each cell, relative to that of an outlier."""
        measured = min(max(estimate.extinction, 0.0), float(self._extinction[-1]))
        floor = self._relative_floor * max(measured, float(self._extinction[0]))
        # A deviation far beyond the grid says as little as one a bit beyond it, and squares to no infinity.
        seen = estimate.reach * measured / OPTICAL_DEPTH_AT_VISIBILITY if measured > 0.0 else 1.0
        unseen = self._unseen_deviation * max(0.0, 1.0 - seen) * measured
        # Errors in common that do not yet widen the belief are errors of this estimate.
        more = math.sqrt(max(min(estimate.common_deviation, _MOST_COMMON) ** 2 - self._common**2, 0.0))
        deviation = math.hypot(min(max(estimate.own_deviation, 0.0), 10.0), floor, unseen, more * measured)
        return _log_likelihoods(self._extinction, measured, deviation, self._outlier_share)

    def _log_likelihood_within(self, bounds: ExtinctionBounds) -> Floats:
        """Logarithm of the likelihood of each cell by bounds of k, at most 0."""
        softness = max(bounds.softness, self._relative_floor)
        inside = np.ones(CELLS)
        if bounds.most < math.inf:
            inside *= _normal_share((math.log(max(bounds.most, 1e-12)) - self._log_extinction) / softness)
        if bounds.least > 0.0:
            inside *= _normal_share((self._log_extinction - math.log(bounds.least)) / softness)
        # Wrong signs are more frequent than other outliers, and the belief must survive two of them.
        share = max(self._outlier_share, LEAST_UNBOUND)
        return np.asarray(np.log(share + (1.0 - share) * inside))


def _is_measured(estimate: Estimate) -> bool:
    return estimate.valid and math.isfinite(estimate.extinction) and math.isfinite(estimate.standard_deviation)


def _normal_share(deviations: Floats) -> Floats:
    """Share of a normal distribution below so many standard deviations [-]."""
    return np.array([0.5 * math.erfc(-x / math.sqrt(2.0)) for x in deviations.tolist()])


@kernel
def _folded(spread: Floats) -> Floats:
    """Probabilities of the cells of a grid by those of as many more on either side."""
    count = (len(spread) + 2) // 3
    inside, total = spread[count - 1 : 2 * count - 1].copy(), 0.0
    for i in range(count - 1):
        inside[i] += spread[count - 2 - i]
        inside[count - 1 - i] += spread[2 * count - 1 + i]
    for i in range(count):
        total += inside[i]
    return inside / total


@kernel
def _log_likelihoods(extinction: Floats, measured: float, deviation: float, outlier_share: float) -> Floats:
    """Logarithm of the likelihood of each extinction by a measured one, relative to that of an outlier."""
    # An outlier is any ln k on the grid: 1 / (k _LOG_RANGE) in k, and no more than that at k̂ = 0.
    outlier = 1.0 / (_LOG_RANGE * max(measured, deviation))
    share = (1.0 - outlier_share) / outlier_share / (math.sqrt(2.0 * math.pi) * deviation * outlier)
    out = np.empty(len(extinction))
    for i in range(len(extinction)):
        out[i] = math.log1p(share * math.exp(-0.5 * ((measured - extinction[i]) / deviation) ** 2))
    return out
