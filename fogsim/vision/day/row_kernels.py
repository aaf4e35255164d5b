"""Evidence of fog in rows of sky and road: a Kalman filter over each, and columns whose factors are integrated out.

Light of row i is C_i β + h_i · x_i + noise: β has the airlight, the road's reflectance and other factors with normal
priors, x_i the state of the albedo along the road, of the sky above it and of noise that rows share. The filter whitens
the light and every column by one pass, so the evidence of each prior of β costs a small Cholesky factor.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

Floats = NDArray[np.float64]

AIRLIGHT, ROAD, DARKENING, SHEEN, WET, VIGNETTING, TONE, NEAR_TONE, STRAY, SKY, SHIFT, OTHER_SKY, COLUMNS = range(13)
"""Columns: airlight, road, how the airlight darkens downward, sheen at grazing angles, mirror image of the sky on a wet
road, shade of the lens, two shapes of local tone mapping, stray light, a sky's brightness higher up,
a small shift of the horizon, a sky that is not the airlight's; and their number."""

DARKENING_ANGLE, SHEEN_ANGLE, SKY_ANGLE = 0.064, 0.06, 0.3
"""Angles over which airlight darkens downward, sheen fades and a sky's brightness changes [rad]."""

TONE_ANGLE, NEAR_TONE_ANGLE = 0.12, 0.04
"""Angles over which local tone mapping changes [rad]."""

PATCHES, GRAIN, SHARED_ROWS = 30.0, 4.0, 8.0
"""Lengths over which albedo is alike, of patches and grain [m], and noise of rows [px]."""

SKY_VARIANCE = 0.10
"""Growth of a sky's variance upward from the horizon [1/rad, of full scale squared]."""

SHARED_NOISE, HIGHEST_OBSTACLE = 0.5 / 255.0, 0.12
"""Deviation of noise that neighbouring rows share, of full scale [-], and up to where things stand before the sky
[rad]."""

NODES, WEIGHTS = np.array([-0.7745966692414834, 0.0, 0.7745966692414834]), np.array([5.0, 8.0, 5.0]) / 18.0
"""Gauss and Legendre's three places within a row, and their weights."""

MOST_CONTRAST, MOST_DOUBT = 1.2, 3.0
"""Greatest contrast across a road in clear air, relative to the airlight, and most that one row speaks against fog that
leaves less [-]."""

REFRACTION = 1.33**2
"""Squared refractive index of water [-]."""

FARTHEST = 5000.0
"""Depth that counts as the road's farthest [m]."""


class RowData(NamedTuple):
    """What was read of an image, under each response (r, n).

    Attributes
    ----------
    first, last : (n,) float64
        Rows of each bin.
    light, slope, noise, by_row : (r, n) float64
        Light of each bin, its derivative by the signal, its noise (0 where clipped), and its change by row.
    level, least_airlight : (r,) float64
        Brightest light, and light that the airlight surely exceeds.
    contrast : (2, n) float64
        Contrast across a strip of road, relative to the airlight, and the noise of that.
    cuts : (c,) int64
        Bins before which the road ends, the first being the first bin below the horizon, the last n.
    free : (c,) float64
        Evidence of the signals of the bins from each cut on by a law of no road.
    none : float
        The same of all bins, the sky's too.
    """

    first: Floats
    last: Floats
    light: Floats
    slope: Floats
    noise: Floats
    by_row: Floats
    level: Floats
    least_airlight: Floats
    contrast: Floats
    cuts: NDArray[np.int64]
    free: Floats
    none: float


@kernel
def fresnel(sine: float) -> float:
    """Share of light that water mirrors under an angle above it.

    Parameters
    ----------
    sine : float
        Of the angle.
    """
    root = math.sqrt(REFRACTION - 1.0 + sine * sine)
    across, along = (sine - root) / (sine + root), (REFRACTION * sine - root) / (REFRACTION * sine + root)
    return 0.5 * (across * across + along * along)


