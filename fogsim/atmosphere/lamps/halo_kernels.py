"""Halos of lamps, drawn: wide ones on coarse images, cores and tiny lamps on the full one."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.halo_lamps import (
    AHEAD,
    BEHIND,
    COLOUR,
    CORE_SIZE,
    DEPTH,
    HIDDEN_SHARE,
    NEARNESS,
    PIXELS,
    PLACE_U,
    PLACE_V,
    RANGE,
    SHOWN,
    SIDES,
    STRENGTH,
    TOWARDS,
    WIDE_FOLD,
    WIDE_SIZE,
    lamp_profile,
)
from fogsim.atmosphere.lamps.lobe_kernels import Angles, side_profiles
from fogsim.atmosphere.lamps.pieces import read_between
from fogsim.core.jit import kernel
from fogsim.units import LUMINANCE_WEIGHTS

_LAST_WIDE = np.float32(WIDE_SIZE - 1.001)
_FOLD = np.float32(WIDE_FOLD)
_TWO, _ONE, _ZERO = np.float32(2.0), np.float32(1.0), np.float32(0.0)
_LEAST = np.float32(1e-20)
_FOUR, _LAST_SIDE = np.float32(4.0), np.float32(SIDES - 0.001)
_NEXT = np.uint32(1)
_FIRST, _SECOND, _THREE = np.uint64(1), np.uint64(2), np.uint64(3)
_RED, _GREEN, _BLUE = (np.float32(share) for share in LUMINANCE_WEIGHTS)


@kernel
def add_wide_glows(
    directions: NDArray[np.float32],
    up: NDArray[np.float64],
    lamps: NDArray[np.float64],
    light: NDArray[np.float32],
    table: NDArray[np.float32],
    log_depth: NDArray[np.float64],
    angles: Angles,
    faintest: float,
    out: NDArray[np.float32],
) -> None:
    """Sum wide glows on the coarsest image.

    Takes `directions` (3, m), `up` (3,), `light` [lx], `log_depth` (depths,), `faintest` [cd/m²], `out` (4, m) [cd/m²].
    """
    red, green, blue, near = out[0], out[1], out[2], out[3]
    count = red.shape[0]
    onward, around = np.empty(count, np.float32), np.empty(count, np.float32)
    cell, glow, number = np.empty(count, np.int32), np.empty(count, np.float32), np.uint64(count)
    profile, profiles = np.empty(WIDE_SIZE, np.float32), np.empty((WIDE_SIZE, SIDES + 1), np.float32)
    for i in range(lamps.shape[0]):
        lamp = lamps[i]
        lamp_profile(table, lamp, HIDDEN_SHARE, log_depth, profile)
        if profile[0] * light[i].max() < faintest:
            continue
        side_profiles(profile, light[i], angles, profiles)
        _place_about(directions, up, lamp, cell, onward, around)
        read_between(number, profiles.reshape(-1), SIDES + 1, cell, onward, around, glow)
        r, g, b = np.float32(lamp[COLOUR]), np.float32(lamp[COLOUR + 1]), np.float32(lamp[COLOUR + 2])
        n = (_RED * r + _GREEN * g + _BLUE * b) * np.float32(lamp[NEARNESS])
        for p in range(number):
            red[p] += glow[p] * r
            green[p] += glow[p] * g
            blue[p] += glow[p] * b
            near[p] += glow[p] * n


@kernel
def _place_about(
    directions: NDArray[np.float32],
    up: NDArray[np.float64],
    lamp: NDArray[np.float64],
    cell: NDArray[np.int32],
    onward: NDArray[np.float32],
    around: NDArray[np.float32],
) -> None:
    """Entry of directions in a lamp's profile, by the side of it on which they pass as the lamp sees them.

    `onward` and `around` are how far on a direction is to the next entry and to the next side.
    """
    x, y, z = directions[0], directions[1], directions[2]
    ax, ay, az = lamp[TOWARDS], lamp[TOWARDS + 1], lamp[TOWARDS + 2]
    bx, by, bz = up[1] * az - up[2] * ay, up[2] * ax - up[0] * az, up[0] * ay - up[1] * ax
    level = max(math.sqrt(bx * bx + by * by + bz * bz), 1e-6)
    bx, by, bz = bx / level, by / level, bz / level
    lx, ly, lz = np.float32(ax), np.float32(ay), np.float32(az)
    rx, ry, rz = np.float32(bx), np.float32(by), np.float32(bz)
    ux, uy, uz = np.float32(ay * bz - az * by), np.float32(az * bx - ax * bz), np.float32(ax * by - ay * bx)
    quarter, size = np.float32(SIDES / 4), np.int32(SIDES + 1)
    for p in range(np.uint64(cell.shape[0])):
        square = max(_ZERO, _TWO - _TWO * (x[p] * lx + y[p] * ly + z[p] * lz))
        place = square / (square + _FOLD) * _LAST_WIDE
        right, above = x[p] * rx + y[p] * ry + z[p] * rz, x[p] * ux + y[p] * uy + z[p] * uz
        # An angle about the lamp without trigonometry: the share of a quarter turn by |above| / (|right| + |above|).
        bend = abs(above) / (abs(right) + abs(above) + _LEAST)
        half = bend if right >= _ZERO else _TWO - bend
        turn = min(_LAST_SIDE, (half if above >= _ZERO else _FOUR - half) * quarter)
        entry, side = np.int32(place), np.int32(turn)
        cell[p] = entry * size + side
        onward[p], around[p] = place - np.float32(entry), turn - np.float32(side)


@kernel
def upsample_grid(coarsest: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """The coarsest image stretched to the coarse one, linearly between its corners.

    Takes `coarsest`, `out` (4, rows, cols).
    """
    rows, columns = out.shape[1], out.shape[2]
    for v in range(rows):
        place = v * (coarsest.shape[1] - 1) / (rows - 1)
        upper = min(int(place), coarsest.shape[1] - 2)
        down = np.float32(place - upper)
        for u in range(columns):
            along = u * (coarsest.shape[2] - 1) / (columns - 1)
            left = min(int(along), coarsest.shape[2] - 2)
            aside = np.float32(along - left)
            for c in range(4):
                low = coarsest[c, upper, left] + (coarsest[c, upper, left + 1] - coarsest[c, upper, left]) * aside
                high = coarsest[c, upper + 1, left]
                high += (coarsest[c, upper + 1, left + 1] - coarsest[c, upper + 1, left]) * aside
                out[c, v, u] = low + (high - low) * down


@kernel
def add_middle_glows(
    directions: NDArray[np.float32],
    cell: NDArray[np.float64],
    reach: float,
    lamps: NDArray[np.float64],
    light: NDArray[np.float32],
    table: NDArray[np.float32],
    log_depth: NDArray[np.float64],
    faintest: float,
    out: NDArray[np.float32],
) -> None:
    """Add to the coarse image what the coarsest lacks near the lamps.

    Takes `cell` (3,) [px], `reach` [rad], `light` [lx], `out` (4, rows, cols).
    """
    rows, columns = out.shape[1], out.shape[2]
    profile, scale = np.empty(CORE_SIZE, np.float32), np.float32((CORE_SIZE - 1.0) / reach)
    # At the end of a profile there is nothing left.
    last = np.float32(CORE_SIZE - 1.00001)
    entries, shares = np.empty(columns, np.int32), np.empty(columns, np.float32)
    red, green, blue, near = out[0].reshape(-1), out[1].reshape(-1), out[2].reshape(-1), out[3].reshape(-1)
    for i in range(lamps.shape[0]):
        lamp = lamps[i]
        lamp_profile(table, lamp, 0.0, log_depth, profile)
        profile *= light[i]
        if lamp[AHEAD] <= BEHIND or profile[0] < faintest:
            continue
        lx, ly, lz = np.float32(lamp[TOWARDS]), np.float32(lamp[TOWARDS + 1]), np.float32(lamp[TOWARDS + 2])
        r, g, b = np.float32(lamp[COLOUR]), np.float32(lamp[COLOUR + 1]), np.float32(lamp[COLOUR + 2])
        n = (_RED * r + _GREEN * g + _BLUE * b) * np.float32(lamp[NEARNESS])
        u0, v0, half = lamp[PLACE_U] / cell[0], lamp[PLACE_V] / cell[1], cell[2] / lamp[AHEAD] ** 2 + 1.0
        begin, end = max(0, math.ceil(u0 - half)), min(columns, math.floor(u0 + half) + 1)
        size = np.uint64(max(end - begin, 0))
        for v in range(max(0, math.ceil(v0 - half)), min(rows, math.floor(v0 + half) + 1)):
            first = np.uint64(v * columns + begin)
            for m in range(size):
                p = first + m
                cosine = directions[0, p] * lx + directions[1, p] * ly + directions[2, p] * lz
                place = min(np.sqrt(max(_TWO - _TWO * cosine, _ZERO)) * scale, last)
                entry = np.int32(place)
                entries[m], shares[m] = entry, place - np.float32(entry)
            for m in range(size):
                p, entry_before = first + m, np.uint32(entries[m])
                low = profile[entry_before]
                glow = low + (profile[entry_before + _NEXT] - low) * shares[m]
                red[p] += glow * r
                green[p] += glow * g
                blue[p] += glow * b
                near[p] += glow * n


@kernel
def divide_by_luminance(coarse: NDArray[np.float32]) -> None:
    """Make of luminance over range in the last channel of a coarse image the mean 1 / R [1/m] (`coarse` (4, m))."""
    for p in range(coarse.shape[1]):
        coarse[3, p] /= max(_RED * coarse[0, p] + _GREEN * coarse[1, p] + _BLUE * coarse[2, p], _LEAST)


@kernel
def _upsample_row(
    coarse: NDArray[np.float32],
    first: int,
    coarse_columns: int,
    light: NDArray[np.float32],
    near: NDArray[np.float32],
) -> None:
    """One row of the coarse image, which begins at `first`, stretched to the width of the image."""
    columns = near.shape[0]
    for u in range(columns):
        place = np.float32(u) * np.float32(coarse_columns - 1) / np.float32(max(columns - 1, 1))
        cell = min(int(place), coarse_columns - 2)
        a, aside = first + cell, place - np.float32(cell)
        for c in range(3):
            light[3 * u + c] = coarse[c, a] + (coarse[c, a + 1] - coarse[c, a]) * aside
        near[u] = coarse[3, a] + (coarse[3, a + 1] - coarse[3, a]) * aside


@kernel
def _add_between(
    lights: tuple[NDArray[np.float32], NDArray[np.float32]],
    nears: tuple[NDArray[np.float32], NDArray[np.float32]],
    share: np.float32,
    distance: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add to a row what is seen of the light between two stretched rows."""
    (above, below), (far, near) = lights, nears
    for u in range(np.uint64(distance.shape[0])):
        seen, at = min(_ONE, distance[u] * (far[u] + (near[u] - far[u]) * share)), _THREE * u
        out[at] += (above[at] + (below[at] - above[at]) * share) * seen
        out[at + _FIRST] += (above[at + _FIRST] + (below[at + _FIRST] - above[at + _FIRST]) * share) * seen
        out[at + _SECOND] += (above[at + _SECOND] + (below[at + _SECOND] - above[at + _SECOND]) * share) * seen


