"""A radar-like sensor that tracks the vehicle ahead; radar waves pass through fog, not through walls."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fogsim.values import Leader, LeadMeasurement, Structure, StructureKind
from fogsim.values.obstruction import obstructions_of

_FREQUENCY = 77.0
"""Carrier of long-range automotive radars [GHz]."""

HEIGHT = 0.6
"""Height above the road of the radar, and of what of a vehicle sends most back to it [m]."""

_DENSE_WOOD = 14.0
"""Way through leaves from which each further metre weakens less [m]."""


def foliage_loss(way: float, frequency: float = _FREQUENCY) -> float:
    """What leaves take from a wave on a single way [m] through them [dB] (`frequency` [GHz]).

    Source: Weissberger, M. A. (1982), An initial critical summary of models for predicting the attenuation of radio
    waves by trees, ESD-TR-81-101: the modified exponential decay model, for 0.23 to 95 GHz and trees in leaf.
    """
    if way <= 0.0:
        return 0.0
    shape = 0.45 * way if way <= _DENSE_WOOD else 1.33 * math.pow(way, 0.588)
    return shape * math.pow(frequency, 0.284)


class RadarShadow:
    """How much less far a radar reaches because of what stands next to the road."""

    def __init__(self, structures: Sequence[Structure]) -> None:
        self._solid = obstructions_of(one for one in structures if one.kind is not StructureKind.HEDGE)
        self._leaves = obstructions_of(one for one in structures if one.kind is StructureKind.HEDGE)
        self._is_there = bool(self._solid) or bool(self._leaves)

    def __bool__(self) -> bool:
        """Whether there is anything that could be in the way."""
        return self._is_there

    def share_of_reach(self, radar: ArrayLike, rear: ArrayLike) -> float:
        """Share of its reach in the open that a radar (3,) [m] has toward vehicles' rears (k, 3) [m], 0 … 1.

        By the radar equation a loss of L dB on the way there and on the way back shortens the reach by 10^(−2 L / 40).
        """
        points = np.asarray(rear, np.float64).reshape(-1, 3)
        starts = np.broadcast_to(np.asarray(radar, np.float64), points.shape)
        free = points[~self._solid.hide(starts, points[:, None, :])]
        if not len(free):
            return 0.0
        way = float(self._leaves.way_through(starts[: len(free)], free).min())
        return math.pow(10.0, -foliage_loss(way) / 20.0)


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
    """Measurement of the vehicle ahead; None if nothing is in view (`own_speed` [m/s], `bearing` [rad]).

    Every call draws two numbers, leader or not, so that what comes later never depends on it.
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
