"""Posterior of the visibility: veil, lit road, daylight and pedestal fitted to cells for each draw of the nuisances."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float64]
Templates = NDArray[np.float32]

_RATIOS = np.linspace(-1.8, 1.8, 7)
"""ln of the veil over the road, relative to what is drawn: pavement and droplets [-]."""

_RATIO_DEVIATION = 0.7
"""Standard deviation of that [-]."""

_SOFTNESS = 0.25
"""Mean square of the deviations below which a fit is not better [-]."""

_SOFT, _HARD = 2.5, 3.5
"""Deviations from which on a cell that is too bright or too dark counts less: others' lamps, things on the road [-]."""

_LAMPS, _PEDESTAL, _AIRLIGHT, _DAY_ROAD, _SLOPE, _OTHERS, _TERMS = range(7)
"""Terms that add up to the light: lamplight, pedestal, airlight, the road by day, how the sky brightens upward, glow of
others' lamps; and how many they are. Sets of terms are bits."""

_ROUNDING = 1e-12
"""Share of a sum of squares below which what is left of it is rounding [-]."""

_SLOPE_AT_TOP = 4.0
"""How much brighter the highest cell of the sky is for each unit of the slope [-]."""

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


class _Weighed(NamedTuple):
    """What sums need that no draw changes. Cells of the sky come first, and see no road."""

    sky: int  # How many cells are sky
    one: Floats  # (cells,): Precision, which is weight over variance
    seen: Floats  # (cells,): Luminance times precision
    rise: Floats  # (cells,): How the sky brightens upward times precision
    # one_sum, seen_sum, rise_sum, rise_square, rise_seen: sums of these, and of the products of rise, over all cells
    one_sum: float
    seen_sum: float
    rise_sum: float
    rise_square: float
    rise_seen: float
    glow: Floats  # (shapes, cells): Glow of others' lamps times precision
    glow_sums: Floats  # (shapes, 4): Sums of that alone, and times itself, luminance and rise


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
    sets: int,
) -> Floats:
    """Logarithm of the likelihood (sets, draws, extinctions), largest over amplitudes, summed over ratios.

    Lamps light `veil` and `road` (draws, extinctions, cells), which is `depth` (draws, cells) away [m]. `variance` and
    `weight` are those of cells, and `best` is written to. In one set draws have the shapes of others' glow in turn; in
    as many as there are shapes, each has its own.
    """
    draws, count, cells = veil.shape
    independent, shapes, total = measured.independent, len(measured.others), weight.sum()
    is_day = measured.sky_scale > 0.0 or measured.lamp_scale > 0.0
    terms = (1 << _LAMPS | 1 << _PEDESTAL) + is_day * (1 << _AIRLIGHT | 1 << _DAY_ROAD | 1 << _SLOPE)
    terms += (shapes > 0) << _OTHERS
    weighed, factors = _weighed(measured, weight / variance), np.exp(_RATIOS)
    power = (weighed.seen * measured.seen).sum()
    kept, gram = np.zeros(cells), np.zeros((_TERMS + 1, _TERMS + 2))
    known, used = np.zeros((2, _TERMS)), np.zeros(_TERMS)
    # By which terms but the lamplight are free
    solved = np.zeros((1 << (_TERMS - 1), _TERMS, _TERMS + 3))
    found, highest = np.empty((sets, draws, count)), -np.inf
    for place in range(count):
        for draw in range(draws):
            if is_day or draw == 0:
                _sums_of_light(weighed, depth[draw], extinction[place], measured.even, kept, gram)
            _sums_of_lamps(weighed, veil[draw, place], road[draw, place], kept, gram)
            for number in range(sets):
                shape = number if sets > 1 else draw % max(shapes, 1)
                if shapes > 0:
                    _sums_of_others(weighed, shape, veil[draw, place], road[draw, place], kept, gram)
                    known[1, _OTHERS] = 1.0 / min(1.0, _GLOW_CLEAR + _GLOW_REACH * extinction[place]) ** 2
                if is_day:
                    _set_daylight(measured, gram, known, solved, terms, used)
                solved[:, 0, 0] = np.nan
                likelihood = 0.0
                for i, ratio in enumerate(_RATIOS):
                    square = max(power + _set_amplitudes(gram, known, solved, terms, factors[i], used), 0.0) / total
                    value = -0.5 * (independent * math.log(_SOFTNESS + square) + (ratio / _RATIO_DEVIATION) ** 2)
                    likelihood += math.exp(value)
                    if value > highest:
                        highest, best.summary[0] = value, square
                        _model(used, factors[i], veil[draw, place], road[draw, place], kept, measured, shape, best)
                found[number, draw, place] = math.log(max(likelihood, 1e-300))
    return found


