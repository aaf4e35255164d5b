"""The loops of the lens's glare; grids of light are (rows, 3 · columns), so that colours go side by side."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)


class Places(NamedTuple):
    """Where points of a finer grid lie between the cells of a coarser one, along rows or columns."""

    at: NDArray[np.int32]  # (n,) int32: The cell before each point
    share: NDArray[np.float32]  # (n,): How far beyond it the point is, in cells


@kernel
def count_bright(lines: NDArray[np.float32], limit: np.float32, counts: NDArray[np.int32]) -> int:
    """Count the values above a limit, by row and in all. A sum of integers, so that compilers emit vector instructions.

    Takes `lines` (rows, 3 · cols), `counts` (rows,) int32.
    """
    total = 0
    for row in range(lines.shape[0]):
        line, found = lines[row], np.int32(0)
        for i in range(line.shape[0]):
            found += np.int32(line[i] > limit)
        counts[row] = found
        total += int(found)
    return total


@kernel
def _scattered(line: NDArray[np.float32], at: int, limit: np.float32, share: np.float32) -> np.float32:
    """Share of its light that a pixel loses: of what is above the limit, in the pixel's own colour."""
    peak = max(line[at], line[at + 1], line[at + 2])
    return share * (_ONE - limit / peak) if peak > limit else _ZERO


@kernel
def share_among_cells(
    lines: NDArray[np.float32],
    counts: NDArray[np.int32],
    limit: np.float32,
    share: np.float32,
    rows: Places,
    columns: Places,
    grid: NDArray[np.float32],
) -> None:
    """Add the light that bright pixels scatter to the four cells around each, so that its middle stays in place.

    Takes `grid` (grid rows, 3 · grid cols).
    """
    for row in range(lines.shape[0]):
        if counts[row] == 0:
            continue
        line, upper, lower = lines[row], grid[rows.at[row]], grid[rows.at[row] + 1]
        down = rows.share[row]
        for column in range(columns.at.shape[0]):
            lost = _scattered(line, 3 * column, limit, share)
            if lost > _ZERO:
                right, cell = columns.share[column], 3 * columns.at[column]
                for i in range(3):
                    light = lost * line[3 * column + i]
                    upper[cell + i] += (_ONE - down) * (_ONE - right) * light
                    upper[cell + 3 + i] += (_ONE - down) * right * light
                    lower[cell + i] += down * (_ONE - right) * light
                    lower[cell + 3 + i] += down * right * light


@kernel
def coarsen_grid(
    fine: NDArray[np.float32],
    rows: Places,
    columns: Places,
    coarse: NDArray[np.float32],
) -> None:
    """Add each cell's light to the four cells around it in a coarser grid.

    Takes `fine` (rows, 3 · cols), `coarse` (coarse rows, 3 · coarse cols).
    """
    strip = np.zeros(coarse.shape[1], np.float32)
    for row in range(fine.shape[0]):
        line = fine[row]
        if not line.any():
            continue
        strip[:] = _ZERO
        for column in range(columns.at.shape[0]):
            right, cell = columns.share[column], 3 * columns.at[column]
            for i in range(3):
                light = line[3 * column + i]
                strip[cell + i] += (_ONE - right) * light
                strip[cell + 3 + i] += right * light
        down, upper, lower = rows.share[row], coarse[rows.at[row]], coarse[rows.at[row] + 1]
        for i in range(strip.shape[0]):
            upper[i] += (_ONE - down) * strip[i]
            lower[i] += down * strip[i]


@kernel
def blur_grid(grid: NDArray[np.float32], taps: NDArray[np.float32], gain: np.float32, out: NDArray[np.float32]) -> None:
    """Add a grid, spread by the taps along rows and columns, to another; what leaves the grid is lost.

    Takes `grid`, `out` (rows, 3 · cols), `taps` (2 n + 1,).
    """
    reach = taps.shape[0] // 2
    strip = np.empty(grid.shape[1] + 6 * reach, np.float32)
    for row in range(grid.shape[0]):
        if grid[row].any():
            strip[:] = _ZERO
            _spread_along(grid[row], taps, gain, 0, grid.shape[1], strip)
            _spread_across(strip, taps, row, 0, grid.shape[1], out)


