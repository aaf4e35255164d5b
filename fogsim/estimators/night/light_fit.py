"""Posterior of the visibility: veil, lit road, daylight and pedestal fitted to cells for each draw of the nuisances."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

Floats = NDArray[np.float64]
Templates = NDArray[np.float32]

RATIOS = np.linspace(-1.8, 1.8, 7)
"""ln of the veil over the road, relative to what is drawn: pavement and droplets [-]."""

RATIO_DEVIATION = 0.7
"""Standard deviation of that [-]."""

SOFTNESS = 0.25
"""Mean square of the deviations below which a fit is not better [-]."""

SOFT, HARD = 2.5, 3.5
"""Deviations from which on a cell that is too bright or too dark counts less: others' lamps, things on the road [-]."""

TERMS = 5
"""Lamplight, pedestal, airlight, the road by day, and how the sky brightens upward."""


class Measured(NamedTuple):
    """What an image shows.

    Attributes
    ----------
    seen : (cells,) float64
        Luminance of the cells, full scale being 1.
    variance : (cells,) float64
        Of what the model says of each.
    depth : (cells,) float64
        Distance to the road, inf in the sky [m].
    up : (cells,) float64
        Elevation of sky cells over the highest [-], 0 on the road.
    sky_scale, lamp_scale : float
        Standard size of the airlight: of full scale, and relative to the lamplight's amplitude; 0 where unused.
    even : float
        Standard deviation of light that is the same everywhere, of full scale [-].
    independent : float
        How many of the cells err independently of one another.
    """

    seen: Floats
    variance: Floats
    depth: Floats
    up: Floats
    sky_scale: float
    lamp_scale: float
    even: float
    independent: float


@kernel
def log_likelihoods(
    measured: Measured, extinction: Floats, veil: Templates, road: Templates, weight: Floats, best: Floats
) -> Floats:
    """Logarithm of the likelihood (draws, extinctions), largest over amplitudes, summed over ratios.

    Parameters
    ----------
    measured : Measured
        The image.
    extinction : (n,) float64
        Extinction coefficients [1/m].
    veil, road : (draws, n, cells) float32
        What lamps light.
    weight : (cells,) float64
        How much each cell counts.
    best : (cells + 2,) float64
        Written to: luminance of the cells by the likeliest fit, its mean squared deviation, and which share of the
        light of all cells is the lamps'.
    """
    seen, independent = measured.seen, measured.independent
    draws, count, cells = veil.shape
    found, precision, total = np.empty((draws, count)), weight / measured.variance, weight.sum()
    power = (precision * seen * seen).sum()
    even, gram, side = np.empty((3, cells)), np.zeros((TERMS + 1, TERMS + 1)), np.zeros(TERMS + 1)
    matrix, right, used = np.zeros((TERMS, TERMS)), np.zeros(TERMS), np.zeros(TERMS)
    scratch = np.empty((TERMS, TERMS + 1))
    is_day = measured.sky_scale > 0.0 or measured.lamp_scale > 0.0
    terms, scale, highest = TERMS if is_day else 2, 0.0, -np.inf
    for place in range(count):
        _even_light(measured, extinction[place], even)
        _sums_of_light(even, seen, precision, gram, side)
        gram[2, 2] += 1.0 / measured.even**2
        for draw in range(draws):
            _sums_of_lamps(veil[draw, place], road[draw, place], even, seen, precision, terms, gram, side)
            if is_day:
                _combine(gram, side, 1.0, terms, matrix, right)
                scale = max(_daylight_scale(matrix, right, measured, used, scratch), 1e-7)
            likelihood = 0.0
            for ratio in RATIOS:
                _combine(gram, side, math.exp(ratio), terms, matrix, right)
                if is_day:
                    rest = power + _of_lamps_and_day(matrix, right, scale, used, scratch)
                else:
                    rest = power + _of_lamps_alone(matrix, right, used)
                square = max(rest, 0.0) / total
                value = -0.5 * (independent * math.log(SOFTNESS + square) + (ratio / RATIO_DEVIATION) ** 2)
                likelihood += math.exp(value)
                if value > highest:
                    highest, best[cells] = value, square
                    _model(used, math.exp(ratio), veil[draw, place], road[draw, place], even, best)
            found[draw, place] = math.log(max(likelihood, 1e-300))
    return found


