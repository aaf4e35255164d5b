"""How bright the lamps of a vehicle shine toward an eye: from behind, from ahead, from the side.

Signal lamps within what UNECE allows (R148), dimmer off their axis as its figures have it and the pictures draw them.
Of dipped beams an eye at the height of eyes gets the light above their cut-off, and of both beams what leaves
to the side: fits to the median US lamps of UMTRI-2004-23, table 4, and UMTRI-2001-19, table 6.
"""

import functools
import math

from fogsim.values import Lamp
from fogsim.values.light import Side, burning
from fogsim.values.luminous_intensity import SignalLobe, signal_share

_REAR_LAMPS = ((int(Lamp.REAR_FOG), 200.0), (int(Lamp.STOP), 100.0), (int(Lamp.POSITION), 8.0))
"""Luminous intensity of one rear lamp, brightest first [cd]: within UNECE's 150–300, 60–185 and 4–12."""

THIRD_STOP_LAMP = 40.0
"""Luminous intensity of the third stop lamp, where it burns alone [cd]: within UNECE's 25–110 (R148, S3)."""

BRIGHTEST = _REAR_LAMPS[0][1]
"""Luminous intensity of the brightest rear lamp [cd]."""

_FRONT_SIGNAL_LAMPS = ((int(Lamp.DAYTIME), 600.0), (int(Lamp.POSITION), 10.0))
"""Luminous intensity of one front lamp that shines all around [cd]: within UNECE's 400–1200 and 4–140."""

LEAST_INTENSITY = 0.05
"""What lit position lamps send wherever they are to be seen at all [cd] (UNECE R148)."""

LIT_ROAD_INTENSITY = 0.2
"""Of the road before lit head lamps, seen from any side [cd]: Φ ρ / π · h / d, for two low beams of 315 lm each
(UMTRI-2004-23), asphalt of reflectance 0.1, and eyes 1.1 m high at 100 m."""

SIDE_MARKER = 4.0
"""Luminous intensity of a side marker lamp [cd]: UNECE R148 asks for 4–25."""

_SHORTEST_WITH_MARKERS = 6.0
"""Vehicles longer than this must have side marker lamps [m] (UNECE R48)."""

_HEAD_LAMPS = int(Lamp.LOW_BEAM | Lamp.HIGH_BEAM)

_BEAM_WIDTH = math.radians(7.0)
"""Angle to the side at which a dipped beam below its cut-off has 1/e of its light ahead [rad]: UMTRI-2004-23 at 1.5°
down has 0.52, 0.22, 0.05 at 5°, 10°, 20°, the mean of both sides."""


@functools.lru_cache(maxsize=1024)
def _kinds_that_burn(lamps: int) -> int:
    """Kinds of lamps that burn on the left or on the right, bits of `Lamp`."""
    return burning(lamps, Side.LEFT) | burning(lamps, Side.RIGHT)


@functools.lru_cache(maxsize=1024)
def head_lamps_that_burn(lamps: int) -> tuple[int, ...]:
    """Beams, bits of `Lamp`, of each of a vehicle's two head lamps that burns."""
    return tuple(lit for side in (Side.LEFT, Side.RIGHT) if (lit := burning(lamps, side) & _HEAD_LAMPS))


def burning_head_lamps(lamps: int) -> float:
    """Share of a vehicle's head lamps that burn [-]."""
    return 0.5 * len(head_lamps_that_burn(lamps))


@functools.lru_cache(maxsize=1024)
def rear_intensity(lamps: int) -> float:
    """Luminous intensity of the brightest lit rear lamp [cd]; one of a pair counts like both."""
    kinds = _kinds_that_burn(lamps)
    third = THIRD_STOP_LAMP if burning(lamps, Side.MIDDLE) else 0.0
    return max(next((intensity for lamp, intensity in _REAR_LAMPS if kinds & lamp), 0.0), third)


