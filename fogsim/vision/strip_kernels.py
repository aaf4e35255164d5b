"""Compiled row statistics of strips of road and of rows of sky, read straight from the pixels that they need."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

MOST_SAMPLES = 64
"""Pixels that one row's statistic is made of; more cost time and gain little beside the road's own texture."""

SKY_SHARE, SKY_WIDTH = 7, 0.012
"""Part of a row (one in so many) that sky must fill to be found, and half the width of its luminances, relative [-]."""

LEAST_SKY_ROWS = 4
"""Rows of sky before it can end downward."""

LEAST_SKY_HEIGHT, STEEPEST_SKY = 0.04, 0.8
"""Height that rows must span to show how the sky brightens upward [rad], and most that it does [1/rad]."""

KEPT = 2.5
"""Half-width of the core of a row, in its robust standard deviations: marks and other narrow things lie outside."""


@kernel
def light(pixels: NDArray[np.uint8] | NDArray[np.uint16], tables: NDArray[np.float32], row: int, col: int) -> float:
    """Luminance of a pixel [linear grey levels]."""
    total = np.float32(0.0)
    for channel in range(pixels.shape[2]):
        total += tables[channel, pixels[row, col, channel]]
    return float(total)


@kernel
def row_bins(horizon: float, top: int, bottom: int, whole_rows: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last row of bins from the bottom up to a top row; their height grows with their rows below the horizon.

    Parameters
    ----------
    horizon : float
        Row of the horizon [px].
    top, bottom : int
        First and last row.
    whole_rows : float
        Rows below the horizon up to which every row is a bin of its own [px].
    """
    first, last = np.empty(max(bottom - top + 1, 0), np.int64), np.empty(max(bottom - top + 1, 0), np.int64)
    row, count = bottom, 0
    while row >= top:
        height = max(int((row - horizon) / whole_rows), 1)
        first[count], last[count] = max(row - height + 1, top), row
        row -= height
        count += 1
    return first[:count].copy(), last[:count].copy()