@kernel
def _even_light(measured: Measured, extinction: float, even: Floats) -> None:
    """What daylight adds to cells: airlight, the road behind it, and how the sky brightens upward."""
    for cell in range(len(measured.seen)):
        kept = math.exp(-extinction * measured.depth[cell])
        even[0, cell], even[1, cell], even[2, cell] = 1.0 - kept, kept, 4.0 * measured.up[cell]


@kernel
def _model(
    used: Floats, factor: float, veil: NDArray[np.float32], road: NDArray[np.float32], even: Floats, best: Floats
) -> None:
    """Luminance of the cells by amplitudes, and the lamps' share of it, written to `best`."""
    by_lamps = total = 0.0
    for cell in range(len(veil)):
        lit = used[0] * (factor * veil[cell] + road[cell])
        by_day = used[2] * even[0, cell] + used[3] * even[1, cell] + used[4] * even[2, cell]
        best[cell] = lit + used[1] + by_day
        by_lamps += lit
        total += best[cell]
    best[len(veil) + 1] = by_lamps / max(total, 1e-12)


@kernel
def _sums_of_light(even: Floats, seen: Floats, precision: Floats, gram: Floats, side: Floats) -> None:
    """Normal equations of what does not depend on the lamps."""
    for i in range(4):
        for j in range(i, 4):
            total = 0.0
            for cell in range(len(seen)):
                a = 1.0 if i == 0 else even[i - 1, cell]
                b = 1.0 if j == 0 else even[j - 1, cell]
                total += precision[cell] * a * b
            gram[2 + i, 2 + j] = total
        total = 0.0
        for cell in range(len(seen)):
            total += precision[cell] * (1.0 if i == 0 else even[i - 1, cell]) * seen[cell]
        side[2 + i] = total


@kernel
def _sums_of_lamps(
    veil: NDArray[np.float32],
    road: NDArray[np.float32],
    even: Floats,
    seen: Floats,
    precision: Floats,
    terms: int,
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
        if terms > 2:
            va += v * even[0, cell]
            ra += r * even[0, cell]
            vd += v * even[1, cell]
            rd += r * even[1, cell]
            vs += v * even[2, cell]
    gram[0, 0], gram[0, 1], gram[1, 1], gram[0, 2], gram[1, 2] = vv, vr, rr, v1, r1
    gram[0, 3], gram[1, 3], gram[0, 4], gram[1, 4], gram[0, 5], gram[1, 5] = va, ra, vd, rd, vs, 0.0
    side[0], side[1] = vy, ry


@kernel
def _combine(gram: Floats, side: Floats, factor: float, terms: int, matrix: Floats, right: Floats) -> None:
    """Normal equations of lamplight as one, with a ratio of veil and road."""
    matrix[0, 0] = factor * factor * gram[0, 0] + 2.0 * factor * gram[0, 1] + gram[1, 1]
    right[0] = factor * side[0] + side[1]
    for i in range(1, terms):
        matrix[0, i] = matrix[i, 0] = factor * gram[0, 1 + i] + gram[1, 1 + i]
        right[i] = side[1 + i]
        for j in range(i, terms):
            matrix[i, j] = matrix[j, i] = gram[1 + i, 1 + j]


@kernel
def _daylight_scale(matrix: Floats, right: Floats, measured: Measured, used: Floats, scratch: Floats) -> float:
    """Standard size of the airlight: of the sky that is seen, or by the light sensor and the lamplight's amplitude."""
    if measured.lamp_scale == 0.0:
        return measured.sky_scale
    _of_lamps_alone(matrix, right, used)
    _of_lamps_and_day(matrix, right, max(measured.lamp_scale * used[0], 1e-7), used, scratch)
    return float(measured.lamp_scale * used[0])


@kernel
def _of_lamps_alone(matrix: Floats, right: Floats, used: Floats) -> float:
    used[:] = 0.0
    det = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] ** 2
    lamp = max((right[0] * matrix[1, 1] - right[1] * matrix[0, 1]) / max(det, 1e-300), 0.0)
    dark = (right[1] - lamp * matrix[0, 1]) / matrix[1, 1]
    used[0], used[1] = lamp, dark
    form = lamp * lamp * matrix[0, 0] + 2.0 * lamp * dark * matrix[0, 1] + dark * dark * matrix[1, 1]
    return float(form - 2.0 * (lamp * right[0] + dark * right[1]))


