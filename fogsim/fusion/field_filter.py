"""Belief over space: what is known of the fog at places along the way, from estimates, announcements and reports."""

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.fusion.grid_filter import LEAST_UNBOUND, GridFilter
from fogsim.fusion.route_field import AHEAD, CELL, RouteField
from fogsim.fusion.route_field_kernels import shares_in_cells
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.belief import Belief
from fogsim.values.estimate import NORMAL_90_PERCENT, DenserFog, Estimate, ExtinctionBounds, OpticalDepths
from fogsim.values.observation import FogReport

Floats = NDArray[np.float64]

_CUTS = np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
"""Range of optical depths in which a curve resolves stretches of its own [-]."""

_SHORTEST, _SHARED, _GRAIN = 15.0, 0.8, 0.02
"""Shortest such stretch [m], correlation of a curve's errors at its ends, and least deviation of its depth [-]."""


def _curve_stretches(curve: OpticalDepths, farthest: float) -> Floats:
    """(n, 4): start and end up to `farthest` [m], ln of the mean extinction, and its standard deviation."""
    return _cut(np.array(curve.distance), np.array(curve.depth), np.array(curve.standard_deviation), _CUTS, farthest)


@kernel
def _interpolated(at: float, places: Floats, values: Floats) -> float:
    """As `np.interp`, which takes half a second to compile."""
    i = 0
    while i < places.size and places[i] <= at:
        i += 1
    if not 0 < i < places.size or places[i - 1] == at:
        return float(values[max(i - 1, 0)])
    return float((values[i] - values[i - 1]) / (places[i] - places[i - 1]) * (at - places[i - 1]) + values[i - 1])


@kernel
def _cut(distance: Floats, depth: Floats, deviation: Floats, cuts: Floats, farthest: float) -> Floats:
    out, count = np.empty((cuts.size, 4)), 0
    start = reached = unsure = 0.0
    for cut in cuts:
        end = _interpolated(cut, depth, distance) if cut < depth[-1] else distance[-1]
        if end - start >= _SHORTEST:
            total, spread = _interpolated(end, distance, depth), _interpolated(end, distance, deviation)
            more = max(total - reached, 1e-4)
            apart = math.sqrt(max(spread**2 + unsure**2 - 2.0 * _SHARED * spread * unsure, 0.0))
            out[count, 0], out[count, 1] = start, min(end, farthest)
            out[count, 2], out[count, 3] = math.log(more / (end - start)), math.hypot(apart, _GRAIN) / more
            count += 1
            start, reached, unsure = end, total, spread
        if start >= farthest or cut >= depth[-1]:
            break
    return out[:count]


FARTHEST = CELL * AHEAD
"""How far ahead an estimate is taken to speak [m]."""

_CLEAR, _UNSURE = 4e-4, 1.5
"""Extinction [1/m] and relative deviation [-] from which on an estimate only says that there is little fog."""

_STARTLED, _CERTAIN, _LEAST_LEAP = 3.0, 0.35, 0.3
"""By how many standard deviations, and by how much in ln k, the belief of the here and now must differ for a leap, and
how sure it must be of ln k [-]."""

_CLOCKS_DISAGREE = 5.0
"""How far in the future a report may be for it to count as one of now [s]: clocks of vehicles differ."""

_SAME_PLACE, _BESIDE, _SAME_FOG = 5.0, 100.0, 0.3
"""Distances between which a report next to a doubted one confirms it [m], and by how much the fog may differ [-]."""

_ANNOUNCED, _ANNOUNCED_DEVIATION = 75.0, 0.6
"""Length of the denser fog that is announced [m], and the standard deviation of ln k there: a front is seen, not what
lies behind it."""


