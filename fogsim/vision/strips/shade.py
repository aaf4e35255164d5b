"""Sun and shade on the road: strips are divided into what the sun lights and what it does not.

A shadow multiplies the road's luminance by some factor. Where its edge crosses the strips their bins mix both, which
looks like fog, like uneven fog or like an obstacle. Each row has the same fog before both, so that a road which has
two luminances without fog gives its extinction by either, and by how the contrast between both is lost.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.strips.joint_fit import JointFit, Priors, extinction_grid, fit_jointly, strip_bins
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.shade_kernels import Levels, fit_levels, pieces_of
from fogsim.vision.strips.strip_curves import StripCurves, strip_curves
from fogsim.vision.strips.strip_geometry import StripGeometry

Floats = NDArray[np.float64]

_SURE, _ALL_USED = 0.045, 0.97
"""Relative deviation of k up to which, and share of its bins in use from which on, the own lane needs no shade [-]."""

_EXTINCTIONS, _FINER = 28, 15
"""Extinctions of the search, evenly in ln k and a quarter apart, and how many more about the best of them: strips are
divided only once, by what these say."""

_LEAST_GAIN, _MOST_RATIO, _LEAST_MIXED = 1.0, 0.6, 0.05
"""What a division is to gain in minus twice the log likelihood of a piece, the most that the shade's luminance is of
the sun's, and the least share of bins that have both [-]: texture gains 0.3 to 0.9 with a ratio above 0.6, and fog that
varies along the way leaves every bin with one of both."""

_LIT, _SHADED = 0.65, 0.35
"""From where on, and up to where, in the logarithm between shade and sun, a pixel is lit or shaded [-]: between them
lie penumbrae."""

_PLAIN = 5.0
"""Least gap between what is lit and what is shaded, in deviations of pixels [-]: else noise would decide."""

_LEAST_BINS, _ENOUGH = 4, 16
"""Fewest bins of a strip in sun or in shade, and of the own lane in shade to be what the road is judged by."""

NOTHING = np.zeros(0, np.bool_)
"""Bins in use of an answer that is only a start."""

_MISLED = 0.15
"""How likely a shadow's edge is taken for a line along the road, so that the assumed horizon is better than the seen
[-]."""


@dataclass(frozen=True, slots=True)
class DividedRoad:
    """Strips in sun and in shade, and their fit."""

    curves: StripCurves  # Luminance by bin; the first strip is the own lane's, in shade if there is enough of it
    geometry: StripGeometry  # Where they lie
    fit: JointFit  # Of even fog to all of them
    share: float  # Part of the road that is shaded [-]


def is_sure(own: JointFit | None, curves: StripCurves) -> bool:
    """Whether the own lane's fit explains it, so that shade on it need not be looked for."""
    if own is None or own.hidden.any() or own.extinction_deviation > _SURE * own.extinction:
        return False
    return bool(own.used[0].sum() >= _ALL_USED * (curves.variance[0] > 0).sum())


def divided_road(
    pixels: LinearPixels,
    curves: StripCurves,
    geometry: StripGeometry,
    camera: Camera,
    priors: Priors,
    stated: Horizon,
    noise: float,
    free: float,
) -> DividedRoad | None:
    """Divide strips into sun and shade, and fit even fog to them.

    Returns None if no shade is found. Takes `noise` [linear grey levels], `free` [m].
    """
    levels = shade_levels(pixels, curves, geometry, priors[0], noise)
    if levels is None:
        return None
    stated_too = (*_seen_or_stated(priors[0], stated, camera), *priors[1:])
    some, laid = _divided(pixels, curves, geometry, levels, noise, camera, free)
    near = JointFit(levels.extinction, 0.0, levels.airlight, priors[0].shift, levels.lit, 1.0, NOTHING, NOTHING)
    fit = fit_jointly(some, laid, stated_too, near)
    return None if fit is None or fit.extinction <= 0.0 else DividedRoad(some, laid, fit, levels.share)


def shade_levels(
    pixels: LinearPixels, curves: StripCurves, geometry: StripGeometry, prior: JointPrior, noise: float
) -> Levels | None:
    """Luminance of the road in sun and in shade, with the fog before it.

    Returns None if no shade is found.
    """
    bins = strip_bins(curves, geometry, prior)
    pieces = pieces_of(pixels, np.stack([geometry.first, geometry.last]), geometry.left, geometry.right)
    grid = extinction_grid(bins, _EXTINCTIONS)
    found = fit_levels(pieces, bins, grid, prior, noise, True)
    if found.shaded > _MOST_RATIO * found.lit or found.mixed < _LEAST_MIXED:
        return None
    whole = fit_levels(pieces, bins, grid, prior, noise, False)
    if whole.cost - found.cost < _LEAST_GAIN:
        return None
    step = math.log(grid[1] / grid[0])
    around = found.extinction * np.exp(np.linspace(-step, step, _FINER + 2)[1:-1])
    return fit_levels(pieces, bins, around, prior, noise, True)


def _seen_or_stated(prior: JointPrior, stated: Horizon, camera: Camera) -> tuple[JointPrior, JointPrior]:
    """Prior with the seen horizon, and that with the stated one."""
    seen = prior._replace(cost=-2.0 * math.log((1.0 - _MISLED) / prior.shift_deviation))
    shift, deviation = stated.row - camera.horizon_row, stated.standard_deviation
    return seen, prior._replace(
        shift=shift, shift_deviation=deviation, cost=-2.0 * math.log(_MISLED / max(deviation, prior.shift_deviation))
    )


def _divided(
    pixels: LinearPixels,
    curves: StripCurves,
    geometry: StripGeometry,
    levels: Levels,
    noise: float,
    camera: Camera,
    free: float,
) -> tuple[StripCurves, StripGeometry]:
    """Strips in shade and in sun, each lane's after the other."""
    passed = np.exp(-levels.extinction * geometry.path / np.maximum(geometry.below, 1e-9))
    dark, light = math.log(levels.shaded), math.log(levels.lit)
    above, under = (math.exp(dark + part * (light - dark)) for part in (_LIT, _SHADED))
    seen = (curves.variance > 0) & ((above - under) * passed > _PLAIN * noise)
    every = np.full(passed.shape, math.inf)
    lit = np.stack([levels.airlight + (above - levels.airlight) * passed, every], axis=1)
    shaded = np.stack([-every, levels.airlight + (under - levels.airlight) * passed], axis=1)
    read = [strip_curves(pixels, geometry, noise, camera, free, None, limits) for limits in (shaded, lit)]
    if (seen[0] & (read[0].variance[0] > 0)).sum() < _ENOUGH:
        read.reverse()
    variance = [np.where(seen, one.variance, 0.0) for one in read]
    both = StripCurves(
        *(
            np.stack(values, axis=1).reshape(-1, passed.shape[1])
            for values in ([one.luminance for one in read], variance, [one.scatter for one in read])
        )
    )
    some = [strip for strip, one in enumerate(both.variance) if strip == 0 or (one > 0).sum() >= _LEAST_BINS]
    return both.only(some), geometry.only([strip // 2 for strip in some])