AIRLIGHT, AIRLIGHT_DEVIATION = 0.7, 0.5
DAY_ROAD, DAY_ROAD_DEVIATION = 0.15, 0.12
SLOPE_DEVIATION = 0.3
"""What is known of airlight, of the road by day, and of how the sky brightens upward, over their scale [-]."""


@kernel
def _of_lamps_and_day(matrix: Floats, right: Floats, scale: float, used: Floats, scratch: Floats) -> float:
    """As `_of_lamps_alone`, with daylight whose size is about known."""
    free = np.ones(TERMS, np.bool_)
    mean = (0.0, 0.0, AIRLIGHT * scale, DAY_ROAD * scale, 0.0)
    weight = (
        0.0,
        0.0,
        1.0 / (AIRLIGHT_DEVIATION * scale) ** 2,
        1.0 / (DAY_ROAD_DEVIATION * scale) ** 2,
        1.0 / (SLOPE_DEVIATION * scale) ** 2,
    )
    while True:
        for i in range(TERMS):
            scratch[i, TERMS] = right[i] + weight[i] * mean[i] if free[i] else 0.0
            for j in range(TERMS):
                scratch[i, j] = matrix[i, j] if free[i] and free[j] else 0.0
            scratch[i, i] = matrix[i, i] + weight[i]
        _eliminate(scratch, used)
        fixed = False
        # Lamplight, airlight and the road by day are not negative.
        for i in (0, 2, 3):
            if used[i] < 0.0 and not fixed:
                free[i], fixed = False, True
        if not fixed:
            return _form(matrix, right, mean, weight, used)


@kernel
def _eliminate(a: Floats, found: Floats) -> None:
    """Solve positive definite equations, whose right side is the last column, by elimination in place."""
    for i in range(TERMS):
        scale = 1.0 / a[i, i]
        for k in range(i + 1, TERMS):
            share = a[k, i] * scale
            for j in range(i + 1, TERMS + 1):
                a[k, j] -= share * a[i, j]
    for i in range(TERMS - 1, -1, -1):
        rest = a[i, TERMS]
        for j in range(i + 1, TERMS):
            rest -= a[i, j] * found[j]
        found[i] = rest / a[i, i]


@kernel
def _form(matrix: Floats, right: Floats, mean: tuple[float, ...], weight: tuple[float, ...], used: Floats) -> float:
    """Quadratic form of amplitudes, and what is known of them, less the form's constant."""
    form = 0.0
    for i in range(TERMS):
        form += weight[i] * (used[i] - mean[i]) ** 2 - 2.0 * used[i] * right[i]
        for j in range(TERMS):
            form += used[i] * matrix[i, j] * used[j]
    return form


@kernel
def robust_weights(seen: Floats, model: Floats, variance: Floats) -> Floats:
    """How much each cell counts where a model is given: little where others' lamps shine, or something is in front."""
    weight = np.ones(len(seen))
    for cell in range(len(seen)):
        above = (seen[cell] - model[cell]) / math.sqrt(variance[cell])
        limit = SOFT if above > 0.0 else HARD
        weight[cell] = min(1.0, (limit / max(abs(above), 1e-9)) ** 2)
    return weight
