"""Joint fit of extinction, airlight and horizon over strips of road whose albedo may wander.

`fit_jointly` fits given strips, `fit_own` the own lane, and `with_neighbours` those strips that agree with it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.strips import albedo_filter, joint_kernels, joint_start_kernels
from fogsim.vision.strips.airlight_slopes import darkening_of_bins, slope_cost
from fogsim.vision.strips.albedo_filter import Albedo
from fogsim.vision.strips.joint_kernels import PARAMETERS, Bins, JointPrior, Solution
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import StripGeometry

Floats = NDArray[np.float64]

_PATCH_LENGTH, _DRIFT_LENGTH = 3.0, 30.0
"""Lengths over which the albedo of a strip forgets itself: repaired patches, and slow change along the road [m]."""

_SHEEN = (0.04, 0.04)
"""Part of the sky's light that asphalt reflects at grazing angles, and its standard deviation [-]."""

ALBEDOS = (
    Albedo(0.015, _PATCH_LENGTH, 0.005, _DRIFT_LENGTH),
    Albedo(0.015, _PATCH_LENGTH, 0.04, _DRIFT_LENGTH),
    Albedo(0.015, _PATCH_LENGTH, 0.02, _DRIFT_LENGTH, *_SHEEN),
    Albedo(0.015, _PATCH_LENGTH, 0.12, _DRIFT_LENGTH, *_SHEEN),
    Albedo(0.04, _PATCH_LENGTH, 0.05, _DRIFT_LENGTH, *_SHEEN),
    Albedo(0.08, _PATCH_LENGTH, 0.1, _DRIFT_LENGTH, *_SHEEN),
    Albedo(0.2, _PATCH_LENGTH, 0.3, _DRIFT_LENGTH, *_SHEEN),
)
"""How the albedo may wander: what is tried, before airlight that is as uneven as the sky."""

ALBEDO_CHANCES = (0.5, 0.25, 0.08, 0.05, 0.07, 0.04, 0.01)
"""How likely each of those is before the image is seen [-]."""

EVERY = tuple(range(len(ALBEDOS)))
"""All of them."""

_NEGLIGIBLE = 1e-3
"""Probability below which an albedo need not be tried in the next images of a drive [-]."""

_SMOOTH, _EXPLAINED = 4, 1.0
"""How many of those have patches as faint as the first, and misfit of the first up to which stronger ones are not tried
[-]: they explain nothing then."""

_EXTINCTIONS = 28
"""Extinctions of the first search, evenly in ln k."""

ALIKE = 0.3
"""Difference of ln k below which two starts lead to the same answer [-]."""

_CLEAR_MISFIT = 1.5
"""Misfit below which all lanes' answer needs no other [-]."""

_STEPS, MORE_STEPS = 10, 5
"""Most Gauss–Newton steps for the first strength of patches and drift, and from its answer for each of the others."""

LEAST_BINS = 8
"""Fewest bins of the own lane for a fit."""

_MOST_VIGNETTING = 0.6
"""Most that a lens takes of a bin's light [-]."""

_DISAGREEMENT = 2.0
"""Standard deviations by which a neighbouring strip may change the extinction [-]."""

MODEL_DEVIATION = 0.01
"""Relative deviation of k by what the model leaves out: marks, rounding, a road that is not quite flat [-]."""

_SURE = 0.03
"""Relative deviation of k up to which the own lane's answer judges its neighbours [-]: one that is less sure, as where
something stands in that lane, is itself more easily wrong than they."""

_OVERCONFIDENCE = 1.0
"""How much farther than its deviation says such an answer may be off [-]."""


@dataclass(frozen=True, slots=True)
class JointFit:
    """Posterior of a joint fit."""

    # extinction, extinction_deviation: k and its standard deviation [1/m]; k may come out a little below 0
    extinction: float
    extinction_deviation: float
    airlight: float  # A [linear grey levels]
    shift: float  # Rows by which the horizon is lower than the calibration has it [px]
    road: float  # Luminance of the own lane without fog [linear grey levels]
    misfit: float  # Mean square of the standardised residuals; about 1 where the model holds
    used: NDArray[np.bool_]  # (strips, n) bool: Bins that took part
    hidden: NDArray[np.bool_]  # (n,) bool: Bins of the first strip that lie behind an obstacle which stands on it
    darkening_chance: float = 0.0  # How likely the airlight darkens toward the road [-]
    # Logarithm of how likely this picture is with each kind of droplets, if it darkens, over the likeliest [-]; none
    # where it was not tried
    droplets: tuple[float, ...] = ()
    albedos: tuple[int, ...] = EVERY  # Those of `ALBEDOS` that are not negligible


