"""Compiled row statistics of strips of road and of rows of sky, read straight from the pixels that they need."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

MOST_SAMPLES = 64
"""Pixels that one row's statistic is made of; more cost time and gain little beside the road's own texture."""

KEPT = 2.5
"""Half-width of the core of a row, in its robust standard deviations: marks and other narrow things lie outside."""


@kernel
def _light(pixels: NDArray[np.uint8] | NDArray[np.uint16], tables: NDArray[np.float32], row: int, col: int) -> float:
    total = np.float32(0.0)
    for channel in range(pixels.shape[2]):
        total += tables[channel, pixels[row, col, channel]]
    return float(total)


@kernel
def _core(samples: NDArray[np.float32], count: int, floor: float) -> tuple[float, float]:
    """Mean and deviation of what lies near the median of the first `count` samples."""
    ordered = np.sort(samples[:count])
    middle = 0.5 * (ordered[(count - 1) // 2] + ordered[count // 2])
    apart = np.sort(np.abs(ordered - middle))
    reach = KEPT * max(1.4826 * float(apart[count // 2]), floor)
    total, square, kept = 0.0, 0.0, 0
    for value in ordered:
        offset = float(value) - middle
        if abs(offset) <= reach:
            total += offset
            square += offset * offset
            kept += 1
    mean = total / kept
    return middle + mean, math.sqrt(max(square / kept - mean * mean, 0.0))


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
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Mean and deviation of the core of each bin of rows of one strip, and how many pixels that is of.

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
    mean, deviation, number = np.zeros(count), np.zeros(count), np.zeros(count, np.int64)
    samples = np.empty(MOST_SAMPLES, np.float32)
    for i in range(count):
        low, width, height = left[i], right[i] - left[i], last[i] - first[i] + 1
        if width < 2.0:
            continue
        wanted = int(min(width * height, float(MOST_SAMPLES)))
        hides = first[i] <= hidden_above
        taken = 0
        for j in range(wanted):
            # Rows of the bin in turn, columns evenly: neighbouring samples do not share a row.
            row = first[i] + j % height
            col = min(max(math.floor(low + (j + 0.5) * width / wanted + 0.5), 0), cols - 1)
            if hides and hidden_from <= col <= hidden_to:
                continue
            samples[taken] = _light(pixels, tables, row, col)
            taken += 1
        if taken < 2 or taken < 0.25 * wanted:
            continue
        mean[i], deviation[i] = _core(samples, taken, floor)
        number[i] = taken
    return mean, deviation, number


@kernel
def sky_rows(
    pixels: NDArray[np.uint8] | NDArray[np.uint16],
    tables: NDArray[np.float32],
    rows: NDArray[np.int64],
    left: int,
    right: int,
    floor: float,
) -> NDArray[np.float64]:
    """Brightness of the bright part of each row: of the sky, where trees and vehicles stand before it.

    Starts at the row's upper quartile and moves to the mean of what lies near, so that up to about half of the row may
    be covered by what is darker.
    """
    out = np.zeros(rows.size)
    samples = np.empty(MOST_SAMPLES, np.float32)
    count = min(MOST_SAMPLES, right - left)
    for i in range(rows.size):
        for j in range(count):
            col = left + int((j + 0.5) * (right - left) / count)
            samples[j] = _light(pixels, tables, rows[i], col)
        ordered = np.sort(samples[:count])
        centre = float(ordered[(3 * count) // 4])
        upper = float(ordered[count - 1 - count // 20]) - centre
        reach = max(3.0 * upper, 3.0 * floor)
        for _ in range(4):
            total, kept = 0.0, 0
            for value in ordered:
                if abs(float(value) - centre) <= reach:
                    total += float(value)
                    kept += 1
            centre = total / kept
        out[i] = centre
    return out


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
        for col in range(0, cols - 1, 2 * step):
            if count < apart.size:
                apart[count] = abs(_light(pixels, tables, row, col) - _light(pixels, tables, row, col + 1))
                count += 1
    # The root of the mean square of the lower three quarters stands for all: medians of whole numbers jump.
    ordered = np.sort(apart[:count])
    kept = max((3 * count) // 4, 1)
    square = 0.0
    for i in range(kept):
        square += ordered[i] * ordered[i]
    # For a normal difference of deviation √2 σ, the lower three quarters have a mean square of 0.3692 · 2 σ².
    return math.sqrt(square / kept / (2.0 * 0.3692))
