"""Daylight that a script makes brighter or darker."""

from dataclasses import dataclass, replace

import numpy as np

from fogsim.atmosphere import airlight_from_illuminance
from fogsim.values import FogField


@dataclass(frozen=True, slots=True)
class Ramp:
    """A quantity that goes over from one value to another, evenly or by the same factor in each second.

    Attributes
    ----------
    first : float
        The value before.
    last : float or None
        The value after; None for the same.
    begun, duration : float
        When it begins to change, and how long that takes [s].
    by_factors : bool
        Whether its logarithm goes over evenly, and not the value itself; both values are positive then.
    """

    first: float
    last: float | None = None
    begun: float = 0.0
    duration: float = 0.0
    by_factors: bool = False

    def at(self, time: float) -> float:
        """The value at a time.

        Parameters
        ----------
        time : float
            The time [s].
        """
        if self.last is None or time <= self.begun:
            return self.first
        if time >= self.begun + self.duration:
            return self.last
        if self.by_factors:
            return float(self.first * (self.last / self.first) ** ((time - self.begun) / self.duration))
        return float(np.interp(time, [self.begun, self.begun + self.duration], [self.first, self.last]))

    def turned(self, time: float, value: float, duration: float, by_factors: bool = False) -> "Ramp":
        """The quantity when from a time on it goes elsewhere.

        Parameters
        ----------
        time : float
            The time [s].
        value : float
            Value to come to.
        duration : float
            Time that it takes [s].
        by_factors : bool
            See `Ramp`; not where the value is 0 now.
        """
        first = self.at(time)
        return Ramp(first, value, time, duration, by_factors and first > 0.0)


def in_daylight(fog: FogField, illuminance: float) -> FogField:
    """Fog by another daylight.

    Parameters
    ----------
    fog : FogField
        The fog.
    illuminance : float
        Horizontal illuminance of the sky [lx].
    """
    return replace(fog, airlight=airlight_from_illuminance(illuminance, fog.airlight_share))
