"""Light that a lens scatters: the glow around lamps that a camera sees in clear air too."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.camera.glare_kernels import (
    Places,
    add_interpolated_rows,
    blur_grid,
    coarsen_grid,
    count_bright,
    interpolate_columns,
    share_among_cells,
    spread_core,
)
from fogsim.core.jit import Bands
from fogsim.values import Camera

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
        """Luminance with what the lens scatters.

        Returns the image itself where nothing is brighter than `BRIGHT` times saturation (rows, cols, 3). Takes
        `radiance` (rows, cols, 3) [cd/m²], `saturation` [cd/m²].
        """
        lines = np.ascontiguousarray(radiance, dtype=np.float32).reshape(radiance.shape[0], -1)
        counts, limit = np.empty(lines.shape[0], np.int32), np.float32(BRIGHT * saturation)
        if self._share == 0 or count_bright(lines, limit, counts) == 0:
            return radiance
        out = self._with_tail(lines, counts, limit) if self._levels else lines.copy()
        spread_core(lines, counts, limit, self._share, self._taps, self._core, out)
        return out.reshape(radiance.shape)

    def _with_tail(
        self, lines: NDArray[np.float32], counts: NDArray[np.int32], limit: np.float32
    ) -> NDArray[np.float32]:
        """The light of the wide Gaussians, added from the coarsest grid to the finest and then to the pixels."""
        grids = self._gathered(lines, counts, limit)
        below = np.zeros_like(grids[-1])
        for number in range(len(grids) - 1, -1, -1):
            level = self._levels[number]
            blur_grid(grids[number], level.taps, level.gain, below)
            wide = np.empty((below.shape[0], 3 * level.columns.at.size), np.float32)
            interpolate_columns(below, level.columns, wide)
            if number > 0:
                below = self._added(np.zeros_like(grids[number - 1]), wide, level)
        return self._added(lines, wide, self._levels[0])

    def _gathered(
        self, lines: NDArray[np.float32], counts: NDArray[np.int32], limit: np.float32
    ) -> list[NDArray[np.float32]]:
        """Scattered light in each level's grid, from fine to coarse."""
        grids = [np.zeros(level.shape, np.float32) for level in self._levels]
        rows, columns = self._levels[0].rows, self._levels[0].columns
        share_among_cells(lines, counts, limit, self._share, rows, columns, grids[0])
        for level, (fine, coarse) in zip(self._levels[1:], itertools.pairwise(grids), strict=True):
            coarsen_grid(fine, level.rows, level.columns, coarse)
        return grids

    def _added(self, lines: NDArray[np.float32], wide: NDArray[np.float32], level: _Level) -> NDArray[np.float32]:
        out = np.empty_like(lines)

        def add(_: int, begin: int, end: int) -> None:
            add_interpolated_rows(lines, wide, level.rows, begin, end, out)

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