Priors = tuple[JointPrior, ...]


@dataclass(frozen=True, slots=True)
class _Answer:
    """A solution, its cost with what is likely beforehand, under which prior, and for which albedo."""

    cost: float
    solution: Solution
    prior: JointPrior
    albedo: int

    @property
    def is_even(self) -> bool:
        """Whether its airlight is."""
        return self.prior.rise.size == 0


def fit_jointly(
    curves: StripCurves,
    geometry: StripGeometry,
    priors: Priors,
    near: JointFit | None = None,
    albedos: tuple[int, ...] = EVERY,
) -> JointFit | None:
    """Fit Koschmieder's law to strips of road.

    The likelihood is that of `joint_kernels`; how much the albedo wanders is unknown, so several answers are tried and
    averaged by their evidence (Laplace's approximation), which makes the deviation honest where the road itself fades.

    Returns None if there are too few bins.
    """
    if int((curves.variance[0] > 0).sum()) < LEAST_BINS:
        return None
    return _average([answer for prior in priors for answer in _answers(curves, geometry, prior, near, albedos)])


def _answers(
    curves: StripCurves, geometry: StripGeometry, prior: JointPrior, near: JointFit | None, albedos: tuple[int, ...]
) -> list[_Answer]:
    """Answers under one prior, each with its cost, in which how likely the albedo is beforehand is counted."""
    bins = strip_bins(curves, geometry, prior)
    best = _from_near(bins, near, prior)
    most = len(ALBEDOS) if best.misfit > _EXPLAINED else _SMOOTH
    found = [(0, best)]
    found += [(a, _refined(bins, ALBEDOS[a], prior, best.theta, MORE_STEPS)) for a in albedos if 0 < a < most]
    cost = slope_cost(prior) + prior.cost
    return [_Answer(f.cost + cost - 2.0 * math.log(ALBEDO_CHANCES[a]), f, prior, a) for a, f in found]


def strip_bins(curves: StripCurves, geometry: StripGeometry, prior: JointPrior) -> Bins:
    """Strips as the kernels take them, the lens's vignetting undone."""
    luminance, variance, vignetting = curves.luminance, curves.variance, prior.vignetting
    if vignetting != 0.0:
        gain = 1.0 / (1.0 - np.minimum(vignetting * geometry.off_axis, _MOST_VIGNETTING))
        luminance, variance = gain * luminance, gain**2 * variance
    darker, by_row = darkening_of_bins(geometry.grazing, geometry.below, prior)
    return Bins(
        luminance=np.ascontiguousarray(luminance),
        noise=np.ascontiguousarray(variance),
        path=geometry.path,
        off_axis=geometry.off_axis,
        below=geometry.below,
        half=geometry.half,
        distance=geometry.distance,
        extent=geometry.extent,
        grazing=geometry.grazing,
        darker=darker,
        darker_by_row=by_row,
        eye=float(geometry.distance[0] * math.tan(geometry.grazing[0])),
    )


def _from_near(bins: Bins, near: JointFit | None, prior: JointPrior) -> Solution:
    """Best answer from that with a constant albedo, and from one for some of the strips, if there is another."""
    simple = _constant_albedo(bins, prior)
    if near is None:
        return _refined_from(bins, prior, simple, prior.shift)
    found = [_refined_from(bins, prior, (near.extinction, near.airlight), near.shift)]
    if abs(math.log(simple[0] / max(near.extinction, _span(bins)[0]))) > ALIKE:
        found.append(_refined_from(bins, prior, simple, prior.shift))
    return min(found, key=lambda f: f.cost)


def _constant_albedo(bins: Bins, prior: JointPrior) -> tuple[float, float]:
    return joint_start_kernels.fit_constant_albedo(bins, extinction_grid(bins, _EXTINCTIONS), prior)


def extinction_grid(bins: Bins, count: int) -> Floats:
    """Extinctions that show, evenly in ln k [1/m]."""
    least, most = _span(bins)
    return np.exp(np.linspace(math.log(least), math.log(most), count))


def _span(bins: Bins) -> tuple[float, float]:
    """Least and greatest extinction that show [1/m]."""
    unit = 1.0 / float(bins.path[0, 0])
    return 0.2 * unit, 2.0 * unit * float(bins.below[0])


def _refined_from(bins: Bins, prior: JointPrior, start: tuple[float, float], shift: float) -> Solution:
    theta = [*start, shift, 0.0]
    if prior.rise.size:
        theta.append(joint_start_kernels.darkness_by_sky(prior, start[0], bins.eye)[0])
    return _refined(bins, ALBEDOS[0], prior, np.array(theta), _STEPS)


