"""How drivers follow advice: by content, by display and by trust, as field studies found it.

Of the studies only abstracts, summaries and one table have been seen; a share of compliance is what gives the published
change of speed in FogSim, and the text of each preset says from what.
"""

from dataclasses import dataclass

from fogsim.core.registry import Registry


@dataclass(frozen=True, slots=True)
class Compliance:
    """Who follows an advised speed, and how far."""

    # Share of drivers whom the advice reaches (a sign that they pass, a device on board), 0 … 1
    reached_share: float = 1.0
    rate: float = 1.0  # Share of those who follow it, 0 … 1
    strength: float = 1.0  # How far they go from their own speed down to the advised one, 0 … 1
    delay: float = 2.0  # Time before they do [s]
    # How far those who by themselves drive slower in fog go up to the advised speed, for they take it to be safe, 0 …
    # 1; never beyond what they drive in clear air
    trust: float = 0.0
    foreseen: float = 1.0  # Share of `strength` and `trust` that is left where they see no fog yet, 0 … 1


FULL = Compliance()
"""Everyone is reached and goes all the way down, and no one up: the best case."""

_SPEED_LIMIT_SIGN = Compliance(strength=0.6, trust=1.0)
"""Signs with a speed limit for the visibility, above every lane, which drivers know and trust.

A16 (Hogema & van der Horst 1997): 80 km/h for 70 to 140 m, 60 km/h below; mean speeds 8 to 10 km/h lower than without
signs, and below 35 m 60 km/h in place of 29: drivers took the sign's speed for safe. On I-77 limits for the visibility
made 2 to 5 mph (Gonzales & Fontaine 2018); in Finland 80 for 100 km/h on slippery roads 3.4 km/h (Rämä 1999).
"""

_ADVISORY_SIGN = Compliance(rate=0.1, strength=0.35)
"""Signs next to the road that advise a speed.

Caltrans' CAWS near Stockton (MacCarley, Ackles & Watts 2006): mean speeds fell by 1.1 mph over all fogs, and were
61 mph where 30 mph were advised in dense fog: 0.035 of the way. In Saudi Arabia an advised speed made 6.5 km/h; the
word "fog" without a speed 1.8 mph on the M25 (Cooper & Sawyer 1993).
"""

IN_CAR = Compliance(strength=0.55)
"""Advice on a display in the car.

Guan et al. 2022, in a simulator (table 3): 92.2 km/h in place of 107.2 on the way into the fog and 64.8 in place of
70.4 in dense fog, lower than with a sign next to. The advised speeds are not in what we have seen: 0.55 supposes
60 km/h.
"""

_VEHICLE_TO_VEHICLE = Compliance(reached_share=0.3, strength=0.55)
"""Advice from vehicle to vehicle, displayed in the car: as `IN_CAR`, to those who are equipped; FogSim's own share."""

COMPLIANCES: Registry[Compliance] = Registry(
    "compliance",
    {
        "full": FULL,
        "speed_limit_sign": _SPEED_LIMIT_SIGN,
        "advisory_sign": _ADVISORY_SIGN,
        "in_car": IN_CAR,
        "vehicle_to_vehicle": _VEHICLE_TO_VEHICLE,
    },
)


def complied_speed(own: float, advised: float, strength: float, trust: float = 0.0) -> float:
    """Speed of a driver who goes some way from the own speed to an advised one [m/s] (`own`, `advised` [m/s])."""
    return own + strength * min(0.0, advised - own) + trust * max(0.0, advised - own)
