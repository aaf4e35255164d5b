"""Evidence of hypotheses about an image's rows: the columns' factors integrated over normal priors."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.vision.day.row_filters import road_pass, sky_pass
from fogsim.vision.day.row_kernels import (
    AIRLIGHT,
    COLUMNS,
    FARTHEST,
    OTHER_SKY,
    ROAD,
    SHIFT,
    RowData,
    contrast_across,
    fill_columns,
)

Floats = NDArray[np.float64]

SHARED_NOISE, HIGHEST_OBSTACLE = 0.5 / 255.0, 0.12
"""Deviation of noise that neighbouring rows share, of full scale [-], and up to where things stand before the sky
[rad]."""

MOST_ALBEDO = 0.95
"""Most light of a road over the airlight [-]."""


@kernel
def log_normal_share(value: float) -> float:
    """Logarithm of a normal law's share below a value."""
    if value > -5.0:
        return math.log(0.5 * math.erfc(-value / math.sqrt(2.0)))
    return -0.5 * value * value - math.log(-value * math.sqrt(2.0 * math.pi))


@kernel
def factored(
    gram: Floats, mean: Floats, deviation: Floats, used: NDArray[np.int64], low: Floats, right: Floats
) -> float:
    """Cholesky's factor of the columns' posterior precision, in deviations of their priors.

    Returns the sum of squares that is left, and twice the logarithm of the factor's determinant. Takes `used` (m,)
    int64, `low` (m, m), `right` (m,).
    """
    square = gram[COLUMNS, COLUMNS]
    for a in range(used.size):
        i = used[a]
        total = gram[i, COLUMNS]
        for j in used:
            total -= gram[min(i, j), max(i, j)] * mean[j]
        square -= mean[i] * (gram[i, COLUMNS] + total)
        total *= deviation[i]
        for b in range(a + 1):
            entry = deviation[i] * deviation[used[b]] * gram[used[b], i]
            for c in range(b):
                entry -= low[a, c] * low[b, c]
            low[a, b] = math.sqrt(entry + 1.0) if a == b else entry / low[b, b]
        for c in range(a):
            total -= low[a, c] * right[c]
        right[a] = total / low[a, a]
        square += 2.0 * math.log(low[a, a]) - right[a] * right[a]
    return float(square)


@kernel
def solved(low: Floats, at: int, value: float, out: Floats) -> None:
    """Solve low · out = value in one place and zero elsewhere (`low` (m, m), `out` (m,))."""
    out[:] = 0.0
    out[at] = value / low[at, at]
    for a in range(at + 1, out.size):
        total = 0.0
        for c in range(at, a):
            total -= low[a, c] * out[c]
        out[a] = total / low[a, a]


@kernel
def evidence(gram: Floats, half: float, mean: Floats, deviation: Floats, least_airlight: float) -> float:
    """Logarithm of the density of the light under normal priors of the columns' factors."""
    used = np.flatnonzero(deviation > 0.0)
    low, right = np.empty((used.size, used.size)), np.empty(used.size)
    square = factored(gram, mean, deviation, used, low, right)
    # Airlight and road are the first columns: the road reflects something, and less than the airlight.
    of_airlight, of_road = np.empty(used.size), np.empty(used.size)
    solved(low, 0, deviation[AIRLIGHT], of_airlight)
    solved(low, 1, deviation[ROAD], of_road)
    airlight, road, apart = mean[AIRLIGHT], mean[ROAD], MOST_ALBEDO * mean[AIRLIGHT] - mean[ROAD]
    a_square, r_square, d_square = 0.0, 0.0, 0.0
    for a in range(used.size):
        both = MOST_ALBEDO * of_airlight[a] - of_road[a]
        airlight += of_airlight[a] * right[a]
        road += of_road[a] * right[a]
        apart += both * right[a]
        a_square += of_airlight[a] * of_airlight[a]
        r_square += of_road[a] * of_road[a]
        d_square += both * both
    result = -0.5 * square - half
    result += log_normal_share(road / math.sqrt(r_square)) + log_normal_share(apart / math.sqrt(d_square))
    if least_airlight > 0.0:
        result += log_normal_share((airlight - least_airlight) / math.sqrt(a_square + 1e-6))
    return result


