"""Daylight that a script makes brighter or darker; by day the picture goes with it in proportion."""

from dataclasses import dataclass, replace

import numpy as np

from fogsim.values import FogField


@dataclass(frozen=True, slots=True)
class Ramp:
    """A quantity that goes over from one value to another, evenly.

    Attributes
    ----------
    first : float
        The value before.
    last : float or None
        The value after; None for the same.
    begun, duration : float
        When it begins to change, and how long that takes [s].
    """

    first: float
    last: float | None = None
    begun: float = 0.0
    duration: float = 0.0

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
        return float(np.interp(time, [self.begun, self.begun + self.duration], [self.first, self.last]))

    def turned(self, time: float, value: float, duration: float) -> "Ramp":
        """The quantity when from a time on it goes elsewhere.

        Parameters
        ----------
        time : float
            The time [s].
        value : float
            Value to come to.
        duration : float
            Time that it takes [s].
        """
        return Ramp(self.at(time), value, time, duration)


def brightened(fog: FogField, factor: float) -> FogField:
    """Fog by brighter daylight.

    Parameters
    ----------
    fog : FogField
        The fog.
    factor : float
        How much brighter [-].
    """
    if factor == 1.0:
        return fog
    red, green, blue = fog.airlight
    return replace(fog, airlight=(red * factor, green * factor, blue * factor))
