"""Lamps of others before a camera: where, how bright, behind what, which look like one; and how each one glows."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

PLACE_U, PLACE_V, AHEAD, RANGE, DEPTH, STRENGTH, SHOWN, _AREA, PIXELS = range(9)
COLOUR, TOWARDS = 9, 12
NEARNESS = 15
COLUMNS = 16
"""Columns of a table of lamps.

Place on the image [px], cosine of the angle off the camera's axis, range [m], optical depth, illuminance at the eye
were the air clear [lx], the share of the lamp that nothing hides, luminous area as a solid angle [sr] and in pixels,
colour (3), direction in the camera's axes (3), and what it adds to the mean 1 / R by which surfaces cut glows [1/m].
"""

BEHIND = 0.2
"""Cosine of the angle off the camera's axis at which lamps begin to fade as they pass the camera."""

WIDE_SIZE = 200
"""Entries of a lamp's profile on the coarsest image, over c² / (c² + WIDE_FOLD)."""

WIDE_FOLD = 0.02

CORE_SIZE = 64
"""Entries of a lamp's profile near it, evenly over the chord or the distance on the image."""

SIDES = 8
"""Sides of a lamp, 45° apart, from its right over above, on which its glow may differ."""

HIDDEN_SHARE = 0.5
"""Share of the wide glow that is left of a lamp that something hides, which casts a shadow into the fog as well."""

_EXTENDED = 0.004  # solid angle above which a source is no lamp but a lit piece of road [sr]
_EXTENDED_NEARNESS = 0.25  # so that such, which are near, do not uncover the glow of far lamps
_NEAREST = 0.5  # lamps nearer than this are not drawn [m]
_BEFORE = 1.0  # a surface so far before a lamp may be the lamp's own vehicle [m]
_SAME_RANGE = 0.15  # share by which ranges of lamps may differ that are drawn as one


class LampLight(NamedTuple):
    """Light of lamps."""

    intensity: NDArray[np.float64]  # (n,): Luminous intensity toward the camera [cd]
    colour: NDArray[np.float64]  # (n, 3): Linear colours of luminance 1
    area: NDArray[np.float64]  # (n,): Luminous area as the camera sees it [m²]


class GlowLines(NamedTuple):
    """Glow of a lamp of unit strength, over optical depth and chord."""

    values: NDArray[np.float64]  # (depths, chords): Glow times chord, over chords that lie evenly over c / (c + fold)
    log_depth: NDArray[np.float64]  # (depths,): ln τ of the rows, evenly spaced
    fold: float  # Chord that is placed half-way


@kernel
def project_lamps(
    position: NDArray[np.float64],
    intensity: NDArray[np.float64],
    eye: NDArray[np.float64],
    axes: NDArray[np.float64],
    lens: NDArray[np.float64],
    lamps: NDArray[np.float64],
    chosen: NDArray[np.int64],
) -> int:
    """Set place, range and direction of lamps before a camera; their count.

    Takes `position` (n, 3) [m], `intensity` (n,) [cd], `eye` (3,) [m], `axes` (3, 3), `lens` (3,) [px], `chosen` (n,)
    int64.
    """
    count = 0
    for i in range(position.shape[0]):
        x, y, z = position[i, 0] - eye[0], position[i, 1] - eye[1], position[i, 2] - eye[2]
        distance = math.sqrt(x * x + y * y + z * z)
        forward = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        if intensity[i] <= 0.0 or distance <= _NEAREST or forward <= 0.0:
            continue
        right = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
        down = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
        lamp = lamps[count]
        lamp[PLACE_U] = lens[1] + lens[0] * right / max(forward, 1e-9)
        lamp[PLACE_V] = lens[2] + lens[0] * down / max(forward, 1e-9)
        lamp[RANGE], lamp[AHEAD] = distance, forward / distance
        lamp[TOWARDS], lamp[TOWARDS + 1], lamp[TOWARDS + 2] = right / distance, down / distance, forward / distance
        chosen[count] = i
        count += 1
    return count


@kernel
def _smooth(x: float) -> float:
    x = min(max(x, 0.0), 1.0)
    return (3.0 - 2.0 * x) * x * x


