"""Sun and shade on the road: strips are divided into what the sun lights and what it does not.

A shadow multiplies the road's luminance by some factor. Where its edge crosses the strips their bins mix both, which
looks like fog, like uneven fog or like an obstacle. Each row has the same fog before both, so that a road which has
two luminances without fog gives its extinction by either, and by how the contrast between both is lost.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import LinearPixels, pixel_luminance
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.strips.joint_fit import JointFit, Priors, extinction_grid, fit_jointly, strip_bins
from fogsim.vision.strips.joint_kernels import Bins, JointPrior, mean_transmittance
from fogsim.vision.strips.strip_curves import StripCurves, strip_curves
from fogsim.vision.strips.strip_geometry import StripGeometry

Floats = NDArray[np.float64]

_PIECES, _SAMPLES = 6, 3
"""Pieces that a bin of a strip is cut into across the road, half a metre wide, since a shadow's edge mostly runs along
or aslant it, and the pixels of each that are averaged."""

_MOST_BINS = 60
"""Bins of a strip that are looked at, or up to twice as many."""

_UNEVEN, _TEXTURE = 0.01, 0.1
"""Deviations of pieces by compression and by the road's texture, relative to the airlight and to the road [-]."""

_ROUNDS = 5
"""Rounds of telling sun from shade and of fitting both."""

_CLEAR, _FEWEST, _ENDS = 0.4, 20, 10
"""Least transmittance of pieces used for the first guess [-], the count up to which pieces are too few, and which part
of them, the darkest and the brightest, is beyond that guess: one in so many."""

_STEPS, _MOST = 1024, 2.0
"""Luminance steps of the first guess, and its upper limit, over the airlight's [-]."""

_DARKEST = 0.02
"""Least luminance of a road over the airlight's [-]."""


class Levels(NamedTuple):
    """A road that sun and shade divide."""

    extinction: float  # k [1/m]
    # airlight, lit, shaded: luminance of the airlight, and of the road in sun and in shade without fog [linear grey
    # levels]
    airlight: float
    lit: float
    shaded: float
    cost: float  # Minus twice the log likelihood, over the number of pieces; infinite if there are too few
    # share, mixed: parts of the pieces that are shaded, and of the bins that have both, weighed by what is left of
    # their light [-]
    share: float
    mixed: float


