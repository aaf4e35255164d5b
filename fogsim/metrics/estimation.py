"""How right the estimators and the belief were."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from fogsim.metrics.metric import JsonValue, Sample, share
from fogsim.units import finite_or_none

FOG_LIMIT = 1000.0
"""Visibility below which the air is called fog [m] (WMO); errors are counted only there."""


def relative_error(visibility: float, truth: float) -> float:
    """|V − V_true| / V_true in percent; ``inf`` for a visibility without limit.

    Parameters
    ----------
    visibility, truth : float
        Visibilities [m].
    """
    return abs(visibility - truth) / truth * 100.0


@dataclass(slots=True)
class Errors:
    """Errors of one source of visibilities, against the visibility ahead."""

    asked: int = 0
    percent: list[float] = field(default_factory=list)

    def result(self) -> dict[str, JsonValue]:
        """Say count, validity and quantiles; a quantile is None where it falls on "no fog at all"."""
        return {
            "count": self.asked,
            "valid_share": share(len(self.percent), self.asked),
            "clear_air_share": share(sum(map(math.isinf, self.percent)), len(self.percent)),
            "median_error_percent": self._quantile(0.5),
            "p95_error_percent": self._quantile(0.95),
        }

    def _quantile(self, probability: float) -> float | None:
        """Quantile without interpolation, so that an infinite error never makes a NaN of its neighbour."""
        if not self.percent:
            return None
        return finite_or_none(float(np.quantile(self.percent, probability, method="inverted_cdf")))


@dataclass(slots=True)
class EstimatorErrors:
    """Error of every method in fog, frame by frame."""

    meanings: ClassVar[Mapping[str, str]] = {
        "estimators": "error |V − V_true| / V_true of each method against the true visibility ahead, in fog "
        "(below 1000 m): frames, share with a valid estimate, share of those that said clear air, quantiles",
    }
    _methods: dict[str, Errors] = field(default_factory=dict)

    def update(self, sample: Sample) -> None:
        """Take in one step.

        Parameters
        ----------
        sample : Sample
            The step, and what is derived from it.
        """
        truth = sample.step.truth.visibility_ahead
        for estimate in sample.step.estimates:
            errors = self._methods.setdefault(estimate.method, Errors())
            if truth >= FOG_LIMIT:
                continue
            errors.asked += 1
            if estimate.valid:
                errors.percent.append(relative_error(estimate.visibility, truth))

    def result(self) -> dict[str, JsonValue]:
        """Say the error of each method."""
        return {"estimators": {method: errors.result() for method, errors in self._methods.items()}}


@dataclass(slots=True)
class BeliefError:
    """Error of the median belief in fog, and how often its 90 % interval held the truth."""

    meanings: ClassVar[Mapping[str, str]] = {
        "belief_count": "number of steps in fog (true visibility ahead below 1000 m)",
        "belief_median_error_percent": "median over those steps of the error of the median belief",
        "belief_p95_error_percent": "95th percentile of the same",
        "belief_coverage_share": "share of those steps in which the 90 % interval held the truth",
    }
    _errors: Errors = field(default_factory=Errors)
    _covered: int = 0

    def update(self, sample: Sample) -> None:
        """Take in one step.

        Parameters
        ----------
        sample : Sample
            The step, and what is derived from it.
        """
        truth, belief = sample.step.truth.visibility_ahead, sample.step.belief
        if truth >= FOG_LIMIT:
            return
        self._errors.asked += 1
        self._errors.percent.append(relative_error(belief.visibility, truth))
        self._covered += belief.visibility_quantile(0.05) <= truth <= belief.visibility_quantile(0.95)

    def result(self) -> dict[str, JsonValue]:
        """Say the error and the coverage."""
        errors = self._errors.result()
        return {
            "belief_count": errors["count"],
            "belief_median_error_percent": errors["median_error_percent"],
            "belief_p95_error_percent": errors["p95_error_percent"],
            "belief_coverage_share": share(self._covered, self._errors.asked),
        }
