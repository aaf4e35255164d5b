"""Lamps of vehicles that shine toward an eye, one after another."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

FORWARD, LEFT, UP, INTENSITY, AREA, FOUND = range(3, 9)
"""Columns of what is found of a lamp, and their count.

First its place [m]; then the way from it to the eye in the vehicle's axes [m], its intensity toward the eye [cd] and
its luminous area as the eye sees it [m²].
"""


class LampTable(NamedTuple):
    """Lamps of all bodies in their unit boxes.

    Attributes
    ----------
    place : (n, 3) float64
        Middles.
    area : (n,) float64
        Luminous areas over width times height of the body.
    mask : (n,) int64
        Bits of `Lamp` that light each.
    intensity : (n,) float64
        Along its axis [cd].
    dark_shift : (n,) int64
        By how many bits the lit ones are shifted to tell where a lamp is dark; see `fogsim.values.light.DARK_SHIFT`.
    forwards : (n,) float64
        1 for a lamp that shines ahead, −1 for one that shines back.
    of_body : (bodies, most) int64
        Lamps of each body, then −1.
    signals : int
        Bits of lamps whose intensity is that of the table; that of others is left at 0.
    """

    place: NDArray[np.float64]
    area: NDArray[np.float64]
    mask: NDArray[np.int64]
    intensity: NDArray[np.float64]
    dark_shift: NDArray[np.int64]
    forwards: NDArray[np.float64]
    of_body: NDArray[np.int64]
    signals: int


class LampCarriers(NamedTuple):
    """Vehicles with lamps.

    Attributes
    ----------
    position : (v, 3) float64
        Middles of the front bumpers [m].
    turned : (4, v) float64
        Cosine and sine of their headings, and of their grades.
    size : (3, v) float64
        Length, width and height [m].
    lit, body : (v,) int64
        Bits of lit lamps, and number of the body.
    """

    position: NDArray[np.float64]
    turned: NDArray[np.float64]
    size: NDArray[np.float64]
    lit: NDArray[np.int64]
    body: NDArray[np.int64]


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

    Parameters
    ----------
    vehicles, lamps
        The vehicles, and the lamps of bodies.
    eye : (3,) float64
        Where the eye is [m].
    farthest : float
        Distance beyond which vehicles are left out [m].
    found : (n, FOUND) float64
        Is filled.
    which : (2, n) int64
        Is filled: number of each lamp, and the bits that light it.
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
            one, square = found[count], facing * facing
            over = x * level - z * rise
            one[0] = position[row, 0] + over * cosine - y * sine
            one[1] = position[row, 1] + over * sine + y * cosine
            one[2] = position[row, 2] + x * rise + z * level
            one[FORWARD], one[LEFT], one[UP] = forward, left, up
            one[INTENSITY] = lamps.intensity[lamp] * square * square if bits & lamps.signals else 0.0
            one[AREA] = lamps.area[lamp] * width * height * facing
            which[0, count], which[1, count] = lamp, bits
            count += 1
    return count
