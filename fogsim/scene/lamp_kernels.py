"""Lamps of vehicles that shine toward an eye, one after another."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

FORWARD, LEFT, UP, INTENSITY, AREA, FULL_INTENSITY, AXIS = range(3, 10)
FOUND = 13
"""Columns of what is found of a lamp, and their count.

First its place [m]; then the way from it to the eye in the vehicle's axes [m], its intensity toward the eye [cd], its
luminous area as the eye sees it [m²], its intensity along its axis [cd], and its axis (3).
"""


class LampTable(NamedTuple):
    """Lamps of all bodies in their unit boxes."""

    place: NDArray[np.float64]  # (n, 3): Middles
    area: NDArray[np.float64]  # (n,): Luminous areas over width times height of the body
    mask: NDArray[np.int64]  # (n,) int64: Bits of `Lamp` that light each
    intensity: NDArray[np.float64]  # (n,): Along its axis [cd]
    # (n,) int64: By how many bits the lit ones are shifted to tell where a lamp is dark; see
    # `fogsim.values.light.DARK_SHIFT`
    dark_shift: NDArray[np.int64]
    forwards: NDArray[np.float64]  # (n,): 1 for a lamp that shines ahead, −1 for one that shines back
    of_body: NDArray[np.int64]  # (bodies, most) int64: Lamps of each body, then −1
    signals: int  # Bits of lamps whose intensity is that of the table; that of others is left at 0
    lobe: NDArray[np.int64]  # (n,) int64: Number of the way each shines
    # azimuths, elevations (e,): ascending angles next to and above a lamp's axis from 0 on [rad]
    azimuths: NDArray[np.float64]
    elevations: NDArray[np.float64]
    # (lobes, e, a): ln of the share of its axial intensity that a lamp shines there, alike on both sides
    log_share: NDArray[np.float64]
    fall_off: float  # How fast that falls beyond the axes' ends [1/rad]


class LampCarriers(NamedTuple):
    """Vehicles with lamps."""

    position: NDArray[np.float64]  # (v, 3): Middles of the front bumpers [m]
    turned: NDArray[np.float64]  # (4, v): Cosine and sine of their headings, and of their grades
    size: NDArray[np.float64]  # (3, v): Length, width and height [m]
    # lit, body (v,) int64: bits of lit lamps, and number of the body
    lit: NDArray[np.int64]
    body: NDArray[np.int64]


@kernel
def _before(axis: NDArray[np.float64], value: float) -> tuple[int, float]:
    """Entry of an axis before a value, and the share of the next one; values beyond its ends are as those."""
    entry = 0
    while entry < axis.shape[0] - 2 and value > axis[entry + 1]:
        entry += 1
    return entry, min(max((value - axis[entry]) / (axis[entry + 1] - axis[entry]), 0.0), 1.0)


@kernel
def _share_toward(lamps: LampTable, lamp: int, forward: float, left: float, up: float) -> float:
    """Share of its axial intensity that a lamp shines in a direction in the vehicle's axes."""
    ahead = forward * lamps.forwards[lamp]
    azimuth, elevation = math.atan2(abs(left), ahead), math.atan2(abs(up), math.hypot(ahead, left))
    column, aside = _before(lamps.azimuths, azimuth)
    row, above = _before(lamps.elevations, elevation)
    table = lamps.log_share[lamps.lobe[lamp]]
    low = table[row, column] + (table[row, column + 1] - table[row, column]) * aside
    high = table[row + 1, column] + (table[row + 1, column + 1] - table[row + 1, column]) * aside
    beyond_sides = max(azimuth - lamps.azimuths[lamps.azimuths.shape[0] - 1], 0.0)
    beyond_ends = max(elevation - lamps.elevations[lamps.elevations.shape[0] - 1], 0.0)
    return math.exp(low + (high - low) * above - lamps.fall_off * math.hypot(beyond_sides, beyond_ends))


@kernel
def find_lamps(
    vehicles: LampCarriers,
    lamps: LampTable,
    eye: NDArray[np.float64],
    farthest: float,
    found: NDArray[np.float64],
    which: NDArray[np.int64],
) -> int:
    """Find the lit lamps on the side of their vehicle that the eye is on; their count.

    Takes `eye` (3,) [m], `farthest` [m], `which` (2, n) int64.
    """
    position, turned, size = vehicles.position, vehicles.turned, vehicles.size
    count = 0
    for row in range(len(vehicles.body)):
        dx, dy, dz = eye[0] - position[row, 0], eye[1] - position[row, 1], eye[2] - position[row, 2]
        if abs(dx) + abs(dy) > farthest:
            continue
        cosine, sine, level, rise = turned[0, row], turned[1, row], turned[2, row], turned[3, row]
        length, width, height = size[0, row], size[1, row], size[2, row]
        onward, aside = dx * cosine + dy * sine, dy * cosine - dx * sine
        ahead, above = onward * level + dz * rise, dz * level - onward * rise
        for column in range(lamps.of_body.shape[1]):
            lamp = lamps.of_body[vehicles.body[row], column]
            bits = vehicles.lit[row] & lamps.mask[lamp] & ~(vehicles.lit[row] >> lamps.dark_shift[lamp])
            # The eye sees lamps at the front from before it, those at the rear from behind it.
            before = ahead > 0.0 if lamps.forwards[lamp] > 0.0 else ahead + length < 0.0
            if lamp < 0 or bits == 0 or not before:
                continue
            x, y, z = lamps.place[lamp, 0] * length, lamps.place[lamp, 1] * width, lamps.place[lamp, 2] * height
            forward, left, up = ahead - x, aside - y, above - z
            far = math.sqrt(forward * forward + left * left + up * up + 1e-12)
            facing = max(forward * lamps.forwards[lamp] / far, 0.0)
            one, sign = found[count], lamps.forwards[lamp]
            over = x * level - z * rise
            one[0] = position[row, 0] + over * cosine - y * sine
            one[1] = position[row, 1] + over * sine + y * cosine
            one[2] = position[row, 2] + x * rise + z * level
            one[FORWARD], one[LEFT], one[UP] = forward, left, up
            full = lamps.intensity[lamp] if bits & lamps.signals else 0.0
            one[FULL_INTENSITY] = full
            one[INTENSITY] = full * _share_toward(lamps, lamp, forward, left, up) if full > 0.0 else 0.0
            one[AXIS], one[AXIS + 1], one[AXIS + 2] = sign * level * cosine, sign * level * sine, sign * rise
            one[AREA] = lamps.area[lamp] * width * height * facing
            which[0, count], which[1, count] = lamp, bits
            count += 1
    return count
