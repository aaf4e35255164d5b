"""How right the estimators and the belief were."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from fogsim.metrics.metric import Definition, JsonValue, Sample, definitions_of, share
from fogsim.units import finite_or_none, visibility_from_extinction
from fogsim.values import Belief

FOG_LIMIT = 1000.0
"""Visibility below which the air is called fog [m] (WMO); errors are counted only there."""


def relative_error(visibility: float, truth: float) -> float:
    """|V − V_true| / V_true in percent; ``inf`` for a visibility without limit."""
    return abs(visibility - truth) / truth * 100.0


_LONGEST_LAG = 30.0
"""Latencies are looked for up to this [s]."""

_MOST_WAITING = 64
"""Beliefs that are gathered before they are judged: one after another they cost half of one in each step."""

_LEAST_CHANGE = 0.1
"""Standard deviation of ln V over a run above which a latency can be measured; a tenth is a change of 10 %."""


@dataclass(slots=True)
class Errors:
    """Errors of one source of visibilities, against the visibility ahead.

    The bias is the median of ln (V / V_true), as errors of extinction are by ratio. The latency is the lag L, up to
    30 s, by which the mean of |ln V(t) − ln V_true(t − L)| over the run is least: how long after a change of the fog
    it is followed.
    """

    asked: int = 0
    percent: list[float] = field(default_factory=list)
    covered: int = 0
    _ratios: list[float] = field(default_factory=list)
    _estimates: list[tuple[float, float]] = field(default_factory=list)
    _truths: list[tuple[float, float]] = field(default_factory=list)

    def follow(self, time: float, truth: float, estimate: float | None) -> None:
        """Add the visibility ahead [m] at a time [s], and the reported one, if any."""
        self._truths.append((time, math.log(min(truth, FOG_LIMIT))))
        if estimate is not None:
            self._estimates.append((time, math.log(min(estimate, FOG_LIMIT))))

    def judge(self, truth: float, estimate: float, low: float, high: float) -> None:
        """Add a visibility reported in fog, ``inf`` for clear air, and its 90 % interval [m]."""
        self.percent.append(relative_error(estimate, truth))
        self._ratios.append(math.log(estimate / truth))
        self.covered += low <= truth <= high

    @property
    def bias_percent(self) -> float | None:
        """Median of V / V_true − 1 in percent; None without any, or on clear air."""
        ratio = quantile(self._ratios, 0.5)
        return None if ratio is None else 100.0 * math.expm1(ratio)

    @property
    def latency(self) -> float | None:
        """How long after a change of the fog it is followed [s]; None where the fog does not change."""
        if len(self._estimates) < 2:
            return None
        (when, estimate), (times, truths) = np.array(self._estimates).T, np.array(self._truths).T
        if truths.std() < _LEAST_CHANGE:
            return None
        # At every lag the same part of the run is compared: that before which the longest lag reaches.
        longest = min(_LONGEST_LAG, 0.5 * (times[-1] - times[0]))
        settled = when >= times[0] + longest
        if not settled.any():
            return None
        lags = np.arange(0.0, longest, float(np.diff(times).min()))
        costs = [np.abs(estimate[settled] - np.interp(when[settled] - lag, times, truths)).mean() for lag in lags]
        return float(lags[int(np.argmin(costs))])

    def result(self) -> dict[str, JsonValue]:
        """Say count, validity and quantiles; a quantile is None where it falls on "no fog at all"."""
        return {
            "count": self.asked,
            "valid_share": share(len(self.percent), self.asked),
            "clear_air_share": share(sum(map(math.isinf, self.percent)), len(self.percent)),
            "median_error_percent": quantile(self.percent, 0.5),
            "p95_error_percent": quantile(self.percent, 0.95),
            "bias_percent": self.bias_percent,
            "coverage_share": share(self.covered, len(self.percent)),
            "latency_s": self.latency,
        }


def quantile(values: Sequence[float], probability: float) -> float | None:
    """Quantile without interpolation, so that an infinite value never makes a NaN of its neighbour."""
    if not values:
        return None
    return finite_or_none(float(np.quantile(values, probability, method="inverted_cdf")))


@dataclass(slots=True)
class EstimatorErrors:
    """Error of every method in fog, frame by frame."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("estimators")
    _methods: dict[str, Errors] = field(default_factory=dict)

    def update(self, sample: Sample) -> None:
        """Add one step."""
        truth = sample.step.truth.visibility_ahead
        for estimate in sample.step.estimates:
            errors = self._methods.setdefault(estimate.method, Errors())
            errors.follow(sample.step.time, truth, estimate.visibility if estimate.valid else None)
            if truth >= FOG_LIMIT:
                continue
            errors.asked += 1
            if estimate.valid:
                errors.judge(truth, estimate.visibility, *estimate.visibility_interval)

    def result(self) -> dict[str, JsonValue]:
        """Say the error of each method."""
        return {"estimators": {method: errors.result() for method, errors in self._methods.items()}}


@dataclass(slots=True)
class BeliefError:
    """Error of the median belief in fog, and how often its 90 % interval held the truth."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("belief")
    _errors: Errors = field(default_factory=Errors)
    _waiting: list[tuple[float, float, Belief]] = field(default_factory=list)

    def update(self, sample: Sample) -> None:
        """Add one step."""
        self._waiting.append((sample.step.time, sample.step.truth.visibility_ahead, sample.step.belief))
        if len(self._waiting) >= _MOST_WAITING:
            self._judge_waiting()

    def _judge_waiting(self) -> None:
        for time, truth, belief in self._waiting:
            low, estimate, high = belief.visibility_quantiles((0.05, 0.5, 0.95))
            self._errors.follow(time, truth, estimate)
            if truth < FOG_LIMIT:
                self._errors.asked += 1
                self._errors.judge(truth, estimate, low, high)
        self._waiting.clear()

    def result(self) -> dict[str, JsonValue]:
        """Say the error and the coverage."""
        self._judge_waiting()
        errors = self._errors.result()
        return {
            "belief_count": errors["count"],
            "belief_median_error_percent": errors["median_error_percent"],
            "belief_p95_error_percent": errors["p95_error_percent"],
            "belief_bias_percent": errors["bias_percent"],
            "belief_latency_s": errors["latency_s"],
            "belief_coverage_share": errors["coverage_share"],
        }


@dataclass(slots=True)
class EquippedBelief:
    """How right the beliefs of all other equipped vehicles were, where the fog ahead of them is below 1000 m."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("equipped")
    _steps: int = 0
    _vehicles: int = 0
    _held: int = 0
    _errors: list[float] = field(default_factory=list)

    def update(self, sample: Sample) -> None:
        """Add one step."""
        self._steps += 1
        self._vehicles += len(sample.step.equipped)
        for one in sample.step.equipped:
            truth = visibility_from_extinction(one.extinction_ahead)
            if truth < FOG_LIMIT:
                low, middle, high = one.belief.visibility_quantiles((0.05, 0.5, 0.95))
                self._errors.append(relative_error(middle, truth))
                self._held += low <= truth <= high

    def result(self) -> dict[str, JsonValue]:
        """Say how many, error and coverage."""
        return {
            "equipped_vehicles_mean": self._vehicles / self._steps if self._steps else None,
            "equipped_belief_median_error_percent": quantile(self._errors, 0.5),
            "equipped_belief_coverage_share": share(self._held, len(self._errors)),
        }
