"""Compiled growth of regions, and the widest band that crosses one.

Every kernel is called with the dtypes named in its docstring and C-contiguous arrays, so that it compiles once.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel


class GrowthLimits(NamedTuple):
    """What a pixel may differ by to join a region that grows upward, see `fogsim.vision.region.road_region`."""

    steps: NDArray[np.float32]  # (rows,): From a neighbour in the row below [linear grey levels]
    from_seed: NDArray[np.float64]  # (rows,): From the seed [linear grey levels]


@kernel
def grow_upward(
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
def column_tops(region: NDArray[np.uint8], hole: int) -> NDArray[np.int64]:
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
def highest_band(
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