@kernel
def add_upsampled(
    coarse: NDArray[np.float32],
    coarse_columns: int,
    distance: NDArray[np.float32],
    top: int,
    bottom: int,
    out: NDArray[np.float32],
) -> None:
    """Add the coarse image to rows of an image.

    Light is scattered into a line of sight about evenly up to its lamp, so of the glow of a lamp at R what is seen
    before a surface at d is the share min(1, d / R).

    Takes `coarse` (4, m) [cd/m²], [1/m], `distance` (rows, cols) [m], `out` (rows, cols · 3) [cd/m²].
    """
    rows, columns = distance.shape
    coarse_rows = coarse.shape[1] // coarse_columns
    # Each coarse row is stretched once, those above the band are not.
    ready = min(int(np.float32(top) * np.float32(coarse_rows - 1) / np.float32(max(rows - 1, 1))), coarse_rows - 2) - 1
    lights, nears = np.empty((2, 3 * columns), np.float32), np.empty((2, columns), np.float32)
    for v in range(top, bottom):
        place = np.float32(v) * np.float32(coarse_rows - 1) / np.float32(max(rows - 1, 1))
        upper = min(int(place), coarse_rows - 2)
        while ready < upper + 1:
            ready += 1
            _upsample_row(coarse, ready * coarse_columns, coarse_columns, lights[ready % 2], nears[ready % 2])
        share, first = place - np.float32(upper), upper % 2
        last = 1 - first
        _add_between((lights[first], lights[last]), (nears[first], nears[last]), share, distance[v], out[v])