@kernel
def fill_columns(
    first: Floats, last: Floats, horizon: float, lens: Floats, extinction: float, hidden: float,
    columns: Floats, place: Floats,
) -> None:  # fmt: skip
    """Columns of all bins, and where each lies.

    Parameters
    ----------
    first, last : (n,) float64
        Rows of each bin.
    horizon : float
        Row of the horizon.
    lens : (3,) float64
        Focal length [px], height [m], principal row.
    extinction : float
        k [1/m].
    hidden : float
        Depth from which on something hides the road [m].
    columns : (n, COLUMNS) float64
        Is written.
    place : (n, 5) float64
        Is written: what fog leaves of the road, its depth and extent [m], rows below the horizon [px],
        angle above it [rad].
    """
    focal, height = lens[0], lens[1]
    for i in range(first.size):
        middle, size = 0.5 * (first[i] + last[i]), last[i] - first[i] + 1.0
        columns[i] = 0.0
        left = 0.0
        top, bottom = middle - 0.5 * size, middle + 0.5 * size
        sky = min(max((horizon - top) / size, 0.0), 1.0)
        if sky > 0.0:
            angle = max(0.5 * (horizon - top) if sky < 1.0 else horizon - middle, 0.0) / focal
            columns[i, AIRLIGHT] = columns[i, OTHER_SKY] = sky
            columns[i, SKY] = sky * angle / 0.1 * math.exp(-angle / SKY_ANGLE)
        upper = max(top, horizon)
        for j in range(3 if sky < 1.0 else 0):
            row = 0.5 * (upper + bottom) + 0.5 * (bottom - upper) * NODES[j]
            angle = max(row - horizon, 1e-4) / focal
            weight = WEIGHTS[j] * (1.0 - sky)
            slant = math.sqrt(1.0 + angle * angle)
            depth = min(height / angle, hidden)
            through = math.exp(-extinction * depth * slant)
            left += weight * through
            columns[i, AIRLIGHT] += weight * (1.0 - through)
            columns[i, ROAD] += weight * through
            columns[i, DARKENING] -= weight * (1.0 - through) * (1.0 - math.exp(-angle / DARKENING_ANGLE))
            columns[i, SHEEN] += weight * through * math.exp(-angle / SHEEN_ANGLE)
            columns[i, WET] += weight * through * fresnel(angle / slant)
            columns[i, STRAY] += weight
        angle = (middle - horizon) / focal
        off = (middle - lens[2]) / focal
        columns[i, VIGNETTING] = off * off
        columns[i, TONE] = math.exp(-((angle / TONE_ANGLE) ** 2))
        columns[i, NEAR_TONE] = math.exp(-((angle / NEAR_TONE_ANGLE) ** 2))
        below = max(angle, 0.25 / focal)
        place[i, 0] = left
        place[i, 1] = min(height / below, FARTHEST)
        upper, lower = max(below - 0.5 * size / focal, 0.1 / focal), below + 0.5 * size / focal
        place[i, 2] = min(height / upper, FARTHEST) - min(height / lower, FARTHEST)
        place[i, 3] = middle - horizon
        place[i, 4] = max(-angle, 0.0)


@kernel
def footprint(extent: float, length: float) -> float:
    """Deviation that is left of an exponential process averaged over an extent, relative to its own.

    Parameters
    ----------
    extent, length : float
        Both in one unit.
    """
    ratio = extent / length
    if ratio < 1e-3:
        return 1.0
    return math.sqrt(2.0 * (ratio - 1.0 + math.exp(-ratio))) / ratio


