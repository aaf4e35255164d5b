"""Posterior of the visibility: veil, lit road, daylight and pedestal fitted to cells for each draw of the nuisances."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float64]
Templates = NDArray[np.float32]
Terms = NDArray[np.int64]

_RATIOS = np.linspace(-1.8, 1.8, 7)
"""ln of the veil over the road, relative to what is drawn: pavement and droplets [-]."""

_RATIO_DEVIATION = 0.7
"""Standard deviation of that [-]."""

_SOFTNESS = 0.25
"""Mean square of the deviations below which a fit is not better [-]."""

_SOFT, _HARD = 2.5, 3.5
"""Deviations from which on a cell that is too bright or too dark counts less: others' lamps, things on the road [-]."""

_LAMPS, _PEDESTAL, _AIRLIGHT, _DAY_ROAD, _SLOPE, _OTHERS = range(6)
"""Terms: lamplight, pedestal, airlight, the road by day, how the sky brightens upward, glow of others' lamps."""

_AIRLIGHT_MEAN, _AIRLIGHT_DEVIATION = 0.7, 0.5
_DAY_ROAD_MEAN, _DAY_ROAD_DEVIATION = 0.15, 0.12
_SLOPE_DEVIATION = 0.3
"""What is known of airlight, of the road by day, and of how the sky brightens upward, over their scale [-]."""

_GLOW_CLEAR, _GLOW_REACH = 0.05, 100.0
"""Standard deviation of the glow of others' lamps where it begins, over full scale: in clear air, where lenses make it
[-], and the distance that times the extinction is what fog adds, up to 1 in all [m]."""


class Measured(NamedTuple):
    """What an image shows."""

    seen: Floats  # (cells,): Luminance of the cells, full scale being 1
    up: Floats  # (cells,): Elevation of sky cells over the highest [-], 0 on the road
    # (shapes, cells): Glow of others' lamps, by the shapes that it may have, were it of full scale where they are
    # clipped; of no shape where there are none. Draws have them in turn
    others: Floats
    # sky_scale, lamp_scale: standard size of the airlight: of full scale, and relative to the lamplight's amplitude; 0
    # where unused
    sky_scale: float
    lamp_scale: float
    even: float  # Standard deviation of light that is the same everywhere, of full scale [-]
    independent: float  # How many of the cells err independently of one another


class Fit(NamedTuple):
    """What the likeliest fit says."""

    luminance: Floats  # (cells,): Luminance of the cells, full scale being 1
    summary: Floats  # (2,): Mean squared deviation, and share of the light of all cells that is the lamps'


@kernel
def log_likelihoods(
    measured: Measured,
    extinction: Floats,
    veil: Templates,
    road: Templates,
    depth: Templates,
    variance: Floats,
    weight: Floats,
    best: Fit,
) -> Floats:
    """Logarithm of the likelihood (draws, extinctions), largest over amplitudes, summed over ratios.

    Lamps light `veil` and `road` (draws, extinctions, cells), which is `depth` (draws, cells) away [m]. `variance` and
    `weight` are those of cells, and `best` is written to.
    """
    seen, independent, others = measured.seen, measured.independent, measured.others
    draws, count, cells = veil.shape
    found, precision, total = np.empty((draws, count)), weight / variance, weight.sum()
    power = (precision * seen * seen).sum()
    is_day = measured.sky_scale > 0.0 or measured.lamp_scale > 0.0
    terms = _terms(is_day, len(others) > 0)
    even, gram, side = np.ones((4, cells)), np.zeros((_OTHERS + 2, _OTHERS + 2)), np.zeros(_OTHERS + 2)
    matrix, right, used = np.zeros((len(terms), len(terms))), np.zeros(len(terms)), np.zeros(len(terms))
    known, scratch = np.zeros((2, len(terms))), np.empty((len(terms), len(terms) + 1))
    highest = -np.inf
    for place in range(count):
        for draw in range(draws):
            if is_day or draw == 0:
                _even_light(measured.up, depth[draw], extinction[place], even)
                _sums_of_light(even, seen, precision, gram, side)
                gram[2, 2] += 1.0 / measured.even**2
            _sums_of_lamps(veil[draw, place], road[draw, place], even, seen, precision, is_day, gram, side)
            if len(others) > 0:
                glow = others[draw % len(others)]
                _sums_of_others(glow, veil[draw, place], road[draw, place], even, seen, precision, gram, side)
            if len(terms) > 2:
                _combine(gram, side, 1.0, terms, matrix, right)
                known[1, -1] = 1.0 / min(1.0, _GLOW_CLEAR + _GLOW_REACH * extinction[place]) ** 2
                _set_known(terms, _daylight_scale(matrix, right, terms, measured, used, known, scratch), known)
            likelihood = 0.0
            for ratio in _RATIOS:
                _combine(gram, side, math.exp(ratio), terms, matrix, right)
                if len(terms) > 2:
                    rest = power + _of_all_light(matrix, right, terms, known, used, scratch)
                else:
                    rest = power + _of_lamps_alone(matrix, right, used)
                square = max(rest, 0.0) / total
                value = -0.5 * (independent * math.log(_SOFTNESS + square) + (ratio / _RATIO_DEVIATION) ** 2)
                likelihood += math.exp(value)
                if value > highest:
                    highest, best.summary[0] = value, square
                    _model(
                        used, terms, math.exp(ratio), veil[draw, place], road[draw, place], even, measured, draw, best
                    )
            found[draw, place] = math.log(max(likelihood, 1e-300))
    return found


