"""Medians and quantiles of few numbers, without the checks of numpy's, which take longer than the search."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def columns_apart(image: NDArray[Any], step: int) -> NDArray[Any]:
    """Columns some way apart, from both sides of an image inward: of a mirrored image the same pixels.

    Parameters
    ----------
    image : (rows, cols, …) array
        The image.
    step : int
        Columns from one to the next.

    Returns
    -------
    (rows, n, …) array
        Those of the left half from left to right, then those of the right half from right to left.
    """
    cols = image.shape[1]
    # Two slices: numpy takes columns by their numbers several times as slowly.
    return np.concatenate((image[:, : (cols + 1) // 2 : step], image[:, ::-1][:, : cols // 2 : step]), axis=1)


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
    ordered = np.partition(flat, half)
    # Of the lower half the largest is the neighbour: to ask for both takes numpy several times as long.
    return 0.5 * (float(ordered[:half].max()) + float(ordered[half]))


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
    ordered = np.partition(flat, below)
    lower = float(ordered[below])
    upper = float(ordered[below + 1 :].min()) if below + 1 < flat.size else lower
    return lower + (place - below) * (upper - lower)


def row_medians(values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Median of each row of numbers that are all finite.

    Parameters
    ----------
    values : (rows, n) float
        At least one column.
    """
    half = values.shape[1] // 2
    ordered = np.sort(values, axis=1)
    if values.shape[1] % 2:
        return ordered[:, half].astype(np.float64)
    return np.asarray(0.5 * (ordered[:, half - 1].astype(np.float64) + ordered[:, half]))