@kernel
def of_lights(
    rows: RowData, response: int, lights: Floats, many: int, shift: float, sky_gram: Floats, sky_half: float,
    grams: Floats, halves: Floats, out: Floats,
) -> None:  # fmt: skip
    """Evidence of one response and surface under each light, and of a road that ends at a cut (`out` (m,))."""
    mean, deviation, gram = np.empty(COLUMNS), np.empty(COLUMNS), np.empty((COLUMNS + 1, COLUMNS + 1))
    level, last = rows.level[response], rows.cuts.size - 1
    for j in range(out.size):
        cut, which = (last, j) if j < many else (j - many, 0)
        for i in range(COLUMNS):
            mean[i], deviation[i] = lights[0, which, i] * level, lights[1, which, i] * level
        mean[SHIFT], deviation[SHIFT] = 0.0, shift
        for a in range(COLUMNS + 1):
            for b in range(a, COLUMNS + 1):
                gram[a, b] = grams[cut, a, b] + sky_gram[a, b]
        least = rows.least_airlight[response] if deviation[OTHER_SKY] == 0.0 else 0.0
        out[j] = rows.free[cut] + evidence(gram, halves[cut] + sky_half, mean, deviation, least)


@kernel
def evidence_grid(
    rows: RowData, lens: Floats, cells: Floats, tried: NDArray[np.int64],
    surfaces: Floats, lights: Floats, many: int, shift: float, out: Floats,
) -> None:  # fmt: skip
    """Logarithm of the evidence of cells, pairs of a response and a surface, and lights or cuts.

    Takes `lens` (3,), `cells` (c, 2) [1/m], `tried` (t, 2) int64, `surfaces` (s, 4) [m], `shift` [px], `out` (c, t, m).
    """
    n = rows.first.size
    columns, place = np.empty((n, COLUMNS)), np.empty((n, 5))
    grams, halves = np.empty((rows.cuts.size, COLUMNS + 1, COLUMNS + 1)), np.empty(rows.cuts.size)
    sky_gram, albedo, hide = np.zeros((COLUMNS + 1, COLUMNS + 1)), np.empty(3), np.empty(2)
    shared, jacobian, of_road = np.empty(n), np.zeros(n + 1), np.empty(n)
    for c in range(cells.shape[0]):
        horizon, extinction = cells[c, 0], cells[c, 1]
        size = 0
        while size < n and rows.last[size] + 0.5 <= horizon:
            size += 1
        before, across = -1.0, 0.0
        for t in range(tried.shape[0]):
            r, s = tried[t, 0], tried[t, 1]
            hidden, level = surfaces[s, 3], rows.level[r]
            if hidden != before:
                fill_columns(rows.first, rows.last, horizon, lens, extinction, hidden, columns, place)
                across = contrast_across(rows.contrast, place, size)
                before = hidden
            noise, slope = rows.noise[r], rows.slope[r]
            for i in range(n):
                jacobian[i + 1] = jacobian[i] + (math.log(slope[i]) if noise[i] > 0.0 else 0.0)
                shared[i] = SHARED_NOISE * slope[i]
                of_road[i] = noise[i] if i >= size else 0.0
                columns[i, SHIFT] = rows.by_row[r, i]
            sky_gram[:] = 0.0
            hide[0] = surfaces[s, 2] * level * math.exp(-extinction * hidden) if hidden < FARTHEST else 0.0
            hide[1] = HIGHEST_OBSTACLE
            sky_half = sky_pass(rows.light[r], slope, noise, columns, place, size, hide, sky_gram)
            for j in range(3):
                albedo[j] = surfaces[s, j] * level
            road_pass(rows.light[r], of_road, shared, columns, place, albedo, hidden, rows.cuts, grams, halves)
            of_lights(rows, r, lights, many, shift, sky_gram, sky_half, grams, halves, out[c, t])
            for j in range(out.shape[2]):
                cut = rows.cuts.size - 1 if j < many else j - many
                out[c, t, j] += jacobian[max(rows.cuts[cut], size)] + across
