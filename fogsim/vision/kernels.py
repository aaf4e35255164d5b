"""Compiled inner loops of the image operations: plain contiguous arrays in, plain arrays out, one thread.

Every kernel is called with the dtypes named in its docstring and C-contiguous arrays, so that it compiles once.
"""

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

Pixels = NDArray[np.uint8] | NDArray[np.uint16]

RED, GREEN, BLUE = np.float32(0.2126), np.float32(0.7152), np.float32(0.0722)


@kernel
def grey_luminance(image: Pixels, table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Look every pixel up: (rows, cols) uint8 or uint16 and (2^bits,) float32 to (rows, cols) float32."""
    rows, cols = image.shape
    out = np.empty((rows, cols), np.float32)
    for row in range(rows):
        for col in range(cols):
            out[row, col] = table[image[row, col]]
    return out


@kernel
def colour_luminance(image: Pixels, table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Look every channel up and weigh them: (rows, cols, 3) uint8 or uint16 to (rows, cols) float32."""
    rows, cols, _ = image.shape
    red, green, blue = table * RED, table * GREEN, table * BLUE
    out = np.empty((rows, cols), np.float32)
    for row in range(rows):
        for col in range(cols):
            pixel = image[row, col]
            out[row, col] = red[pixel[0]] + green[pixel[1]] + blue[pixel[2]]
    return out


@kernel
def grow_upward(
    luminance: NDArray[np.float32],
    edges: NDArray[np.uint8],
    steps: NDArray[np.float32],
    seed: float,
    seed_tolerance: float,
) -> NDArray[np.uint8]:
    """Grow a region from the bottom row upward; see `fogsim.vision.region.grow_region`.

    Growth only ever goes to the row above, so one sweep from the bottom does what a queue would.
    """
    rows, cols = luminance.shape
    region = np.zeros((rows, cols), np.uint8)
    for col in range(cols):
        near_seed = abs(luminance[rows - 1, col] - seed) <= seed_tolerance
        region[rows - 1, col] = near_seed and edges[rows - 1, col] == 0
    drift = seed_tolerance
    for row in range(rows - 2, -1, -1):
        step = steps[row]
        drift += step
        for col in range(cols):
            value = luminance[row, col]
            if edges[row, col] != 0 or abs(value - seed) > drift:
                continue
            for below in range(max(col - 1, 0), min(col + 2, cols)):
                if region[row + 1, below] != 0 and abs(value - luminance[row + 1, below]) <= step:
                    region[row, col] = 1
                    break
    return region


@kernel
def column_tops(region: NDArray[np.uint8], hole: int) -> NDArray[np.int64]:
    """Row to which each column of a (rows, cols) uint8 region reaches unbroken from the bottom.

    Gaps of up to `hole` pixels are stepped over; a column that does not start at the bottom gets `rows`.
    """
    rows, cols = region.shape
    tops = np.full(cols, rows, np.int64)
    for col in range(cols):
        for row in range(rows - 1, -1, -1):
            if region[row, col] != 0:
                tops[col] = row
            elif tops[col] - row > hole:
                break
    return tops


@kernel
def best_run(tops: NDArray[np.int64], top: int, enough: int, centre: float) -> tuple[int, int]:
    """First column and width of the widest run of columns that reach up to row `top` or higher.

    Width beyond `enough` does not count; of equals the run nearest to column `centre` is taken.
    """
    best_start, best_width, best_offset, start = 0, 0, np.inf, 0
    for col in range(tops.size + 1):
        if col < tops.size and tops[col] <= top:
            continue
        counted = min(col - start, enough)
        offset = max(start - centre, centre - (col - 1), 0.0)
        if counted > min(best_width, enough) or (counted == min(best_width, enough) and offset < best_offset):
            best_start, best_width, best_offset = start, col - start, offset
        start = col + 1
    return best_start, best_width


@kernel
def highest_band(
    tops: NDArray[np.int64], bottom: int, min_width: int, enough: int, centre: float
) -> tuple[int, int, int]:
    """Highest row that at least `min_width` neighbouring columns reach, and the best run of such columns.

    Returns
    -------
    tuple of int
        Top row, first column, width; the width is 0 where no band is wide enough.
    """
    for top in range(bottom):
        start, width = best_run(tops, top, enough, centre)
        if width >= min_width:
            return top, start, width
    return bottom, 0, 0


@kernel
def isotonic_decreasing(values: NDArray[np.float64]) -> NDArray[np.float64]:
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
