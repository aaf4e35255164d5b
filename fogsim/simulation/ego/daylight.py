"""Daylight that a script makes brighter or darker."""

from dataclasses import dataclass, replace

import numpy as np

from fogsim.atmosphere import airlight_from_illuminance
from fogsim.values import FogField


@dataclass(frozen=True, slots=True)
class Ramp:
    """A quantity that goes over from one value to another, evenly or by the same factor in each second."""

    first: float  # The value before
    last: float | None = None  # The value after; None for the same
    # begun, duration: when it begins to change, and how long that takes [s]
    begun: float = 0.0
    duration: float = 0.0
    # Whether its logarithm goes over evenly, and not the value itself; both values are positive then
    by_factors: bool = False

    def at(self, time: float) -> float:
        """The value at a time (`time` [s])."""
        if self.last is None or time <= self.begun:
            return self.first
        if time >= self.begun + self.duration:
            return self.last
        if self.by_factors:
            return float(self.first * (self.last / self.first) ** ((time - self.begun) / self.duration))
        return float(np.interp(time, [self.begun, self.begun + self.duration], [self.first, self.last]))

    def turned(self, time: float, value: float, duration: float, by_factors: bool = False) -> "Ramp":
        """The quantity when from a time on it goes elsewhere (`time` [s], `duration` [s])."""
        first = self.at(time)
        return Ramp(first, value, time, duration, by_factors and first > 0.0)


def in_daylight(fog: FogField, illuminance: float) -> FogField:
    """Fog by another daylight (`illuminance` [lx])."""
    return replace(fog, airlight=airlight_from_illuminance(illuminance, fog.airlight_share))