def _refined(bins: Bins, albedo: Albedo, prior: JointPrior, start: Floats, steps: int) -> Solution:
    return joint_kernels.gauss_newton(bins, under_sky(albedo, prior), prior, start, steps)


def under_sky(albedo: Albedo, prior: JointPrior) -> Albedo:
    """Albedo seen through an airlight that is as uneven as is known beforehand."""
    return albedo._replace(cloud_deviation=prior.cloud)


def _average(answers: list[_Answer]) -> JointFit:
    costs = np.array([answer.cost for answer in answers])
    weight = np.exp(-0.5 * (costs - costs.min()))
    weight /= weight.sum()
    found = [answer.solution for answer in answers]
    thetas = np.array([f.theta[:PARAMETERS] for f in found])
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
        darkening_chance=float(weight[[not answer.is_even for answer in answers]].sum()),
        droplets=_droplets(answers),
        albedos=_of_weight(answers, weight),
    )


def _of_weight(answers: list[_Answer], weight: Floats) -> tuple[int, ...]:
    """Albedos that are not negligible under all priors together."""
    share = np.bincount([answer.albedo for answer in answers], weight)
    return tuple(np.flatnonzero(share > _NEGLIGIBLE).tolist())


def _droplets(answers: list[_Answer]) -> tuple[float, ...]:
    """Log likelihoods of the kinds of droplets, over the likeliest."""
    uneven = [one for one in answers if not one.is_even]
    found = []
    for kind in sorted({one.prior.droplets for one in uneven}):
        costs = [one.cost - one.prior.cost for one in uneven if one.prior.droplets == kind]
        found.append(float(np.logaddexp.reduce([-0.5 * cost for cost in costs])))
    return tuple(one - max(found) for one in found)


def fit_own(
    curves: StripCurves, geometry: StripGeometry, priors: Priors, albedos: tuple[int, ...] = EVERY
) -> JointFit | None:
    """Fit the own lane, which is the first strip, alone; None if it has too few bins."""
    return fit_jointly(curves.only([0]), geometry.only([0]), priors, albedos=albedos)


def with_neighbours(
    own: JointFit,
    curves: StripCurves,
    geometry: StripGeometry,
    priors: Priors,
    albedos: tuple[int, ...] = EVERY,
) -> JointFit:
    """Fit the own lane again, with the neighbours that agree with it.

    A strip that holds a lane at one distance and a verge at another looks like fog of another density. Where the own
    lane alone says little, all strips count.
    """

    def fitted(strips: list[int]) -> JointFit | None:
        return fit_jointly(curves.only(strips), geometry.only(strips), priors, own, albedos)

    seen = [strip for strip in range(1, len(curves.variance)) if (curves.variance[strip] > 0).any()]
    best = fitted([0, *seen]) if seen else None
    if best is None:
        return own
    agreed = agree(own, best)
    if agreed and best.misfit < _CLEAR_MISFIT:
        return best
    if len(seen) == 1:
        return best if agreed else own
    found = [fitted([0, strip]) for strip in seen]
    pairs = [pair for pair in found if pair is not None]
    # With an obstacle where there is none, or without the one that there is, a lane alone fits well and is far off.
    if own.hidden.any() and len(pairs) == len(seen) and all(_alike(pair, best) for pair in pairs):
        return min((best, *pairs), key=_deviation)
    kept = [pair for pair in pairs if agree(own, pair)]
    return min(kept, key=_deviation) if kept else own


def _deviation(fit: JointFit) -> float:
    return fit.extinction_deviation


def agree(own: JointFit, more: JointFit) -> bool:
    """Whether more strips change the extinction by no more than they sharpen it (Hausman 1978, eq. 2.2)."""
    sharpened = max(own.extinction_deviation**2 - more.extinction_deviation**2, 0.0)
    if own.extinction_deviation > _SURE * own.extinction:
        sharpened = (_OVERCONFIDENCE * own.extinction_deviation) ** 2
    return abs(more.extinction - own.extinction) <= _DISAGREEMENT * math.hypot(
        math.sqrt(sharpened), MODEL_DEVIATION * own.extinction
    )


def _alike(first: JointFit, second: JointFit) -> bool:
    """Whether two answers differ by no more than their deviations."""
    apart = math.hypot(first.extinction_deviation, second.extinction_deviation)
    return abs(first.extinction - second.extinction) <= _DISAGREEMENT * apart
