"""The per-pixel loop of Koschmieder's law."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

ENDLESS = 1e7
"""Length that stands for an endless ray [m]."""


@kernel
def _ramp(station: float, middle: float, edge: float) -> float:
    t = min(max((station - middle) / edge + 0.5, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@kernel
def _ramp_integral(station: float, middle: float, edge: float) -> float:
    t = min(max((station - middle) / edge + 0.5, 0.0), 1.0)
    return edge * t * t * t * (1.0 - 0.5 * t) + max(station - (middle + 0.5 * edge), 0.0)


@kernel
def _bank_share(bank: NDArray[np.float64], integral_here: float, rate: float, length: float) -> float:
    """Mean of a bank's profile along a ray, 0 … 1; `rate` is the change of the station with distance."""
    here, start, end, edge = bank[0], bank[3], bank[4], bank[5]
    span = rate * length
    if abs(span) < 1e-3:
        return _ramp(here, start, edge) - _ramp(here, end, edge)
    there = here + span
    return (_ramp_integral(there, start, edge) - _ramp_integral(there, end, edge) - integral_here) / span


@kernel
def fog_pixels(
    radiance: NDArray[np.float32],
    distance: NDArray[np.float32],
    ray_map: NDArray[np.float64],
    eye_height: float,
    top: float,
    base_extinction: float,
    banks: NDArray[np.float64],
    airlight: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """L = L0 e^(−τ) + L∞ (1 − e^(−τ)) for every pixel, τ exact through layers and banks.

    `ray_map` (3, 3) takes (u, v, 1) to a ray in the world (not normalised). `banks` (n, 7) holds for each bank the
    station of the eye, the axis (x, y), start, end, edge and extra extinction.
    """
    rows, columns = distance.shape
    integral_here = np.empty(banks.shape[0])
    for b in range(banks.shape[0]):
        here, edge = banks[b, 0], banks[b, 5]
        integral_here[b] = _ramp_integral(here, banks[b, 3], edge) - _ramp_integral(here, banks[b, 4], edge)
    for v in range(rows):
        for u in range(columns):
            x = ray_map[0, 0] * u + ray_map[0, 1] * v + ray_map[0, 2]
            y = ray_map[1, 0] * u + ray_map[1, 1] * v + ray_map[1, 2]
            z = ray_map[2, 0] * u + ray_map[2, 1] * v + ray_map[2, 2]
            norm = 1.0 / math.sqrt(x * x + y * y + z * z)
            # An endless path through fog shows nothing but airlight; through clear air, everything.
            length = min(float(distance[v, u]), ENDLESS)
            if z > 0.0 and eye_height + length * z * norm > top:
                length = (top - eye_height) / (z * norm)
            extinction = base_extinction
            for b in range(banks.shape[0]):
                rate = (x * banks[b, 1] + y * banks[b, 2]) * norm
                extinction += banks[b, 6] * _bank_share(banks[b], integral_here[b], rate, length)
            transmission = math.exp(-extinction * length)
            for c in range(3):
                light = airlight[c]
                out[v, u, c] = light + (radiance[v, u, c] - light) * transmission