@kernel
def _shown(distance: NDArray[np.float32], u: float, v: float, nearest: float) -> float:
    """Share of the sixteen pixels about a place that see beyond a distance; outside the image nothing hides a lamp."""
    rows, columns = distance.shape
    if not (-1.0 < u < columns and -1.0 < v < rows):
        return 1.0
    u0, v0 = math.floor(u), math.floor(v)
    seen, free = 0, 0
    for row in range(max(0, v0 - 1), min(rows, v0 + 3)):
        for column in range(max(0, u0 - 1), min(columns, u0 + 3)):
            seen += 1
            if distance[row, column] > nearest:
                free += 1
    # A lamp's own surface may be a pixel in size, with other things next to it.
    return min(1.0, 4.0 * free / max(seen, 1))


@kernel
def select_lamps(
    light: LampLight,
    chosen: NDArray[np.int64],
    depth: NDArray[np.float64],
    farthest: float,
    focal: float,
    distance: NDArray[np.float32],
    lamps: NDArray[np.float64],
) -> int:
    """Set the other columns of projected lamps, and keep those that are not lost in fog; their count.

    Takes `chosen` (n,) int64, `depth` (n,), `focal` [px], `distance` (rows, cols) [m].
    """
    intensity, colour, area = light.intensity, light.colour, light.area
    count = 0
    for i in range(depth.shape[0]):
        if depth[i] >= farthest:
            continue
        lamp, number = lamps[count], chosen[i]
        lamp[:] = lamps[i]
        chosen[count] = number
        square = lamp[RANGE] ** 2
        fade = _smooth(4.0 * (1.0 - depth[i] / farthest)) * _smooth(lamp[AHEAD] / BEHIND)
        lamp[DEPTH], lamp[STRENGTH] = depth[i], intensity[number] / square * fade
        lamp[SHOWN] = _shown(distance, lamp[PLACE_U], lamp[PLACE_V], lamp[RANGE] - _BEFORE)
        # A pixel sees the solid angle cos³ / f² of its direction off the axis.
        lamp[_AREA] = area[number] / square
        lamp[PIXELS] = lamp[_AREA] * focal**2 / max(lamp[AHEAD], BEHIND) ** 3
        lamp[NEARNESS] = 1.0 / lamp[RANGE]
        if lamp[_AREA] > _EXTENDED:
            lamp[NEARNESS] *= _EXTENDED_NEARNESS
        for c in range(3):
            lamp[COLOUR + c] = colour[number, c]
        count += 1
    return count


@kernel
def merge_lamps(
    lamps: NDArray[np.float64],
    light: NDArray[np.float32],
    apart: float,
    fused: NDArray[np.float64],
    fused_light: NDArray[np.float32],
) -> int:
    """Draw together lamps that are close to each other on the image, at like ranges; their count.

    What is left for them is the sum of their light, at its middle.

    Takes `light`, `fused_light` (n, entries) [lx], `apart` [px].
    """
    count = 0
    for i in range(lamps.shape[0]):
        u, v, far, found = lamps[i, PLACE_U], lamps[i, PLACE_V], lamps[i, RANGE], -1
        for j in range(count):
            near = abs(fused[j, PLACE_U] - u) < apart and abs(fused[j, PLACE_V] - v) < apart
            if near and abs(fused[j, RANGE] - far) < _SAME_RANGE * far:
                found = j
                break
        if found < 0:
            fused[count], fused_light[count] = lamps[i], light[i]
            count += 1
            continue
        fused_light[found] += light[i]
        strength = fused[found, STRENGTH] + lamps[i, STRENGTH]
        share = lamps[i, STRENGTH] / strength if strength > 0.0 else 0.0
        for column in range(COLUMNS):
            fused[found, column] += (lamps[i, column] - fused[found, column]) * share
        fused[found, STRENGTH] = strength
    return count


@kernel
def _glow(chord: float, line: NDArray[np.float64], fold: float) -> float:
    """Glow at a chord, from its values times chord."""
    place = min(line.shape[0] - 1.001, chord / (chord + fold) * (line.shape[0] - 1) * ((1.98 + fold) / 1.98))
    c = int(place)
    return float((line[c] + (line[c + 1] - line[c]) * (place - c)) / chord)