@kernel
def sky_pass(
    light: Floats, slope: Floats, noise: Floats, columns: Floats, place: Floats, size: int, hidden: Floats,
    gram: Floats,
) -> float:  # fmt: skip
    """Whiten the sky's rows, from the horizon upward, and add them to a Gram matrix.

    Parameters
    ----------
    light, slope, noise : (n,) float64
        Light of each bin, its derivative by the signal, and its noise; none where that is 0.
    columns, place
        See `fill_columns`.
    size : int
        How many bins, from the first on, are sky.
    hidden : (2,) float64
        Deviation by what stands before the sky, and up to which angle above the horizon.
    gram : (COLUMNS + 1, COLUMNS + 1) float64
        Sum of products of whitened columns, the light last; its upper half is added to.

    Returns
    -------
    float
        Half the logarithm of the determinant of the covariance, with 2π.
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
        for a in range(COLUMNS + 1):
            for b in range(a, COLUMNS + 1):
                gram[a, b] += whitened[a] * whitened[b]
        total += 0.5 * math.log(2.0 * math.pi * innovation)
    return total


@kernel
def road_pass(
    light: Floats, noise: Floats, shared: Floats, columns: Floats, place: Floats, albedo: Floats, hidden: float,
    cuts: NDArray[np.int64], grams: Floats, halves: Floats,
) -> None:  # fmt: skip
    """Whiten the road's rows, from far to near; Gram matrices of all rows up to each of several cuts.

    Parameters
    ----------
    light, noise, shared : (n,) float64
        Light of each bin, its own noise and that which rows share; none where the first noise is 0.
    columns, place
        See `fill_columns`.
    albedo : (3,) float64
        Deviations of the road's light by patches and grain, and of what hides the road.
    hidden : float
        Depth from which on something hides the road [m].
    cuts : (m,) int64
        Bins before which rows end, ascending; bins of sky have an angle below 0.
    grams : (m, COLUMNS + 1, COLUMNS + 1) float64
        Is written, upper half.
    halves : (m,) float64
        Half the logarithm of the determinant of the covariance, with 2π; is written.
    """
    gram = np.zeros((COLUMNS + 1, COLUMNS + 1))
    state, whitened = np.zeros((4, COLUMNS + 1)), np.empty(COLUMNS + 1)
    p = np.zeros((4, 4))
    rate = math.sqrt(3.0) / PATCHES
    p[0, 0], p[1, 1], p[2, 2], p[3, 3] = 1.0, rate * rate, 1.0, 1.0
    f, ph = np.zeros((4, 4)), np.empty(4)
    half, cut = 0.0, 0
    depth, angle = 0.0, 0.0
    total = light.size
    for i in range(total):
        while cut < cuts.size and cuts[cut] <= i:
            grams[cut], halves[cut] = gram, half
            cut += 1
        if noise[i] <= 0.0:
            continue
        away = place[i, 1]
        if depth > 0.0:
            step = max(depth - away, 0.0)
            e = math.exp(-rate * step)
            f[0, 0], f[0, 1] = e * (1.0 + rate * step), e * step
            f[1, 0], f[1, 1] = -e * rate * rate * step, e * (1.0 - rate * step)
            f[2, 2] = math.exp(-step / GRAIN)
            f[3, 3] = math.exp(-(place[i, 3] - angle) / SHARED_ROWS)
            f00, f01, f10, f11, f22, f33 = f[0, 0], f[0, 1], f[1, 0], f[1, 1], f[2, 2], f[3, 3]
            a, b, c = p[0, 0], p[0, 1], p[1, 1]
            s1 = rate * rate
            p[0, 0] = f00 * f00 * (a - 1.0) + 2.0 * f00 * f01 * b + f01 * f01 * (c - s1) + 1.0
            p[0, 1] = f00 * f10 * (a - 1.0) + (f00 * f11 + f01 * f10) * b + f01 * f11 * (c - s1)
            p[1, 1] = f10 * f10 * (a - 1.0) + 2.0 * f10 * f11 * b + f11 * f11 * (c - s1) + s1
            for j in (2, 3):
                u, v = p[0, j], p[1, j]
                g = f22 if j == 2 else f33
                p[0, j], p[1, j] = (f00 * u + f01 * v) * g, (f10 * u + f11 * v) * g
            p[2, 3] *= f22 * f33
            p[2, 2] = f22 * f22 * (p[2, 2] - 1.0) + 1.0
            p[3, 3] = f33 * f33 * (p[3, 3] - 1.0) + 1.0
            for j in range(COLUMNS + 1):
                u, v = state[0, j], state[1, j]
                state[0, j], state[1, j] = f00 * u + f01 * v, f10 * u + f11 * v
                state[2, j] *= f22
                state[3, j] *= f33
        depth, angle = away, place[i, 3]
        h0 = place[i, 0] * albedo[0] * footprint(place[i, 2], PATCHES)
        h2 = place[i, 0] * (albedo[2] if away > hidden else albedo[1] * footprint(place[i, 2], GRAIN))
        h3 = shared[i]
        ph[0] = p[0, 0] * h0 + p[0, 2] * h2 + p[0, 3] * h3
        ph[1] = p[0, 1] * h0 + p[1, 2] * h2 + p[1, 3] * h3
        ph[2] = p[0, 2] * h0 + p[2, 2] * h2 + p[2, 3] * h3
        ph[3] = p[0, 3] * h0 + p[2, 3] * h2 + p[3, 3] * h3
        innovation = h0 * ph[0] + h2 * ph[2] + h3 * ph[3] + noise[i] * noise[i]
        scale, gain = 1.0 / math.sqrt(innovation), 1.0 / innovation
        for j in range(COLUMNS + 1):
            value = columns[i, j] if j < COLUMNS else light[i]
            apart = value - h0 * state[0, j] - h2 * state[2, j] - h3 * state[3, j]
            whitened[j] = apart * scale
            apart *= gain
            state[0, j] += ph[0] * apart
            state[1, j] += ph[1] * apart
            state[2, j] += ph[2] * apart
            state[3, j] += ph[3] * apart
        for a in range(4):
            for b in range(a, 4):
                p[a, b] -= ph[a] * ph[b] * gain
        for a in range(COLUMNS + 1):
            if whitened[a] != 0.0:
                for b in range(a, COLUMNS + 1):
                    gram[a, b] += whitened[a] * whitened[b]
        half += 0.5 * math.log(2.0 * math.pi * innovation)
    while cut < cuts.size:
        grams[cut], halves[cut] = gram, half
        cut += 1


@kernel
def log_normal_share(value: float) -> float:
    """Logarithm of a normal law's share below a value.

    Parameters
    ----------
    value : float
        In standard deviations.
    """
    if value > -5.0:
        return math.log(0.5 * math.erfc(-value / math.sqrt(2.0)))
    return -0.5 * value * value - math.log(-value * math.sqrt(2.0 * math.pi))


@kernel
def evidence(gram: Floats, half: float, mean: Floats, deviation: Floats, least_airlight: float) -> float:
    """Logarithm of the density of the light under normal priors of the columns' factors.

    Parameters
    ----------
    gram : (COLUMNS + 1, COLUMNS + 1) float64
        Upper half, from the passes.
    half : float
        From the passes.
    mean, deviation : (COLUMNS,) float64
        Of the priors; a column of deviation 0 is left out.
    least_airlight : float
        Light that the airlight surely exceeds, as clipped pixels show.
    """
    used, size = np.empty(COLUMNS, np.int64), 0
    for j in range(COLUMNS):
        if deviation[j] > 0.0:
            used[size] = j
            size += 1
    last = COLUMNS
    square = gram[last, last]
    right = np.empty(size)
    low = np.zeros((size, size))
    for a in range(size):
        i = used[a]
        total = gram[i, last]
        for b in range(size):
            j = used[b]
            total -= (gram[i, j] if i <= j else gram[j, i]) * mean[j]
        right[a] = deviation[i] * total
        square -= mean[i] * (gram[i, last] + total)
    logs = 0.0
    for a in range(size):
        for b in range(a + 1):
            i, j = used[b], used[a]
            total = deviation[i] * deviation[j] * gram[i, j]
            if a == b:
                total += 1.0
            for c in range(b):
                total -= low[a, c] * low[b, c]
            low[a, b] = math.sqrt(total) if a == b else total / low[b, b]
        logs += math.log(low[a, a])
    solved = np.empty(size)
    for a in range(size):
        total = right[a]
        for c in range(a):
            total -= low[a, c] * solved[c]
        solved[a] = total / low[a, a]
        square -= solved[a] * solved[a]
    # The road reflects something, and less than the airlight; both are the first columns.
    result = -0.5 * square - half - logs
    z0 = deviation[AIRLIGHT] / low[0, 0]
    airlight, a_square = mean[AIRLIGHT], 0.0
    road, r_square, apart, d_square = mean[ROAD], 0.0, 0.95 * mean[AIRLIGHT] - mean[ROAD], 0.0
    z_a, z_r = np.zeros(size), np.zeros(size)
    z_a[0] = z0
    z_r[1] = deviation[ROAD] / low[1, 1]
    for a in range(1, size):
        total, other = 0.0, 0.0
        for c in range(a):
            total -= low[a, c] * z_a[c]
            other -= low[a, c] * z_r[c]
        z_a[a] = total / low[a, a]
        if a > 1:
            z_r[a] = other / low[a, a]
    for a in range(size):
        airlight += z_a[a] * solved[a]
        road += z_r[a] * solved[a]
        both = 0.95 * z_a[a] - z_r[a]
        apart += both * solved[a]
        a_square += z_a[a] * z_a[a]
        r_square += z_r[a] * z_r[a]
        d_square += both * both
    result += log_normal_share(road / math.sqrt(r_square)) + log_normal_share(apart / math.sqrt(d_square))
    if least_airlight > 0.0:
        result += log_normal_share((airlight - least_airlight) / math.sqrt(a_square + 1e-6))
    return result


@kernel
def contrast_across(contrast: Floats, place: Floats, size: int) -> float:
    """Logarithm of the chance of contrasts across the road, of which fog leaves the less, the farther away.

    Parameters
    ----------
    contrast : (2, n) float64
        Contrast of each bin, relative to the airlight, and the noise of that.
    place
        See `fill_columns`.
    size : int
        How many bins, from the first on, are sky.
    """
    total = 0.0
    for i in range(size, place.shape[0]):
        noise = contrast[1, i]
        apart = (contrast[0, i] - MOST_CONTRAST * place[i, 0]) / noise - 3.0
        if apart > 0.0:
            total -= min(0.5 * apart * apart, MOST_DOUBT)
    return total


@kernel
def evidence_grid(
    rows: RowData, lens: Floats, cells: Floats, tried: NDArray[np.int64],
    surfaces: Floats, lights: Floats, many: int, shift: float, out: Floats,
) -> None:  # fmt: skip
    """Logarithm of the evidence of cells, pairs of a response and a surface, and lights or cuts.

    Parameters
    ----------
    rows : RowData
        What was read.
    lens : (3,) float64
        See `fill_columns`.
    cells : (c, 2) float64
        Row of the horizon, and k [1/m].
    tried : (t, 2) int64
        Response and surface of each pair.
    surfaces : (s, 4) float64
        Patches, grain and obstacles, and the depth from which on those hide the road [m].
    lights : (2, l, COLUMNS) float64
        Means and deviations of the columns' factors.
    many : int
        How many of the lights count, from the first on; where all do, also roads that end at each cut but the last,
        under the first light.
    shift : float
        Standard deviation of the horizon about each of its rows [px].
    out : (c, t, m) float64
        Is written.
    """
    n, last = rows.first.size, rows.cuts.size - 1
    columns, place = np.empty((n, COLUMNS)), np.empty((n, 5))
    grams, halves = np.empty((rows.cuts.size, COLUMNS + 1, COLUMNS + 1)), np.empty(rows.cuts.size)
    sky_gram, gram = np.zeros((COLUMNS + 1, COLUMNS + 1)), np.zeros((COLUMNS + 1, COLUMNS + 1))
    mean, deviation, albedo, hide = np.empty(COLUMNS), np.empty(COLUMNS), np.empty(3), np.empty(2)
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
            for j in range(out.shape[2]):
                cut, which = (last, j) if j < many else (j - many, 0)
                for i in range(COLUMNS):
                    mean[i], deviation[i] = lights[0, which, i] * level, lights[1, which, i] * level
                mean[SHIFT], deviation[SHIFT] = 0.0, shift
                for a in range(COLUMNS + 1):
                    for b in range(a, COLUMNS + 1):
                        gram[a, b] = grams[cut, a, b] + sky_gram[a, b]
                least = rows.least_airlight[r] if deviation[OTHER_SKY] == 0.0 else 0.0
                total = jacobian[max(rows.cuts[cut], size)] + rows.free[cut] + across
                out[c, t, j] = total + evidence(gram, halves[cut] + sky_half, mean, deviation, least)