@kernel
def _pieces_of(image: LinearPixels, rows: NDArray[np.int64], left: Floats, right: Floats) -> Floats:
    """Luminance of the pieces of every bin.

    Returns from left to right [linear grey levels]. Takes `rows` (2, n) int64, `left`, `right` (strips, n).
    """
    (strips, count), cols = left.shape, image.pixels.shape[1]
    out = np.zeros((strips, count, _PIECES))
    for strip in range(strips):
        for i in range(count):
            low, high = left[strip, i], right[strip, i]
            step = (high - low) / (_PIECES * _SAMPLES)
            # From both sides inward: a mirrored image gives the same.
            for j in range(_PIECES * _SAMPLES // 2):
                apart = (j + 0.5) * step + 0.5
                row = rows[0, i] + j % _SAMPLES * (rows[1, i] - rows[0, i]) // (_SAMPLES - 1)
                first, last = max(math.floor(low + apart), 0), min(math.ceil(high - apart), cols - 1)
                out[strip, i, j // _SAMPLES] += pixel_luminance(image, row, min(first, cols - 1)) / _SAMPLES
                out[strip, i, _PIECES - 1 - j // _SAMPLES] += pixel_luminance(image, row, max(last, 0)) / _SAMPLES
    return out


@kernel
def _first_levels(pieces: Floats, passed: Floats, airlight: float, ends: int) -> tuple[float, float]:
    """Luminance without fog below and above which are all but one in so many pieces; 0 where few are seen clearly."""
    tally, count, unit = np.zeros(_STEPS, np.int64), 0, _MOST / _STEPS * airlight
    for i in range(passed.size):
        if passed[i] > _CLEAR:
            for value in pieces[i]:
                luminance = airlight + (value - airlight) / passed[i]
                tally[min(max(int(luminance / unit), 0), _STEPS - 1)] += 1
                count += 1
    if count < _FEWEST:
        return 0.0, 0.0
    low, high, below, above = 0, _STEPS - 1, tally[0], tally[_STEPS - 1]
    while below <= count // ends:
        low += 1
        below += tally[low]
    while above <= count // ends:
        high -= 1
        above += tally[high]
    return (high + 0.5) * unit, (low + 0.5) * unit


@kernel
def _distinguished(pieces: Floats, passed: Floats, levels: Levels, grey: float, sums: Floats) -> None:
    """Write to `sums` (2, 5) what pieces in sun and in shade say, in Cauchy's norm."""
    sums[:] = 0.0
    for i in range(passed.size):
        t = passed[i]
        bright = levels.airlight + (levels.lit - levels.airlight) * t
        dim = levels.airlight + (levels.shaded - levels.airlight) * t
        wide, narrow = grey + (_TEXTURE * levels.lit * t) ** 2, grey + (_TEXTURE * levels.shaded * t) ** 2
        lit, lit_light, dark, dark_light = 0.0, 0.0, 0.0, 0.0
        for value in pieces[i]:
            over, under = value - bright, value - dim
            if abs(under) < abs(over):
                weight = 1.0 / (narrow + under * under)
                dark += weight
                dark_light += weight * value
            else:
                weight = 1.0 / (wide + over * over)
                lit += weight
                lit_light += weight * value
        for c, weight, light in ((0, lit, lit_light), (1, dark, dark_light)):
            sums[c, 0] += weight
            sums[c, 1] += weight * t
            sums[c, 2] += weight * t * t
            sums[c, 3] += light
            sums[c, 4] += light * t


@kernel
def _judged(pieces: Floats, passed: Floats, levels: Levels, grey: float) -> Levels:
    """Levels with their cost and shares."""
    cost, light, dark, mixed = 0.0, 0.0, 0.0, 0.0
    for i in range(passed.size):
        t, shades, product = passed[i], 0, 1.0
        bright = levels.airlight + (levels.lit - levels.airlight) * t
        dim = levels.airlight + (levels.shaded - levels.airlight) * t
        wide, narrow = grey + (_TEXTURE * levels.lit * t) ** 2, grey + (_TEXTURE * levels.shaded * t) ** 2
        for value in pieces[i]:
            over, under = value - bright, value - dim
            if abs(under) < abs(over):
                shades += 1
                product *= (narrow + under * under) ** 2 / narrow
            else:
                product *= (wide + over * over) ** 2 / wide
        cost += math.log(product)
        light += t * t
        dark += shades * t * t / _PIECES
        mixed += t * t if 0 < shades < _PIECES else 0.0
    return Levels(
        levels.extinction,
        levels.airlight,
        levels.lit,
        levels.shaded,
        cost / max(passed.size * _PIECES, 1),
        dark / max(light, 1e-9),
        mixed / max(light, 1e-9),
    )


@kernel
def _fitted(levels: Levels, sums: Floats, prior: JointPrior, divided: bool) -> Levels:
    """Airlight and levels of least squares."""
    known = 1.0 / (prior.below if levels.airlight < prior.airlight else prior.above) ** 2
    left, right = known, known * prior.airlight
    for c in range(2):
        if sums[c, 2] > 0.0:
            left += sums[c, 0] - sums[c, 1] ** 2 / sums[c, 2]
            right += sums[c, 3] - sums[c, 1] * sums[c, 4] / sums[c, 2]
    airlight, found = right / left, np.array([levels.lit, levels.shaded])
    for c in range(2):
        if sums[c, 2] > 0.0:
            found[c] = max(airlight + (sums[c, 4] - airlight * sums[c, 1]) / sums[c, 2], _DARKEST * airlight)
    shaded = found[1] if divided else found[0]
    return Levels(levels.extinction, airlight, found[0], shaded, levels.cost, levels.share, levels.mixed)


@kernel
def _fit_levels(
    pieces: Floats, bins: Bins, extinctions: Floats, prior: JointPrior, pixel: float, divided: bool
) -> Levels:
    """Find the extinction with which a road has two levels, in sun and in shade, or only one.

    Takes `extinctions` (m,) [1/m], `pixel` [linear grey levels].
    """
    count = bins.noise.shape[1]
    used = np.argwhere(bins.noise[:, :: max(count // _MOST_BINS, 1)] > 0.0)
    used[:, 1] *= max(count // _MOST_BINS, 1)
    seen, passed, sums = np.empty((len(used), _PIECES)), np.empty(len(used)), np.empty((2, 5))
    for j in range(len(used)):
        seen[j] = pieces[used[j, 0], used[j, 1]]
    grey = pixel * pixel / _SAMPLES + (_UNEVEN * prior.airlight) ** 2
    best = Levels(0.0, prior.airlight, 0.0, 0.0, np.inf, 0.0, 0.0)
    for k in extinctions:
        for j in range(len(used)):
            strip, i = used[j]
            passed[j] = mean_transmittance(bins.below[i] - prior.shift, bins.half[i], bins.path[strip, i], k)[0]
        lit, shaded = _first_levels(seen, passed, prior.airlight, _ENDS if divided else 2)
        if lit <= 0.0:
            continue
        levels = Levels(k, prior.airlight, lit, shaded if divided else lit, np.inf, 0.0, 0.0)
        for _ in range(_ROUNDS):
            _distinguished(seen, passed, levels, grey, sums)
            levels = _fitted(levels, sums, prior, divided)
        levels = _judged(seen, passed, levels, grey)
        if levels.cost < best.cost:
            best = levels
    return best


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
class _DividedRoad:
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
) -> _DividedRoad | None:
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
    return None if fit is None or fit.extinction <= 0.0 else _DividedRoad(some, laid, fit, levels.share)


def shade_levels(
    pixels: LinearPixels, curves: StripCurves, geometry: StripGeometry, prior: JointPrior, noise: float
) -> Levels | None:
    """Luminance of the road in sun and in shade, with the fog before it.

    Returns None if no shade is found.
    """
    bins = strip_bins(curves, geometry, prior)
    pieces = _pieces_of(pixels, np.stack([geometry.first, geometry.last]), geometry.left, geometry.right)
    grid = extinction_grid(bins, _EXTINCTIONS)
    found = _fit_levels(pieces, bins, grid, prior, noise, True)
    if found.shaded > _MOST_RATIO * found.lit or found.mixed < _LEAST_MIXED:
        return None
    whole = _fit_levels(pieces, bins, grid, prior, noise, False)
    if whole.cost - found.cost < _LEAST_GAIN:
        return None
    step = math.log(grid[1] / grid[0])
    around = found.extinction * np.exp(np.linspace(-step, step, _FINER + 2)[1:-1])
    return _fit_levels(pieces, bins, around, prior, noise, True)


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
