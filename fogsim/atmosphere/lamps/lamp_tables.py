"""Beams and phase functions as fine tables, to be read many times a frame without trigonometry.

A direction (forward, right, up) is placed by its tangents, folded so that all of them fit between −1 and 1:
w = t / (FOLD + |t|), which is fine near the axis, where cut-offs are, and coarse far from it.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.phase_function import PhaseFunction
from fogsim.values import Beam
from fogsim.values.luminous_intensity import checked_beam, luminous_intensity

FOLD = 0.15
"""Tangent that is placed half-way between the axis and the border of a table [-]."""

SIZE = 256
"""Rows and columns of a beam's table: 0.07° apart near the axis, 1° at 50° from it."""

FIRST_BLUR = 0.01
"""Least blur in a table's stack [rad]; each further one is twice as wide."""

BLURS = 8
"""Tables in a stack, the first without blur."""

PHASE_SIZE = 1024

_STEP = math.radians(0.5)
_CELLS = 512
_REMEMBERED = 16


@lru_cache(_REMEMBERED)
def lamp_table(beam: Beam) -> NDArray[np.float32]:
    """Luminous intensity of a lamp as a table over blur, the first entries sharp, the others ever wider; read-only.

    The latest are remembered, since the same lamps are in every scene.

    Returns Intensity [cd]; rows from below to above, columns from left to right, levels of blur.
    """
    checked_beam(beam)
    folded = np.clip(np.linspace(-1.0, 1.0, SIZE), -0.999, 0.999)
    tangent = FOLD * folded / (1.0 - np.abs(folded))
    azimuth = np.arctan(tangent)
    elevation = np.arctan(tangent[:, None] * np.cos(azimuth))
    stack = [luminous_intensity(beam, azimuth, elevation)]
    angles = (np.arange(_CELLS) - _CELLS // 2) * _STEP
    inside = np.abs(angles) <= math.pi / 2
    even = luminous_intensity(beam, angles, angles[:, None]) * inside * inside[:, None]
    spectrum = np.fft.rfft2(even)
    down, across = np.fft.fftfreq(_CELLS)[:, None], np.fft.rfftfreq(_CELLS)
    row, column = elevation / _STEP + _CELLS // 2, azimuth / _STEP + _CELLS // 2
    for level in range(BLURS - 1):
        cells = FIRST_BLUR * 2.0**level / _STEP
        smooth = np.fft.irfft2(spectrum * np.exp(-2.0 * (math.pi * cells) ** 2 * (down**2 + across**2)), even.shape)
        stack.append(np.maximum(_bilinear(smooth, row, column), 0.0))
    table = np.stack(stack, axis=-1).astype(np.float32)
    table.flags.writeable = False
    return table


def _bilinear(table: NDArray[np.float64], row: NDArray[np.float64], column: NDArray[np.float64]) -> NDArray[np.float64]:
    i, j = row.astype(np.int64), column.astype(np.int64)
    down, right = row - i, column - j
    low = table[i, j] * (1 - right) + table[i, j + 1] * right
    return np.asarray(low * (1 - down) + (table[i + 1, j] * (1 - right) + table[i + 1, j + 1] * right) * down)


def phase_table(phase: PhaseFunction) -> NDArray[np.float32]:
    """Phase function over cos(θ/2) in even steps from 0, straight back, to 1, straight on [1/sr]."""
    return phase(2.0 * np.arccos(np.linspace(0.0, 1.0, PHASE_SIZE))).astype(np.float32)
