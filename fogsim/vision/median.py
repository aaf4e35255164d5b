"""Medians and quantiles of few numbers, without the checks of numpy's, which take longer than the search."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def median(values: NDArray[np.floating[Any]]) -> float:
    """Median of numbers that are all finite.

    Parameters
    ----------
    values : (n, …) float
        At least one number.
    """
    flat = values.ravel()
    half = flat.size // 2
    if flat.size % 2:
        return float(np.partition(flat, half)[half])
    ordered = np.partition(flat, (half - 1, half))
    return 0.5 * (float(ordered[half - 1]) + float(ordered[half]))


def quantile(values: NDArray[np.floating[Any]], share: float) -> float:
    """What a share of numbers lie below, linear between neighbours.

    Parameters
    ----------
    values : (n, …) float
        At least one number; all are finite.
    share : float
        0 … 1.
    """
    flat = values.ravel()
    place = share * (flat.size - 1)
    below = min(int(place), flat.size - 1)
    above = min(below + 1, flat.size - 1)
    ordered = np.partition(flat, (below, above))
    return float(ordered[below]) + (place - below) * (float(ordered[above]) - float(ordered[below]))


def row_medians(values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Median of each row of numbers that are all finite.

    Parameters
    ----------
    values : (rows, n) float
        At least one column.
    """
    half = values.shape[1] // 2
    if values.shape[1] % 2:
        return np.asarray(np.partition(values, half, axis=1)[:, half], np.float64)
    ordered = np.partition(values, (half - 1, half), axis=1)[:, half - 1 : half + 1]
    return np.asarray(ordered.mean(axis=1, dtype=np.float64))