@kernel
def _terms(is_day: bool, has_others: bool) -> Terms:
    """Terms that add up to the light."""
    terms = np.arange(_OTHERS + 1)
    if is_day:
        return terms if has_others else terms[:_OTHERS].copy()
    terms[2] = _OTHERS
    return terms[:3].copy() if has_others else terms[:2].copy()


@kernel
def _even_light(up: Floats, depth: Templates, extinction: float, even: Floats) -> None:
    """What daylight adds to cells, after the even light: airlight, the road behind it, and the brighter sky above."""
    for cell in range(len(up)):
        kept = math.exp(-extinction * depth[cell])
        even[1, cell], even[2, cell], even[3, cell] = 1.0 - kept, kept, 4.0 * up[cell]


@kernel
def _model(
    used: Floats,
    terms: Terms,
    factor: float,
    veil: Templates,
    road: Templates,
    even: Floats,
    measured: Measured,
    draw: int,
    best: Fit,
) -> None:
    """Set what amplitudes make of the cells."""
    by_lamps = total = 0.0
    for cell in range(len(veil)):
        lit = used[0] * (factor * veil[cell] + road[cell])
        rest = used[1]
        for i in range(2, len(terms)):
            if terms[i] == _OTHERS:
                rest += used[i] * measured.others[draw % len(measured.others), cell]
            else:
                rest += used[i] * even[terms[i] - _PEDESTAL, cell]
        best.luminance[cell] = lit + rest
        by_lamps += lit
        total += lit + rest
    best.summary[1] = by_lamps / max(total, 1e-12)


@kernel
def _sums_of_light(even: Floats, seen: Floats, precision: Floats, gram: Floats, side: Floats) -> None:
    """Normal equations of what does not depend on the lamps."""
    for i in range(4):
        for j in range(i, 4):
            total = 0.0
            for cell in range(len(seen)):
                total += precision[cell] * even[i, cell] * even[j, cell]
            gram[2 + i, 2 + j] = total
        total = 0.0
        for cell in range(len(seen)):
            total += precision[cell] * even[i, cell] * seen[cell]
        side[2 + i] = total


@kernel
def _sums_of_lamps(
    veil: Templates,
    road: Templates,
    even: Floats,
    seen: Floats,
    precision: Floats,
    is_day: bool,
    gram: Floats,
    side: Floats,
) -> None:
    """Normal equations of veil and road."""
    vv = vr = rr = v1 = r1 = vy = ry = 0.0
    va = ra = vd = rd = vs = 0.0
    for cell in range(len(seen)):
        v, r = precision[cell] * veil[cell], precision[cell] * road[cell]
        vv += v * veil[cell]
        vr += v * road[cell]
        rr += r * road[cell]
        v1 += v
        r1 += r
        vy += v * seen[cell]
        ry += r * seen[cell]
        if is_day:
            va += v * even[1, cell]
            ra += r * even[1, cell]
            vd += v * even[2, cell]
            rd += r * even[2, cell]
            vs += v * even[3, cell]
    gram[0, 0], gram[0, 1], gram[1, 1], gram[0, 2], gram[1, 2] = vv, vr, rr, v1, r1
    gram[0, 3], gram[1, 3], gram[0, 4], gram[1, 4], gram[0, 5], gram[1, 5] = va, ra, vd, rd, vs, 0.0
    side[0], side[1] = vy, ry


@kernel
def _sums_of_others(
    glow: Floats,
    veil: Templates,
    road: Templates,
    even: Floats,
    seen: Floats,
    precision: Floats,
    gram: Floats,
    side: Floats,
) -> None:
    """Normal equations of the glow of others' lamps."""
    last = _OTHERS + 1
    gram[:, last], side[last] = 0.0, 0.0
    for cell in range(len(seen)):
        g = precision[cell] * glow[cell]
        gram[0, last] += g * veil[cell]
        gram[1, last] += g * road[cell]
        for i in range(4):
            gram[2 + i, last] += g * even[i, cell]
        gram[last, last] += g * glow[cell]
        side[last] += g * seen[cell]


