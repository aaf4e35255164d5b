"""Light that a lens scatters: the glow around lamps that a camera sees in clear air too."""

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import Bands, kernel
from fogsim.values import Camera

_ZERO, _ONE, _THREE = np.float32(0.0), np.float32(1.0), np.uint64(3)


class Places(NamedTuple):
    """Where points of a finer grid lie between the cells of a coarser one, along rows or columns."""

    at: NDArray[np.int32]  # (n,) int32: The cell before each point
    share: NDArray[np.float32]  # (n,): How far beyond it the point is, in cells


@kernel
def _count_bright(lines: NDArray[np.float32], limit: np.float32, counts: NDArray[np.int32]) -> int:
    """Count values above a limit, by row and in all; a sum of integers lets compilers emit vector instructions."""
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
def _share_among_cells(
    lines: NDArray[np.float32],
    counts: NDArray[np.int32],
    limit: np.float32,
    share: np.float32,
    rows: Places,
    columns: Places,
    grid: NDArray[np.float32],
) -> None:
    """Add the light that bright pixels scatter to the four cells around each, so that its middle stays in place."""
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
def _coarsen_grid(
    fine: NDArray[np.float32],
    rows: Places,
    columns: Places,
    coarse: NDArray[np.float32],
) -> None:
    """Add each cell's light to the four cells around it in a coarser grid; both (rows, 3 · cols)."""
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
def _blur_grid(
    grid: NDArray[np.float32], taps: NDArray[np.float32], gain: np.float32, out: NDArray[np.float32]
) -> None:
    """Add a grid, spread by the taps along rows and columns, to another; what leaves the grid is lost."""
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
def _interpolate_columns(
    grid: NDArray[np.float32],
    columns: Places,
    wide: NDArray[np.float32],
) -> None:
    """Interpolate the rows of a grid (rows, 3 · cols) at the columns of a finer one."""
    places, shares = columns.at, columns.share
    for row in range(grid.shape[0]):
        line, out = grid[row], wide[row]
        for column in range(np.uint64(places.shape[0])):
            # Unsigned, because indices that may be negative cost a comparison each.
            cell, right, at = _THREE * np.uint64(places[column]), shares[column], _THREE * column
            for i in range(_THREE):
                left = line[cell + i]
                out[at + i] = left + right * (line[cell + _THREE + i] - left)


@kernel
def _add_interpolated_rows(
    lines: NDArray[np.float32],
    wide: NDArray[np.float32],
    rows: Places,
    begin: int,
    end: int,
    out: NDArray[np.float32],
) -> None:
    """The lines from `begin` to before `end`, plus rows that are interpolated between those of a coarser grid."""
    for row in range(begin, end):
        line, upper, lower, sums = lines[row], wide[rows.at[row]], wide[rows.at[row] + 1], out[row]
        down = rows.share[row]
        up = _ONE - down
        for i in range(line.shape[0]):
            sums[i] = line[i] + (up * upper[i] + down * lower[i])


@kernel
def _spread_core(
    lines: NDArray[np.float32],
    counts: NDArray[np.int32],
    limit: np.float32,
    share: np.float32,
    taps: NDArray[np.float32],
    gain: np.float32,
    out: NDArray[np.float32],
) -> None:
    """Take the scattered light from bright pixels and give the part `gain` of it to those next to them."""
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


BRIGHT = 32.0
"""Luminance from which light is scattered, over that which fills a pixel: lamps by night, and by day hardly any."""

SPREADS = (math.radians(0.12), math.radians(0.48), math.radians(1.9), math.radians(7.7))
"""Standard deviations of the Gaussians with equal shares of the scattered light [rad]."""

_NARROWEST = 0.6
"""Spread below which light stays in its pixel [px]."""

_CORE = 2.4
"""Spread up to which light is spread at full resolution [px]; since spreads go by fours there is at most one."""

_CELLS = 1.15
"""Spread of a wider Gaussian in cells of its grid: fewer, and it would not look round."""

_BORDER = 1
"""Cells around the picture, so that each pixel lies between four."""


@dataclass(frozen=True, slots=True)
class _Level:
    """A grid that holds one of the wide Gaussians, and where the next finer grid's (first: the pixels') points lie."""

    shape: tuple[int, int]
    taps: NDArray[np.float32]
    gain: np.float32
    rows: Places
    columns: Places


