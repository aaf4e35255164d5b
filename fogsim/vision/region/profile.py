"""Luminance by row: the curve that fog draws on the road."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.light.medians import row_medians
from fogsim.vision.region.road_region import Band

_MAX_BLOCKS = 48  # columns that a row's median is taken over; more cost time and gain nothing


def band_profile(luminance: NDArray[np.float32], band: Band) -> NDArray[np.float64]:
    """Median luminance of each row of a band.

    A wide band is first averaged over equal blocks of columns: that keeps the median's indifference to marks and other
    narrow things, and loses less to noise than a median of single pixels.

    Returns rows ``band.top`` … ``band.bottom`` from the top down. Takes `luminance` (rows, cols).
    """
    width = band.right - band.left + 1
    block = -(-width // _MAX_BLOCKS)
    count = width // block
    left = band.left + (width - count * block) // 2
    strip = luminance[band.top : band.bottom + 1, left : left + count * block]
    if block > 1:
        strip = strip.reshape(strip.shape[0], count, block).mean(axis=2, dtype=np.float64)
    return row_medians(strip)


def decreasing(profile: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smooth a profile such that it never rises from the top down, and falls wherever its neighbourhood does.

    Isotonic regression, then the binomial 1-2-1, which keeps the order and rounds the steps off.

    Takes `profile` (n,).
    """
    ordered: NDArray[np.float64] = _isotonic_decreasing(np.ascontiguousarray(profile))
    padded = np.concatenate([ordered[:1], ordered, ordered[-1:]])
    return 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]


@kernel
def _isotonic_decreasing(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Nearest sequence in least squares that never rises: pool adjacent violators on (n,) float64."""
    count = values.size
    means = np.empty(count)
    sizes = np.empty(count, np.int64)
    blocks = 0
    for value in values:
        means[blocks], sizes[blocks] = value, 1
        blocks += 1
        while blocks > 1 and means[blocks - 2] < means[blocks - 1]:
            total = sizes[blocks - 2] + sizes[blocks - 1]
            means[blocks - 2] += (means[blocks - 1] - means[blocks - 2]) * sizes[blocks - 1] / total
            sizes[blocks - 2] = total
            blocks -= 1
    return np.repeat(means[:blocks], sizes[:blocks])


@dataclass(frozen=True, slots=True)
class RoadCurve:
    """The luminance of the road by row, with what the flat world says about the rows."""

    below_horizon: NDArray[np.float64]  # (n,): v − v_h of each row, ascending [px]; not positive for rows of sky
    luminance: NDArray[np.float64]  # (n,): Linear luminance of each row
    distance: NDArray[np.float64]  # (n,): Length of the fog path to each row's road [m]; ``inf`` for rows of sky
    weight: NDArray[np.float64]  # (n,): 1, or 0 for rows that say nothing (saturated)
    row_distance: float  # λ of the camera [px·m]


def path_lengths(
    below_horizon: NDArray[np.float64], row_distance: float, slant: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance from the optical centre to the road by row.

    Returns distances [m]; ``inf`` at and above the horizon. Takes `below_horizon` (n,) [px], `row_distance` [px·m],
    `slant` (n,).
    """
    distance = np.full(below_horizon.shape, np.inf)
    np.divide(row_distance * slant, below_horizon, out=distance, where=below_horizon > 0)
    return distance