@checked_parameters
class FieldFilter:
    """A Gaussian process of ln k over the way, ahead and behind, next to `GridFilter`'s belief of the here and now.

    Each estimate measures the mean extinction over both halves of the stretch that it has seen, for it has taken the
    fog for even; a curve of optical depths measures several stretches. Denser fog that is announced is believed at its
    position, and a report where it was measured, less as it ages. Two neighbouring reports that contradict the belief
    and agree are the edge of a bank. Fog without any report follows from what is near, and beyond that only from how
    much fog varies: the interval widens. Where the filter of the here and now, which believes in leaps,
    surely differs from the field, the edge of a bank has been driven through: what was believed ahead is doubted.

    The scalar belief is the distribution of the mean extinction from the vehicle to where 95 % of the light is lost.

    Parameters
    ----------
    deviation, length : float
        Standard deviation of ln k along the way [-], and the length over which it varies [m].
    steadiness : float
        Time over which banks drift or dissolve [s].
    relative_floor : float
        Relative standard deviation that estimates of one stretch never come below, as their errors are alike [-].
    outlier_share, wrong_reports : float
        Share of estimates, and of reports, that say nothing, above 0 and below 1 [-].
    correlation_time : float
        Time after which the errors of an estimator are new ones [s]; longer than `GridFilter`'s, which forgets sooner.
    oldest_report : float
        Age beyond which reports do not count [s].

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    def __init__(
        self,
        deviation: Annotated[float, Range(0.01, 10.0)] = 2.0,
        length: Annotated[float, Range(10.0, 1e5, "m")] = 300.0,
        steadiness: Annotated[float, Range(1.0, 1e6, "s")] = 900.0,
        relative_floor: Annotated[float, Range(1e-4, 10.0)] = 0.1,
        outlier_share: Annotated[float, Range(1e-12, 0.999)] = 0.07,
        wrong_reports: Annotated[float, Range(1e-12, 0.999)] = 0.2,
        correlation_time: Annotated[float, Range(1e-3, 1e6, "s")] = 2.0,
        oldest_report: Annotated[float, Range(0.0, 1e6, "s")] = 600.0,
    ) -> None:
        self._here = GridFilter(outlier_share=outlier_share)
        self._field = RouteField(deviation, length, steadiness)
        self._floor, self._outlier_share, self._wrong_reports = relative_floor, outlier_share, wrong_reports
        self._correlation_time, self._oldest_report = correlation_time, oldest_report
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._here.reset()
        self._field.reset()
        self._time: float | None = None
        self._share = 1.0
        self._place = 0.0
        self._heard: set[tuple[str, int]] = set()
        self._doubted: tuple[float, float, float] | None = None

    def update_at(
        self, estimates: Sequence[Estimate], time: float, place: float, reports: Sequence[FogReport] = ()
    ) -> Belief:
        """Learn from the estimates of one instant [s] at a place [m] and from reports; see `LocatedFusion.update_at`.

        Reports of the future, beyond what clocks disagree by, too old or repeated ones, and what is no number do not
        count.
        """
        if not math.isfinite(place):
            raise InputError(f"field_filter: the place of an update must be finite, got {place!r}")
        now = self._here.update_at(estimates, time, place)
        if self._time is not None and time > self._time:
            self._share = min(1.0, (time - self._time) / self._correlation_time)
            self._field.elapse(time - self._time)
        self._time = time
        self._place = place
        self._field.move_to(place)
        for estimate in estimates:
            self._take_in(estimate)
        for report in reports:
            self._hear(report, time, place)
        seen = [estimate.reach for estimate in estimates if estimate.valid or estimate.bounds is not None]
        if seen:
            self._mind_leaps(now, max(seen))
        if now.denser is not None:
            self._expect(now.denser)
        return self._belief(now)

    def _take_in(self, estimate: Estimate) -> None:
        """Learn an estimate over the stretch that it has seen."""
        if not estimate.valid:
            if estimate.bounds is not None:
                self._take_in_bounds(estimate.bounds)
            return
        k = estimate.extinction
        if not (math.isfinite(k) and math.isfinite(estimate.standard_deviation)):
            return
        relative = estimate.standard_deviation / max(k, _CLEAR)
        if k < _CLEAR or relative > _UNSURE:
            most = max(k + 1.3 * estimate.standard_deviation, _CLEAR)
            self._field.learn_at_most(min(estimate.reach, self._sight(most)), math.log(most), 0.3)
            return
        if estimate.optical_depths is None:
            end, known = min(estimate.reach, self._sight(k)), (math.log(k), math.sqrt(2.0) * relative)
            stretches, least = np.array([(0.0, 0.5 * end, *known), (0.5 * end, 0.5 * end + 0.5 * end, *known)]), 0.0
        else:
            stretches, least = _curve_stretches(estimate.optical_depths, FARTHEST), 0.5 * relative
        # The errors of pictures that follow one another are alike: each counts for the share of time that is new.
        floor = max(self._floor, estimate.common_deviation)
        self._field.learn_curve(stretches, least, floor, self._outlier_share, self._share)

    def _take_in_bounds(self, bounds: ExtinctionBounds) -> None:
        how = max(bounds.softness, 0.05), max(self._outlier_share, LEAST_UNBOUND), self._share
        if bounds.most < math.inf:
            most = max(bounds.most, _CLEAR)
            self._field.learn_at_most(self._sight(most), math.log(most), *how)
        if bounds.least > _CLEAR:
            self._field.learn_at_most(self._sight(bounds.least), math.log(bounds.least), *how, side=-1.0)

    def _hear(self, report: FogReport, time: float, place: float) -> None:
        """Learn what others have measured."""
        age, ahead, known = time - report.time, report.place - place, (report.source, report.number)
        age = 0.0 if -_CLOCKS_DISAGREE <= age < 0.0 else age
        numbers = (age, ahead, report.extinction, report.relative_deviation)
        if known in self._heard or not all(map(math.isfinite, numbers)) or not 0.0 <= age <= self._oldest_report:
            return
        if not -FARTHEST < ahead < FARTHEST or report.extinction < 0.0 or report.relative_deviation <= 0.0:
            return
        self._heard.add(known)
        value = math.log(max(report.extinction, _CLEAR))
        deviation = math.hypot(max(report.relative_deviation, self._floor), math.sqrt(self._field.variance_of_age(age)))
        self._learn_report(report.place, value, deviation)

    def _learn_report(self, at: float, value: float, deviation: float) -> None:
        """Learn a report; two neighbours that agree on a fog that was doubted are the edge of a bank."""
        wrong, doubted = self._wrong_reports, self._doubted
        if doubted is not None and self._confirms(doubted, at, value, deviation):
            # Two that are both wrong would hardly agree.
            wrong *= wrong
            self._field.leap(min(doubted[0], at) - self._place)
            self._field.learn(*self._cell_at(doubted[0]), *doubted[1:], wrong, self._floor)
            self._doubted = None
        if self._field.learn(*self._cell_at(at), value, deviation, wrong, self._floor) < 0.5:
            self._doubted = at, value, deviation

    @staticmethod
    def _confirms(doubted: tuple[float, float, float], at: float, value: float, deviation: float) -> bool:
        apart = _SAME_FOG + NORMAL_90_PERCENT * math.hypot(deviation, doubted[2])
        return _SAME_PLACE < abs(doubted[0] - at) < _BESIDE and abs(doubted[1] - value) < apart

    def _cell_at(self, place: float) -> tuple[float, float]:
        """Ends of a stretch as long as a cell about a place of the way, ahead of the vehicle [m]."""
        return place - self._place - 0.5 * CELL, place - self._place + 0.5 * CELL

    def _mind_leaps(self, now: Belief, reach: float) -> None:
        """Doubt the field where the belief of the here and now surely differs from it, as far as that has been seen."""
        value, deviation = now.log_moments()
        if deviation > _CERTAIN:
            return
        # A bank that others have reported beyond what was seen is no contradiction.
        sight = min(self._sight(math.exp(value)), reach)
        believed, variance = self._field.mean_extinction(0.0, sight)
        apart = abs(value - believed)
        if apart > max(_STARTLED * math.sqrt(variance + deviation**2), _LEAST_LEAP):
            self._field.leap()
            self._field.learn(0.0, sight, value, max(deviation, 0.1), self._outlier_share, self._floor)

    def _expect(self, denser: DenserFog) -> None:
        start = denser.distance
        value = math.log(max(denser.extinction, _CLEAR))
        widened = _ANNOUNCED_DEVIATION / math.sqrt(self._share)
        self._field.learn(start, start + _ANNOUNCED, value, widened, self._outlier_share, self._floor)

    def _belief(self, now: Belief) -> Belief:
        """The belief with its profile."""
        cells, samples = now.log_extinction, self._field.sighted_extinctions()
        first, step = float(cells[0]), float(cells[1] - cells[0])
        probability = shares_in_cells(samples, first, step, cells.size)
        return Belief(cells, probability, now.denser, self._field.profile())

    @staticmethod
    def _sight(extinction: float) -> float:
        """Meteorological visibility, as far as the field goes [m]."""
        return min(OPTICAL_DEPTH_AT_VISIBILITY / extinction, FARTHEST)