@kernel
def _weighed(measured: Measured, precision: Floats) -> _Weighed:
    sky, up = 0, _SLOPE_AT_TOP * measured.up
    while sky < len(up) and up[sky] > 0.0:
        sky += 1
    seen, rise, glow = precision * measured.seen, precision * up, measured.others * precision
    sums = np.empty((len(glow), 4))
    for shape in range(len(glow)):
        sums[shape, 0], sums[shape, 1] = glow[shape].sum(), (glow[shape] * measured.others[shape]).sum()
        sums[shape, 2], sums[shape, 3] = (glow[shape] * measured.seen).sum(), (glow[shape] * up).sum()
    light = precision.sum(), seen.sum(), rise.sum(), (rise * up).sum(), (rise * measured.seen).sum()
    return _Weighed(sky, precision, seen, rise, *light, glow, sums)


@kernel
def _model(
    used: Floats,
    factor: float,
    veil: Templates,
    road: Templates,
    kept: Floats,
    measured: Measured,
    shape: int,
    best: Fit,
) -> None:
    """Set what amplitudes make of the cells."""
    by_lamps = total = 0.0
    for cell in range(len(veil)):
        lit = used[_LAMPS] * (factor * veil[cell] + road[cell])
        rest = used[_PEDESTAL] + used[_AIRLIGHT] * (1.0 - kept[cell]) + used[_DAY_ROAD] * kept[cell]
        rest += used[_SLOPE] * _SLOPE_AT_TOP * measured.up[cell]
        if len(measured.others) > 0:
            rest += used[_OTHERS] * measured.others[shape, cell]
        best.luminance[cell] = lit + rest
        by_lamps += lit
        total += lit + rest
    best.summary[1] = by_lamps / max(total, 1e-12)


@kernel
def _sums_of_light(of: _Weighed, depth: Templates, extinction: float, even: float, kept: Floats, gram: Floats) -> None:
    """Normal equations of what does not depend on the lamps; sets the share of the road's light that is `kept`.

    In `gram` veil and road come before the other terms, and the right side last.
    """
    k = kk = ky = 0.0
    for cell in range(of.sky, len(kept)):
        kept[cell] = math.exp(-extinction * depth[cell])
        share = of.one[cell] * kept[cell]
        k += share
        kk += share * kept[cell]
        ky += of.seen[cell] * kept[cell]
    gram[2, 2], gram[2, 3], gram[2, 4], gram[2, 5] = of.one_sum + 1.0 / even**2, of.one_sum - k, k, of.rise_sum
    gram[3, 3], gram[3, 4], gram[3, 5] = of.one_sum - 2.0 * k + kk, k - kk, of.rise_sum
    gram[4, 4], gram[4, 5], gram[5, 5] = kk, 0.0, of.rise_square
    gram[2, -1], gram[3, -1], gram[4, -1], gram[5, -1] = of.seen_sum, of.seen_sum - ky, ky, of.rise_seen


@kernel
def _sums_of_lamps(of: _Weighed, veil: Templates, road: Templates, kept: Floats, gram: Floats) -> None:
    """Normal equations of veil and road."""
    vv = vr = rr = v1 = r1 = vy = ry = vk = rk = vs = 0.0
    for cell in range(of.sky):
        v = of.one[cell] * veil[cell]
        v1 += v
        vv += v * veil[cell]
        vy += of.seen[cell] * veil[cell]
        vs += of.rise[cell] * veil[cell]
    for cell in range(of.sky, len(veil)):
        v, r = of.one[cell] * veil[cell], of.one[cell] * road[cell]
        v1 += v
        r1 += r
        vv += v * veil[cell]
        vr += v * road[cell]
        rr += r * road[cell]
        vy += of.seen[cell] * veil[cell]
        ry += of.seen[cell] * road[cell]
        vk += v * kept[cell]
        rk += r * kept[cell]
    gram[0, 0], gram[0, 1], gram[1, 1], gram[0, -1], gram[1, -1] = vv, vr, rr, vy, ry
    gram[0, 2], gram[0, 3], gram[0, 4], gram[0, 5] = v1, v1 - vk, vk, vs
    gram[1, 2], gram[1, 3], gram[1, 4], gram[1, 5] = r1, r1 - rk, rk, 0.0


@kernel
def _sums_of_others(of: _Weighed, shape: int, veil: Templates, road: Templates, kept: Floats, gram: Floats) -> None:
    """Normal equations of the glow of others' lamps."""
    v = r = k = 0.0
    for cell in range(len(veil)):
        glow = of.glow[shape, cell]
        v += glow * veil[cell]
        r += glow * road[cell]
        k += glow * kept[cell]
    sums = of.glow_sums[shape]
    one, square, seen, rise = sums[0], sums[1], sums[2], sums[3]
    gram[0, 6], gram[1, 6], gram[2, 6], gram[3, 6], gram[4, 6] = v, r, one, one - k, k
    gram[5, 6], gram[6, 6], gram[6, -1] = rise, square, seen


