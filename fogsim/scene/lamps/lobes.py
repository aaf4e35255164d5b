"""How signal lamps and street lamps shine in all directions, as regulations and makers have it."""

import math
from collections.abc import Mapping
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.values.light import Beam
from fogsim.values.luminous_intensity import luminous_intensity

LOBE_AZIMUTHS = np.radians([0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 80.0])
"""Angles beside the axis of a signal lamp to which the columns of its lobe belong, alike on both sides [rad]."""

LOBE_ELEVATIONS = np.radians([0.0, 5.0, 10.0, 15.0, 30.0])
"""Angles above and below it to which the rows belong [rad]."""


class SignalLobe(IntEnum):
    """Kinds of signal lamps by the way they shine."""

    SIGNAL = 0
    """Position and stop lamps and direction indicators."""

    DAYTIME = 1
    REAR_FOG = 2


_SHARES: Mapping[SignalLobe, tuple[tuple[float, ...], ...]] = {
    # UNECE R148 figure A3-I up to 20° aside and 10° up and down; beyond, what its fields of geometric visibility ask.
    SignalLobe.SIGNAL: (
        (1.0, 0.90, 0.35, 0.12, 0.06, 0.030, 0.0125),
        (0.70, 0.50, 0.20, 0.10, 0.05, 0.025, 0.0125),
        (0.30, 0.20, 0.12, 0.06, 0.03, 0.015, 0.010),
        (0.12, 0.09, 0.06, 0.035, 0.02, 0.0125, 0.008),
        (0.03, 0.025, 0.02, 0.012, 0.008, 0.005, 0.003),
    ),
    # The same, figure A3-II.
    SignalLobe.DAYTIME: (
        (1.0, 0.90, 0.70, 0.25, 0.08, 0.020, 0.003),
        (0.70, 0.50, 0.20, 0.10, 0.05, 0.015, 0.002),
        (0.20, 0.20, 0.12, 0.06, 0.03, 0.010, 0.002),
        (0.10, 0.09, 0.06, 0.03, 0.02, 0.008, 0.002),
        (0.02, 0.02, 0.015, 0.01, 0.007, 0.004, 0.001),
    ),
    # UNECE R148 asks for 150 cd (of at most 300) along 10° to either side and 5° up and down, half between these.
    SignalLobe.REAR_FOG: (
        (1.0, 0.92, 0.75, 0.20, 0.08, 0.030, 0.005),
        (0.75, 0.65, 0.40, 0.14, 0.06, 0.025, 0.005),
        (0.25, 0.22, 0.16, 0.08, 0.04, 0.015, 0.004),
        (0.10, 0.09, 0.07, 0.04, 0.02, 0.010, 0.003),
        (0.02, 0.02, 0.015, 0.01, 0.007, 0.005, 0.002),
    ),
}


FULL = 1000.0
"""Intensity of the lobes of signal lamps along their axes [cd], so that they are never as dark as beams may be."""


def _lobe(shares: tuple[tuple[float, ...], ...]) -> Beam:
    table = np.array(shares)
    azimuth, elevation = (np.concatenate((-axis[:0:-1], axis)) for axis in (LOBE_AZIMUTHS, LOBE_ELEVATIONS))
    upper = np.concatenate((table[:, :0:-1], table), axis=1)
    return Beam(azimuth, elevation, FULL * np.concatenate((upper[:0:-1], upper)))


SIGNAL_LOBES: tuple[Beam, ...] = tuple(_lobe(_SHARES[kind]) for kind in SignalLobe)
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
    return np.asarray(np.log(np.array([_SHARES[kind] for kind in SignalLobe])))


@lru_cache(maxsize=64)
def sum_of_beams(beams: tuple[Beam, ...]) -> Beam:
    """What lamps in one housing shine together.

    Parameters
    ----------
    beams : tuple of Beam
        One or more.
    """
    if len(beams) == 1:
        return beams[0]
    azimuth, elevation = (
        np.unique(np.concatenate([getattr(beam, name) for beam in beams])) for name in ("azimuth", "elevation")
    )
    each = np.stack([luminous_intensity(beam, azimuth, elevation[:, None]) for beam in beams])
    return Beam(azimuth, elevation, each.sum(axis=0))
