"""Joint fit of extinction, airlight and horizon over strips of road whose albedo may wander.

`fit_jointly` fits given strips, `fit_own` the own lane, and `with_neighbours` those strips that agree with it.
"""

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.strips import albedo_filter
from fogsim.vision.strips.airlight_slopes import darkening_of_bins, slope_cost, slope_table
from fogsim.vision.strips.albedo_filter import Albedo, albedo_transitions
from fogsim.vision.strips.joint_kernels import PARAMETERS, Bins, JointPrior, Solution, gauss_newton
from fogsim.vision.strips.joint_start_kernels import darkness_by_sky, fit_constant_albedo
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import StripGeometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

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

_BRIGHTEST_ASPHALT, _GROWTH = 0.3, 0.5
"""Light of a road over the airlight up to which the sheen of `ALBEDOS` is all by which it brightens toward the horizon,
and the relative deviation by which the light beyond does so too [-]: CIE's surfaces R1 to R4 reflect 1.35 to 2.1 times
as much at 1° as from above (CIE 144:2001); chosen on pool 0 of `benchmarks/camera_kinds.py`."""


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

    @property
    def bright_deviation(self) -> float:
        """Standard deviation of k by a bright road that itself brightens toward the horizon as fog does [1/m]."""
        beyond = self.road - _BRIGHTEST_ASPHALT * self.airlight
        return _GROWTH * abs(self.extinction) * beyond / (self.airlight - self.road) if beyond > 0.0 else 0.0


Priors = tuple[JointPrior, ...]


class _Answers(NamedTuple):
    """Solutions under one prior by albedo, and what comes of the likeliest."""

    # (m, 7): Minus twice the logarithm of the evidence with how likely the albedo is, the four parameters of
    # `fogsim.vision.strips.joint_kernels.Solution`, the variance of k [1/m²], and which of `ALBEDOS`
    table: Floats
    road: float
    misfit: float
    used: NDArray[np.uint8]


class _Mixture(NamedTuple):
    """Solutions averaged by their evidence."""

    theta: Floats  # (4,): Their mean
    deviation: float  # Of k [1/m]
    uneven: float  # Share of those whose airlight is not even [-]
    albedo: Floats  # (albedos,): Share of each albedo [-]


class _Tried(NamedTuple):
    """Albedos that are tried."""

    albedos: Floats  # (m, 6): Theirs, before airlight that is as uneven as the sky
    chances: Floats  # (m,): How likely each is beforehand [-]
    number: Ints  # (m,): Which of `ALBEDOS`


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
    if np.count_nonzero(curves.variance[0] > 0) < LEAST_BINS:
        return None
    table, tried = slope_table(), _tried(albedos)
    begin = (math.nan, 0.0, 0.0) if near is None else (near.extinction, near.airlight, near.shift)
    found = [_answers(curves, geometry, prior, table.angle, table.below, begin, tried) for prior in priors]
    return _average(priors, found)


@functools.cache
def _tried(albedos: tuple[int, ...]) -> _Tried:
    which = [0, *(albedo for albedo in albedos if albedo)]
    every = np.array([one[:6] for one in ALBEDOS])
    return _Tried(every[which], np.array(ALBEDO_CHANCES)[which], np.array(which, np.int64))


@kernel
def _answers(
    curves: StripCurves,
    geometry: StripGeometry,
    prior: JointPrior,
    angle: Floats,
    below: Floats,
    near: tuple[float, float, float],
    tried: _Tried,
) -> _Answers:
    """Answers under one prior; `angle` and `below` of a `SlopeTable`, `near` as in `_from_near`."""
    bins = bins_of(curves, geometry, prior, angle, below)
    best = likeliest = _from_near(bins, near, prior, _albedo(tried, 0))
    most = len(ALBEDOS) if best.misfit > _EXPLAINED else _SMOOTH
    table, before, least, count = np.empty((tried.number.size, 7)), slope_cost(prior) + prior.cost, np.inf, 0
    for a in range(tried.number.size):
        if tried.number[a] >= most:
            continue
        one = best if a == 0 else gauss_newton(bins, _albedo(tried, a), prior, best.theta, MORE_STEPS)
        table[count, 0] = one.cost + before - 2.0 * math.log(tried.chances[a])
        table[count, 1:5], table[count, 5], table[count, 6] = one.theta[:4], one.covariance[0, 0], tried.number[a]
        if table[count, 0] < least:
            least, likeliest = table[count, 0], one
        count += 1
    return _Answers(table[:count], likeliest.road, likeliest.misfit, likeliest.used)


@kernel
def _albedo(tried: _Tried, a: int) -> Albedo:
    one = tried.albedos[a]
    return Albedo(one[0], one[1], one[2], one[3], one[4], one[5], 0.0)


def strip_bins(curves: StripCurves, geometry: StripGeometry, prior: JointPrior) -> Bins:
    """Strips as the kernels take them, the lens's vignetting undone."""
    table = slope_table()
    return bins_of(curves, geometry, prior, table.angle, table.below)


