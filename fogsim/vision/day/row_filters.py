"""Kalman filters over rows of sky and of road that whiten their light and the columns that explain it."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.vision.day.row_kernels import COLUMNS

Floats = NDArray[np.float64]

PATCHES, GRAIN, SHARED_ROWS = 30.0, 4.0, 8.0
"""Lengths over which albedo is alike, of patches and grain [m], and noise of rows [px]."""

RATE = math.sqrt(3.0) / PATCHES
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
        if whitened[a] != 0.0:
            for b in range(a, COLUMNS + 1):
                gram[a, b] += whitened[a] * whitened[b]


@kernel
def advance(p: Floats, state: Floats, metres: float, rows: float) -> None:
    """Predict the road's state some metres and rows nearer: patches and their slope, grain, noise that rows share.

    Takes `p` (4, 4).
    """
    square, e = RATE * RATE, math.exp(-RATE * metres)
    f00, f01, f10, f11 = e * (1.0 + RATE * metres), e * metres, -e * square * metres, e * (1.0 - RATE * metres)
    f22, f33 = math.exp(-metres / GRAIN), math.exp(-rows / SHARED_ROWS)
    # Each process in its own long run: what is forgotten of it comes back as its variance.
    a, b, c = p[0, 0] - 1.0, p[0, 1], p[1, 1] - square
    p[0, 0] = f00 * f00 * a + 2.0 * f00 * f01 * b + f01 * f01 * c + 1.0
    p[0, 1] = f00 * f10 * a + (f00 * f11 + f01 * f10) * b + f01 * f11 * c
    p[1, 1] = f10 * f10 * a + 2.0 * f10 * f11 * b + f11 * f11 * c + square
    for j in (2, 3):
        kept, u, v = f22 if j == 2 else f33, p[0, j], p[1, j]
        p[0, j], p[1, j] = (f00 * u + f01 * v) * kept, (f10 * u + f11 * v) * kept
        p[j, j] = kept * kept * (p[j, j] - 1.0) + 1.0
    p[2, 3] *= f22 * f33
    for j in range(COLUMNS + 1):
        u, v = state[0, j], state[1, j]
        state[0, j], state[1, j] = f00 * u + f01 * v, f10 * u + f11 * v
        state[2, j] *= f22
        state[3, j] *= f33


@kernel
def take_in(
    p: Floats, state: Floats, seen: Floats, noise: float, column: Floats, light: float, whitened: Floats
) -> float:
    """Correct the road's state by a row, and whiten that; return the variance of what is new (`seen` (3,))."""
    h0, h2, h3 = seen[0], seen[1], seen[2]
    g0 = p[0, 0] * h0 + p[0, 2] * h2 + p[0, 3] * h3
    g1 = p[0, 1] * h0 + p[1, 2] * h2 + p[1, 3] * h3
    g2 = p[0, 2] * h0 + p[2, 2] * h2 + p[2, 3] * h3
    g3 = p[0, 3] * h0 + p[2, 3] * h2 + p[3, 3] * h3
    variance = h0 * g0 + h2 * g2 + h3 * g3 + noise * noise
    scale = 1.0 / math.sqrt(variance)
    for j in range(COLUMNS + 1):
        value = column[j] if j < COLUMNS else light
        new = scale * (value - h0 * state[0, j] - h2 * state[2, j] - h3 * state[3, j])
        whitened[j] = new
        new *= scale
        state[0, j] += g0 * new
        state[1, j] += g1 * new
        state[2, j] += g2 * new
        state[3, j] += g3 * new
    gain = np.array([g0 * scale, g1 * scale, g2 * scale, g3 * scale])
    for a in range(4):
        for b in range(a, 4):
            p[a, b] -= gain[a] * gain[b]
    return float(variance)


@kernel
def sky_pass(
    light: Floats, slope: Floats, noise: Floats, columns: Floats, place: Floats, size: int, hidden: Floats,
    gram: Floats,
) -> float:  # fmt: skip
    """Whiten the sky's rows, from the horizon upward, and add them to a Gram matrix.

    Returns half the logarithm of the determinant of the covariance, with 2π. Takes `light`, `slope`, `noise` (n,),
    `hidden` (2,).
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
            value = columns[i, j] if j < COLUMNS else light[i]
            apart = value - h * state[j] - o * other[j]
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
    light: Floats, noise: Floats, shared: Floats, columns: Floats, place: Floats, albedo: Floats, hidden: float,
    cuts: NDArray[np.int64], grams: Floats, halves: Floats,
) -> None:  # fmt: skip
    """Whiten the road's rows, from far to near; Gram matrices of all rows up to each of several cuts.

    Takes `light`, `noise`, `shared` (n,), `albedo` (3,), `hidden` [m], `cuts` (m,) int64, `halves` (m,).
    """
    gram, whitened = np.zeros((COLUMNS + 1, COLUMNS + 1)), np.empty(COLUMNS + 1)
    state, p, seen = np.zeros((4, COLUMNS + 1)), np.diag(np.array([1.0, RATE * RATE, 1.0, 1.0])), np.empty(3)
    half, cut, depth, row = 0.0, 0, 0.0, 0.0
    for i in range(light.size):
        while cut < cuts.size and cuts[cut] <= i:
            grams[cut], halves[cut] = gram, half
            cut += 1
        if noise[i] <= 0.0:
            continue
        away = place[i, 1]
        if depth > 0.0:
            advance(p, state, max(depth - away, 0.0), place[i, 3] - row)
        depth, row = away, place[i, 3]
        seen[0] = place[i, 0] * albedo[0] * footprint(place[i, 2], PATCHES)
        seen[1] = place[i, 0] * (albedo[2] if away > hidden else albedo[1] * footprint(place[i, 2], GRAIN))
        seen[2] = shared[i]
        half += 0.5 * math.log(2.0 * math.pi * take_in(p, state, seen, noise[i], columns[i], light[i], whitened))
        add_products(whitened, gram)
    while cut < cuts.size:
        grams[cut], halves[cut] = gram, half
        cut += 1
