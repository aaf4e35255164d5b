"""Joint fit of extinction, airlight and horizon over strips of road whose albedo may wander."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.strips import albedo_filter, joint_kernels, joint_search
from fogsim.vision.strips.sky import UNTOLD_DARKENING
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import StripGeometry

Floats = NDArray[np.float64]

PATCH_LENGTH, DRIFT_LENGTH = 3.0, 30.0
"""Lengths over which the albedo of a strip forgets itself: repaired patches, and slow change along the road [m]."""

ALBEDOS = ((0.015, 0.005), (0.015, 0.04), (0.015, 0.12), (0.04, 0.05), (0.08, 0.1))
"""Deviations of patches and of drift that are tried, relative to the road's luminance [-]."""

ALBEDO_CHANCES = (0.4, 0.2, 0.2, 0.15, 0.05)
"""How likely each of those is before the image is seen [-]."""

SMOOTH, EXPLAINED = 3, 1.0
"""How many of those have patches as faint as the first, and misfit of the first up to which stronger ones are not tried
[-]: they explain nothing then."""

EXTINCTIONS, SIMPLE_EXTINCTIONS = 14, 28
"""Extinctions of the first searches, evenly in ln k."""

ALIKE = 0.3
"""Difference of ln k below which two starts lead to the same answer [-]."""

CLEAR_MISFIT, CLEAR_USED = 1.5, 0.97
"""Misfit below which, and share of bins in use from which on, the simple model's answer needs no other [-]."""

STEPS, MORE_STEPS = 10, 5
"""Most Gauss–Newton steps for the first strength of patches and drift, and from its answer for each of the others."""

LEAST_BINS = 8
"""Fewest bins of the own lane for a fit."""


UNSURE = 0.008
"""Relative deviation of the airlight from which on its place is sought [-]."""

MOST_DARKENED = 0.6
"""Most that a lens takes of a bin's light [-]."""

FAR_BINS = 8
"""Farthest bins of the own lane, which show the airlight where the fog is dense."""


@dataclass(frozen=True, slots=True)
class JointFit:
    """Posterior of a joint fit.

    Attributes
    ----------
    extinction, extinction_deviation : float
        k and its standard deviation [1/m]; k may come out a little below 0.
    airlight : float
        A [linear grey levels].
    shift : float
        Rows by which the horizon is lower than told [px].
    road : float
        Luminance of the own lane without fog [linear grey levels].
    misfit : float
        Mean square of the standardised residuals; about 1 where the model holds.
    used : (strips, n) bool
        Bins that took part.
    hidden : (n,) bool
        Bins of the first strip that lie behind an obstacle which stands on it.
    """

    extinction: float
    extinction_deviation: float
    airlight: float
    shift: float
    road: float
    misfit: float
    used: NDArray[np.bool_]
    hidden: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class JointPrior:
    """What is known before the road is looked at.

    Attributes
    ----------
    airlight : float
        Luminance of the sky [linear grey levels].
    below, above : float
        Deviation of the airlight from it, downward and upward; upward it is large where the sky is saturated.
    shift, shift_deviation : float
        Rows by which the horizon is lower than told, and their standard deviation [px].
    darkening, darkening_deviation : float
        How much of what a simple lens takes from pixels off its axis (1 − cos⁴) this one takes, and the standard
        deviation of that [-].
    """

    airlight: float
    below: float
    above: float
    shift: float
    shift_deviation: float
    darkening: float = 0.0
    darkening_deviation: float = UNTOLD_DARKENING


def fit_jointly(
    curves: StripCurves, geometry: StripGeometry, prior: JointPrior, near: JointFit | None = None
) -> JointFit | None:
    """Fit Koschmieder's law to strips of road.

    The likelihood is that of `joint_kernels`; how much the albedo wanders is unknown, so several answers are tried and
    averaged by their evidence (Laplace's approximation), which makes the deviation honest where the road itself fades.

    Parameters
    ----------
    curves : StripCurves
        Luminance by bin.
    geometry : StripGeometry
        Where the bins are.
    prior : JointPrior
        Sky and horizon.
    near : JointFit or None
        Answer for some of the strips, from which to start in place of a search.

    Returns
    -------
    JointFit or None
        None if there are too few bins.
    """
    if int((curves.variance[0] > 0).sum()) < LEAST_BINS:
        return None
    data = _Data(_brightened(curves, geometry, prior.darkening), geometry)
    best = data.from_search(prior) if near is None else data.from_near(near, prior)
    tried = ALBEDOS if best.misfit > EXPLAINED else ALBEDOS[:SMOOTH]
    return _average([best] + [data.refined(albedo, prior, best.theta, MORE_STEPS) for albedo in tried[1:]])


