"""Kalman filters over rows of sky and of road that whiten their light and the columns that explain it."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.day.row_kernels import COLUMNS

Floats = NDArray[np.float64]

PATCHES, GRAIN, SHARED_ROWS = 30.0, 4.0, 8.0
"""Lengths over which albedo is alike, of patches and grain [m], and noise of rows [px]."""

_RATE = math.sqrt(3.0) / PATCHES
"""Rate of a Matérn process of order 3/2 of that length [1/m]."""

SKY_VARIANCE = 0.10
"""Growth of a sky's variance upward from the horizon [1/rad, of full scale squared]."""


@kernel
def footprint(extent: float, length: float) -> float:
    """Deviation that is left of an exponential process averaged over an extent, relative to its own."""
    ratio = extent / length
    if ratio < 1e-3:
        return 1.0
    return math.sqrt(2.0 * (ratio - 1.0 + math.exp(-ratio))) / ratio


@kernel
def add_products(whitened: Floats, gram: Floats) -> None:
    """Add the products of whitened columns to the upper half of a Gram matrix."""
    for a in range(COLUMNS + 1):
        value = whitened[a]
        if value != 0.0:
            for b in range(a, COLUMNS + 1):
                gram[a, b] += value * whitened[b]


@kernel
def road_steps(place: Floats, noise: Floats, first: int) -> Floats:
    """How the road's state passes from each bin in use, from far to near, to the next, and what a bin shows of it.

    Returns the four factors by which patches and their slope pass into themselves and each other, those of grain and of
    noise that rows share, and the shares of patches and of grain that the bin's mean shows (n, 8). Takes `place`
    (n, 5), `noise` (n,).
    """
    steps = np.zeros((noise.size, 8))
    before = -1
    for i in range(first, noise.size):
        if noise[i] <= 0.0:
            continue
        metres, rows = 0.0, 0.0
        if before >= 0:
            metres, rows = max(place[before, 1] - place[i, 1], 0.0), place[i, 3] - place[before, 3]
        e = math.exp(-_RATE * metres)
        steps[i, 0], steps[i, 1] = e * (1.0 + _RATE * metres), e * metres
        steps[i, 2], steps[i, 3] = -e * _RATE * _RATE * metres, e * (1.0 - _RATE * metres)
        steps[i, 4], steps[i, 5] = math.exp(-metres / GRAIN), math.exp(-rows / SHARED_ROWS)
        steps[i, 6], steps[i, 7] = footprint(place[i, 2], PATCHES), footprint(place[i, 2], GRAIN)
        before = i
    return steps


@kernel
def _advance(p: Floats, steps: Floats, i: int) -> None:
    """Predict the covariance of patches and their slope, grain, and noise that rows share (`p` (4, 4))."""
    square = _RATE * _RATE
    f00, f01, f10, f11, f22, f33 = steps[i, 0], steps[i, 1], steps[i, 2], steps[i, 3], steps[i, 4], steps[i, 5]
    # Each process in its own long run: what is forgotten of it comes back as its variance.
    a, b, c = p[0, 0] - 1.0, p[0, 1], p[1, 1] - square
    p[0, 0] = f00 * f00 * a + 2.0 * f00 * f01 * b + f01 * f01 * c + 1.0
    p[0, 1] = f00 * f10 * a + (f00 * f11 + f01 * f10) * b + f01 * f11 * c
    p[1, 1] = f10 * f10 * a + 2.0 * f10 * f11 * b + f11 * f11 * c + square
    for j in (2, 3):
        kept, u, v = steps[i, j + 2], p[0, j], p[1, j]
        p[0, j], p[1, j] = (f00 * u + f01 * v) * kept, (f10 * u + f11 * v) * kept
        p[j, j] = kept * kept * (p[j, j] - 1.0) + 1.0
    p[2, 3] *= f22 * f33


