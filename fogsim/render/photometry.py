"""How bright things are: overcast daylight and lamps.

Radiance is given per colour channel in cd/m², scaled so that a grey surface has its luminance in every channel; the
luminance of a coloured light is `fogsim.units.luminance_of` it.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fogsim.units import luminance_of
from fogsim.values.light import SIGNAL_COLOURS, SIGNAL_DIAMETER, SIGNAL_INTENSITY, Lamp, SignalLight
from fogsim.values.scene import Surface

SKY_TINT = (0.988, 1.0, 1.035)
"""Colour of the overcast sky, of luminance 1."""

_RED, _AMBER, _WHITE = (1.0, 0.03, 0.015), (1.0, 0.36, 0.015), (1.0, 0.97, 0.90)
_WARM = (1.0, 0.86, 0.66)
_LENS = SIGNAL_INTENSITY / (math.pi / 4.0 * SIGNAL_DIAMETER**2)
_BEAMS = Lamp.LOW_BEAM | Lamp.HIGH_BEAM | Lamp.DAYTIME

_LAMPS: Mapping[Surface, tuple[Lamp | SignalLight, float, tuple[float, float, float]]] = {
    Surface.LAMP_POSITION_REAR: (Lamp.POSITION, 1300.0, _RED),
    Surface.LAMP_STOP: (Lamp.STOP, 17e3, _RED),
    Surface.LAMP_REAR_FOG: (Lamp.REAR_FOG, 20e3, _RED),
    Surface.LAMP_INDICATOR_LEFT: (Lamp.INDICATOR_LEFT, 15e3, _AMBER),
    Surface.LAMP_INDICATOR_RIGHT: (Lamp.INDICATOR_RIGHT, 15e3, _AMBER),
    Surface.LAMP_HEAD: (_BEAMS, 30e3, _WHITE),
    Surface.LAMP_STREET: (Lamp.NONE, 30e3, _WARM),
    Surface.DIODES_WHITE: (Lamp.NONE, 75.0, _WHITE),
    Surface.DIODES_RED: (Lamp.NONE, 18.0, _RED),
    Surface.LENS_RED: (SignalLight.RED, _LENS, SIGNAL_COLOURS[SignalLight.RED]),
    Surface.LENS_YELLOW: (SignalLight.YELLOW, _LENS, SIGNAL_COLOURS[SignalLight.YELLOW]),
    Surface.LENS_GREEN: (SignalLight.GREEN, _LENS, SIGNAL_COLOURS[SignalLight.GREEN]),
}
"""Lamps that light a surface, its luminance then [cd/m²] and its colour.

Luminous intensity over area: a tail lamp of 8 cd and 60 cm², a stop lamp of 100 cd and 60 cm², a rear fog lamp of
200 cd and 100 cm², a head lamp seen next to its beam with 500 cd and 150 cm², a street lamp of 9 klm over a tenth of a
square metre [M], a lens of a traffic light of 200 cd and 200 mm (`SIGNAL_INTENSITY`). The diodes of message signs are
dimmed as by night, to about the least of class L3 of EN 12966 below 4 lx, also by day [M].
"""


def zenith_luminance(illuminance: float) -> float:
    """Luminance of the zenith of the CIE standard overcast sky, 9 E / (7 π) [cd/m²] (`illuminance` [lx])."""
    return 9.0 * illuminance / (7.0 * math.pi)


def lamp_radiance(surface: Surface) -> NDArray[np.float64]:
    """Radiance of a lit lamp's surface per channel [cd/m²]; zero for what is no lamp."""
    if surface not in _LAMPS:
        return np.zeros(3)
    _, luminance, colour = _LAMPS[surface]
    return luminance * np.array(colour) / luminance_of(colour)


def lighting_bits(surface: Surface) -> int:
    """Bits of `Lamp`; any of them lights a surface. −1 for one that is always lit, 0 for what is no lamp."""
    return (int(_LAMPS[surface][0]) or -1) if surface in _LAMPS else 0
