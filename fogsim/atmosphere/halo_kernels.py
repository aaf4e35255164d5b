"""Halos of lamps, drawn: wide ones on a coarse image, cores and tiny lamps on the full one."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.kernels import three_times
from fogsim.jit import kernel

WIDE_SIZE = 200
"""Entries of a lamp's profile on the coarse image, over c² / (c² + WIDE_FOLD)."""

WIDE_FOLD = 0.02

CORE_SIZE = 64
"""Entries of a lamp's profile near it, evenly over the distance on the image."""

_LAST_WIDE = np.float32(WIDE_SIZE - 1.001)
_FOLD = np.float32(WIDE_FOLD)
_TWO, _ONE, _ZERO = np.float32(2.0), np.float32(1.0), np.float32(0.0)
_LEAST = np.float32(1e-20)
_NEXT = np.uint32(1)
_RED, _GREEN, _BLUE = np.float32(0.2126), np.float32(0.7152), np.float32(0.0722)  # luminance of channels (BT.709)


@kernel
def _glow(chord: float, line: NDArray[np.float64], fold: float) -> float:
    """Glow at a chord, from its values times chord."""
    place = min(chord / (chord + fold) * (line.shape[0] - 1) * ((1.98 + fold) / 1.98), line.shape[0] - 1.001)
    c = int(place)
    return float((line[c] + (line[c + 1] - line[c]) * (place - c)) / chord)


@kernel
def lamp_profiles(
    depth: NDArray[np.float64],
    strength: NDArray[np.float64],
    softness: NDArray[np.float64],
    core_softness: float,
    core_reach: NDArray[np.float64],
    log_depth: NDArray[np.float64],
    log_glow: NDArray[np.float64],
    fold: float,
    wide: NDArray[np.float32],
    core: NDArray[np.float32],
) -> None:
    """Luminance of each lamp's glow [cd/m²]: `wide` with its middle softened, `core` what is missing of it there.

    `strength` is I / R². `softness` and `core_softness` [rad] are the radii within which the glow is flat: that of the
    lamp, and that of the coarse image. `core` goes to 0 at `core_reach` [rad].
    """
    line = np.empty(log_glow.shape[1])
    for i in range(depth.shape[0]):
        # Below the table glow is proportional to optical depth, as the table's entries are.
        place = (math.log(max(depth[i], 1e-9)) - log_depth[0]) / (log_depth[1] - log_depth[0])
        place = min(max(place, 0.0), log_depth.shape[0] - 1.001)
        row = int(place)
        share = place - row
        gain = strength[i] * depth[i]
        for c in range(line.shape[0]):
            line[c] = gain * math.exp(log_glow[row, c] + (log_glow[row + 1, c] - log_glow[row, c]) * share)
        for n in range(WIDE_SIZE):
            u = min(n / (WIDE_SIZE - 1.0), 0.995)
            chord = math.sqrt(WIDE_FOLD * u / (1.0 - u) + softness[i] ** 2 + core_softness**2)
            wide[i, n] = _glow(chord, line, fold)
        for n in range(CORE_SIZE):
            x = n / (CORE_SIZE - 1.0)
            square = (core_reach[i] * x) ** 2 + softness[i] ** 2
            sharp = _glow(math.sqrt(square), line, fold)
            soft = _glow(math.sqrt(square + core_softness**2), line, fold)
            core[i, n] = (sharp - soft) * (1.0 - x**4) ** 2