@kernel
def add_glow_cores(
    lamps: NDArray[np.float64],
    bright: NDArray[np.bool_],
    reach: float,
    profiles: NDArray[np.float32],
    distance: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add to an image the cores of glows.

    Takes `bright`, `profiles` (n,) bool, `reach` [px], `distance` (rows, cols) [m], `out` (rows, cols · 3) [cd/m²].
    """
    rows, columns = distance.shape
    scale, last = np.float32((CORE_SIZE - 1.001) / reach), np.float32(CORE_SIZE - 1.001)
    entries, shares = np.empty(columns, np.int32), np.empty(columns, np.float32)
    for i in range(lamps.shape[0]):
        if not bright[i]:
            continue
        u0, v0, near, profile = lamps[i, PLACE_U], lamps[i, PLACE_V], np.float32(lamps[i, NEARNESS]), profiles[i]
        red, green = np.float32(lamps[i, COLOUR]), np.float32(lamps[i, COLOUR + 1])
        blue = np.float32(lamps[i, COLOUR + 2])
        for v in range(max(0, math.ceil(v0 - reach)), min(rows, math.floor(v0 + reach) + 1)):
            half = math.sqrt(max(reach**2 - (v - v0) ** 2, 0.0))
            first, after = max(0, math.ceil(u0 - half)), min(columns, math.floor(u0 + half) + 1)
            if after <= first:
                continue
            begin, size = np.uint64(first), np.uint64(after - first)
            height, start = np.float32((v - v0) ** 2), np.float32(first - u0)
            for n in range(size):
                across = start + np.float32(np.int32(n))
                place = min(last, np.sqrt(height + across * across) * scale)
                entry = np.int32(place)
                entries[n], shares[n] = entry, place - np.float32(entry)
            for n in range(size):
                before = np.uint32(entries[n])
                low = profile[before]
                shares[n] = low + (profile[before + _NEXT] - low) * shares[n]
            line, seen = out[v], distance[v]
            for n in range(size):
                u = begin + n
                light, at = shares[n] * min(_ONE, seen[u] * near), _THREE * u
                line[at] += light * red
                line[at + _FIRST] += light * green
                line[at + _SECOND] += light * blue


_SAME_PLACE = 1.0
"""Difference of distances up to which a pixel shows a lamp of the same vehicle [m]."""


@kernel
def _luminance_at(luminance: NDArray[np.float32], v: int, u: int) -> float:
    """Luminance of a pixel (`luminance` (rows, cols · 3)) [cd/m²]."""
    return float(_RED * luminance[v, 3 * u] + _GREEN * luminance[v, 3 * u + 1] + _BLUE * luminance[v, 3 * u + 2])


@kernel
def _drawn_about(
    luminance: NDArray[np.float32], distance: NDArray[np.float32], u0: int, v0: int, far: float, bright: float
) -> tuple[float, float]:
    """Luminance of the sixteen pixels about a place: sum beyond that of the darkest, and sum of those of lamps there.

    Takes `far` [m], `bright` [cd/m²].
    """
    drawn, shining, least, count = 0.0, 0.0, math.inf, 0
    for v in range(max(0, v0 - 1), min(distance.shape[0], v0 + 3)):
        for u in range(max(0, u0 - 1), min(distance.shape[1], u0 + 3)):
            here = _luminance_at(luminance, v, u)
            drawn, least, count = drawn + here, min(least, here), count + 1
            if here > bright and abs(distance[v, u] - far) < _SAME_PLACE:
                shining += here
    return max(drawn - count * least, 0.0), shining


@kernel
def _dim_about(
    luminance: NDArray[np.float32],
    distance: NDArray[np.float32],
    u0: int,
    v0: int,
    far: float,
    bright: float,
    share: float,
    out: NDArray[np.float32],
) -> None:
    """Take a share of what was drawn from those of the sixteen pixels about a place that show lamps.

    Takes `far` [m], `bright` [cd/m²].
    """
    for v in range(max(0, v0 - 1), min(distance.shape[0], v0 + 3)):
        for u in range(max(0, u0 - 1), min(distance.shape[1], u0 + 3)):
            if _luminance_at(luminance, v, u) > bright and abs(distance[v, u] - far) < _SAME_PLACE:
                for j in range(3 * u, 3 * u + 3):
                    out[v, j] = max(out[v, j] - np.float32(share) * luminance[v, j], _ZERO)


@kernel
def _expected_about(lamps: NDArray[np.float64], number: int, focal: float, largest: float) -> tuple[float, bool]:
    """Sum over pixels of the luminance of a lamp and those next to it [cd/m²], and whether no large one may be there.

    Takes `focal` [px], `largest` [px²].
    """
    total, are_small = 0.0, True
    for j in range(lamps.shape[0]):
        other = lamps[j]
        apart = max(abs(other[PLACE_U] - lamps[number, PLACE_U]), abs(other[PLACE_V] - lamps[number, PLACE_V]))
        if apart < 2.5:
            total += other[STRENGTH] * focal**2 / max(other[AHEAD], BEHIND) ** 3
        are_small &= other[PIXELS] < largest or apart > 2.5 + 2.0 * math.sqrt(other[PIXELS])
    return total, are_small


@kernel
def add_direct_light(
    lamps: NDArray[np.float64],
    focal: float,
    largest: float,
    faintest: float,
    bright: float,
    luminance: NDArray[np.float32],
    distance: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add what a renderer lost of small lamps, and take away what it drew too much of them.

    What of the luminance that a lamp should show without fog was drawn already about the lamp, shared with its
    neighbours, is not added again; a lamp smaller than the pixel that shows it was drawn too bright. Pixels brighter
    than `bright` show lamps. Of a lamp behind something the part that is hidden is left out. The light goes to the four
    pixels about the place.

    Takes `focal` [px], `largest` [px²], `faintest`, `bright` [cd/m²], `luminance`, `out` (rows, cols · 3) [cd/m²],
    `distance` (rows, cols) [m].
    """
    rows, columns = distance.shape
    for i in range(lamps.shape[0]):
        lamp = lamps[i]
        inside = -1 < lamp[PLACE_U] < columns and -1 < lamp[PLACE_V] < rows and lamp[AHEAD] > BEHIND
        if not inside or lamp[PIXELS] >= largest or lamp[SHOWN] == 0.0:
            continue
        # Sum over pixels of the luminance [cd/m²].
        expected = lamp[STRENGTH] * focal**2 / lamp[AHEAD] ** 3
        kept = math.exp(-lamp[DEPTH])
        transmittance = kept * lamp[SHOWN]
        if expected * transmittance < faintest:
            continue
        u0, v0 = math.floor(lamp[PLACE_U]), math.floor(lamp[PLACE_V])
        drawn, shining = _drawn_about(luminance, distance, u0, v0, lamp[RANGE], bright)
        around, are_small = _expected_about(lamps, i, focal, largest)
        if are_small and shining > around:
            share = kept * expected * (1.0 / around - 1.0 / shining)
            _dim_about(luminance, distance, u0, v0, lamp[RANGE], bright, share, out)
            continue
        missing = expected * max(0.0, 1.0 - drawn / around) * transmittance
        right, below = lamp[PLACE_U] - u0, lamp[PLACE_V] - v0
        for corner in range(4):
            u, v = u0 + corner % 2, v0 + corner // 2
            if 0 <= u < columns and 0 <= v < rows:
                part = missing * (right if corner % 2 else 1.0 - right) * (below if corner // 2 else 1.0 - below)
                for c in range(3):
                    out[v, 3 * u + c] += part * lamp[COLOUR + c]


@kernel
def mean_luminance(image: NDArray[np.float32], step: int) -> float:
    """Mean of an image's green channel, near enough to that of its luminance [cd/m²].

    Takes `image` (rows, cols · 3) [cd/m²].
    """
    total, count = 0.0, 0
    for v in range(step // 2, image.shape[0], step):
        for u in range(step // 2, image.shape[1] // 3, step):
            total += image[v, 3 * u + 1]
            count += 1
    return total / max(count, 1)
