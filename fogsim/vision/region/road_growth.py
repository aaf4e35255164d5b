"""Regions grown from the road's bottom row with limits to the step and to the distance from the seed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel


@dataclass(frozen=True, slots=True)
class GrowthLimits:
    """What a pixel may differ by to join a region [linear grey levels].

    Attributes
    ----------
    step : float
        From a neighbour in the row below.
    per_row : float
        From the seed, for each row of distance from it.
    seed : float
        Of a seed from the median of the bottom row.
    """

    step: float
    per_row: float
    seed: float


def grown_road(luminance: NDArray[np.float32], edges: NDArray[np.uint8], limits: GrowthLimits) -> NDArray[np.uint8]:
    """Grow a region upward from the pixels of the bottom row that are near its median.

    The common form of zhu2015 eqs. 8–11 and of huang2015's first three constraints.

    Parameters
    ----------
    luminance : (rows, cols) float32
        Smoothed linear luminance.
    edges : (rows, cols) uint8
        Non-zero where no pixel may join.
    limits : GrowthLimits
        The constraints.

    Returns
    -------
    (rows, cols) uint8
        1 inside the region.
    """
    seed = float(np.median(luminance[-1]))
    region: NDArray[np.uint8] = _grow(luminance, edges, limits.step, limits.per_row, seed, limits.seed)
    return region


@kernel
def _grow(
    luminance: NDArray[np.float32],
    edges: NDArray[np.uint8],
    step: float,
    per_row: float,
    seed: float,
    tolerance: float,
) -> NDArray[np.uint8]:
    rows, cols = luminance.shape
    region = np.zeros((rows, cols), np.uint8)
    for col in range(cols):
        region[rows - 1, col] = abs(luminance[rows - 1, col] - seed) <= tolerance and edges[rows - 1, col] == 0
    for row in range(rows - 2, -1, -1):
        allowed = tolerance + per_row * (rows - 1 - row)
        for col in range(cols):
            value = luminance[row, col]
            if edges[row, col] != 0 or abs(value - seed) > allowed:
                continue
            for below in range(max(col - 1, 0), min(col + 2, cols)):
                if region[row + 1, below] != 0 and abs(value - luminance[row + 1, below]) <= step:
                    region[row, col] = 1
                    break
    return region


MOST_PIXELS = 64
"""Pixels, evenly over a row, that its median is of; more cost time and gain little beside the road's own texture."""


@dataclass(frozen=True, slots=True)
class RowMedians:
    """Medians of a region's rows.

    Attributes
    ----------
    luminance : (rows,) float64
        0 where there are too few pixels.
    count : (rows,) int64
        Pixels that the median is of; 0 where there are too few.
    """

    luminance: NDArray[np.float64]
    count: NDArray[np.int64]


def row_medians(
    luminance: NDArray[np.float32],
    region: NDArray[np.uint8],
    left: NDArray[np.int64],
    right: NDArray[np.int64],
    fewest: int = 3,
) -> RowMedians:
    """Median of each row's pixels that lie in a region and between two columns.

    Parameters
    ----------
    luminance : (rows, cols) float32
        Linear luminance.
    region : (rows, cols) uint8
        Non-zero inside the region.
    left, right : (rows,) int64
        First and last column of each row; they may lie outside the image.
    fewest : int
        Fewest pixels that make a median.
    """
    return RowMedians(*_row_medians(luminance, region, left, right, fewest))


@kernel
def _row_medians(
    luminance: NDArray[np.float32],
    region: NDArray[np.uint8],
    left: NDArray[np.int64],
    right: NDArray[np.int64],
    fewest: int,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    rows, cols = luminance.shape
    medians, counts = np.zeros(rows), np.zeros(rows, np.int64)
    found = np.empty(cols, np.float32)
    for row in range(rows):
        first, last = max(left[row], 0), min(right[row], cols - 1)
        count = 0
        for col in range(first, last + 1, max((last - first + 1) // MOST_PIXELS, 1)):
            if region[row, col] != 0:
                found[count] = luminance[row, col]
                count += 1
        if count >= fewest:
            medians[row], counts[row] = np.median(found[:count]), count
    return medians, counts


@kernel
def region_tops(region: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Topmost row of each column of a (rows, cols) uint8 region that has one; shorter than `cols` if some have none."""
    rows, cols = region.shape
    tops = np.empty(cols, np.int64)
    count = 0
    for col in range(cols):
        for row in range(rows):
            if region[row, col] != 0:
                tops[count] = row
                count += 1
                break
    return tops[:count]
