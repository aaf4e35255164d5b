"""How much light each lamp of a table sends into its glow, by the angle off it and the side of it."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.halo_lamps import DEPTH, STRENGTH
from fogsim.core.jit import kernel


class LobeTables(NamedTuple):
    """Mean intensities that kinds of lamps send into their glow."""

    # (kinds, azimuths, elevations, depths, angles · sides): intensities of
    # `fogsim.atmosphere.lamps.lobes.mean_intensity`, where they are known [cd]
    values: NDArray[np.float32]
    # azimuth_fold, elevation_fold: angles that lie half-way in a table [rad]
    azimuth_fold: float
    elevation_fold: float
    log_depth: NDArray[np.float64]  # (depths,): ln τ


class LampShapes(NamedTuple):
    """How lamps shine."""

    # (n,) int64: Number of each lamp's kind among the tables, −1 for one that shines alike in all directions
    kind: NDArray[np.int64]
    scale: NDArray[np.float64]  # (n,): Its intensity over that of its kind
    forward: NDArray[np.float64]  # (n, 3): Unit vectors along the lamps' axes


@kernel
def _place(angle: float, end: float, fold: float, count: int) -> tuple[int, float]:
    """Entry of a folded axis before an angle, and the share of the next one."""
    place = (angle / (abs(angle) + fold) * (end + fold) / end * 0.5 + 0.5) * (count - 1)
    place = min(count - 1.001, max(0.0, place))
    return int(place), place - int(place)


@kernel
def _way(start: NDArray[np.float64], end: NDArray[np.float64]) -> tuple[float, float, float]:
    """Unit vector from one place to another."""
    x, y, z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    far = max(math.sqrt(x * x + y * y + z * z), 1e-9)
    return x / far, y / far, z / far


@kernel
def _toward(x: float, y: float, z: float, forward: NDArray[np.float64]) -> tuple[float, float]:
    """Direction (x, y, z) to the right of a lamp's axis and above its plane [rad]."""
    flat = max(math.hypot(forward[0], forward[1]), 1e-9)
    left_x, left_y = -forward[1] / flat, forward[0] / flat
    ahead = x * forward[0] + y * forward[1] + z * forward[2]
    left = x * left_x + y * left_y
    up = z * flat - (x * forward[0] + y * forward[1]) * forward[2] / flat
    return math.atan2(-left, ahead), math.asin(min(1.0, max(-1.0, up)))


@kernel
def set_glow_light(
    lamps: NDArray[np.float64],
    chosen: NDArray[np.int64],
    eye: NDArray[np.float64],
    position: NDArray[np.float64],
    intensity: NDArray[np.float64],
    shapes: LampShapes,
    tables: LobeTables,
    known: NDArray[np.bool_],
    unknown: NDArray[np.bool_],
    out: NDArray[np.float32],
) -> int:
    """Light of each lamp that its glow is made of, as the illuminance that a lamp alike in all directions would give.

    Marks the directions to the eye that are not yet in the tables and returns their count; if there are any, the light
    is not valid. Takes `chosen` (n,) int64, `eye` (3,) [m], `position`, `intensity` (all,) [m], [cd], `known`,
    `unknown` (kinds, azimuths, elevations) bool, `out` (n, angles · sides) [lx].
    """
    values, log_depth, count = tables.values, tables.log_depth, 0
    entries, depths = out.shape[1], values.shape[3]
    for i in range(lamps.shape[0]):
        number, one = chosen[i], out[i]
        kind = shapes.kind[number]
        if kind < 0 or intensity[number] <= 0.0:
            one[:] = np.float32(lamps[i, STRENGTH])
            continue
        x, y, z = _way(position[number], eye)
        right, up = _toward(x, y, z, shapes.forward[number])
        column, aside = _place(right, math.pi, tables.azimuth_fold, values.shape[1])
        row, above = _place(up, 0.5 * math.pi, tables.elevation_fold, values.shape[2])
        for a in range(column, column + 2):
            for b in range(row, row + 2):
                if not known[kind, a, b] and not unknown[kind, a, b]:
                    unknown[kind, a, b] = True
                    count += 1
        log_tau, deep = math.log(max(lamps[i, DEPTH], 1e-9)), 0
        while deep < depths - 2 and log_tau > log_depth[deep + 1]:
            deep += 1
        place = min(max((log_tau - log_depth[deep]) / (log_depth[deep + 1] - log_depth[deep]), 0.0), 1.0)
        gain = lamps[i, STRENGTH] * shapes.scale[number] / intensity[number]
        one[:] = np.float32(0.0)
        for corner in range(8):
            a, b, c = corner & 1, (corner >> 1) & 1, corner >> 2
            share = (aside if a else 1.0 - aside) * (above if b else 1.0 - above) * (place if c else 1.0 - place)
            weight, source = np.float32(share * gain), values[kind, column + a, row + b, deep + c]
            for n in range(entries):
                one[n] += weight * source[n]
    return count


class Angles(NamedTuple):
    """Positions of a profile's entries among the angles at which the light of glows is tabulated."""

    entry: NDArray[np.int64]  # (entries,) int64: The angle before each
    share: NDArray[np.float32]  # (entries,): Share of the next one


@kernel
def side_profiles(
    unit: NDArray[np.float32], light: NDArray[np.float32], angles: Angles, out: NDArray[np.float32]
) -> None:
    """Profiles of a glow on each side of its lamp.

    Takes `unit` (entries,) [cd/m²], `light` (angles · sides,) [lx], `out` (entries, sides + 1) [cd/m²].
    """
    sides = out.shape[1] - 1
    for n in range(unit.shape[0]):
        first, line, share, gain = angles.entry[n] * sides, out[n], angles.share[n], unit[n]
        low, high = light[first : first + sides], light[first + sides : first + 2 * sides]
        for side in range(sides):
            line[side] = gain * (low[side] + (high[side] - low[side]) * share)
        line[sides] = line[0]


@kernel
def mean_light(light: NDArray[np.float32], sides: int, angles: Angles, out: NDArray[np.float32]) -> None:
    """Light of glows at the entries of a profile, the mean of all sides.

    Takes `light` (n, angles · sides) [lx], `out` (n, entries) [lx].
    """
    count = light.shape[1] // sides
    mean = np.empty(count, np.float32)
    for i in range(light.shape[0]):
        for angle in range(count):
            mean[angle] = np.mean(light[i, angle * sides : (angle + 1) * sides])
        for n in range(out.shape[1]):
            low = mean[angles.entry[n]]
            out[i, n] = low + (mean[angles.entry[n] + 1] - low) * angles.share[n]