@kernel
def _take_in(
    p: Floats, state: Floats, steps: Floats, seen: Floats, noise: float, columns: Floats, i: int, whitened: Floats
) -> float:
    """Predict the road's state, correct it by a row, and whiten that; return the variance of what is new."""
    _advance(p, steps, i)
    h0, h2, h3 = seen[0], seen[1], seen[2]
    g0 = p[0, 0] * h0 + p[0, 2] * h2 + p[0, 3] * h3
    g1 = p[0, 1] * h0 + p[1, 2] * h2 + p[1, 3] * h3
    g2 = p[0, 2] * h0 + p[2, 2] * h2 + p[2, 3] * h3
    g3 = p[0, 3] * h0 + p[2, 3] * h2 + p[3, 3] * h3
    variance = h0 * g0 + h2 * g2 + h3 * g3 + noise * noise
    scale = 1.0 / math.sqrt(variance)
    g0, g1, g2, g3 = g0 * scale, g1 * scale, g2 * scale, g3 * scale
    f00, f01, f10, f11, f22, f33 = steps[i, 0], steps[i, 1], steps[i, 2], steps[i, 3], steps[i, 4], steps[i, 5]
    for j in range(COLUMNS + 1):
        u, v = state[0, j], state[1, j]
        s0, s1, s2, s3 = f00 * u + f01 * v, f10 * u + f11 * v, state[2, j] * f22, state[3, j] * f33
        new = scale * (columns[i, j] - h0 * s0 - h2 * s2 - h3 * s3)
        whitened[j] = new
        state[0, j], state[1, j] = s0 + g0 * new, s1 + g1 * new
        state[2, j], state[3, j] = s2 + g2 * new, s3 + g3 * new
    p[0, 0], p[0, 1], p[0, 2], p[0, 3] = p[0, 0] - g0 * g0, p[0, 1] - g0 * g1, p[0, 2] - g0 * g2, p[0, 3] - g0 * g3
    p[1, 1], p[1, 2], p[1, 3] = p[1, 1] - g1 * g1, p[1, 2] - g1 * g2, p[1, 3] - g1 * g3
    p[2, 2], p[2, 3], p[3, 3] = p[2, 2] - g2 * g2, p[2, 3] - g2 * g3, p[3, 3] - g3 * g3
    return float(variance)


@kernel
def sky_pass(
    slope: Floats, noise: Floats, columns: Floats, place: Floats, size: int, hidden: Floats, gram: Floats
) -> float:
    """Whiten the sky's rows, from the horizon upward, and add them to a Gram matrix.

    Returns half the logarithm of the determinant of the covariance, with 2π. Takes `slope`, `noise` (n,), `columns`
    (n, COLUMNS + 1), `hidden` (2,).
    """
    state, other = np.zeros(COLUMNS + 1), np.zeros(COLUMNS + 1)
    whitened = np.empty(COLUMNS + 1)
    variance, shared, cross = 0.0, 1.0, 0.0
    before, total = 0.0, 0.0
    for i in range(size - 1, -1, -1):
        above = place[i, 4]
        variance += SKY_VARIANCE * max(above - before, 0.0)
        kept = math.exp(-abs(above - before) / 0.02) if i < size - 1 else 0.0
        before = above
        shared = kept * kept * shared + 1.0 - kept * kept
        cross *= kept
        if noise[i] <= 0.0:
            for j in range(COLUMNS + 1):
                other[j] *= kept
            continue
        h, o = slope[i], hidden[0] if above < hidden[1] else 0.0
        vh, so = variance * h + cross * o, cross * h + shared * o
        innovation = h * vh + o * so + noise[i] * noise[i]
        scale = 1.0 / math.sqrt(innovation)
        for j in range(COLUMNS + 1):
            other[j] *= kept
            apart = columns[i, j] - h * state[j] - o * other[j]
            state[j] += vh / innovation * apart
            other[j] += so / innovation * apart
            whitened[j] = apart * scale
        variance -= vh * vh / innovation
        shared -= so * so / innovation
        cross -= vh * so / innovation
        add_products(whitened, gram)
        total += 0.5 * math.log(2.0 * math.pi * innovation)
    return total


@kernel
def road_pass(
    noise: Floats, shared: Floats, columns: Floats, place: Floats, steps: Floats, albedo: Floats, hidden: float,
    cuts: NDArray[np.int64], grams: Floats, halves: Floats,
) -> None:  # fmt: skip
    """Whiten the road's rows, from far to near; Gram matrices of all rows up to each of several cuts.

    Takes `noise`, `shared` (n,), `columns` (n, COLUMNS + 1), `steps` (n, 8), `albedo` (3,), `hidden` [m], `cuts` (m,)
    int64, `halves` (m,).
    """
    gram, whitened = np.zeros((COLUMNS + 1, COLUMNS + 1)), np.empty(COLUMNS + 1)
    state, p, seen = np.zeros((4, COLUMNS + 1)), np.diag(np.array([1.0, _RATE * _RATE, 1.0, 1.0])), np.empty(3)
    half, cut = 0.0, 0
    for i in range(noise.size):
        while cut < cuts.size and cuts[cut] <= i:
            grams[cut], halves[cut] = gram, half
            cut += 1
        # A bin that is in use forgets no more than all.
        if steps[i, 0] == 0.0:
            continue
        seen[0] = place[i, 0] * albedo[0] * steps[i, 6]
        seen[1] = place[i, 0] * (albedo[2] if place[i, 1] > hidden else albedo[1] * steps[i, 7])
        seen[2] = shared[i]
        variance = _take_in(p, state, steps, seen, noise[i], columns, i, whitened)
        half += 0.5 * math.log(2.0 * math.pi * variance)
        add_products(whitened, gram)
    while cut < cuts.size:
        grams[cut], halves[cut] = gram, half
        cut += 1
