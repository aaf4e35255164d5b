"""Compiled medians of bins of rows."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.light.pixel_kernels import even_column

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SKY_SHARE, _SKY_REACH = 7, 0.012
"""Part of a row of sky (one in so many) that is at least seen, and half the width of its pixel values, relative [-]."""

_MOST_COLUMNS, _MOST_ROWS = 80, 4
"""Most pixels of a row, and rows of a bin, that are read."""

_TAIL = 0.04
"""Share of the pixels of a strip beyond either level whose difference is its contrast [-]."""


class RowBins(NamedTuple):
    """Bins of rows, the highest first."""

    # first, last (n,) int64: rows
    first: Ints
    last: Ints
    # left, right (n,) int64: first and last columns
    left: Ints
    right: Ints
    # outer_left, outer_right (n,) int64: the same of a wider strip of road, over which contrast is looked for
    outer_left: Ints
    outer_right: Ints


@kernel
def bright_part(seen: Floats) -> tuple[float, float]:
    """Mean of those pixels of sky that are alike near the brightest, and their mean distance from it (`seen` (n,))."""
    count = seen.size
    centre = seen[count - 1 - count // _SKY_SHARE]
    spread = seen[count - 1 - count // 20] - seen[count - 1 - count // 3]
    reach = max(_SKY_REACH * centre, min(1.5 * spread, 3.0 * _SKY_REACH * centre))
    apart = 0.0
    for _ in range(4):
        total, kept, apart = 0.0, 0, 0.0
        for value in seen:
            if abs(value - centre) <= reach:
                total += value
                apart += abs(value - centre)
                kept += 1
        centre, apart = total / max(kept, 1), apart / max(kept, 1)
    return centre, apart


@kernel
def bin_medians(image: NDArray[Any], bins: RowBins, channel: int, sky_end: int, out: Floats) -> None:
    """Median of each bin, and the median distance from it [pixel values].

    Takes `image` (rows, cols, channels) uint8, `out` (3, n).
    """
    values = np.empty(_MOST_COLUMNS * _MOST_ROWS)
    for i in range(bins.first.size):
        rows = min(bins.last[i] - bins.first[i] + 1, _MOST_ROWS)
        columns = min(bins.right[i] - bins.left[i] + 1, _MOST_COLUMNS)
        count = 0
        for a in range(rows):
            row = bins.first[i] + (2 * a + 1) * (bins.last[i] - bins.first[i] + 1) // (2 * rows)
            for b in range(columns):
                column = even_column(b, columns, bins.left[i] - 0.5, bins.right[i] + 0.5)
                values[count] = image[row, column, channel]
                count += 1
        seen = np.sort(values[:count])
        middle = 0.5 * (seen[(count - 1) // 2] + seen[count // 2])
        apart = np.sort(np.abs(seen - middle))
        # Of values in whole levels the median jumps: the mean of the middle half stands for it.
        quarter = count // 4
        out[0, i] = seen[quarter : count - quarter].mean()
        out[1, i] = apart[count // 2]
        if bins.last[i] < sky_end:
            # Trees and houses hide sky on both sides: what is alike near the brightest counts.
            out[0, i], out[1, i] = bright_part(seen)
        row = (bins.first[i] + bins.last[i]) // 2
        count = min(bins.outer_right[i] - bins.outer_left[i] + 1, _MOST_COLUMNS)
        for b in range(count):
            column = even_column(b, count, bins.outer_left[i] - 0.5, bins.outer_right[i] + 0.5)
            values[b] = image[row, column, channel]
        seen = np.sort(values[:count])
        tail = int(_TAIL * count)
        out[2, i] = seen[count - 1 - tail] - seen[tail]
