"""Beams and phase functions as fine tables, to be read many times a frame without trigonometry.

A direction (forward, right, up) is placed by its tangents, folded so that all of them fit between −1 and 1:
w = t / (FOLD + |t|), which is fine near the axis, where cut-offs are, and coarse far from it.
"""

import math
from functools import cache, lru_cache
from typing import NamedTuple

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
_ANGLES = (np.arange(_CELLS) - _CELLS // 2) * _STEP
_AHEAD = slice(_CELLS // 2 - 180, _CELLS // 2 + 181)
"""Directions up to a right angle off the axis."""

_REMEMBERED = 16


@lru_cache(_REMEMBERED)
def lamp_table(beam: Beam) -> NDArray[np.float32]:
    """Luminous intensity of a lamp as a table over blur, the first entries sharp, the others ever wider; read-only.

    The latest are remembered, since the same lamps are in every scene.

    Returns Intensity [cd]; rows from below to above, columns from left to right, levels of blur.
    """
    checked_beam(beam)
    places = _places()
    azimuth, elevation = places.azimuth, places.elevation
    table = np.empty((SIZE, SIZE, BLURS), np.float32)
    table[..., 0] = luminous_intensity(beam, azimuth, elevation)
    # Lamps shine ahead alone: rows that look back are dark, and so are left out where each is transformed by itself.
    even = np.zeros((_AHEAD.stop - _AHEAD.start, _CELLS))
    even[:, _AHEAD] = luminous_intensity(beam, _ANGLES[_AHEAD], _ANGLES[_AHEAD, None])
    rows = np.zeros((_CELLS, _CELLS // 2 + 1), np.complex128)
    rows[_AHEAD] = np.fft.rfft(even)
    spectrum = np.fft.fft(rows, axis=0)
    for level in range(BLURS - 1):
        weight = _blur(level)
        kept = weight.shape[1]
        columns = np.fft.ifft(spectrum[:, :kept] * weight, axis=0)
        smooth = np.fft.irfft(columns[_AHEAD], _CELLS).reshape(-1)
        low = smooth.take(places.start) * places.left + smooth.take(places.start + 1) * places.right
        start = places.start + _CELLS
        high = smooth.take(start) * places.left + smooth.take(start + 1) * places.right
        table[..., level + 1] = np.maximum(low * places.above + high * places.down, 0.0)
    table.flags.writeable = False
    return table


class _Places(NamedTuple):
    """Directions of a table's entries, and where they lie between the evenly spaced ones ahead."""

    azimuth: NDArray[np.float64]
    elevation: NDArray[np.float64]
    start: NDArray[np.int64]
    left: NDArray[np.float64]
    right: NDArray[np.float64]
    above: NDArray[np.float64]
    down: NDArray[np.float64]


@cache
def _places() -> _Places:
    folded = np.clip(np.linspace(-1.0, 1.0, SIZE), -0.999, 0.999)
    tangent = FOLD * folded / (1.0 - np.abs(folded))
    azimuth = np.arctan(tangent)
    elevation = np.arctan(tangent[:, None] * np.cos(azimuth))
    row, column = elevation / _STEP + _CELLS // 2, azimuth / _STEP + _CELLS // 2
    i, j = row.astype(np.int64), column.astype(np.int64)
    down, right = row - i, column - j
    return _Places(azimuth, elevation, (i - _AHEAD.start) * _CELLS + j, 1 - right, right, 1 - down, down)


@cache
def _blur(level: int) -> NDArray[np.float64]:
    """What is left of a spectrum (rows, columns) of directions when they are blurred, up to where nothing is."""
    cells = FIRST_BLUR * 2.0**level / _STEP
    down, across = np.fft.fftfreq(_CELLS)[:, None], np.fft.rfftfreq(_CELLS)
    weight = np.exp(-2.0 * (math.pi * cells) ** 2 * (down**2 + across**2))
    return np.ascontiguousarray(weight[:, : np.count_nonzero(weight[0])])


def phase_table(phase: PhaseFunction) -> NDArray[np.float32]:
    """Phase function over cos(θ/2) in even steps from 0, straight back, to 1, straight on [1/sr]."""
    return phase(2.0 * np.arccos(np.linspace(0.0, 1.0, PHASE_SIZE))).astype(np.float32)
