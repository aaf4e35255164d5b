"""Luminance of glows over the distance from their lamps."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.halo_lamps import AHEAD, BEHIND, DEPTH, PIXELS, SHOWN, STRENGTH
from fogsim.jit import kernel

WIDE_SIZE = 200
"""Entries of a lamp's profile on the coarsest image, over c² / (c² + WIDE_FOLD)."""

WIDE_FOLD = 0.02

CORE_SIZE = 64
"""Entries of a lamp's profile near it, evenly over the chord or the distance on the image."""

HIDDEN_SHARE = 0.5
"""Share of the wide glow that is left of a lamp that something hides, which casts a shadow into the fog as well."""


@kernel
def _glow(chord: float, line: NDArray[np.float64], fold: float) -> float:
    """Glow at a chord, from its values times chord."""
    place = min(chord / (chord + fold) * (line.shape[0] - 1) * ((1.98 + fold) / 1.98), line.shape[0] - 1.001)
    c = int(place)
    return float((line[c] + (line[c + 1] - line[c]) * (place - c)) / chord)


@kernel
def profile_tables(
    lines: NDArray[np.float64],
    fold: float,
    soft: float,
    softer: float,
    reach: float,
    wide: NDArray[np.float32],
    middle: NDArray[np.float32],
) -> None:
    """Glow of unit strength at each depth of a table: `wide` with its middle softened, `middle` what is missing there.

    `lines` (depths, chords) holds glow times chord; `soft` and `softer` are the radii within which the glow is flat on
    the coarse and the coarsest image, and `middle` goes to 0 at `reach` [rad].
    """
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
    place = min(max(place, 0.0), log_depth.shape[0] - 1.001)
    return int(place), place - int(place), factor


@kernel
def lamp_profile(
    table: NDArray[np.float32],
    lamp: NDArray[np.float64],
    left: float,
    log_depth: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """Profile of a lamp's glow beyond its core [cd/m²]; of a hidden lamp a share of it is `left`."""
    row, share, factor = _row_of(lamp[DEPTH], log_depth)
    gain = np.float32(lamp[STRENGTH] * factor * (left + (1.0 - left) * lamp[SHOWN]))
    low, high, part = table[row], table[row + 1], np.float32(share)
    for n in range(out.shape[0]):
        out[n] = gain * (low[n] + (high[n] - low[n]) * part)


@kernel
def core_profiles(
    lamps: NDArray[np.float64],
    lines: NDArray[np.float64],
    log_depth: NDArray[np.float64],
    fold: float,
    soft: float,
    reach: float,
    pixel: float,
    faintest: float,
    core: NDArray[np.float32],
    bright: NDArray[np.bool_],
) -> None:
    """Luminance [cd/m²] of each glow that coarse images lack, evenly over the distance up to `reach` [px].

    `pixel` is the angle of a pixel on the axis [rad]. Cores that are nowhere brighter than `faintest` are not `bright`.
    """
    line = np.empty(lines.shape[1])
    for i in range(lamps.shape[0]):
        lamp = lamps[i]
        row, share, factor = _row_of(lamp[DEPTH], log_depth)
        gain = lamp[STRENGTH] * factor * lamp[SHOWN]
        # Off the axis a pixel sees a smaller angle.
        angle = pixel * max(lamp[AHEAD], BEHIND) ** 1.5
        flat = lamp[PIXELS] * angle**2 / math.pi + (0.5 * angle) ** 2
        chord = math.sqrt(flat)
        place = min(chord / (chord + fold) * (line.shape[0] - 1), line.shape[0] - 2.0)
        peak = gain * max(lines[row, int(place)], lines[row + 1, int(place)]) / chord
        bright[i] = peak > faintest and lamp[AHEAD] > BEHIND
        if not bright[i]:
            continue
        for c in range(line.shape[0]):
            line[c] = gain * (lines[row, c] + (lines[row + 1, c] - lines[row, c]) * share)
        for n in range(CORE_SIZE):
            x = n / (CORE_SIZE - 1.0)
            square = (reach * angle * x) ** 2
            sharp, blunt = _glow(math.sqrt(square + flat), line, fold), _glow(math.sqrt(square + soft**2), line, fold)
            core[i, n] = (sharp - blunt) * (1.0 - x**4) ** 2