@kernel
def _core(samples: NDArray[np.float32], count: int, floor: float) -> tuple[float, float, float]:
    """Mean and deviation of what lies near the median of the first `count` samples; mean distance of all from it."""
    ordered = samples[:count]
    ordered.sort()
    middle = 0.5 * (ordered[(count - 1) // 2] + ordered[count // 2])
    # The nearest half of sorted samples is a run of them: take ends away, the farther first, until it is left.
    low, high, apart = 0, count - 1, np.float32(0.0)
    for _ in range(count - count // 2):
        below, above = middle - ordered[low], ordered[high] - middle
        apart = max(below, above)
        if below > above:
            low += 1
        else:
            high -= 1
    reach = KEPT * max(1.4826 * float(apart), floor)
    total, square, kept, away = 0.0, 0.0, 0, 0.0
    for value in ordered:
        offset = float(value) - middle
        away += abs(offset)
        if abs(offset) <= reach:
            total += offset
            square += offset * offset
            kept += 1
    mean = total / kept
    return middle + mean, math.sqrt(max(square / kept - mean * mean, 0.0)), away / count


@kernel
def strip_rows(
    pixels: NDArray[np.uint8] | NDArray[np.uint16],
    tables: NDArray[np.float32],
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    left: NDArray[np.float64],
    right: NDArray[np.float64],
    hidden_from: float,
    hidden_to: float,
    hidden_above: float,
    floor: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Mean and deviation of the core of each bin of rows of one strip, scatter of the whole bin, and number of pixels.

    Parameters
    ----------
    pixels : (rows, cols, channels) uint8 or uint16
        The image.
    tables : (channels, levels) float32
        Linear grey levels that each channel adds.
    first, last : (n,) int64
        Rows of each bin.
    left, right : (n,) float64
        Columns between which the strip lies on each bin.
    hidden_from, hidden_to : float
        Columns between which an obstacle hides the road on rows up from `hidden_above`.
    hidden_above : float
        Row of that obstacle's foot.
    floor : float
        Least deviation that a core has [linear grey levels].
    """
    cols = pixels.shape[1]
    count = first.size
    mean, deviation, scatter = np.zeros(count), np.zeros(count), np.zeros(count)
    number = np.zeros(count, np.int64)
    samples = np.empty(MOST_SAMPLES, np.float32)
    for i in range(count):
        low, width, height = left[i], right[i] - left[i], last[i] - first[i] + 1
        if width < 2.0:
            continue
        # An even number: the middle one of an odd number would lie between two columns.
        wanted = int(min(width * height, float(MOST_SAMPLES))) // 2 * 2
        hides = first[i] <= hidden_above
        taken = 0
        for j in range(wanted):
            # Rows of the bin in turn, columns evenly: a mirrored image gives the same.
            row = first[i] + min(j, wanted - 1 - j) % height
            col = min(max(math.floor(low + (j + 0.5) * width / wanted + 0.5), 0), cols - 1)
            if hides and hidden_from <= col <= hidden_to:
                continue
            samples[taken] = light(pixels, tables, row, col)
            taken += 1
        if taken < 2 or taken < 0.25 * wanted:
            continue
        mean[i], deviation[i], scatter[i] = _core(samples, taken, floor)
        number[i] = taken
    return mean, deviation, scatter, number


@kernel
def sky_rows(
    pixels: NDArray[np.uint8] | NDArray[np.uint16],
    tables: NDArray[np.float32],
    rows: NDArray[np.int64],
    left: int,
    right: int,
    floor: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Brightness of the bright part of each row: of the sky, where trees and vehicles stand before it.

    Starts near the row's brightest and moves to the mean of what lies near, so that what is darker may cover most of
    the row. The second of the two arrays is the share of the row that is as bright.
    """
    bright, share = np.zeros(rows.size), np.zeros(rows.size)
    samples = np.empty(MOST_SAMPLES, np.float32)
    count = min(MOST_SAMPLES, right - left)
    for i in range(rows.size):
        for j in range(count):
            col = left + int((j + 0.5) * (right - left) / count)
            samples[j] = light(pixels, tables, rows[i], col)
        ordered = np.sort(samples[:count])
        centre, kept = float(ordered[count - 1 - count // SKY_SHARE]), 0
        reach = max(2.5 * floor, SKY_WIDTH * centre)
        for _ in range(4):
            total, kept = 0.0, 0
            for value in ordered:
                if abs(float(value) - centre) <= reach:
                    total += float(value)
                    kept += 1
            centre = total / kept
        bright[i], share[i] = centre, kept / count
    return bright, share


@kernel
def level_at_horizon(
    bright: NDArray[np.float64], height: NDArray[np.float64], step: float
) -> tuple[float, float, float, float]:
    """Brightness of the sky at the horizon, from that of rows above it (Theil and Sen's robust straight line).

    Where rows darken downward by more than `step` from one to the next, something stands before the sky, and the rows
    below say nothing.

    Parameters
    ----------
    bright : (n,) float64
        Brightness of rows, the highest first.
    height : (n,) float64
        Their height above the horizon.
    step : float
        Darkening that is no sky's, as a share.

    Returns
    -------
    tuple of float
        Brightness at height 0, slope, robust deviation of the rows from the line, height of the lowest row in use.
    """
    drops = np.zeros(bright.size)
    count = 1
    for i in range(1, bright.size):
        usual = max(float(np.median(drops[1:i])), 0.0) if i > 1 else 0.0
        drops[i] = bright[i - 1] - bright[i]
        twice = bright[max(i - 2, 0)] - bright[i]
        least = step * bright[i - 1]
        if count >= LEAST_SKY_ROWS and (drops[i] > least + 2.0 * usual or twice > 1.5 * least + 4.0 * usual):
            break
        count = i + 1
    slopes = np.zeros(count * (count - 1) // 2 + 1)
    number = 0
    for i in range(count):
        for j in range(i):
            slopes[number] = (bright[i] - bright[j]) / (height[i] - height[j])
            number += 1
    middle, slope = float(np.median(bright[:count])), 0.0
    if height[0] - height[count - 1] > LEAST_SKY_HEIGHT:
        slope = min(max(float(np.median(slopes[:number])), -STEEPEST_SKY * middle), STEEPEST_SKY * middle)
    rest = bright[:count] - slope * height[:count]
    level = float(np.median(rest))
    return level, slope, 1.4826 * float(np.median(np.abs(rest - level))), height[count - 1]


@kernel
def pixel_noise(
    pixels: NDArray[np.uint8] | NDArray[np.uint16], tables: NDArray[np.float32], rows: NDArray[np.int64]
) -> float:
    """Robust deviation of single pixels on rows, from the differences of neighbours [linear grey levels]."""
    cols = pixels.shape[1]
    per_row = max((cols - 1) // 2, 1)
    step = max(per_row // 32, 1)
    apart = np.empty(rows.size * (per_row // step + 1))
    count = 0
    for row in rows:
        for col in range(((cols - 2) % (2 * step)) // 2, cols - 1, 2 * step):
            if count < apart.size:
                apart[count] = abs(light(pixels, tables, row, col) - light(pixels, tables, row, col + 1))
                count += 1
    # The root of the mean square of the lower three quarters stands for all: medians of whole numbers jump.
    ordered = np.sort(apart[:count])
    kept = max((3 * count) // 4, 1)
    square = 0.0
    for i in range(kept):
        square += ordered[i] * ordered[i]
    # For a normal difference of deviation √2 σ, the lower three quarters have a mean square of 0.3692 · 2 σ².
    return math.sqrt(square / kept / (2.0 * 0.3692))


@kernel
def saturation(
    pixels: NDArray[np.uint8] | NDArray[np.uint16], largest: int, rows: NDArray[np.int64], side: int
) -> tuple[float, float]:
    """Shares of rows' pixels with all and with some channels saturated, but for `side` columns at either end."""
    cols, channels = pixels.shape[1], pixels.shape[2]
    every, some = 0, 0
    for row in rows:
        for col in range(side, cols - side):
            count = 0
            for channel in range(channels):
                count += pixels[row, col, channel] == largest
            every += count == channels
            some += count > 0
    total = max(rows.size * (cols - 2 * side), 1)
    return every / total, some / total


@kernel
def middle_levels(
    pixels: NDArray[np.uint8] | NDArray[np.uint16], tables: NDArray[np.float32], rows: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Median of the middle third of each row (n,) [linear grey levels]."""
    cols = pixels.shape[1]
    out, samples = np.empty(rows.size), np.empty(24, np.float32)
    for i in range(rows.size):
        for j in range(samples.size):
            samples[j] = light(pixels, tables, rows[i], cols // 3 + int((j + 0.5) * (cols // 3) / samples.size))
        samples.sort()
        out[i] = 0.5 * (float(samples[(samples.size - 1) // 2]) + float(samples[samples.size // 2]))
    return out
