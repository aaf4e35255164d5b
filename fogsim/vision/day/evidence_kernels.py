"""Evidence of hypotheses about an image's rows: the columns' factors integrated over normal priors."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.day.row_filters import road_pass, road_steps, sky_pass
from fogsim.vision.day.row_kernels import (
    AIRLIGHT,
    COLUMNS,
    COMMON,
    DARKENING,
    FARTHEST,
    OTHER_SKY,
    ROAD,
    SHIFT,
    RowData,
    contrast_across,
    fill_columns,
)

Floats = NDArray[np.float64]

_SHARED_NOISE, _HIGHEST_OBSTACLE = 0.5 / 255.0, 0.12
"""Deviation of noise that neighbouring rows share, of full scale [-], and up to where things stand before the sky
[rad]."""

_MOST_ALBEDO = 0.95
"""Most light of a road over the airlight [-]."""


@kernel
def log_normal_share(value: float) -> float:
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
    result += log_normal_share(road / math.sqrt(r_square)) + log_normal_share(apart / math.sqrt(d_square))
    if least_airlight > 0.0:
        result += log_normal_share((airlight - least_airlight) / math.sqrt(a_square + 1e-6))
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
    many, last, before = laws.number.size, rows.cuts.size - 1, -1.0
    gram = grams[last] + sky_gram
    for j in range(out.size):
        cut, which = (last, j) if j < many else (j - many, 0)
        if j >= many:
            gram = grams[cut] + sky_gram
        used = laws.used[which, : laws.number[which]]
        law = Law(laws.mean[response, which], laws.deviation[response, which], used)
        least = rows.least_airlight[response] if law.deviation[OTHER_SKY] == 0.0 else 0.0
        # What lights have in common is factored once.
        first = COMMON if j < many and law.mean[DARKENING] == before else 0
        before = law.mean[DARKENING]
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
