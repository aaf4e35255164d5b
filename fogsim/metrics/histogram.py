"""Time spent at each value of a quantity, for shares and quantiles over all vehicles of a run."""

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.metric import share


class Histogram:
    """Time by value, in bins of equal width; what lies beyond the ends is in the outermost two."""

    def __init__(self, low: float, high: float, width: float) -> None:
        self._low, self._width = low, width
        self._bins = round((high - low) / width)
        self._time = np.zeros(self._bins + 2)

    def add(self, values: NDArray[np.float64], elapsed: NDArray[np.float64]) -> None:
        """Add times [s] at values (n,), which may be infinite."""
        # A value on an edge is above it, whatever the quotient's last bit.
        place = np.clip((values - self._low) / self._width + (1.0 + 1e-9), 0.0, self._bins + 1.0)
        self._time += np.bincount(place.astype(np.intp), elapsed, minlength=self._bins + 2)

    def share_below(self, value: float) -> float | None:
        """Share of the time below a value, an edge of a bin [-]; None without any."""
        until = round((value - self._low) / self._width) + 1
        return share(float(self._time[:until].sum()), float(self._time.sum()))

    def quantile(self, probability: float) -> float | None:
        """Value below which a share of the time was spent; None without any, or beyond the range."""
        total = np.cumsum(self._time)
        wanted = probability * total[-1]
        place = int(np.searchsorted(total, wanted))
        if not wanted or not 1 <= place <= self._bins:
            return None
        part = (wanted - total[place - 1]) / self._time[place]
        return float(self._low + self._width * (place - 1 + part))