def intensity_toward(lamps: int, length: float, ahead: float, aside: float) -> float:
    """Luminous intensity of the brightest lamp of a vehicle toward an eye [cd] (`length` [m], `ahead`, `aside` [m])."""
    kinds = _kinds_that_burn(lamps)
    if not lamps:
        return 0.0
    has_position_lamps = bool(kinds & int(Lamp.POSITION))
    lit_road = LIT_ROAD_INTENSITY * burning_head_lamps(lamps)
    least = max(lit_road, LEAST_INTENSITY if has_position_lamps else 0.0)
    aside = abs(aside)
    if ahead > 0.0:
        return max(_front_intensity(kinds, math.atan2(aside, ahead)), least)
    if ahead < -length:
        lobe = SignalLobe.REAR_FOG if kinds & int(Lamp.REAR_FOG) else SignalLobe.SIGNAL
        return max(rear_intensity(lamps) * signal_share(lobe, math.atan2(aside, -length - ahead)), least)
    return SIDE_MARKER if has_position_lamps and length > _SHORTEST_WITH_MARKERS else least


def head_lamp_share(bearing: float) -> float:
    """Light of the own head lamps in a direction over that straight ahead [-] (`bearing` [rad])."""
    return math.exp(-abs(bearing) / _BEAM_WIDTH)


def _front_intensity(lamps: int, angle: float) -> float:
    signal = next((intensity for lamp, intensity in _FRONT_SIGNAL_LAMPS if lamps & lamp), 0.0)
    signal *= signal_share(SignalLobe.DAYTIME if lamps & int(Lamp.DAYTIME) else SignalLobe.SIGNAL, angle)
    return max(signal, beam_intensity(lamps, math.degrees(angle)))


def beam_intensity(lamps: int, degrees: float) -> float:
    """Luminous intensity of one head lamp toward an eye as high as it or a little higher [cd] (`degrees` [°])."""
    if lamps & int(Lamp.HIGH_BEAM):
        return 32585.0 * math.exp(-((degrees / 5.669) ** 1.202)) + 1674.0 * math.exp(-((degrees / 23.30) ** 1.5))
    if lamps & int(Lamp.LOW_BEAM):
        return 601.0 * math.exp(-((degrees / 14.0) ** 1.2))
    return 0.0


HIGH_BEAM_LIGHT = 4.8
"""Light of high beams on the rear of a vehicle ahead over that of low beams [-]: the mean over 1.6 m across and 0.3 to
1.2 m above the road of UMTRI-2001-19, table 6, over that of UMTRI-2004-23, table 4, is 4.5 … 5.0 from 30 to 200 m."""

_DENSEST_VEIL = 4.4
"""What the veil of high beams exceeds that of low beams by in the densest fog [cd/m²]."""

_HALF_VEIL_EXTINCTION = 0.0325
"""Extinction coefficient at which it is half of that [1/m]."""


@functools.lru_cache(maxsize=1024)
def head_lamp_light(lamps: int) -> float:
    """Light of a vehicle's head lamps straight ahead over that of two low beams [-]."""
    high = int(Lamp.HIGH_BEAM)
    return sum(0.5 * (HIGH_BEAM_LIGHT if lit & high else 1.0) for lit in head_lamps_that_burn(lamps))


def uses_high_beam(lamps: int) -> bool:
    """Whether a head lamp shines its high beam."""
    return head_lamp_light(lamps) > 1.0


def high_beam_veil(extinction: float) -> float:
    """What fog [1/m] adds to a driver's veil when high beams take the place of low beams [cd/m²].

    A fit to the veil of the pictures in moderate radiation fog (docs/explanation/night.md), from a car driver's eyes
    toward the road 40 m ahead: within 10 % from V_met = 30 m to 1000 m. From higher up it is less: 0.6 of it from 1.5
    m.
    """
    return _DENSEST_VEIL * extinction / (extinction + _HALF_VEIL_EXTINCTION)
