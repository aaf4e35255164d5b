"""Belief as the papers combine measurements: k-means against outliers, a mixture of normals, weights that decay."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import majority, reduced
from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.fusion.grid_filter import CELLS, LOG_HIGH, LOG_LOW
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.belief import Belief
from fogsim.values.estimate import Estimate
from fogsim.values.observation import FogReport

Floats = NDArray[np.float64]

_FORGOTTEN = 0.05
"""Probability of correctness below which a measurement is dropped [-]."""


@dataclass(frozen=True, slots=True)
class _Measurement:
    visibility: float
    time: float
    place: float


@checked_parameters
class MixtureFilter:
    """Measurements of the visibility, each a normal distribution, in a mixture of that majority which k-means finds.

    Each has a probability of being correct p, which falls by e^(−d_s / t_s) with the way driven since and by
    e^(−d_t / t_t) with the time (Gabb 2014, as huang2015, 5.2, has it); its standard deviation is 1 / (√(2π) p) m.
    Weighted k-means parts them into clusters, and those of the heaviest one count: μ = Σ p z / Σ p and
    σ² = Σ p (z − μ)² / ((M − 1) / M Σ p) (belaroussi2015, eq. 2). One cluster takes in all, as huang2015 does (his
    eq. 5.2 lacks a square). t_s and t_t are not published.

    What it does not have: leaps of the fog, estimates of less or more certainty, a belief about places.

    Parameters
    ----------
    clusters : int
        How many k-means parts the measurements into: 3 in belaroussi2015, 1 as in huang2015.
    correctness : float
        p of a new measurement; belaroussi2015 sets 1 [-].
    decay_distance, decay_time : float
        t_s [m] and t_t [s].
    spacing : float
        Time between two measurements of one estimator that are taken [s].

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    def __init__(
        self,
        clusters: Annotated[int, Range(1, 10)] = 3,
        correctness: Annotated[float, Range(0.05, 1.0)] = 1.0,
        decay_distance: Annotated[float, Range(1.0, 1e6, "m")] = 750.0,
        decay_time: Annotated[float, Range(0.1, 1e6, "s")] = 45.0,
        spacing: Annotated[float, Range(0.0, 1e4, "s")] = 1.0,
    ) -> None:
        self._clusters, self._correctness, self._spacing = int(clusters), correctness, spacing
        self._decay_distance, self._decay_time = decay_distance, decay_time
        self._log_extinction = np.linspace(LOG_LOW, LOG_HIGH, CELLS)
        self._log_extinction.flags.writeable = False
        self.reset()

    def reset(self) -> None:
        """Forget all measurements."""
        self._measurements: list[_Measurement] = []
        self._taken: dict[str, float] = {}
        self._time = -math.inf

    def update_at(
        self,
        estimates: Sequence[Estimate],
        time: float,
        place: float,
        reports: Sequence[FogReport] = (),  # noqa: ARG002 - the papers know of none
    ) -> Belief:
        """Learn from the valid estimates of fog of one instant; see `LocatedFusion.update_at`."""
        if not (math.isfinite(time) and math.isfinite(place)):
            raise InputError(f"mixture_filter: time and place of an update must be finite, got {time!r} and {place!r}")
        if time < self._time:
            raise InputError(
                f"mixture_filter: time went back from {self._time!r} to {time!r} s; call reset() to start again"
            )
        self._time = time
        for one in estimates:
            if one.valid and math.isfinite(one.visibility) and time >= self._taken.get(one.method, -math.inf):
                self._measurements.append(_Measurement(one.visibility, time, place))
                self._taken[one.method] = time + self._spacing - 1e-9
        correct = [self._correct(one, time, place) for one in self._measurements]
        kept = [(one, p) for one, p in zip(self._measurements, correct, strict=True) if p >= _FORGOTTEN]
        self._measurements = [one for one, _ in kept]
        return self._belief(np.array([one.visibility for one, _ in kept]), np.array([p for _, p in kept]))

    def _correct(self, one: _Measurement, time: float, place: float) -> float:
        way, age = abs(place - one.place), time - one.time
        return self._correctness * math.exp(-way / self._decay_distance - age / self._decay_time)

    def _belief(self, values: Floats, weights: Floats) -> Belief:
        if not values.size:
            return Belief(self._log_extinction, np.full(CELLS, 1.0 / CELLS))
        kept = majority(values.tolist(), weights.tolist(), self._clusters)
        mean, deviation = reduced(values[kept].tolist(), weights[kept].tolist())
        # Measurements that are all the same are no surer than one.
        normal = NormalDist(mean, max(deviation, 1.0 / (math.sqrt(2.0 * math.pi) * float(weights[kept].max()))))
        edges = 0.5 * (self._log_extinction[1:] + self._log_extinction[:-1])
        beyond = np.array([normal.cdf(OPTICAL_DEPTH_AT_VISIBILITY / math.exp(edge)) for edge in edges.tolist()])
        # The larger k, the smaller V: what is above an edge in ln k is below it in V.
        probability = -np.diff(np.concatenate([[1.0], beyond, [0.0]]))
        return Belief(self._log_extinction, np.maximum(probability, 0.0) / np.maximum(probability, 0.0).sum())
