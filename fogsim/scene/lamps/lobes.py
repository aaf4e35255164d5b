"""How signal lamps and street lamps shine in all directions, as regulations and makers have it."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.values.light import Beam
from fogsim.values.luminous_intensity import (
    LOBE_AZIMUTHS,
    LOBE_ELEVATIONS,
    SIGNAL_SHARES,
    SignalLobe,
    luminous_intensity,
)

FULL = 1000.0
"""Intensity of the lobes of signal lamps along their axes [cd], so that they are never as dark as beams may be."""


def _lobe(shares: tuple[tuple[float, ...], ...]) -> Beam:
    table = np.array(shares)
    azimuth, elevation = (np.concatenate((-axis[:0:-1], axis)) for axis in (LOBE_AZIMUTHS, LOBE_ELEVATIONS))
    upper = np.concatenate((table[:, :0:-1], table), axis=1)
    return Beam(azimuth, elevation, FULL * np.concatenate((upper[:0:-1], upper)))


SIGNAL_LOBES: tuple[Beam, ...] = tuple(_lobe(SIGNAL_SHARES[kind]) for kind in SignalLobe)
"""How signal lamps shine that give `FULL` along their axes, by `SignalLobe`."""

STREET_ANGLES = np.radians([0.0, 30.0, 50.0, 60.0, 65.0, 70.0, 75.0, 80.0, 85.0, 90.0])
"""Angles from straight down to which `STREET_INTENSITIES` belong [rad]."""

STREET_INTENSITIES = np.array([1500.0, 1800.0, 2400.0, 2900.0, 3000.0, 2900.0, 2000.0, 1000.0, 500.0, 0.0])
"""Intensity of a street lamp on a mast of 8 m, a large one: 12.3 klm, alike in all directions about the mast [cd]."""


def _street_lobe() -> Beam:
    below = np.radians(np.arange(0.0, 90.1, 1.0))
    column = np.interp(below, STREET_ANGLES, STREET_INTENSITIES)
    return Beam(np.array([-math.pi, math.pi]), below - 0.5 * math.pi, np.repeat(column[:, None], 2, axis=1))


STREET_LOBE: Beam = _street_lobe()
"""The same as a beam, whatever its axis."""


def signal_shares() -> NDArray[np.float64]:
    """Ln of the share of its axial intensity that each kind of signal lamp shines (kinds, elevations, azimuths)."""
    return np.asarray(np.log(np.array([SIGNAL_SHARES[kind] for kind in SignalLobe])))


@lru_cache(maxsize=64)
def sum_of_beams(beams: tuple[Beam, ...]) -> Beam:
    """What lamps in one housing shine together."""
    if len(beams) == 1:
        return beams[0]
    azimuth, elevation = (
        np.unique(np.concatenate([getattr(beam, name) for beam in beams])) for name in ("azimuth", "elevation")
    )
    each = np.stack([luminous_intensity(beam, azimuth, elevation[:, None]) for beam in beams])
    return Beam(azimuth, elevation, each.sum(axis=0))
