"""How much the extinctions of a drive's last images differ."""

import math
from collections import deque

import numpy as np

_MEMORY, _FACTOR = 10.0, 1.5
"""Time over which recent extinctions measure how uneven the fog is [s], and the factor on a single one's relative
deviation [-]: fog that has varied along the road will vary further."""

_LEAST = 1e-4
"""Extinction below which differences do not count [1/m]."""


class RecentChange:
    """Measures how the extinction changes over a drive, up to a relative deviation (`most` [-])."""

    def __init__(self, most: float) -> None:
        self._most = most
        self._before: deque[tuple[float, float]] = deque()

    def reset(self) -> None:
        """Forget all earlier images."""
        self._before.clear()

    def of(self, time: float, extinction: float) -> float:
        """Relative deviation of an image's extinction (`time` [s], `extinction` [1/m]); 0 without times."""
        while self._before and not time - _MEMORY <= self._before[0][0] < time:
            self._before.popleft()
        self._before.append((time, math.log(max(extinction, _LEAST))))
        recent = np.array([logarithm for _, logarithm in self._before])
        apart = recent - recent.sum() / recent.size
        return min(_FACTOR * math.sqrt(float((apart * apart).sum()) / recent.size), self._most)
