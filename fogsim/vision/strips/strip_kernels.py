"""Compiled row statistics of strips of road and of rows of sky, read straight from the pixels that they need."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.light.medians import MOST_SAMPLES, median_of_few
from fogsim.vision.light.pixel_kernels import LinearPixels, even_column, pixel_luminance

_LEAST_DEVIATION = 0.1
"""Least deviation of a bin's mean: what quantisation leaves [linear grey levels]."""

_QUIET, _SMOOTHED = 0.3, 1.0
"""Pixel noise, in levels, below which an image was compressed, and the deviation that this leaves in a mean [-]."""

_KEPT = 2.5
"""Half-width of the core of a row, in its robust standard deviations: marks and other narrow things lie outside."""

_MOST_COLUMNS = 128
"""Columns of a row that are looked at for airlight, or up to twice as many."""


class StripBins(NamedTuple):
    """Where the bins of one strip of road are."""

    rows: NDArray[np.int64]  # (2, n) int64: First and last row of each bin
    sides: NDArray[np.float64]  # (2, n): Columns between which the strip lies on each bin
    pieces: NDArray[np.float64]  # (n,): Pieces of road in each bin whose albedo counts as independent


@kernel
def row_bins(horizon: float, top: int, bottom: int, whole_rows: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last row of bins from the bottom up to a top row; their height grows with their rows below the horizon.

    Takes `horizon` [px], `whole_rows` [px].
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
def _core(samples: NDArray[np.float32], ordered: NDArray[np.float32], floor: float) -> tuple[float, float, float]:
    """Mean and deviation of what lies near the median of samples; mean distance of all from it.

    `ordered` is as many numbers of room.
    """
    count, middle = samples.size, median_of_few(samples, ordered)
    # The nearest half of sorted samples is a run of them: take ends away, the farther first, until it is left.
    low, high, apart = 0, count - 1, np.float32(0.0)
    for _ in range(count - count // 2):
        below, above = middle - ordered[low], ordered[high] - middle
        apart = max(below, above)
        if below > above:
            low += 1
        else:
            high -= 1
    reach = _KEPT * max(1.4826 * float(apart), floor)
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
def strip_bins(
    image: LinearPixels,
    table: NDArray[np.float32],
    bins: StripBins,
    vehicle: NDArray[np.float64],
    limits: NDArray[np.float64],
    noise: float,
    out: NDArray[np.float64],
    again: bool,
) -> None:
    """Luminance of the core of each bin of rows of one strip, its variance, and the scatter of the whole bin.

    Takes `table` (levels,), `vehicle` (3,), `limits` (2, n) [linear grey levels], `noise` [linear grey levels], `out`
    (3, n).
    """
    cols, rows, sides = image.pixels.shape[1], bins.rows, bins.sides
    samples, ordered = np.empty(MOST_SAMPLES, np.float32), np.empty(MOST_SAMPLES, np.float32)
    for i in range(rows.shape[1]):
        low, width, height = sides[0, i], sides[1, i] - sides[0, i], rows[1, i] - rows[0, i] + 1
        hides = rows[0, i] <= vehicle[2]
        beside = sides[1, i] < vehicle[0] - 1.0 or low > vehicle[1] + 1.0
        if again and (not hides or beside or out[1, i] <= 0.0):
            continue
        out[:, i] = 0.0
        if width < 2.0:
            continue
        # An even number: the middle one of an odd number would lie between two columns.
        pairs = int(min(width * height, float(MOST_SAMPLES))) // 2
        wanted, step, row, taken = 2 * pairs, 0.5 * width / pairs, rows[0, i], 0
        for j in range(pairs):
            # Rows of the bin in turn, columns evenly from both sides inward: a mirrored image gives the same.
            apart = (j + 0.5) * step + 0.5
            for col in (math.floor(low + apart), math.ceil(sides[1, i] - apart)):
                if not (hides and vehicle[0] <= col <= vehicle[1]):
                    value = pixel_luminance(image, row, min(max(col, 0), cols - 1))
                    if limits[0, i] <= value <= limits[1, i]:
                        samples[taken] = value
                        taken += 1
            row = row + 1 if row < rows[1, i] else rows[0, i]
        if taken < 2 or taken < 0.25 * wanted:
            continue
        mean, deviation, scatter = _core(samples[:taken], ordered[:taken], max(noise, 2.0 * _LEAST_DEVIATION))
        texture = max(deviation**2 - noise**2, 0.0) / min(float(taken), bins.pieces[i])
        out[0, i], out[2, i] = mean, scatter
        out[1, i] = noise**2 / taken + texture + _LEAST_DEVIATION**2 + _coarseness(mean, deviation, noise, table)


@kernel
def _coarseness(mean: float, deviation: float, noise: float, table: NDArray[np.float32]) -> float:
    """Variance of means by rounding to levels, and by compression, which does away with noise and faint gradients."""
    place = min(max(int(np.searchsorted(table, mean)) - 1, 0), table.size - 2)
    level = max(float(table[place + 1] - table[place]), 1e-6)
    # Rounding does not average out where nothing dithers it: 1/√12 of a level without noise, nothing from half on.
    rounding = math.exp(-4.0 * (math.pi * deviation / level) ** 2) / 12.0
    quiet = max(1.0 - noise / (_QUIET * level), 0.0)
    return level**2 * (rounding + (_SMOOTHED * quiet) ** 2)


@kernel
def middle_levels(image: LinearPixels, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """Median luminance of the middle third of rows [linear grey levels] (`rows` (n,) int64)."""
    cols = image.pixels.shape[1]
    samples, ordered = np.empty(24, np.float32), np.empty(24, np.float32)
    left, right, out = cols // 3 - 0.5, cols - cols // 3 - 0.5, np.empty(rows.size)
    for i in range(rows.size):
        for j in range(samples.size):
            samples[j] = pixel_luminance(image, rows[i], even_column(j, samples.size, left, right))
        out[i] = median_of_few(samples, ordered)
    return out


@kernel
def airlight_shares(
    image: LinearPixels, rows: NDArray[np.int64], columns: tuple[int, int], airlight: float, alike: float
) -> NDArray[np.float64]:
    """Shares of rows' pixels that are as bright as the airlight [-].

    Takes `rows` (n,) int64, `columns` (int, int), `airlight` [linear grey levels].
    """
    shares: NDArray[np.float64] = np.zeros(rows.size)
    step = max((columns[1] - columns[0]) // _MOST_COLUMNS, 1)
    for i in range(rows.size):
        count = 0
        for column in range(columns[0], columns[1], step):
            count += 1
            shares[i] += abs(pixel_luminance(image, rows[i], column) - airlight) < alike * airlight
        shares[i] /= max(count, 1)
    return shares
