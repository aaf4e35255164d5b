"""Types of vehicles on roads by template, with the sizes and drivers of FogSim's own scenarios."""

from dataclasses import dataclass

from fogsim.core.registry import Registry


@dataclass(frozen=True, slots=True)
class VehicleKind:
    """A kind of vehicle."""

    vehicle_class: str  # SUMO's ``vClass``
    # length, width, height: size [m]
    length: float
    width: float
    height: float
    top_speed: float  # What it can drive at most [m/s]
    # Share of the limit that its drivers want to drive, as SUMO has it: ``normc(mean,deviation,least,most)``
    speed_factor: str
    headway: float  # Time that they keep to who is ahead (Krauss' tau) [s]
    # acceleration, deceleration: what they use at most [m/s²]
    acceleration: float = 2.6
    deceleration: float = 4.5
    imperfection: float = 0.4  # How imperfectly they drive (Krauss' sigma) [-]


CAR = VehicleKind("passenger", 4.6, 1.85, 1.5, 55.0, "normc(0.95,0.10,0.75,1.20)", 1.4)

VEHICLE_KINDS: Registry[VehicleKind] = Registry(
    "vehicle type",
    {
        "car": CAR,
        "van": VehicleKind("delivery", 5.9, 2.05, 2.4, 36.1, "normc(0.90,0.08,0.70,1.10)", 1.5),
        "lorry": VehicleKind("truck", 9.2, 2.5, 3.4, 25.0, "normc(0.95,0.05,0.80,1.05)", 1.6, 1.2, 4.0, 0.3),
        "truck": VehicleKind("truck", 15.5, 2.5, 3.8, 24.7, "normc(0.98,0.03,0.90,1.05)", 1.8, 0.8, 4.0, 0.3),
        "coach": VehicleKind("coach", 12.5, 2.55, 3.55, 27.8, "normc(1.00,0.02,0.95,1.05)", 1.7, 1.2, 4.0, 0.3),
        "motorcycle": VehicleKind("motorcycle", 2.2, 0.9, 1.5, 55.0, "normc(1.00,0.10,0.80,1.25)", 1.3, 4.0, 6.0),
        "bicycle": VehicleKind("bicycle", 1.8, 0.65, 1.7, 7.0, "normc(0.90,0.10,0.70,1.00)", 1.0, 1.2, 3.0),
    },
)
"""Vehicles by the name of their type."""

USUAL_MIX = (("car", 0.68), ("van", 0.14), ("truck", 0.15), ("coach", 0.03))
"""Default shares of types in traffic."""

TOWN_MIX = (("car", 0.84), ("van", 0.10), ("lorry", 0.06))
"""Shares of types in the traffic of streets."""

SLOW = ("truck", "coach", "bicycle")
"""Types that keep to the right lane."""
