"""Which droplets a fog has, accumulated over images: droplets last longer than what one image sees."""

import math

import numpy as np

from fogsim.vision.strips.airlight_slopes import DROPLET_CHANCES

OTHER_ROAD = 30.0
"""Way after which an image shows so much other road that its evidence counts again [m]."""

LASTS = 1000.0
"""Way over which droplets stay the same [m]."""

MOST = 2.5
"""Most that the logarithm of a likelihood counts, in one picture: some roads fit the wrong droplets by far more [-]."""


class DropletMemory:
    """Chances of the kinds of droplets, learnt over the way.

    A single image hardly separates them, for a road whose albedo wanders may look like either. Its evidence is
    counted by the share of the road in it that is new.
    """

    def __init__(self) -> None:
        self._logarithms = np.log(DROPLET_CHANCES)
        self._time: float | None = None

    @property
    def chances(self) -> tuple[float, ...]:
        """How likely each kind is [-]."""
        weight = np.exp(self._logarithms - self._logarithms.max())
        return tuple((weight / weight.sum()).tolist())

    def learn(self, logarithms: tuple[float, ...], time: float, speed: float) -> None:
        """Learn from a picture (`time`, `speed` [s], [m/s])."""
        if not logarithms:
            return
        moved = 0.0 if self._time is None else max(speed * (time - self._time), 0.0)
        self._time = time
        beforehand, kept = np.log(DROPLET_CHANCES), math.exp(-moved / LASTS)
        learnt = min(moved / OTHER_ROAD, 1.0) * np.maximum(logarithms, -MOST)
        self._logarithms = beforehand + kept * (self._logarithms - beforehand) + learnt
