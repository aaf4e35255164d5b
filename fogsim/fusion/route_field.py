"""A normal distribution of ln k over places along the way, which moves on with the vehicle."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import inverse_of, matrix_product
from fogsim.fusion import route_field_kernels
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY, extinction_from_visibility
from fogsim.values.belief import FogProfile

Floats = NDArray[np.float64]

CELL, BEHIND, AHEAD = 25.0, 12, 40
"""Length of a cell of the way [m], and how many are kept behind the one in which the vehicle is, and ahead of it."""

COUNT = BEHIND + AHEAD + 1

LEVEL, LEVEL_DEVIATION = math.log(extinction_from_visibility(750.0)), 1.2
"""Mean and standard deviation of a whole road's ln k before anything is known of it."""

GRAIN, GRAIN_LENGTH = 0.4, 50.0
"""Standard deviation of what else varies, from place to place [-], and the length over which it does [m]."""

_BELIEVED = 1.3
"""Standard deviations by which the belief lies below a bound that says nothing new [-]."""

_SAMPLES = 48
"""Pairs of samples that give the visibility ahead."""


class RouteField:
    """ln k along the way: a level that no one knows, and what varies about it with place [m] and time [s].

    What varies has a Matérn covariance over the way, σ² (1 + √3 |Δs| / ℓ) e^(−√3 |Δs| / ℓ), and some grain; it forgets
    itself over a time T. What is learnt is taken in by assumed-density filtering: the exact moments of one function of
    the cells, the logarithm of the mean extinction over a stretch, linearised.
    """

    def __init__(self, deviation: float, length: float, steadiness: float) -> None:
        self._deviation, self._length, self._steadiness = deviation, length, steadiness
        places = CELL * np.arange(COUNT + 1)
        apart = np.abs(places[:, None] - places)
        smooth = (1.0 + math.sqrt(3.0) * apart / length) * np.exp(-math.sqrt(3.0) * apart / length)
        beforehand = LEVEL_DEVIATION**2 + deviation**2 * smooth + GRAIN**2 * np.exp(-apart / GRAIN_LENGTH)
        self._beforehand = beforehand[:-1, :-1]
        self._next = matrix_product(inverse_of(np.ascontiguousarray(self._beforehand)), beforehand[:-1, -1])
        self._rest = float(beforehand[-1, -1] - matrix_product(self._next, beforehand[:-1, -1]))
        # The same in every run: samples of a distribution must not depend on chance.
        self._normals = np.ascontiguousarray(np.random.default_rng(0).standard_normal((_SAMPLES, AHEAD + 1)).T)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._mean, self._covariance = np.full(COUNT, LEVEL), self._beforehand.copy()
        self._cell: int | None = None
        self._place = 0.0

    def move_to(self, place: float) -> None:
        """Let the vehicle be at a place (`place` [m])."""
        cell = math.floor(place / CELL)
        if self._cell is not None and not 0 <= cell - self._cell < COUNT:
            self.reset()
        for _ in range(cell - (cell if self._cell is None else self._cell)):
            route_field_kernels.roll(self._mean, self._covariance, self._next, LEVEL, self._rest)
        self._cell, self._place = cell, place

    def elapse(self, time: float) -> None:
        """Let a time pass [s], which widens what is believed to no more than what was believed beforehand."""
        forgotten = -math.expm1(-2.0 * time / self._steadiness)
        self._covariance += forgotten * (self._beforehand - self._covariance)

    def variance_of_age(self, age: float) -> float:
        """By how much a measurement's variance of ln k grows with its age [-] (`age` [s])."""
        return 2.0 * self._deviation**2 * -math.expm1(-max(age, 0.0) / self._steadiness)

    def leap(self, distance: float = 0.0) -> None:
        """Doubt what was believed of a place [m] and of all beyond it, since the edge of a bank is there."""
        first = math.floor((distance - self._rear()) / CELL)
        beyond = np.arange(COUNT) >= first
        self._covariance += self._beforehand * beyond[:, None] * beyond

    def mean_extinction(self, start: float, end: float) -> tuple[float, float]:
        """Mean and variance of the logarithm of the mean extinction over a stretch [ln 1/m, -] (`start`, `end` [m])."""
        value, _, variance = self._linearised(start, end)
        return value, variance

    def _linearised(self, start: float, end: float) -> tuple[float, Floats, float]:
        """Logarithm of the mean extinction over a stretch: mean, covariance with all cells, and variance."""
        weights = route_field_kernels.stretch_weights(COUNT, CELL, self._rear(), start, end)
        return route_field_kernels.linearised(self._mean, self._covariance, weights)

    def learn(
        self, start: float, end: float, value: float, deviation: float, wrong: float, floor: float, share: float = 1.0
    ) -> float:
        """Update with the mean extinction measured over a stretch [m]; return the probability that it is right [-]."""
        weights = route_field_kernels.stretch_weights(COUNT, CELL, self._rear(), start, end)
        return route_field_kernels.learn(self._mean, self._covariance, weights, value, deviation, wrong, floor, share)

    def learn_curve(self, stretches: Floats, least: float, floor: float, wrong: float, share: float) -> None:
        """Update with measurements of stretches, one after another; see `route_field_kernels.learn_curve`."""
        known, rear = (self._mean, self._covariance), self._rear()
        route_field_kernels.learn_curve(*known, CELL, rear, stretches, least, floor, wrong, share)

    def learn_at_most(
        self, end: float, value: float, softness: float, wrong: float = 0.0, share: float = 1.0, side: float = 1.0
    ) -> None:
        """Learn that the mean extinction up to `end` [m] is likely no more than a value, for `side` -1 no less.

        Nothing changes where that is believed already: the errors of bounds that are repeated are alike.
        """
        before, shared, variance = self._linearised(0.0, end)
        if variance <= 0.0 or side * before + _BELIEVED * math.sqrt(variance) < side * value:
            return
        bound = side * before, variance, side * value, softness, wrong, share
        moved, left = route_field_kernels.moments_at_most(*bound)
        self._condition(shared, variance, side * moved, variance - left)

    def _condition(self, shared: Floats, variance: float, moved: float, narrowed: float) -> None:
        route_field_kernels.condition(self._mean, self._covariance, shared / variance, moved, narrowed)

    def sighted_extinctions(self) -> Floats:
        """(samples,) float64, ascending: ln of the mean extinction up to where 95 % of the light is lost."""
        ahead, ends = slice(BEHIND, None), np.asarray(self._rear() + CELL * np.arange(BEHIND + 1, COUNT + 1))
        found = route_field_kernels.sighted_extinctions(
            self._mean[ahead], self._covariance[ahead, ahead], self._normals, ends, OPTICAL_DEPTH_AT_VISIBILITY
        )
        found.sort()
        return found

    def profile(self) -> FogProfile:
        """What is believed at the middle of each cell."""
        middles, deviation = route_field_kernels.marginals(self._covariance, self._rear(), CELL)
        return FogProfile(middles, self._mean.copy(), deviation)

    def _rear(self) -> float:
        """Where the hindmost cell begins, ahead of the vehicle [m]."""
        return CELL * ((self._cell or 0) - BEHIND) - self._place