@kernel
def profile_tables(
    glow: GlowLines,
    soft: float,
    softer: float,
    reach: float,
    wide: NDArray[np.float32],
    middle: NDArray[np.float32],
) -> None:
    """Glow of unit strength at each depth of a table: `wide` with its middle softened, `middle` what is missing there.

    Takes `soft`, `softer` [rad], `reach` [rad].
    """
    lines, fold = glow.values, glow.fold
    for i in range(lines.shape[0]):
        for n in range(WIDE_SIZE):
            u = min(n / (WIDE_SIZE - 1.0), 0.995)
            wide[i, n] = _glow(math.sqrt(WIDE_FOLD * u / (1.0 - u) + softer**2), lines[i], fold)
        for n in range(CORE_SIZE):
            x = n / (CORE_SIZE - 1.0)
            square = (reach * x) ** 2
            sharp, blunt = math.sqrt(square + soft**2), math.sqrt(square + softer**2)
            middle[i, n] = (_glow(sharp, lines[i], fold) - _glow(blunt, lines[i], fold)) * (1.0 - x**4) ** 2


@kernel
def _row_of(depth: float, log_depth: NDArray[np.float64]) -> tuple[int, float, float]:
    """Row of a table before an optical depth, the share of the next one, and a factor for depths below the table."""
    step = log_depth[1] - log_depth[0]
    place = (math.log(max(depth, 1e-9)) - log_depth[0]) / step
    # Below the table glow is proportional to optical depth.
    factor = math.exp(min(place, 0.0) * step)
    place = min(log_depth.shape[0] - 1.001, max(0.0, place))
    return int(place), place - int(place), factor


@kernel
def lamp_profile(
    table: NDArray[np.float32],
    lamp: NDArray[np.float64],
    left: float,
    log_depth: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """Profile of a lamp's glow beyond its core, were its light 1 lx [cd/m²].

    Takes `table` (depths, entries), `log_depth` (depths,), `out` (entries,).
    """
    row, share, factor = _row_of(lamp[DEPTH], log_depth)
    gain = np.float32(factor * (left + (1.0 - left) * lamp[SHOWN]))
    low, high, part = table[row], table[row + 1], np.float32(share)
    for n in range(out.shape[0]):
        out[n] = gain * (low[n] + (high[n] - low[n]) * part)


@kernel
def core_profiles(
    lamps: NDArray[np.float64],
    light: NDArray[np.float32],
    glow: GlowLines,
    soft: float,
    reach: float,
    pixel: float,
    faintest: float,
    core: NDArray[np.float32],
    bright: NDArray[np.bool_],
) -> None:
    """Luminance of each glow that coarse images lack, evenly over the distance on the image.

    Takes `light` [lx], `soft` [rad], `reach` [px], `pixel` [rad], `faintest` [cd/m²], `core` [cd/m²], `bright` (n,)
    bool.
    """
    lines, log_depth, fold = glow.values, glow.log_depth, glow.fold
    line = np.empty(lines.shape[1])
    for i in range(lamps.shape[0]):
        lamp = lamps[i]
        row, share, factor = _row_of(lamp[DEPTH], log_depth)
        gain = factor * lamp[SHOWN]
        # Off the axis a pixel sees a smaller angle.
        angle = pixel * max(lamp[AHEAD], BEHIND) ** 1.5
        flat = lamp[PIXELS] * angle**2 / math.pi + (0.5 * angle) ** 2
        chord = math.sqrt(flat)
        place = min(line.shape[0] - 2.0, chord / (chord + fold) * (line.shape[0] - 1))
        peak = light[i, 0] * gain * max(lines[row, int(place)], lines[row + 1, int(place)]) / chord
        bright[i] = peak > faintest and lamp[AHEAD] > BEHIND
        if not bright[i]:
            continue
        for c in range(line.shape[0]):
            line[c] = gain * (lines[row, c] + (lines[row + 1, c] - lines[row, c]) * share)
        for n in range(CORE_SIZE):
            x = n / (CORE_SIZE - 1.0)
            square = (reach * angle * x) ** 2
            sharp, blunt = _glow(math.sqrt(square + flat), line, fold), _glow(math.sqrt(square + soft**2), line, fold)
            core[i, n] = light[i, n] * (sharp - blunt) * (1.0 - x**4) ** 2
