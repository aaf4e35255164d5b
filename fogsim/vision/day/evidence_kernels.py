"""Evidence of hypotheses about an image's rows: the columns' factors integrated over normal priors."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.day.row_kernels import (
    AIRLIGHT,
    COLUMNS,
    COMMON,
    FARTHEST,
    OTHER_SKY,
    ROAD,
    SHIFT,
    RowData,
    contrast_across,
    fill_columns,
)

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
def _add_products(whitened: Floats, gram: Floats) -> None:
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
        _add_products(whitened, gram)
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
        _add_products(whitened, gram)
    while cut < cuts.size:
        grams[cut], halves[cut] = gram, half
        cut += 1


_SHARED_NOISE, _HIGHEST_OBSTACLE = 0.5 / 255.0, 0.12
"""Deviation of noise that neighbouring rows share, of full scale [-], and up to where things stand before the sky
[rad]."""

_MOST_ALBEDO = 0.95
"""Most light of a road over the airlight [-]."""


@kernel
def _log_normal_share(value: float) -> float:
    """Logarithm of a normal law's share below a value."""
    if value > -5.0:
        return math.log(0.5 * math.erfc(-value / math.sqrt(2.0)))
    return -0.5 * value * value - math.log(-value * math.sqrt(2.0 * math.pi))


class Law(NamedTuple):
    """Normal priors of the columns' factors, and which columns have one, airlight and road first."""

    mean: Floats
    deviation: Floats
    used: NDArray[np.int64]


class Factor(NamedTuple):
    """Cholesky's factor of the factors' posterior precision, in deviations of their priors, and what comes of it."""

    low: Floats  # (COLUMNS, COLUMNS)
    right: Floats  # (COLUMNS,): low⁻¹ of the right-hand side
    square: Floats  # (COLUMNS,): What each row adds to the sum of squares, with twice the logarithm of its pivot
    ends: Floats  # (COLUMNS, 2): low⁻¹ of airlight's and road's deviations


@kernel
def no_factor() -> Factor:
    """Room for a factor."""
    return Factor(np.empty((COLUMNS, COLUMNS)), np.empty(COLUMNS), np.empty(COLUMNS), np.empty((COLUMNS, 2)))


@kernel
def _factor(gram: Floats, law: Law, first: int, out: Factor) -> None:
    """Rows of the factor from some on."""
    mean, deviation, used = law
    for a in range(first, used.size):
        i = used[a]
        total = gram[i, COLUMNS]
        for j in used:
            total -= gram[min(i, j), max(i, j)] * mean[j]
        out.square[a] = -mean[i] * (gram[i, COLUMNS] + total)
        total *= deviation[i]
        airlight, road = deviation[i] if a == 0 else 0.0, deviation[i] if a == 1 else 0.0
        for b in range(a):
            entry = deviation[i] * deviation[used[b]] * gram[used[b], i]
            for c in range(b):
                entry -= out.low[a, c] * out.low[b, c]
            entry /= out.low[b, b]
            out.low[a, b] = entry
            total -= entry * out.right[b]
            airlight -= entry * out.ends[b, 0]
            road -= entry * out.ends[b, 1]
        square = deviation[i] ** 2 * gram[i, i] + 1.0
        for c in range(a):
            square -= out.low[a, c] ** 2
        pivot = math.sqrt(square)
        out.low[a, a], out.right[a] = pivot, total / pivot
        out.ends[a, 0], out.ends[a, 1] = airlight / pivot, road / pivot
        out.square[a] += math.log(square) - out.right[a] ** 2


@kernel
def evidence(gram: Floats, half: float, law: Law, least_airlight: float, first: int, room: Factor) -> float:
    """Logarithm of the density of the light under normal priors of the columns' factors.

    Rows of the factor before the first are those of the call before.
    """
    _factor(gram, law, first, room)
    # Airlight and road are the first columns: the road reflects something, and less than the airlight.
    airlight, road = law.mean[AIRLIGHT], law.mean[ROAD]
    apart, square = _MOST_ALBEDO * airlight - road, gram[COLUMNS, COLUMNS]
    a_square, r_square, d_square = 0.0, 0.0, 0.0
    for a in range(law.used.size):
        of_airlight, of_road, right = room.ends[a, 0], room.ends[a, 1], room.right[a]
        both = _MOST_ALBEDO * of_airlight - of_road
        square += room.square[a]
        airlight += of_airlight * right
        road += of_road * right
        apart += both * right
        a_square += of_airlight * of_airlight
        r_square += of_road * of_road
        d_square += both * both
    result = -0.5 * square - half
    result += _log_normal_share(road / math.sqrt(r_square)) + _log_normal_share(apart / math.sqrt(d_square))
    if least_airlight > 0.0:
        result += _log_normal_share((airlight - least_airlight) / math.sqrt(a_square + 1e-6))
    return float(result)


