"""Medians and quantiles of few numbers, by a search that takes a third of the time of numpy's, and no checks."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

MOST_SAMPLES = 64
"""Pixels that one row's statistic is made of; more cost time and gain little next to the road's own texture."""

FEWEST_SAMPLES = 3
"""Fewest pixels of a row of a region that make a median."""


def columns_apart(image: NDArray[Any], step: int) -> NDArray[Any]:
    """Columns some way apart, from both sides of an image inward: of a mirrored image the same pixels.

    Returns those of the left half from left to right, then those of the right half from right to left (rows, n, …).
    Takes `image` (rows, cols, …).
    """
    cols = image.shape[1]
    # Two slices: numpy takes columns by their numbers several times as slowly.
    return np.concatenate((image[:, : (cols + 1) // 2 : step], image[:, ::-1][:, : cols // 2 : step]), axis=1)


def median(values: NDArray[np.floating[Any]]) -> float:
    """Median of numbers that are all finite (`values` (n, …))."""
    # A copy, of one layout: for others the kernel would be compiled again.
    return median_in(values.flatten())


def quantile(values: NDArray[np.floating[Any]], share: float) -> float:
    """What a share of numbers lie below, linear between neighbours (`values` (n, …))."""
    return quantile_among(values.astype(np.float64).ravel(), share)


def row_medians(values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Median of each row of numbers that are all finite (`values` (rows, n))."""
    return _row_middles(values.copy())


class SpanMedians(NamedTuple):
    """Medians of spans of an image's rows."""

    luminance: NDArray[np.float64]  # (rows,): 0 where there are too few pixels
    number: NDArray[np.int64]  # (rows,) int64: Pixels that the median is of; 0 where there are too few


@kernel
def span_medians(
    luminance: NDArray[np.float32],
    region: NDArray[np.uint8],
    left: NDArray[np.int64],
    right: NDArray[np.int64],
    most: int,
    fewest: int,
) -> SpanMedians:
    """Median of each row's pixels that lie in a region and between two columns.

    Takes `luminance` (rows, cols), `region` (rows, cols) uint8, `left`, `right` (rows,) int64.
    """
    rows, cols = luminance.shape
    medians, counts = np.zeros(rows), np.zeros(rows, np.int64)
    found = np.empty(cols, np.float32)
    for row in range(rows):
        first, last = max(left[row], 0), min(right[row], cols - 1)
        count = 0
        for col in range(first, last + 1, max((last - first + 1) // most, 1)):
            if region[row, col] != 0:
                found[count] = luminance[row, col]
                count += 1
        if count >= fewest:
            medians[row], counts[row] = np.median(found[:count]), count
    return SpanMedians(medians, counts)


@kernel
def sort_few(values: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Sort a few dozen numbers, which quicksort is slow for, by counting for each those that are less.

    Takes `values` (n,), `out` (n,).
    """
    out[:] = np.nan
    # 32 bits, as the numbers have: else half as many fit into a register.
    for i in range(values.size):
        value, before = values[i], np.int32(0)
        for j in range(values.size):
            before += np.int32(values[j] < value)
        out[before] = value
    # Equal ones share a place: those that they leave behind it are theirs.
    for i in range(1, values.size):
        out[i] = out[i - 1] if np.isnan(out[i]) else out[i]


@kernel
def median_of_few(values: NDArray[np.float32], ordered: NDArray[np.float32]) -> float:
    """Median of a few dozen numbers (`values` (n,), `ordered` (n,))."""
    sort_few(values, ordered)
    return 0.5 * (float(ordered[(values.size - 1) // 2]) + float(ordered[values.size // 2]))


@kernel
def _put_in_place(rest: NDArray[np.floating[Any]], place: int) -> None:
    """Exchange numbers until none before a place is greater than those behind it (`rest` (n,))."""
    low, high = 0, rest.size - 1
    while low < high:
        pivot, i, j = rest[(low + high) // 2], low, high
        while i <= j:
            while rest[i] < pivot:
                i += 1
            while pivot < rest[j]:
                j -= 1
            if i <= j:
                rest[i], rest[j] = rest[j], rest[i]
                i += 1
                j -= 1
        if place <= j:
            high = j
        elif place >= i:
            low = i
        else:
            break


@kernel
def median_in(values: NDArray[np.floating[Any]]) -> float:
    """`median` of numbers, whose order changes; the mean of two is in double precision (`values` (n,))."""
    half = values.size // 2
    _put_in_place(values, half)
    if values.size % 2:
        return float(values[half])
    below = values[0]
    for i in range(1, half):
        below = max(below, values[i])
    # numba's float() of single precision is of single precision.
    return 0.5 * (np.float64(below) + np.float64(values[half]))


@kernel
def _row_middles(values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    out = np.empty(len(values))
    for row in range(len(values)):
        out[row] = median_in(values[row])
    return out


@kernel
def median_among(values: NDArray[np.floating[Any]]) -> float:
    """Median of numbers as `np.median` finds it, whose code takes half a second to compile (`values` (n,))."""
    rest, half = values.copy(), values.size // 2
    _put_in_place(rest, half)
    if values.size % 2:
        return float(rest[half])
    below = rest[0]
    for i in range(1, half):
        below = max(below, rest[i])
    return float((below + rest[half]) / 2)


@kernel
def quantile_among(values: NDArray[np.floating[Any]], share: float) -> float:
    """What a share of numbers lie below, linear between neighbours; their order changes (`values` (n,))."""
    place = share * (values.size - 1)
    below = int(place)
    _put_in_place(values, below)
    lower = float(values[below])
    upper = float(values[below + 1 :].min()) if below + 1 < values.size else lower
    share = place - below
    return lower + share * (upper - lower) if share < 0.5 else upper - (1.0 - share) * (upper - lower)
