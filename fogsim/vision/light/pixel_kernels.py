"""Compiled luminance of pixels: looked up, weighed and added.

Every kernel is called with the dtypes named in its docstring and C-contiguous arrays, so that it compiles once.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.units import LUMINANCE_WEIGHTS

Pixels = NDArray[np.uint8] | NDArray[np.uint16]

_RED, _GREEN, _BLUE = (np.float32(share) for share in LUMINANCE_WEIGHTS)


class LinearPixels(NamedTuple):
    """An image with what makes light of its values, see `fogsim.vision.light.luminance.linear_pixels`."""

    pixels: Pixels  # (rows, cols, channels) uint8: Contiguous
    tables: NDArray[np.float32]  # (channels, levels): Linear grey levels that each channel adds


@kernel
def grey_luminance(image: Pixels, table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Look every pixel up.

    Returns luminance [linear grey levels] (rows, cols). Takes `image` (rows, cols) uint8.
    """
    rows, cols = image.shape
    out = np.empty((rows, cols), np.float32)
    for row in range(rows):
        for col in range(cols):
            out[row, col] = table[image[row, col]]
    return out


@kernel
def colour_luminance(image: Pixels, table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Look every channel up and weigh them.

    Returns luminance [linear grey levels] (rows, cols). Takes `image` (rows, cols, 3) uint8.
    """
    rows, cols, _ = image.shape
    red, green, blue = table * _RED, table * _GREEN, table * _BLUE
    out = np.empty((rows, cols), np.float32)
    for row in range(rows):
        for col in range(cols):
            pixel = image[row, col]
            out[row, col] = red[pixel[0]] + green[pixel[1]] + blue[pixel[2]]
    return out


@kernel
def pixel_luminance(image: LinearPixels, row: int, col: int) -> float:
    """Luminance of a pixel [linear grey levels]."""
    pixels, tables = image.pixels, image.tables
    if pixels.shape[2] == 1:
        return float(tables[0, pixels[row, col, 0]])
    return float(tables[0, pixels[row, col, 0]] + tables[1, pixels[row, col, 1]] + tables[2, pixels[row, col, 2]])


@kernel
def part_luminance(image: LinearPixels, rows: NDArray[np.int64], left: int, right: int) -> NDArray[np.float32]:
    """Luminance of rows (n,) int64, and of columns up to the right one [linear grey levels]."""
    cols = max(right - left, 0)
    out, part = np.empty((rows.size, cols), np.float32), image.pixels[:, left : left + cols]
    for i in range(rows.size):
        row_luminance(part, image.tables, rows[i], out[i])
    return out


@kernel
def row_luminance(pixels: Pixels, tables: NDArray[np.float32], row: int, line: NDArray[np.float32]) -> None:
    """Luminance of all pixels of a row (`line` (cols,) [linear grey levels])."""
    seen = pixels[row]
    if pixels.shape[2] == 3:
        red, green, blue = tables[0], tables[1], tables[2]
        for col in range(line.size):
            line[col] = red[seen[col, 0]] + green[seen[col, 1]] + blue[seen[col, 2]]
    else:
        for col in range(line.size):
            line[col] = tables[0, seen[col, 0]]


@kernel
def even_column(j: int, count: int, left: float, right: float) -> int:
    """Column of one of several samples evenly between two sides [px]; those of a mirrored image are mirrored.

    Takes `left`, `right` [px].
    """
    apart = (min(j, count - 1 - j) + 0.5) * (right - left) / count
    return math.floor(left + apart + 0.5) if 2 * j < count else math.ceil(right - apart - 0.5)


SATURATED_SHARE = 0.02
"""Share of the sky's pixels at the largest value from which on its brightness is not what its mean says [-]."""


@kernel
def saturation(image: LinearPixels, rows: NDArray[np.int64], side: int) -> tuple[float, float]:
    """Shares of pixels saturated in the least saturated channel, and in any (`rows` (n,) int64).

    Noise is each channel's own: where it comes after clipping, a channel of a clipped sky is saturated in more than
    half of the pixels, but all channels are at once in far fewer.
    """
    pixels, largest = image.pixels, image.tables.shape[1] - 1
    cols, channels = pixels.shape[1], pixels.shape[2]
    each, some = np.zeros(channels), 0
    for row in rows:
        most = 0
        for value in pixels[row].ravel()[side * channels : (cols - side) * channels]:
            most = max(most, value)
        for col in range(side, cols - side if most == largest else side):
            is_any = False
            for channel in range(channels):
                is_saturated = pixels[row, col, channel] == largest
                each[channel] += is_saturated
                is_any |= is_saturated
            some += is_any
    total = max(rows.size * (cols - 2 * side), 1)
    return each.min() / total, some / total


_MOST_OF_ROW = 0.5
"""Most of a row that the sun and its glow saturate [-]."""


@kernel
def sun_in_sky(image: LinearPixels, rows: NDArray[np.int64], side: int) -> bool:
    """Whether the sun or a lamp shines in rows of sky: it saturates some pixels, none at the image's top or lowest row.

    Takes `rows` (n,) int64, downward, `side` [px].
    """
    if saturation(image, rows, side)[1] <= SATURATED_SHARE:
        return False
    most = max([saturation(image, rows[i : i + 1], side)[1] for i in range(rows.size)])
    ends = max(saturation(image, np.zeros(1, np.int64), 0)[1], saturation(image, rows[-1:], side)[1])
    return most < _MOST_OF_ROW and ends <= SATURATED_SHARE