@kernel
def _set_daylight(measured: Measured, gram: Floats, known: Floats, solved: Floats, terms: int, used: Floats) -> None:
    """Set what is known of daylight by its size: that of the sky, or by a sensor and the lamplight's amplitude."""
    if measured.lamp_scale == 0.0:
        _set_known(max(measured.sky_scale, 1e-7), known)
        return
    for some in (1 << _LAMPS | 1 << _PEDESTAL, terms):
        solved[:, 0, 0] = np.nan
        _set_amplitudes(gram, known, solved, some, 1.0, used)
        _set_known(max(measured.lamp_scale * used[_LAMPS], 1e-7), known)


@kernel
def _set_known(scale: float, known: Floats) -> None:
    """Set means and precisions of amplitudes of daylight, before anything is seen, by its size."""
    known[0, _AIRLIGHT], known[0, _DAY_ROAD] = _AIRLIGHT_MEAN * scale, _DAY_ROAD_MEAN * scale
    known[1, _AIRLIGHT] = 1.0 / (_AIRLIGHT_DEVIATION * scale) ** 2
    known[1, _DAY_ROAD] = 1.0 / (_DAY_ROAD_DEVIATION * scale) ** 2
    known[1, _SLOPE] = 1.0 / (_SLOPE_DEVIATION * scale) ** 2


@kernel
def _set_amplitudes(gram: Floats, known: Floats, solved: Floats, terms: int, factor: float, used: Floats) -> float:
    """Set amplitudes for a ratio of veil and road; their quadratic form, and what is known, less the form's constant.

    But for the pedestal and the slope no light is negative.
    """
    while True:
        one = terms >> 1
        if math.isnan(solved[one, 0, 0]):
            _solve_but_for_lamps(gram, known, terms, solved[one])
        whole = own = factor * factor * gram[0, 0] + 2.0 * factor * gram[0, 1] + gram[1, 1]
        lamps = factor * gram[0, -1] + gram[1, -1]
        for i in range(1, _TERMS):
            shared = factor * gram[0, 1 + i] + gram[1, 1 + i]
            own -= shared * (factor * solved[one, i, -2] + solved[one, i, -1])
            lamps -= shared * solved[one, i, -3]
        # Lamplight that looks like the other terms shows nothing but rounding.
        used[_LAMPS] = lamps / own if terms & 1 and own > _ROUNDING * whole else 0.0
        negative = 0 if used[_LAMPS] < 0.0 else _TERMS
        for i in range(1, _TERMS):
            used[i] = solved[one, i, -3] - used[0] * (factor * solved[one, i, -2] + solved[one, i, -1])
            if used[i] < 0.0 and i not in (_PEDESTAL, _SLOPE):
                negative = min(negative, i)
        if negative == _TERMS:
            return float(solved[one, 0, 0] - used[_LAMPS] * lamps)
        terms &= ~(1 << negative)


@kernel
def _solve_but_for_lamps(gram: Floats, known: Floats, terms: int, a: Floats) -> None:
    """Amplitudes of some terms without lamplight, and by how much a unit of veil and of road lowers them.

    They become the last three columns of the equations, whose first row is the solution's form alone.
    """
    form = 0.0
    for i in range(1, _TERMS):
        right = gram[1 + i, -1] + known[1, i] * known[0, i]
        form += known[1, i] * known[0, i] ** 2
        if not (terms >> i) & 1:
            a[i, -3:] = 0.0
            continue
        for j in range(i, _TERMS):
            a[i, j] = gram[1 + i, 1 + j] if (terms >> j) & 1 else 0.0
        a[i, i] += known[1, i]
        a[i, -3], a[i, -2], a[i, -1] = right, gram[0, 1 + i], gram[1, 1 + i]
    _eliminate(a, terms)
    for i in range(1, _TERMS):
        form -= (gram[1 + i, -1] + known[1, i] * known[0, i]) * a[i, -3]
    a[0, 0] = form


@kernel
def _eliminate(a: Floats, terms: int) -> None:
    """Solve positive definite equations of some terms in place, whose right sides are columns."""
    for i in range(1, _TERMS):
        if (terms >> i) & 1:
            scale = 1.0 / a[i, i]
            for k in range(i + 1, _TERMS):
                if (terms >> k) & 1:
                    share = a[i, k] * scale
                    for j in range(k, a.shape[1]):
                        a[k, j] -= share * a[i, j]
    for i in range(_TERMS - 1, 0, -1):
        if (terms >> i) & 1:
            for side in range(_TERMS, a.shape[1]):
                for j in range(i + 1, _TERMS):
                    a[i, side] -= a[i, j] * a[j, side]
                a[i, side] /= a[i, i]


@kernel
def robust_weights(seen: Floats, model: Floats, variance: Floats) -> Floats:
    """How much each cell counts where a model is given: little where others' lamps shine, or something is in front."""
    weight = np.ones(len(seen))
    for cell in range(len(seen)):
        above = (seen[cell] - model[cell]) / math.sqrt(variance[cell])
        limit = _SOFT if above > 0.0 else _HARD
        weight[cell] = min(1.0, (limit / max(abs(above), 1e-9)) ** 2)
    return weight
