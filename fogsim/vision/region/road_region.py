"""The road's region in the image, and the widest vertical band that crosses it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.light.medians import FEWEST_SAMPLES, MOST_SAMPLES, SpanMedians, median, span_medians
from fogsim.vision.region import region_kernels
from fogsim.vision.region.region_kernels import GrowthLimits


@dataclass(frozen=True, slots=True)
class Band:
    """A vertical band of an image; rows and columns are counted in the image that it was found in."""

    # left, right: first and last column [px]
    left: int
    right: int
    # top, bottom: first and last row [px]
    top: int
    bottom: int


def cumulative_limits(steps: NDArray[np.float32], seed_tolerance: float) -> GrowthLimits:
    """Limits that follow from what fog and noise allow between rows (negru2013 section IV.B.b after Hautière 2006).

    A pixel may differ from the seed by no more than the sum of the steps on the way.

    Takes `steps` (rows,) [linear grey levels], `seed_tolerance` [linear grey levels].
    """
    upward = np.concatenate(([seed_tolerance], steps[-2::-1].astype(np.float64)))
    return GrowthLimits(steps, np.ascontiguousarray(np.cumsum(upward)[::-1]))


def constant_limits(rows: int, step: float, per_row: float, seed_tolerance: float) -> GrowthLimits:
    """Limits that are the same in every row (zhu2015 eqs. 8 to 11, huang2015's first three constraints).

    Takes `step` [linear grey levels], `per_row` [linear grey levels], `seed_tolerance` [linear grey levels].
    """
    from_seed = seed_tolerance + per_row * np.arange(rows - 1, -1, -1, dtype=np.float64)
    return GrowthLimits(np.full(rows, step, np.float32), from_seed)


def grow_region(luminance: NDArray[np.float32], edges: NDArray[np.uint8], limits: GrowthLimits) -> NDArray[np.uint8]:
    """Grow the road's region upward from its bottom row.

    Seeds are the pixels of the bottom row near that row's median. From each pixel of the region the three pixels above
    it join if they are not edges and differ from the pixel below, and from the seed, by no more than allowed.

    Returns 1 inside the region (rows, cols) uint8. Takes `luminance` (rows, cols), `edges` (rows, cols) uint8.
    """
    return region_kernels.grow_upward(luminance, edges, limits, median(luminance[-1]))


def region_medians(luminance: NDArray[np.float32], region: NDArray[np.uint8]) -> SpanMedians:
    """Median of each row's pixels that lie in a region (`luminance` (rows, cols), `region` (rows, cols) uint8)."""
    left = np.zeros(region.shape[0], np.int64)
    return span_medians(luminance, region, left, left + region.shape[1], MOST_SAMPLES, FEWEST_SAMPLES)


def crossing_band(
    region: NDArray[np.uint8],
    luminance: NDArray[np.float32],
    centre: float,
    min_width: int,
    max_width: int,
    hole: int = 2,
) -> Band | None:
    """Widest vertical band inside a region that crosses it from its bottom to its top.

    The road narrows toward the vanishing point: far away the sides of a wide band lie on the verge, whose reflectance
    is another, and what lies far from the vanishing point is verge altogether. So the band is cut to a largest width,
    and of several that reach it the one nearest to the vanishing point's column is taken; of two that are alike in all
    that, the darker one, which shows more of the fog.

    Returns None if no band of that width starts at the bottom row. Takes `region` (rows, cols) uint8, `luminance`
    (rows, cols), `centre` [px], `min_width` [px], `max_width` [px], `hole` [px].
    """
    bottom = region.shape[0] - 1
    tops = region_kernels.column_tops(region, hole)
    top, first, width = region_kernels.highest_band(tops, bottom, min_width, max_width, float(centre), luminance)
    if width == 0:
        return None
    kept = min(width, max_width)
    left = centre - 0.5 * (kept - 1)
    if first < left < first + width - kept and left % 1.0 == 0.5:
        # Between two columns: one less lies in the middle.
        kept, left = kept - 1, left + 0.5
    left = min(max(round(left), first), first + width - kept)
    return Band(left, left + kept - 1, top, bottom)
