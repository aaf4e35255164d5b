"""The road's region in the image, and the widest vertical band that crosses it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.light.medians import FEWEST_SAMPLES, MOST_SAMPLES, SpanMedians, median, span_medians


class GrowthLimits(NamedTuple):
    """What a pixel may differ by to join a region that grows upward, see `fogsim.vision.region.road_region`."""

    steps: NDArray[np.float32]  # (rows,): From a neighbour in the row below [linear grey levels]
    from_seed: NDArray[np.float64]  # (rows,): From the seed [linear grey levels]


@kernel
def _grow_upward(
    luminance: NDArray[np.float32], edges: NDArray[np.uint8], limits: GrowthLimits, seed: float
) -> NDArray[np.uint8]:
    """Grow a region from the bottom row upward; see `fogsim.vision.region.road_region.grow_region`.

    Growth only ever goes to the row above, so one sweep from the bottom does what a queue would.

    Takes `luminance` (rows, cols), `edges` (rows, cols) uint8, `seed` [linear grey levels].
    """
    rows, cols = luminance.shape
    region = np.zeros((rows, cols), np.uint8)
    for col in range(cols):
        near_seed = abs(luminance[rows - 1, col] - seed) <= limits.from_seed[rows - 1]
        region[rows - 1, col] = near_seed and edges[rows - 1, col] == 0
    nowhere = np.float32(np.inf)
    # What lies below and belongs to the region, with a border; infinite where nothing does: one comparison tells both.
    lower = np.full(cols + 2, nowhere, np.float32)
    for col in range(cols):
        lower[col + 1] = luminance[rows - 1, col] if region[rows - 1, col] != 0 else nowhere
    joined = np.full(cols + 2, nowhere, np.float32)
    for row in range(rows - 2, -1, -1):
        step, apart_most = limits.steps[row], limits.from_seed[row]
        line, marked, target = luminance[row], edges[row], region[row]
        first, last = np.float32(seed - apart_most), np.float32(seed + apart_most)
        before, under, behind, inside = lower[:cols], lower[1 : cols + 1], lower[2:], joined[1 : cols + 1]
        for col in range(cols):
            value = line[col]
            apart = min(abs(value - before[col]), abs(value - under[col]), abs(value - behind[col]))
            inside[col] = value if (apart <= step) & (value >= first) & (value <= last) else nowhere
        for col in range(cols):
            if marked[col] != 0:
                inside[col] = nowhere
            target[col] = inside[col] != nowhere
        lower, joined = joined, lower
    return region


@kernel
def region_tops(region: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Topmost row of each column of a region that has one.

    Returns from left to right; fewer than `cols` if some columns have none (n,) int64. Takes `region` (rows, cols)
    uint8.
    """
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


@kernel
def _column_tops(region: NDArray[np.uint8], hole: int) -> NDArray[np.int64]:
    """Row to which each column of a region reaches unbroken from the bottom.

    Returns `rows` for a column that does not start at the bottom (cols,) int64. Takes `region` (rows, cols) uint8,
    `hole` [px].
    """
    rows, cols = region.shape
    tops, filled = np.full(cols, rows, np.int32), np.empty(cols, np.int32)
    for row in range(rows - 1, -1, -1):
        line, here, reach = region[row], np.int32(row), np.int32(row + hole + 1)
        # Without a branch and with numbers of one size, so that the loop runs in vector registers.
        for col in range(cols):
            filled[col] = line[col]
        for col in range(cols):
            tops[col] = here if (tops[col] <= reach) & (filled[col] != 0) else tops[col]
    return tops.astype(np.int64)


@kernel
def _best_run(
    tops: NDArray[np.int64], top: int, enough: int, centre: float, luminance: NDArray[np.float32]
) -> tuple[int, int]:
    """First column and width of the widest run of columns that reach up to row `top` or higher.

    Width beyond `enough` does not count; of equals the run nearest to column `centre` is taken, of equally near ones
    the wider one, then the one whose columns reach higher, and then the one of least `luminance` (rows, cols): neither
    side comes first.
    """
    best_start, best_width, best_offset, start = 0, 0, np.inf, 0
    for col in range(tops.size + 1):
        if col < tops.size and tops[col] <= top:
            continue
        width, counted = col - start, min(col - start, enough)
        offset = max(start - centre, centre - (col - 1), 0.0)
        better, equal = counted > min(best_width, enough), counted == min(best_width, enough)
        nearer = better or (equal and offset < best_offset)
        alike = equal and offset == best_offset
        if (
            nearer
            or (alike and width > best_width)
            or (alike and width == best_width > 0 and _comes_first(tops, luminance, start, best_start, width))
        ):
            best_start, best_width, best_offset = start, width, offset
        start = col + 1
    return best_start, best_width


@kernel
def _comes_first(tops: NDArray[np.int64], luminance: NDArray[np.float32], start: int, other: int, width: int) -> bool:
    """Whether a run's columns reach higher than those of another of its width, or as high and are darker."""
    reach, others = tops[start : start + width].sum(), tops[other : other + width].sum()
    if reach != others:
        return bool(reach < others)
    light = 0.0
    for row in range(len(luminance)):
        for col in range(width):
            light += luminance[row, start + col] - luminance[row, other + col]
    return light < 0.0


@kernel
def _highest_band(
    tops: NDArray[np.int64], bottom: int, min_width: int, enough: int, centre: float, luminance: NDArray[np.float32]
) -> tuple[int, int, int]:
    """Highest row that neighbouring columns reach, and the best run of them.

    Returns top row, first column, width; the width is 0 where no band is wide enough. Takes `tops` (cols,) int64,
    `centre` [px], `luminance` (rows, cols).
    """
    # Only where a column ends can a band appear that was not there a row higher.
    for top in np.unique(tops):
        if top >= bottom:
            break
        start, width = _best_run(tops, top, enough, centre, luminance)
        if width >= min_width:
            return top, start, width
    return bottom, 0, 0


@dataclass(frozen=True, slots=True)
class Band:
    """A vertical band of an image; rows and columns are counted in the image that it was found in."""

    # left, right: first and last column [px]
    left: int
    right: int
    # top, bottom: first and last row [px]
    top: int
    bottom: int

    def moved(self, columns: int) -> "Band":
        """The same band in an image that begins so many columns before this one."""
        return Band(self.left + columns, self.right + columns, self.top, self.bottom)


def cumulative_limits(steps: NDArray[np.float32], seed_tolerance: float) -> GrowthLimits:
    """Limits that follow from what fog and noise allow between rows (negru2013 section IV.B.b after Hautière 2006).

    A pixel may differ from the seed by no more than the sum of the steps on the way.

    Takes `steps` (rows,) [linear grey levels], `seed_tolerance` [linear grey levels].
    """
    upward = np.concatenate(([seed_tolerance], steps[-2::-1].astype(np.float64)))
    return GrowthLimits(steps, np.ascontiguousarray(upward.cumsum()[::-1]))


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
    return _grow_upward(luminance, edges, limits, median(luminance[-1]))


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
    tops = _column_tops(region, hole)
    top, first, width = _highest_band(tops, bottom, min_width, max_width, float(centre), luminance)
    if width == 0:
        return None
    kept = min(width, max_width)
    left = centre - 0.5 * (kept - 1)
    if first < left < first + width - kept and left % 1.0 == 0.5:
        # Between two columns: one less lies in the middle.
        kept, left = kept - 1, left + 0.5
    left = min(max(round(left), first), first + width - kept)
    return Band(left, left + kept - 1, top, bottom)
