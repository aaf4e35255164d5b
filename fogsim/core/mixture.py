"""Many measured visibilities as one: outliers set aside by clusters, the rest reduced to a normal distribution.

After belaroussi2015, sections 4.3 and 4.4.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_CLUSTERS = 3
"""Too large, too small, and right (section 4.3)."""

_ROUNDS = 50


def majority(values: Sequence[float], weights: Sequence[float], clusters: int = _CLUSTERS) -> NDArray[np.bool_]:
    """Which values are in the weightiest of some clusters, by weighted k-means on a line.

    Returns all of them, where there are no more than clusters: there is no majority among three (n,) bool.
    """
    x, w = np.asarray(values, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    if len(x) <= clusters:
        return np.ones(len(x), dtype=bool)
    order = np.argsort(x, kind="stable")
    share = (np.cumsum(w[order]) - 0.5 * w[order]) / w.sum()
    middles = np.interp((np.arange(clusters) + 0.5) / clusters, share, x[order])
    nearest = np.zeros(len(x), dtype=np.intp)
    for _ in range(_ROUNDS):
        nearest = np.argmin(np.abs(x[:, None] - middles), axis=1)
        moved = [
            np.average(x[nearest == i], weights=w[nearest == i]) if (nearest == i).any() else middles[i]
            for i in range(clusters)
        ]
        if np.array_equal(moved, middles):
            break
        middles = np.array(moved)
    return np.asarray(nearest == np.argmax([w[nearest == i].sum() for i in range(clusters)]))


def reduced(values: Sequence[float], weights: Sequence[float]) -> tuple[float, float]:
    """Mean and standard deviation of a mixture of normal distributions, one for each value (eq. 2)."""
    z, p = np.asarray(values, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    mean, count = float((p * z).sum() / p.sum()), len(z)
    if count == 1:
        return mean, 1.0 / (math.sqrt(2.0 * math.pi) * float(p[0]))
    return mean, math.sqrt(float((p * (z - mean) ** 2).sum() / ((count - 1) / count * p.sum())))
