"""The per-pixel loop of exposure, noise, response and quantisation."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

NORMAL_TABLE_BITS = 16
"""Noise is drawn from a table of 2^16 normal quantiles by a hash of seed and pixel: fast, and the same everywhere."""

RESPONSE_STEPS = 1 << 14
"""Resolution of the response table: finer than one 8-bit level even in the steepest part of the sRGB curve."""


@kernel
def develop(
    radiance: NDArray[np.float32],
    gain: float,
    shot_variance: float,
    read_variance: float,
    seed: int,
    normals: NDArray[np.float32],
    response: NDArray[np.uint8],
    out: NDArray[np.uint8],
) -> None:
    """Pixel values from radiance.

    `gain` takes radiance to exposure relative to saturation. Shot noise has variance `shot_variance` · exposure and
    read noise `read_variance`, both relative to saturation². `response` takes exposure in 2^14 steps to 8 bit.
    """
    rows, columns, channels = radiance.shape
    top = response.shape[0] - 1
    state = np.uint64(seed)
    for v in range(rows):
        for u in range(columns):
            for c in range(channels):
                # splitmix64: a counter through a mixing function gives independent values in any order.
                state += np.uint64(0x9E3779B97F4A7C15)
                mixed = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
                mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
                normal = normals[mixed >> np.uint64(64 - NORMAL_TABLE_BITS)]
                exposure = max(radiance[v, u, c] * gain, 0.0)
                exposure += normal * math.sqrt(shot_variance * exposure + read_variance)
                index = int(min(max(exposure, 0.0), 1.0) * top + 0.5)
                out[v, u, c] = response[index]