@dataclass(frozen=True, slots=True)
class _Refined:
    """Answer for one strength of patches and drift: k, airlight, shift and darkening with their covariance."""

    theta: Floats
    covariance: Floats
    cost: float
    misfit: float
    road: float
    used: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class _Data:
    """Strips of one image, as the kernels take them."""

    curves: StripCurves
    geometry: StripGeometry

    @property
    def _bins(self) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats]:
        g = self.geometry
        return (self.curves.luminance, self.curves.variance, g.below, g.half, g.path, g.distance, g.extent)

    def from_near(self, near: JointFit, prior: JointPrior) -> _Refined:
        """Best answer from one for some of the strips, and from that of the simple model if it is another."""
        found = [self._refined_from(prior, (near.extinction, near.airlight), near.shift)]
        simple = self._simple(prior)
        if abs(math.log(simple[0] / max(near.extinction, self._span()[0]))) > ALIKE:
            found.append(self._refined_from(prior, simple, prior.shift))
        return min(found, key=lambda f: f.cost)

    def from_search(self, prior: JointPrior) -> _Refined:
        """Best answer from that of the simple model, whose likelihood is not so narrow that a grid may miss it.

        Where it does not fit nearly all bins, others are tried: the best of a coarse grid with an airlight as in the
        prior or, where that is unsure, as what the farthest road may have faded into.
        """
        starts = [self._simple(prior)]
        found = [self._refined_from(prior, starts[0], prior.shift)]
        if self._is_clear(found[0]):
            return found[0]
        airlights = [prior.airlight]
        if prior.below > UNSURE * prior.airlight:
            airlights.append(self._farthest())
        grid = self._grid(EXTINCTIONS)
        for airlight in airlights:
            cost = joint_search.search(*self._bins, _albedo(ALBEDOS[1]), grid, airlight, prior.shift)
            best = int(np.argmin(cost))
            new = all(abs(math.log(grid[best] / k)) > ALIKE for k, _ in starts)
            if math.isfinite(cost[best]) and new:
                starts.append((float(grid[best]), airlight))
                found.append(self._refined_from(prior, starts[-1], prior.shift))
        return min(found, key=lambda f: f.cost)

    def _simple(self, prior: JointPrior) -> tuple[float, float]:
        return joint_search.simple_search(*self._bins[:5], self._grid(SIMPLE_EXTINCTIONS), _known(prior))

    def _grid(self, count: int) -> Floats:
        least, most = self._span()
        return np.exp(np.linspace(math.log(least), math.log(most), count))

    def _span(self) -> tuple[float, float]:
        """Least and greatest extinction that show [1/m]."""
        unit = 1.0 / float(self.geometry.path[0, 0])
        return 0.2 * unit, 2.0 * unit * float(self.geometry.below[0])

    def _refined_from(self, prior: JointPrior, start: tuple[float, float], shift: float) -> _Refined:
        return self.refined(ALBEDOS[0], prior, np.array([*start, shift, 0.0]), STEPS)

    def _is_clear(self, found: _Refined) -> bool:
        """Whether an answer leaves nothing to explain, even on a road that hardly wanders."""
        used = int((found.used == albedo_filter.USED).sum())
        return found.misfit < CLEAR_MISFIT and used >= CLEAR_USED * int((self.curves.variance > 0).sum())

    def _farthest(self) -> float:
        seen = self.curves.luminance[0][self.curves.variance[0] > 0]
        return float(np.median(seen[-FAR_BINS:]))

    def refined(self, albedo: tuple[float, float], prior: JointPrior, start: Floats, steps: int) -> _Refined:
        """Gauss–Newton from a start."""
        used = np.zeros(self.curves.luminance.shape, np.uint8)
        bins = (*self._bins, self.geometry.off_axis)
        theta, covariance, road, cost, squares, number = joint_kernels.refine(
            *bins, _albedo(albedo), _known(prior), start, used, steps
        )
        return _Refined(theta, covariance, cost, squares / max(number, 1), road, used)


def _known(prior: JointPrior) -> Floats:
    shift = (prior.shift, prior.shift_deviation)
    return np.array([prior.airlight, prior.below, prior.above, *shift, prior.darkening_deviation])


def _brightened(curves: StripCurves, geometry: StripGeometry, darkening: float) -> StripCurves:
    """Undo the lens's darkening."""
    if darkening == 0.0:
        return curves
    gain = 1.0 / (1.0 - np.minimum(darkening * geometry.off_axis, MOST_DARKENED))
    return StripCurves(gain * curves.luminance, gain**2 * curves.variance, curves.scatter)


def _albedo(deviations: tuple[float, float]) -> Floats:
    """Deviation and length of patches, deviation and length of drift, as the kernels take them."""
    return np.array([deviations[0], PATCH_LENGTH, deviations[1], DRIFT_LENGTH])


def _average(found: list[_Refined]) -> JointFit:
    costs = np.array([f.cost for f in found]) - 2.0 * np.log(ALBEDO_CHANCES[: len(found)])
    weight = np.exp(-0.5 * (costs - costs.min()))
    weight /= weight.sum()
    thetas = np.array([f.theta for f in found])
    mean = (weight[:, None] * thetas).sum(axis=0)
    variances = np.array([f.covariance[0, 0] for f in found]) + (thetas[:, 0] - mean[0]) ** 2
    best = found[int(np.argmax(weight))]
    return JointFit(
        extinction=float(mean[0]),
        extinction_deviation=math.sqrt((weight * variances).sum()),
        airlight=float(mean[1]),
        shift=float(mean[2]),
        road=best.road,
        misfit=best.misfit,
        used=best.used == albedo_filter.USED,
        hidden=best.used[0] == albedo_filter.HIDDEN,
    )