@kernel
def add_wide(
    directions: NDArray[np.float32],
    towards: NDArray[np.float32],
    profiles: NDArray[np.float32],
    colours: NDArray[np.float32],
    nearness: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Sum the wide glows on a coarse image: (4, m), three channels and the mean 1 / R of what shines there [1/m].

    `directions` (3, m) and `towards` (n, 3) are unit vectors; `nearness` is 1 / R.
    """
    red, green, blue, near = out[0], out[1], out[2], out[3]
    count = red.shape[0]
    place = np.empty(count, np.float32)
    x, y, z = directions[0], directions[1], directions[2]
    red[:], green[:], blue[:], near[:] = _LEAST, _LEAST, _LEAST, _ZERO
    for i in range(towards.shape[0]):
        lx, ly, lz = towards[i, 0], towards[i, 1], towards[i, 2]
        for p in range(count):
            square = max(_TWO - _TWO * (x[p] * lx + y[p] * ly + z[p] * lz), _ZERO)
            place[p] = square / (square + _FOLD) * _LAST_WIDE
        profile, r, g, b, n = profiles[i], colours[i, 0], colours[i, 1], colours[i, 2], nearness[i]
        for p in range(count):
            entry = np.uint32(place[p])
            light = profile[entry] + (profile[entry + _NEXT] - profile[entry]) * (place[p] - np.float32(entry))
            red[p] += light * r
            green[p] += light * g
            blue[p] += light * b
            near[p] += light * n
    for p in range(count):
        near[p] /= _RED * red[p] + _GREEN * green[p] + _BLUE * blue[p]


@kernel
def _stretch(
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
def _between(low: NDArray[np.float32], high: NDArray[np.float32], share: np.float32, out: NDArray[np.float32]) -> None:
    for j in range(out.shape[0]):
        out[j] = low[j] + (high[j] - low[j]) * share


@kernel
def _add_product(light: NDArray[np.float32], seen: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    for j in range(out.shape[0]):
        out[j] += light[j] * seen[j]


@kernel
def add_stretched(
    coarse: NDArray[np.float32], coarse_columns: int, distance: NDArray[np.float32], out: NDArray[np.float32]
) -> None:
    """Add the coarse image (4, m) to an image (rows, cols · 3).

    Light is scattered into a line of sight about evenly up to its lamp, so of the glow of a lamp at R what is seen
    before a surface at d is the share min(1, d / R).
    """
    rows, columns = distance.shape
    coarse_rows, ready = coarse.shape[1] // coarse_columns, -1
    lights, nears = np.empty((2, 3 * columns), np.float32), np.empty((2, columns), np.float32)
    light, near = np.empty(3 * columns, np.float32), np.empty(columns, np.float32)
    seen = np.empty(3 * columns, np.float32)
    for v in range(rows):
        place = np.float32(v) * np.float32(coarse_rows - 1) / np.float32(max(rows - 1, 1))
        upper = min(int(place), coarse_rows - 2)
        while ready < upper + 1:
            ready += 1
            _stretch(coarse, ready * coarse_columns, coarse_columns, lights[ready % 2], nears[ready % 2])
        share, top = place - np.float32(upper), upper % 2
        _between(lights[top], lights[1 - top], share, light)
        _between(nears[top], nears[1 - top], share, near)
        for u in range(columns):
            near[u] = min(_ONE, distance[v, u] * near[u])
        three_times(near, seen)
        _add_product(light, seen, out[v])


@kernel
def add_cores(
    places: NDArray[np.float64],
    reach: NDArray[np.float64],
    ranges: NDArray[np.float64],
    profiles: NDArray[np.float32],
    colours: NDArray[np.float64],
    distance: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add to an image (rows, cols · 3) the cores of glows about places (n, 2) [px] within a reach [px]."""
    rows, columns = distance.shape
    for i in range(places.shape[0]):
        u0, v0 = places[i, 0], places[i, 1]
        scale, near, profile = (CORE_SIZE - 1.001) / reach[i], 1.0 / ranges[i], profiles[i]
        red, green, blue = colours[i, 0], colours[i, 1], colours[i, 2]
        for v in range(max(0, math.ceil(v0 - reach[i])), min(rows, math.floor(v0 + reach[i]) + 1)):
            half = math.sqrt(max(reach[i] ** 2 - (v - v0) ** 2, 0.0))
            for u in range(max(0, math.ceil(u0 - half)), min(columns, math.floor(u0 + half) + 1)):
                place = min(math.sqrt((u - u0) ** 2 + (v - v0) ** 2) * scale, CORE_SIZE - 1.001)
                n = np.uint32(place)
                light = profile[n] + (profile[n + _NEXT] - profile[n]) * (place - n)
                light *= min(1.0, distance[v, u] * near)
                out[v, 3 * u] += light * red
                out[v, 3 * u + 1] += light * green
                out[v, 3 * u + 2] += light * blue


@kernel
def _drawn_about(
    radiance: NDArray[np.float32], distance: NDArray[np.float32], u0: int, v0: int, nearest: float
) -> tuple[float, bool]:
    """Sum of the luminance of the sixteen pixels about a place, and whether any of them sees beyond a distance."""
    rows, columns = distance.shape
    drawn, free = 0.0, False
    for v in range(max(0, v0 - 1), min(rows, v0 + 3)):
        for u in range(max(0, u0 - 1), min(columns, u0 + 3)):
            drawn += _RED * radiance[v, 3 * u] + _GREEN * radiance[v, 3 * u + 1] + _BLUE * radiance[v, 3 * u + 2]
            free |= distance[v, u] > nearest
    return drawn, free


@kernel
def add_points(
    places: NDArray[np.float64],
    ranges: NDArray[np.float64],
    expected: NDArray[np.float64],
    transmission: NDArray[np.float64],
    colours: NDArray[np.float64],
    radiance: NDArray[np.float32],
    distance: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add what a renderer lost of lamps that are hardly larger than a pixel.

    `expected` is the sum over pixels of the luminance that a lamp should show without fog [cd/m²]; what of it
    `radiance` (rows, cols · 3) holds already about the lamp, shared with its neighbours, is not added again. A lamp
    behind something is left out. The light goes to the four pixels about the place.
    """
    rows, columns = distance.shape
    for i in range(places.shape[0]):
        u0, v0 = math.floor(places[i, 0]), math.floor(places[i, 1])
        drawn, free = _drawn_about(radiance, distance, u0, v0, ranges[i] - 1.0)
        if not free:
            continue
        around = 0.0
        for j in range(places.shape[0]):
            if abs(places[j, 0] - places[i, 0]) < 2.5 and abs(places[j, 1] - places[i, 1]) < 2.5:
                around += expected[j]
        missing = expected[i] * max(0.0, 1.0 - drawn / around) * transmission[i]
        right, down = places[i, 0] - u0, places[i, 1] - v0
        for corner in range(4):
            u, v = u0 + corner % 2, v0 + corner // 2
            if 0 <= u < columns and 0 <= v < rows:
                part = missing * (right if corner % 2 else 1.0 - right) * (down if corner // 2 else 1.0 - down)
                for c in range(3):
                    out[v, 3 * u + c] += part * colours[i, c]
