"""What a driver's own head lamps do for the driver: the light they throw ahead, and the veil that fog makes of it."""

import functools

from fogsim.traffic.drivers.lamp_intensity import head_lamps_that_burn
from fogsim.values import Lamp

HIGH_BEAM_LIGHT = 4.8
"""Light of high beams on the rear of a vehicle ahead over that of low beams [-]: the mean over 1.6 m across and 0.3 to
1.2 m above the road of UMTRI-2001-19, table 6, over that of UMTRI-2004-23, table 4, is 4.5 … 5.0 from 30 to 200 m."""

DENSEST_VEIL = 1.9
"""What the veil of high beams exceeds that of low beams by in the densest fog [cd/m²]."""

HALF_VEIL_EXTINCTION = 0.018
"""Extinction coefficient at which it is half of that [1/m]."""


@functools.lru_cache(maxsize=1024)
def head_lamp_light(lamps: int) -> float:
    """Light of a vehicle's head lamps straight ahead over that of two low beams [-].

    Parameters
    ----------
    lamps : int
        Its lit lamps, as `TrafficState.lamps` has them.
    """
    high = int(Lamp.HIGH_BEAM)
    return sum(0.5 * (HIGH_BEAM_LIGHT if lit & high else 1.0) for lit in head_lamps_that_burn(lamps))


def uses_high_beam(lamps: int) -> bool:
    """Whether a head lamp shines its high beam.

    Parameters
    ----------
    lamps : int
        Lit lamps, likewise.
    """
    return head_lamp_light(lamps) > 1.0


def high_beam_veil(extinction: float) -> float:
    """What fog adds to the veil before a driver's eyes when high beams take the place of low beams [cd/m²].

    A fit to the photons of moderate radiation fog toward a target 40 m ahead (docs/night.md): 0.42, 0.63, 0.86, 1.27,
    1.41 and 1.17 cd/m² at V_met = 500, 300, 200, 100, 50 and 30 m, kept to 15 % but for the last (1.6).

    Parameters
    ----------
    extinction : float
        Extinction coefficient at the eyes [1/m].
    """
    return DENSEST_VEIL * extinction / (extinction + HALF_VEIL_EXTINCTION)