class Laws(NamedTuple):
    """Laws of the factors under all responses and lights."""

    # mean, deviation (r, m, COLUMNS); used (m, COLUMNS) int64, of which so many are columns; number (m,) int64
    mean: Floats
    deviation: Floats
    used: NDArray[np.int64]
    number: NDArray[np.int64]


@kernel
def _laws_of(lights: Floats, levels: Floats, shift: float) -> Laws:
    """Laws under responses of some levels of light (`lights` (2, m, COLUMNS), `levels` (r,), `shift` [px])."""
    many = lights.shape[1]
    mean, deviation = np.empty((levels.size, many, COLUMNS)), np.empty((levels.size, many, COLUMNS))
    used, number = np.zeros((many, COLUMNS), np.int64), np.zeros(many, np.int64)
    for r in range(levels.size):
        mean[r], deviation[r] = lights[0] * levels[r], lights[1] * levels[r]
    mean[:, :, SHIFT], deviation[:, :, SHIFT] = 0.0, shift
    for j in range(many):
        for i in range(COLUMNS):
            if deviation[0, j, i] > 0.0:
                used[j, number[j]] = i
                number[j] += 1
    return Laws(mean, deviation, used, number)


@kernel
def _of_lights(
    rows: RowData, response: int, laws: Laws, sky_gram: Floats, sky_half: float, grams: Floats, halves: Floats,
    room: Factor, out: Floats,
) -> None:  # fmt: skip
    """Evidence of one response and surface under each light, and of a road that ends at a cut (`out` (m,))."""
    many, last, before = laws.number.size, rows.cuts.size - 1, -1
    gram = grams[last] + sky_gram
    for j in range(out.size):
        cut, which = (last, j) if j < many else (j - many, 0)
        if j >= many:
            gram = grams[cut] + sky_gram
        used = laws.used[which, : laws.number[which]]
        law = Law(laws.mean[response, which], laws.deviation[response, which], used)
        least = rows.least_airlight[response] if law.deviation[OTHER_SKY] == 0.0 else 0.0
        # What lights of the same means have in common is factored once.
        is_alike = before >= 0 and j < many and np.array_equal(law.mean, laws.mean[response, before])
        first, before = COMMON if is_alike else 0, which
        out[j] = rows.free[cut] + evidence(gram, halves[cut] + sky_half, law, least, first, room)


@kernel
def _jacobians(rows: RowData) -> Floats:
    """(r, n + 1) float64: logarithm of how light changes with the signals of all bins before each."""
    out = np.zeros((rows.slope.shape[0], rows.first.size + 1))
    for r in range(out.shape[0]):
        for i in range(rows.first.size):
            out[r, i + 1] = out[r, i] + (math.log(rows.slope[r, i]) if rows.noise[r, i] > 0.0 else 0.0)
    return out


@kernel
def evidence_grid(
    rows: RowData, lens: Floats, cells: Floats, tried: NDArray[np.int64],
    surfaces: Floats, lights: Floats, shift: float, out: Floats,
) -> None:  # fmt: skip
    """Logarithm of the evidence of cells, pairs of a response and a surface, and lights or cuts.

    Takes `lens` (3,), `cells` (c, 2) [1/m], `tried` (t, 2) int64, `surfaces` (s, 4) [m], `shift` [px], `out` (c, t, m).
    """
    n, last = rows.first.size, rows.cuts.size - 1
    columns, place, steps = np.empty((n, COLUMNS + 1)), np.empty((n, 5)), np.empty((n, 8))
    grams, halves = np.empty((rows.cuts.size, COLUMNS + 1, COLUMNS + 1)), np.empty(rows.cuts.size)
    sky_gram, hide, room = np.zeros((COLUMNS + 1, COLUMNS + 1)), np.empty(2), no_factor()
    jacobian, laws = _jacobians(rows), _laws_of(lights, rows.level, shift)
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
                if t == 0:
                    steps = road_steps(place, rows.noise[0], size)
                before = hidden
            columns[:, SHIFT], columns[:, COLUMNS] = rows.by_row[r], rows.light[r]
            sky_gram[:] = 0.0
            hide[0] = surfaces[s, 2] * level * math.exp(-extinction * hidden) if hidden < FARTHEST else 0.0
            hide[1] = _HIGHEST_OBSTACLE
            sky_half = sky_pass(rows.slope[r], rows.noise[r], columns, place, size, hide, sky_gram)
            shared, albedo = _SHARED_NOISE * rows.slope[r], surfaces[s, :3] * level
            road_pass(rows.noise[r], shared, columns, place, steps, albedo, hidden, rows.cuts, grams, halves)
            _of_lights(rows, r, laws, sky_gram, sky_half, grams, halves, room, out[c, t])
            for j in range(out.shape[2]):
                cut = last if j < lights.shape[1] else j - lights.shape[1]
                out[c, t, j] += jacobian[r, max(rows.cuts[cut], size)] + across
