"""Compiled search for sun and shade on a road in fog: two luminances without fog, and one extinction for both."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.light.pixel_kernels import LinearPixels, pixel_luminance
from fogsim.vision.strips.joint_kernels import Bins, JointPrior, mean_transmittance

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
def pieces_of(image: LinearPixels, rows: NDArray[np.int64], left: Floats, right: Floats) -> Floats:
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
def fit_levels(
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
