"""A radar-like sensor that tracks the vehicle ahead; radar waves pass through fog, not through walls."""

import math
from dataclasses import dataclass

import numpy as np

from fogsim.values import Leader, LeadMeasurement


@dataclass(frozen=True, slots=True)
class LeadSensor:
    """A long-range automotive radar."""

    reach: float = 200.0  # Largest distance at which it tracks a vehicle [m]
    distance_deviation: float = 0.25  # Standard deviation of the distance [m]
    speed_deviation: float = 0.1  # Standard deviation of the relative speed [m/s]
    field_of_view: float = math.inf  # Full horizontal angle within which it measures [rad]


def measure_lead(
    leader: Leader | None,
    own_speed: float,
    sensor: LeadSensor,
    rng: np.random.Generator,
    bearing: float = 0.0,
    share_of_reach: float = 1.0,
) -> LeadMeasurement | None:
    """Measure the vehicle ahead.

    Two numbers are drawn in every call, with a leader or without, so that what comes later never depends on it.

    Returns None if nothing is within reach and field of view. Takes `own_speed` [m/s], `bearing` [rad].
    """
    distance_noise, speed_noise = rng.standard_normal(2).tolist()
    if leader is None or share_of_reach <= 0.0 or leader.gap > share_of_reach * sensor.reach:
        return None
    if 2.0 * abs(bearing) > sensor.field_of_view:
        return None
    return LeadMeasurement(
        distance=max(leader.gap + sensor.distance_deviation * distance_noise, 0.0),
        relative_speed=leader.speed - own_speed + sensor.speed_deviation * speed_noise,
    )