class LensGlare:
    """Scatters a share of the light of lamps over the picture.

    A lens scatters light at its surfaces, in dust and by reflections; the share of it, the veiling glare of ISO 9358,
    is a few per cent for most lenses. Here a lamp's share falls off about with the inverse square of the angle to it,
    as glare of smooth surfaces and of the eye does (CIE 146): a sum of Gaussians with equal light, each four times as
    wide as the one before, from 0.12° to 7.7°. Share and angles are assumed, not those of a certain lens.

    Of a pixel's light only what is above `BRIGHT` times saturation counts: the rest would lift the picture evenly by
    less than a camera's own black level correction takes away. Light that is scattered out of the picture is lost, and
    lamps outside it scatter none into it.
    """

    def __init__(self, camera: Camera, share: float) -> None:
        spreads = [spread * camera.focal_length for spread in SPREADS]
        kept = [spread for spread in spreads if spread >= _NARROWEST]
        core = [spread for spread in kept if spread < _CORE]
        self._share = np.float32(share * len(kept) / len(spreads))
        self._each = 1.0 / len(kept) if kept else 0.0
        self._taps = _taps(core[0] if core else 0.0)
        self._core = np.float32(self._each * len(core))
        self._levels = _levels((camera.height, camera.width), [s for s in kept if s >= _CORE], self._each)
        self._bands = Bands()

    def scatter(self, radiance: NDArray[np.float32], saturation: float) -> NDArray[np.float32]:
        """Luminance with what the lens scatters (rows, cols, 3) [cd/m²]; the image itself if nothing is bright."""
        lines = np.ascontiguousarray(radiance, dtype=np.float32).reshape(radiance.shape[0], -1)
        counts, limit = np.empty(lines.shape[0], np.int32), np.float32(BRIGHT * saturation)
        if self._share == 0 or _count_bright(lines, limit, counts) == 0:
            return radiance
        out = self._with_tail(lines, counts, limit) if self._levels else lines.copy()
        _spread_core(lines, counts, limit, self._share, self._taps, self._core, out)
        return out.reshape(radiance.shape)

    def _with_tail(
        self, lines: NDArray[np.float32], counts: NDArray[np.int32], limit: np.float32
    ) -> NDArray[np.float32]:
        """The light of the wide Gaussians, added from the coarsest grid to the finest and then to the pixels."""
        grids = self._gathered(lines, counts, limit)
        below = np.zeros_like(grids[-1])
        for number in range(len(grids) - 1, -1, -1):
            level = self._levels[number]
            _blur_grid(grids[number], level.taps, level.gain, below)
            wide = np.empty((below.shape[0], 3 * level.columns.at.size), np.float32)
            _interpolate_columns(below, level.columns, wide)
            if number > 0:
                below = self._added(np.zeros_like(grids[number - 1]), wide, level)
        return self._added(lines, wide, self._levels[0])

    def _gathered(
        self, lines: NDArray[np.float32], counts: NDArray[np.int32], limit: np.float32
    ) -> list[NDArray[np.float32]]:
        """Scattered light in each level's grid, from fine to coarse."""
        grids = [np.zeros(level.shape, np.float32) for level in self._levels]
        rows, columns = self._levels[0].rows, self._levels[0].columns
        _share_among_cells(lines, counts, limit, self._share, rows, columns, grids[0])
        for level, (fine, coarse) in zip(self._levels[1:], itertools.pairwise(grids), strict=True):
            _coarsen_grid(fine, level.rows, level.columns, coarse)
        return grids

    def _added(self, lines: NDArray[np.float32], wide: NDArray[np.float32], level: _Level) -> NDArray[np.float32]:
        out = np.empty_like(lines)

        def add(_: int, begin: int, end: int) -> None:
            _add_interpolated_rows(lines, wide, level.rows, begin, end, out)

        self._bands.work(add, lines.shape[0], lines.shape[1] // 3)
        return out


def _levels(size: tuple[int, int], spreads: list[float], each: float) -> tuple[_Level, ...]:
    """Grids for spreads [px] in rising order, of a picture of (rows, columns)."""
    levels, finer, counts = [], 1, size
    border = 0
    for spread in spreads:
        side = max(2, round(spread / _CELLS))
        shape = tuple(math.ceil(pixels / side) + 2 * _BORDER for pixels in size)
        rows, columns = (_places(count, finer, border, side, cells) for count, cells in zip(counts, shape, strict=True))
        # Sharing light among cells and interpolating between them each spread it by 1/6 cell² on average.
        taps = _taps(math.sqrt(max((spread / side) ** 2 - 1.0 / 3.0, 0.0)))
        levels.append(_Level((shape[0], 3 * shape[1]), taps, np.float32(each / side**2), rows, columns))
        finer, counts, border = side, (shape[0], shape[1]), _BORDER
    return tuple(levels)


def _places(count: int, finer: int, border: int, side: int, cells: int) -> Places:
    """Places of `count` points that are `finer` pixels apart among cells of `side` pixels."""
    middle = (np.arange(count) - border + 0.5) * finer
    place = middle / side - 0.5 + _BORDER
    at = np.clip(np.floor(place), 0, cells - 2)
    return Places(at.astype(np.int32), (place - at).astype(np.float32))


def _taps(spread: float) -> NDArray[np.float32]:
    """A Gaussian at integers, to 3.5 standard deviations, that adds up to 1; a single tap for no spread."""
    reach = math.ceil(3.5 * spread)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / max(spread, 1e-9)) ** 2)
    normalised: NDArray[np.float32] = (taps / taps.sum()).astype(np.float32)
    return normalised