@kernel
def _spread_along(
    line: NDArray[np.float32],
    taps: NDArray[np.float32],
    gain: np.float32,
    begin: int,
    end: int,
    strip: NDArray[np.float32],
) -> None:
    """Add values `begin` to before `end` of a row to a strip that is longer by the taps' reach on either side."""
    values = line[begin:end]
    for k in range(taps.shape[0]):
        tap, part = gain * taps[k], strip[begin + 3 * k : end + 3 * k]
        for i in range(values.shape[0]):
            part[i] += tap * values[i]


@kernel
def _spread_across(
    strip: NDArray[np.float32], taps: NDArray[np.float32], row: int, begin: int, end: int, out: NDArray[np.float32]
) -> None:
    """Add a strip, as `_spread_along` makes it, to the rows within the taps' reach."""
    reach = taps.shape[0] // 2
    values = strip[begin + 3 * reach : end + 3 * reach]
    for k in range(taps.shape[0]):
        target = row + k - reach
        if 0 <= target < out.shape[0]:
            tap, part = taps[k], out[target, begin:end]
            for i in range(values.shape[0]):
                part[i] += tap * values[i]


@kernel
def interpolate_columns(
    grid: NDArray[np.float32],
    columns: Places,
    wide: NDArray[np.float32],
) -> None:
    """Interpolate the rows of a grid at the columns of a finer one.

    Takes `grid` (rows, 3 · cols), `wide` (rows, 3 · finer cols).
    """
    for row in range(grid.shape[0]):
        line, out = grid[row], wide[row]
        for column in range(columns.at.shape[0]):
            cell, right = 3 * columns.at[column], columns.share[column]
            for i in range(3):
                left = line[cell + i]
                out[3 * column + i] = left + right * (line[cell + 3 + i] - left)


@kernel
def add_interpolated_rows(
    lines: NDArray[np.float32],
    wide: NDArray[np.float32],
    rows: Places,
    begin: int,
    end: int,
    out: NDArray[np.float32],
) -> None:
    """The lines from `begin` to before `end`, plus rows that are interpolated between those of a coarser grid.

    Takes `lines`, `out` (rows, 3 · cols), `wide` (coarse rows, 3 · cols).
    """
    for row in range(begin, end):
        line, upper, lower, sums = lines[row], wide[rows.at[row]], wide[rows.at[row] + 1], out[row]
        down = rows.share[row]
        up = _ONE - down
        for i in range(line.shape[0]):
            sums[i] = line[i] + (up * upper[i] + down * lower[i])


@kernel
def spread_core(
    lines: NDArray[np.float32],
    counts: NDArray[np.int32],
    limit: np.float32,
    share: np.float32,
    taps: NDArray[np.float32],
    gain: np.float32,
    out: NDArray[np.float32],
) -> None:
    """Take the scattered light from the bright pixels and give the part `gain` of it to those next to them.

    Takes `taps` (2 n + 1,), `out` (rows, 3 · cols).
    """
    reach, size = taps.shape[0] // 2, lines.shape[1]
    light = np.zeros(size, np.float32)
    strip = np.empty(size + 6 * reach, np.float32)
    for row in range(lines.shape[0]):
        if counts[row] == 0:
            continue
        line, kept = lines[row], out[row]
        first, last = size, 0
        for at in range(0, size, 3):
            lost = _scattered(line, at, limit, share)
            if lost > _ZERO:
                first, last = min(first, at), at + 3
                for i in range(at, at + 3):
                    light[i] = lost * line[i]
                    kept[i] -= light[i]
        if gain > _ZERO and first < last:
            strip[:] = _ZERO
            _spread_along(light, taps, gain, first, last, strip)
            begin, end = max(0, first - 3 * reach), min(size, last + 3 * reach)
            _spread_across(strip, taps, row, begin, end, out)
        light[first:last] = _ZERO