@kernel
def _combine(gram: Floats, side: Floats, factor: float, terms: Terms, matrix: Floats, right: Floats) -> None:
    """Normal equations of lamplight as one, with a ratio of veil and road."""
    matrix[0, 0] = factor * factor * gram[0, 0] + 2.0 * factor * gram[0, 1] + gram[1, 1]
    right[0] = factor * side[0] + side[1]
    for i in range(1, len(terms)):
        row = 1 + terms[i]
        matrix[0, i] = matrix[i, 0] = factor * gram[0, row] + gram[1, row]
        right[i] = side[row]
        for j in range(i, len(terms)):
            matrix[i, j] = matrix[j, i] = gram[row, 1 + terms[j]]


@kernel
def _daylight_scale(
    matrix: Floats, right: Floats, terms: Terms, measured: Measured, used: Floats, known: Floats, scratch: Floats
) -> float:
    """Standard size of the airlight: of the sky that is seen, or by the light sensor and the lamplight's amplitude."""
    if measured.lamp_scale == 0.0:
        return max(measured.sky_scale, 1e-7)
    _of_lamps_alone(matrix, right, used)
    _set_known(terms, max(measured.lamp_scale * used[0], 1e-7), known)
    _of_all_light(matrix, right, terms, known, used, scratch)
    return float(max(measured.lamp_scale * used[0], 1e-7))


@kernel
def _of_lamps_alone(matrix: Floats, right: Floats, used: Floats) -> float:
    used[:] = 0.0
    det = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] ** 2
    lamp = max((right[0] * matrix[1, 1] - right[1] * matrix[0, 1]) / max(det, 1e-300), 0.0)
    dark = (right[1] - lamp * matrix[0, 1]) / matrix[1, 1]
    used[0], used[1] = lamp, dark
    form = lamp * lamp * matrix[0, 0] + 2.0 * lamp * dark * matrix[0, 1] + dark * dark * matrix[1, 1]
    return float(form - 2.0 * (lamp * right[0] + dark * right[1]))


@kernel
def _set_known(terms: Terms, scale: float, known: Floats) -> None:
    """Set means and precisions of amplitudes of daylight, before anything is seen, by its size."""
    for i in range(2, len(terms) - (terms[-1] == _OTHERS)):
        mean, deviation = 0.0, _SLOPE_DEVIATION * scale
        if terms[i] == _AIRLIGHT:
            mean, deviation = _AIRLIGHT_MEAN * scale, _AIRLIGHT_DEVIATION * scale
        elif terms[i] == _DAY_ROAD:
            mean, deviation = _DAY_ROAD_MEAN * scale, _DAY_ROAD_DEVIATION * scale
        known[0, i], known[1, i] = mean, 1.0 / deviation**2


@kernel
def _of_all_light(matrix: Floats, right: Floats, terms: Terms, known: Floats, used: Floats, scratch: Floats) -> float:
    """As `_of_lamps_alone`, with light of others and of the day, whose size is about known."""
    count = len(terms)
    free = np.ones(count, np.bool_)
    while True:
        for i in range(count):
            scratch[i, count] = right[i] + known[1, i] * known[0, i] if free[i] else 0.0
            for j in range(count):
                scratch[i, j] = matrix[i, j] if free[i] and free[j] else 0.0
            scratch[i, i] = matrix[i, i] + known[1, i] if free[i] else 1.0
        _eliminate(scratch, used)
        fixed = False
        # But for the pedestal and the slope no light is negative.
        for i in range(count):
            if terms[i] not in (_PEDESTAL, _SLOPE) and used[i] < 0.0 and not fixed:
                free[i], fixed = False, True
        if not fixed:
            return _form(matrix, right, known, used)


@kernel
def _eliminate(a: Floats, found: Floats) -> None:
    """Solve positive definite equations, whose right side is the last column, by elimination in place."""
    count = len(a)
    for i in range(count):
        scale = 1.0 / a[i, i]
        for k in range(i + 1, count):
            share = a[k, i] * scale
            for j in range(i + 1, count + 1):
                a[k, j] -= share * a[i, j]
    for i in range(count - 1, -1, -1):
        rest = a[i, count]
        for j in range(i + 1, count):
            rest -= a[i, j] * found[j]
        found[i] = rest / a[i, i]


@kernel
def _form(matrix: Floats, right: Floats, known: Floats, used: Floats) -> float:
    """Quadratic form of amplitudes, and what is known of them, less the form's constant."""
    form = 0.0
    for i in range(len(used)):
        form += known[1, i] * (used[i] - known[0, i]) ** 2 - 2.0 * used[i] * right[i]
        for j in range(len(used)):
            form += used[i] * matrix[i, j] * used[j]
    return form


@kernel
def robust_weights(seen: Floats, model: Floats, variance: Floats) -> Floats:
    """How much each cell counts where a model is given: little where others' lamps shine, or something is in front."""
    weight = np.ones(len(seen))
    for cell in range(len(seen)):
        above = (seen[cell] - model[cell]) / math.sqrt(variance[cell])
        limit = _SOFT if above > 0.0 else _HARD
        weight[cell] = min(1.0, (limit / max(abs(above), 1e-9)) ** 2)
    return weight
