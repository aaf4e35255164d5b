"""What all signs are paid together: everyone's safety and delay, those included who wait to come onto the road."""

from dataclasses import dataclass

import numpy as np

from fogsim.core.kinematics import stopping_sight_distance
from fogsim.core.parameters import checked_parameters
from fogsim.metrics import DEFAULT_STANDARD, SafetyStandard, time_to_collision
from fogsim.metrics.following import find_following
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import TrafficStep

_KILOMETRE, _MINUTE = 1000.0, 60.0

_CLEAR = 1e-6
"""Extinction coefficient of air in which everyone sees far enough [1/m]."""


@checked_parameters
@dataclass(frozen=True, slots=True)
class CorridorWeights:
    """Weights of the terms, in points.

    Attributes
    ----------
    delay : float
        Against each vehicle-minute lost to the speed that drivers would like in clear air.
    overdriving : float
        Against each vehicle-kilometre driven with no sight at all; in proportion to the share of the stopping sight
        distance that lies beyond the sight.
    conflict : float
        Against each vehicle-second at a time to collision of 0, in proportion to what is missing to the standard's.
    collision : float
        Against each collision.
    """

    delay: float = 0.1
    overdriving: float = 0.3
    conflict: float = 0.1
    collision: float = 20.0


class CorridorReward:
    """Gathers the terms of the reward over the steps of a decision period."""

    def __init__(self, weights: CorridorWeights, standard: SafetyStandard = DEFAULT_STANDARD) -> None:
        self._weights, self._standard = weights, standard
        self._amounts = dict.fromkeys(CorridorWeights.__dataclass_fields__, 0.0)

    def add(self, step: TrafficStep, elapsed: float) -> None:
        """Take in a step (`elapsed` [s])."""
        found = {
            "delay": elapsed * lost_share(step) / _MINUTE,
            "overdriving": elapsed * overdriven(step, self._standard) / _KILOMETRE,
            "conflict": elapsed * conflict(step, self._standard.time_to_collision),
            "collision": float(len(step.collisions)),
        }
        self._amounts = {name: amount + found[name] for name, amount in self._amounts.items()}

    @property
    def collisions(self) -> int:
        """Number of collisions [-]."""
        return int(self._amounts["collision"])

    def terms(self) -> dict[str, float]:
        """Weighted terms by the names of `CorridorWeights`; the reward is their sum."""
        return {name: -getattr(self._weights, name) * amount for name, amount in self._amounts.items()}


def lost_share(step: TrafficStep) -> float:
    """Vehicles whose time is lost [-]: 1 for each that stands or waits to enter the road, 0 for one that is free."""
    traffic = step.traffic
    if not len(traffic.speed):
        return float(step.waiting)
    return float(np.maximum(1.0 - traffic.speed / traffic.free_speed, 0.0).sum()) + step.waiting


def overdriven(step: TrafficStep, standard: SafetyStandard) -> float:
    """Speeds of all vehicles [m/s], each times the share of its stopping sight distance beyond its sight."""
    speed, extinction = step.traffic.speed, step.truth.vehicle_extinctions
    if extinction is None or not len(speed):
        return 0.0
    needed = stopping_sight_distance(np.maximum(speed, 0.1), standard.reaction_time, standard.deceleration)
    seen = OPTICAL_DEPTH_AT_VISIBILITY / np.maximum(extinction, _CLEAR)
    return float((speed * np.maximum(1.0 - seen / needed, 0.0)).sum())


def conflict(step: TrafficStep, threshold: float) -> float:
    """How far everyone's time to collision is below a threshold [s]: the sum of 0 … 1 for each vehicle."""
    found = find_following(step.traffic)
    remaining = time_to_collision(found.gap, found.speed, found.leader_speed)
    return float(np.maximum(1.0 - remaining / threshold, 0.0).sum())