@kernel
def bins_of(curves: StripCurves, geometry: StripGeometry, prior: JointPrior, angle: Floats, below: Floats) -> Bins:
    """`strip_bins` with a `SlopeTable`'s angles (m,) [rad] and airlight below the horizon (droplets, n, m)."""
    luminance, variance = curves.luminance.copy(), curves.variance.copy()
    if prior.vignetting != 0.0:
        for s in range(luminance.shape[0]):
            for i in range(luminance.shape[1]):
                gain = 1.0 / (1.0 - min(prior.vignetting * geometry.off_axis[s, i], _MOST_VIGNETTING))
                luminance[s, i] *= gain
                variance[s, i] *= gain * gain
    darker, by_row = darkening_of_bins(geometry.grazing, geometry.below, prior, angle, below)
    return Bins(
        luminance,
        variance,
        geometry.path,
        geometry.off_axis,
        geometry.below,
        geometry.half,
        geometry.distance,
        geometry.extent,
        geometry.grazing,
        darker,
        by_row,
        geometry.distance[0] * math.tan(geometry.grazing[0]),
        albedo_changes(geometry.distance, geometry.extent, geometry.grazing),
    )


@kernel
def albedo_changes(distance: Floats, extent: Floats, grazing: Floats) -> Floats:
    """How all of `ALBEDOS` change from bin to bin (n, 9): they differ in what they deviate by, not in their lengths."""
    return albedo_transitions(distance, extent, grazing, Albedo(0.0, _PATCH_LENGTH, 0.0, _DRIFT_LENGTH, 0.0, 0.0, 0.0))


@kernel
def _from_near(bins: Bins, near: tuple[float, float, float], prior: JointPrior, albedo: Albedo) -> Solution:
    """Best answer from that with a constant albedo, and from one for some of the strips, if there is another.

    `near` has its extinction, NaN for none, airlight and shift.
    """
    k, airlight = fit_constant_albedo(bins, extinction_grid(bins, _EXTINCTIONS), prior)
    if math.isnan(near[0]):
        return _refined_from(bins, prior, k, airlight, prior.shift, albedo)
    best = _refined_from(bins, prior, near[0], near[1], near[2], albedo)
    if abs(math.log(k / max(near[0], _span(bins)[0]))) > ALIKE:
        other = _refined_from(bins, prior, k, airlight, prior.shift, albedo)
        if other.cost < best.cost:
            best = other
    return best


@kernel
def extinction_grid(bins: Bins, count: int) -> Floats:
    """Extinctions that show, evenly in ln k [1/m]."""
    least, most = _span(bins)
    return np.exp(np.linspace(math.log(least), math.log(most), count))


@kernel
def _span(bins: Bins) -> tuple[float, float]:
    """Least and greatest extinction that show [1/m]."""
    unit = 1.0 / bins.path[0, 0]
    return 0.2 * unit, 2.0 * unit * bins.below[0]


@kernel
def _refined_from(bins: Bins, prior: JointPrior, k: float, airlight: float, shift: float, albedo: Albedo) -> Solution:
    theta = np.zeros(PARAMETERS + (prior.rise.size > 0))
    theta[0], theta[1], theta[2] = k, airlight, shift
    if prior.rise.size:
        theta[PARAMETERS] = darkness_by_sky(prior, k, bins.eye)[0]
    return gauss_newton(bins, albedo, prior, theta, _STEPS)


def _average(priors: Priors, found: list[_Answers]) -> JointFit:
    # Priors of even airlight come first.
    uneven = [(prior, one) for prior, one in zip(priors, found, strict=True) if prior.rise.size]
    table = found[0].table if len(found) == 1 else np.concatenate([one.table for one in found])
    mixture = _mixed(table, len(table) - sum(len(one.table) for _, one in uneven))
    best = found[0] if len(found) == 1 else min(found, key=lambda one: float(one.table[:, 0].min()))
    return JointFit(
        extinction=float(mixture.theta[0]),
        extinction_deviation=mixture.deviation,
        airlight=float(mixture.theta[1]),
        shift=float(mixture.theta[2]),
        road=best.road,
        misfit=best.misfit,
        used=best.used == albedo_filter.USED,
        hidden=best.used[0] == albedo_filter.HIDDEN,
        darkening_chance=mixture.uneven,
        droplets=_droplets([np.logaddexp.reduce(-0.5 * (one.table[:, 0] - prior.cost)) for prior, one in uneven]),
        albedos=tuple([albedo for albedo, share in enumerate(mixture.albedo.tolist()) if share > _NEGLIGIBLE]),
    )


@kernel
def _mixed(table: Floats, even: int) -> _Mixture:
    """Answers, of `_Answers`, averaged; the first ones (`even`) are of even airlight."""
    weight = np.exp(-0.5 * (table[:, 0] - table[:, 0].min()))
    weight /= weight.sum()
    theta, albedo, uneven, variance = np.zeros(PARAMETERS), np.zeros(len(ALBEDOS)), 0.0, 0.0
    for a in range(weight.size):
        theta += weight[a] * table[a, 1:5]
        albedo[int(table[a, 6])] += weight[a]
        uneven += weight[a] if a >= even else 0.0
    for a in range(weight.size):
        variance += weight[a] * (table[a, 5] + (table[a, 1] - theta[0]) ** 2)
    return _Mixture(theta, math.sqrt(variance), uneven, albedo)


def _droplets(logarithms: list[float]) -> tuple[float, ...]:
    """Log likelihoods of the kinds of droplets, over the likeliest."""
    return tuple(float(one - max(logarithms)) for one in logarithms)


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
