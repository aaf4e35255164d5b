"""What a driver's own head lamps do for the driver: the light they throw ahead, and the veil that fog makes of it."""

import functools

from fogsim.traffic.drivers.lamp_intensity import head_lamps_that_burn
from fogsim.values import Lamp

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
    """What fog adds to the veil before a driver's eyes when high beams take the place of low beams [cd/m²].

    A fit to the veil of the pictures in moderate radiation fog (docs/explanation/night.md), from a car driver's eyes
    toward the road 40 m ahead: within 10 % from V_met = 30 m to 1000 m. From higher up it is less: 0.6 of it from 1.5
    m.

    Takes `extinction` [1/m].
    """
    return _DENSEST_VEIL * extinction / (extinction + _HALF_VEIL_EXTINCTION)
