"""Compiled search for sun and shade on a road in fog: two luminances without fog, and one extinction for both."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.vision.light.pixel_kernels import LinearPixels, pixel_luminance
from fogsim.vision.strips.joint_kernels import Bins, JointPrior, mean_transmittance

PIECES, SAMPLES = 6, 3
"""Pieces that a bin of a strip is cut into across the road, and the pixels of each that are averaged."""

GRAINY, TEXTURE = 0.01, 0.1
"""Deviation of pieces by airlight and by the road's texture, relative to the airlight and to the road [-]."""

ROUNDS, ENOUGH = 6, 0.4
"""Rounds of telling pieces apart and fitting their levels; transmittance from which on bins give the first levels."""


class Levels(NamedTuple):
    """A road that sun and shade divide.

    Attributes
    ----------
    extinction : float
        k [1/m].
    airlight, lit, shaded : float
        Luminance of the airlight, and of the road in sun and shade without fog [linear grey levels].
    cost : float
        Minus twice the log likelihood.
    share : float
        Part of the pieces that is shaded, weighed by what is left of their light [-].
    """

    extinction: float
    airlight: float
    lit: float
    shaded: float
    cost: float
    share: float


@kernel
def pieces_of(image: LinearPixels, rows: NDArray[np.int64], left: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """(strips, n, PIECES) luminance of pieces across strips.

    Parameters
    ----------
    image : LinearPixels
        The image.
    rows : (2, n) int64
        First and last row of each bin.
    left, right : (strips, n) float64
        Columns between which the strips lie.
    """
    strips, count = left.shape
    out = np.zeros((strips, count, PIECES))
    cols = image.pixels.shape[1]
    for strip in range(strips):
        for i in range(count):
            step, height = (right[strip, i] - left[strip, i]) / (PIECES * SAMPLES), rows[1, i] - rows[0, i] + 1
            for j in range(PIECES * SAMPLES):
                col = int(left[strip, i] + (j + 0.5) * step + 0.5)
                row = rows[0, i] + (j * height // SAMPLES) % height
                out[strip, i, j // SAMPLES] += pixel_luminance(image, row, min(max(col, 0), cols - 1)) / SAMPLES
    return out


@kernel
def _first_levels(pieces: NDArray[np.float64], noise: NDArray[np.float64], passed: NDArray[np.float64], airlight: float, levels: int) -> tuple[float, float]:
    found, count = np.empty(pieces.size), 0
    for strip in range(noise.shape[0]):
        for i in range(noise.shape[1]):
            if noise[strip, i] > 0.0 and passed[strip, i] > ENOUGH:
                for j in range(PIECES):
                    found[count] = airlight + (pieces[strip, i, j] - airlight) / passed[strip, i]
                    count += 1
    if count < 20:
        return 0.0, 0.0
    ordered = np.sort(found[:count])
    if levels == 1:
        return float(ordered[count // 2]), float(ordered[count // 2])
    return float(ordered[count * 9 // 10]), float(ordered[count // 10])


@kernel
def fit_levels(pieces: NDArray[np.float64], bins: Bins, extinctions: NDArray[np.float64], prior: JointPrior, pixel: float, levels: int) -> Levels:
    strips, count = bins.noise.shape
    passed = np.empty((strips, count))
    best = Levels(0.0, prior.airlight, 0.0, 0.0, np.inf, 0.0)
    for k in extinctions:
        for strip in range(strips):
            for i in range(count):
                passed[strip, i], _, _ = mean_transmittance(bins.below[i] - prior.shift, bins.half[i], bins.path[strip, i], k)
        lit, shaded = _first_levels(pieces, bins.noise, passed, prior.airlight, levels)
        if lit <= 0.0:
            continue
        off, total, dark, light = 0.0, 0.0, 0.0, 0.0
        for iteration in range(ROUNDS):
            sums = np.zeros((2, 5))
            airlight, total, dark, light = prior.airlight + off, 0.0, 0.0, 0.0
            for strip in range(strips):
                for i in range(count):
                    if bins.noise[strip, i] <= 0.0:
                        continue
                    t = passed[strip, i]
                    high, low = airlight + (lit - airlight) * t, airlight + (shaded - airlight) * t
                    base = pixel * pixel / SAMPLES + (GRAINY * prior.airlight) ** 2
                    for j in range(PIECES):
                        value = pieces[strip, i, j]
                        c = 1 if levels == 2 and abs(value - low) < abs(value - high) else 0
                        level = shaded if c else lit
                        spread = base + (TEXTURE * level * t) ** 2
                        rest = value - (low if c else high)
                        weight = 1.0 / (spread + rest * rest)
                        total += 2.0 * math.log1p(rest * rest / spread) + math.log(spread)
                        y = value - prior.airlight
                        sums[c, 0] += weight
                        sums[c, 1] += weight * t
                        sums[c, 2] += weight * t * t
                        sums[c, 3] += weight * y
                        sums[c, 4] += weight * t * y
                        light += t * t
                        dark += c * t * t
            known = 1.0 / (prior.below if off < 0.0 else prior.above) ** 2
            total += known * off * off
            left, right = known, 0.0
            for c in range(2):
                if sums[c, 2] > 0.0:
                    left += sums[c, 0] - sums[c, 1] ** 2 / sums[c, 2]
                    right += sums[c, 3] - sums[c, 1] * sums[c, 4] / sums[c, 2]
            if iteration + 1 < ROUNDS:
                off = right / left
                if sums[0, 2] > 0.0:
                    lit = max(prior.airlight + off + (sums[0, 4] - off * sums[0, 1]) / sums[0, 2], 0.02 * prior.airlight)
                if sums[1, 2] > 0.0:
                    shaded = max(prior.airlight + off + (sums[1, 4] - off * sums[1, 1]) / sums[1, 2], 0.02 * prior.airlight)
        if total < best.cost:
            best = Levels(k, prior.airlight + off, lit, shaded, total, dark / max(light, 1e-9))
    return best
