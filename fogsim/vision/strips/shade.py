"""Sun and shade on the road: its strips, divided into what the sun lights and what it does not."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.strips import shade_kernels
from fogsim.vision.strips.joint_fit import JointFit, Priors, extinction_grid, fit_jointly, strip_bins
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.shade_kernels import Levels
from fogsim.vision.strips.strip_curves import StripCurves, strip_curves
from fogsim.vision.strips.strip_geometry import StripGeometry

Floats = NDArray[np.float64]

SURE, ALL_USED = 0.045, 0.97
EXTINCTIONS = 28
LEAST_GAIN, MOST_RATIO = 1.0, 0.6
LIT, SHADED = 0.65, 0.35
PLAIN = 5.0
LEAST = 0.02
LEAST_BINS, ENOUGH = 4, 16
MISLED = 0.15
START = 0.1


@dataclass(frozen=True, slots=True)
class DividedRoad:
    curves: StripCurves
    geometry: StripGeometry
    fit: JointFit


def is_sure(own: JointFit | None, curves: StripCurves) -> bool:
    if own is None or own.hidden.any() or own.extinction_deviation > SURE * own.extinction:
        return False
    return bool(own.used[0].sum() >= ALL_USED * (curves.variance[0] > 0).sum())


def divided_road(
    pixels: LinearPixels,
    curves: StripCurves,
    geometry: StripGeometry,
    camera: Camera,
    priors: Priors,
    told: Horizon,
    noise: float,
    free: float,
) -> DividedRoad | None:
    levels = _levels(pixels, curves, geometry, priors[0], noise)
    if levels is None:
        return None
    priors = tuple(one for prior in priors for one in _misled(prior, told, camera))
    found = None
    for _ in range(2):
        some, laid = _divided(pixels, curves, geometry, levels, noise, camera, free)
        nothing = np.zeros((1, 0), np.bool_)
        near = JointFit(levels.extinction, START * levels.extinction, levels.airlight, priors[0].shift, levels.lit, 1.0, nothing, nothing[0])
        fit = fit_jointly(some, laid, priors, near)
        if fit is None or fit.extinction <= 0.0:
            return found
        levels = levels._replace(extinction=fit.extinction, airlight=fit.airlight)
        found = DividedRoad(some, laid, fit)
    return found


def _misled(prior: JointPrior, told: Horizon, camera: Camera) -> tuple[JointPrior, JointPrior]:
    seen = -2.0 * math.log((1.0 - MISLED) / prior.shift_deviation)
    unseen = -2.0 * math.log(MISLED / told.standard_deviation)
    other = prior._replace(shift=told.row - camera.horizon_row, shift_deviation=told.standard_deviation, cost=unseen)
    return prior._replace(cost=seen), other


def _levels(
    pixels: LinearPixels, curves: StripCurves, geometry: StripGeometry, prior: JointPrior, noise: float
) -> Levels | None:
    bins = strip_bins(curves, geometry, prior)
    rows = np.stack([geometry.first, geometry.last])
    pieces = shade_kernels.pieces_of(pixels, rows, geometry.left, geometry.right)
    grid = extinction_grid(bins, EXTINCTIONS)
    two, one = (shade_kernels.fit_levels(pieces, bins, grid, prior, noise, levels) for levels in (2, 1))
    gain = (one.cost - two.cost) / max(int((bins.noise > 0).sum()) * shade_kernels.PIECES, 1)
    return two if gain > LEAST_GAIN and two.shaded < MOST_RATIO * two.lit else None


def _divided(
    pixels: LinearPixels,
    curves: StripCurves,
    geometry: StripGeometry,
    levels: Levels,
    noise: float,
    camera: Camera,
    free: float,
) -> tuple[StripCurves, StripGeometry]:
    passed = np.exp(-levels.extinction * geometry.path / geometry.below)
    dark, light = math.log(max(levels.shaded, LEAST)), math.log(levels.lit)
    above, under = (math.exp(dark + part * (light - dark)) for part in (LIT, SHADED))
    seen = (curves.variance > 0) & ((above - under) * passed > PLAIN * noise)
    every = np.full(passed.shape, np.inf)
    lit = np.stack([levels.airlight + (above - levels.airlight) * passed, every], axis=1)
    shaded = np.stack([-every, levels.airlight + (under - levels.airlight) * passed], axis=1)
    read = [strip_curves(pixels, geometry, noise, camera, free, None, limits) for limits in (shaded, lit)]
    if (seen[0] & (read[0].variance[0] > 0)).sum() < ENOUGH:
        read = read[::-1]
    values = [np.stack([getattr(one, name) for one in read], axis=1) for name in ("luminance", "variance", "scatter")]
    values[1][~np.repeat(seen[:, None], 2, axis=1)] = 0.0
    both = StripCurves(*(one.reshape(-1, one.shape[-1]) for one in values))
    some = [strip for strip, one in enumerate(both.variance) if strip == 0 or (one > 0).sum() >= LEAST_BINS]
    return both.only(some), geometry.only([strip // 2 for strip in some])
