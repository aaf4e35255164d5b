"""Texture of the ground along a row of pixels, by where on the ground they look."""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.render.projection import Lens
from fogsim.render.shading.layout import Array, Numbers
from fogsim.render.vectors import Vector

_GRAIN = 256
"""Side of the tile of independent numbers."""

_SMOOTH = 128
"""Side of the tile of smooth noise."""

_PER_CELL = 8
"""Numbers of the smooth tile from one random value to the next."""


class Noise(NamedTuple):
    """Tiles; the squares of a tile lie row after row."""

    grain: NDArray[np.float32]  # Independent numbers
    smooth: NDArray[np.float32]  # Value noise


@functools.cache
def tiles() -> Noise:
    """Make the tiles, the same ones always."""
    rng = np.random.default_rng(20260)
    grain = rng.uniform(-1.0, 1.0, (_GRAIN, _GRAIN))
    cells = rng.uniform(-1.0, 1.0, (_SMOOTH // _PER_CELL, _SMOOTH // _PER_CELL))
    share = np.arange(_SMOOTH) % _PER_CELL / _PER_CELL
    weight, low = share * share * (3.0 - 2.0 * share), np.arange(_SMOOTH) // _PER_CELL
    high = (low + 1) % len(cells)
    rows = cells[low] * (1.0 - weight[:, None]) + cells[high] * weight[:, None]
    smooth = rows[:, low] * (1.0 - weight) + rows[:, high] * weight
    return Noise(_normalised(grain), _normalised(smooth))


def _normalised(tile: NDArray[np.float64]) -> NDArray[np.float32]:
    centred = tile - tile.mean()
    flat: NDArray[np.float32] = (centred / centred.std()).astype(np.float32).ravel()
    flat.flags.writeable = False
    return flat


ASPHALT = ((0.01, 0.25, 3.0, 12.0), (0.12, 0.025, 0.012, 0.02))
"""Sides of the squares of noise [m] and deviations of reflectance: grain, mottling, patches and large patches."""

GRASS = ((0.08, 0.7, 5.0, 31.0), (0.10, 0.06, 0.06, 0.03))
"""Those of grassland."""

_CHUNK, _PIECE = 256, 32  # pixels of a row that share a footprint, and over which large patches are linear
_FAR = float(1 << 20)  # a multiple of the sides of tiles, so that places are not negative
_FAINTEST = 0.002  # deviation below which grain is left out

Four = tuple[float, float, float, float]


class Row(NamedTuple):
    """Memory for one row of pixels."""

    # depth, texture, tint (columns,): depths [m], factors of reflectance, and the share of them that the largest
    # patches have
    depth: Array
    texture: Array
    tint: Array
    place: NDArray[np.uint32]  # (columns,) uint32: Places in a tile of noise
    member: Numbers  # (columns,) int32: Spans that are textured together


def memory_for_row(columns: int) -> Row:
    """Make memory for a row of so many pixels."""
    depth, texture, tint = np.zeros((3, columns), np.float32)
    return Row(depth, texture, tint, np.zeros(columns, np.uint32), np.zeros(columns, np.int32))


@kernel
def set_texture(
    material: tuple[Four, Four],
    plane: Vector,
    row: float,
    begin: int,
    end: int,
    lens: Lens,
    noise: Noise,
    work: Row,
) -> None:
    """Set texture and tint from column `begin` to the one before `end` (`plane` [1/m])."""
    slope, drop, rest = plane
    rays, eye = lens.rays, lens.eye
    texture, place = work.texture, work.place
    grain, smooth = noise.grain, noise.smooth
    sides, deviations = material
    last_wide, last_long = -1.0, -1.0
    strength_1, strength_2, strength_3, strength_4 = 0.0, 0.0, 0.0, 0.0
    scale_1, x_1, y_1, scale_2, x_2, y_2 = 1.0, 0.0, 0.0, 1.0, 0.0, 0.0
    base = drop * row + rest
    while begin < end:
        # Chunks begin at the same columns whatever is seen, so that texture does not depend on what stands before it.
        chunk = begin // _CHUNK * _CHUNK
        after, middle = min(end, chunk + _CHUNK), chunk + 0.5 * _CHUNK
        # The footprint of the pixel in the middle, from the derivatives of its place on the ground.
        z = 1.0 / max(base + slope * middle, 0.5 * (base + slope * begin), 1e-9)
        rx = rays[0, 0] * middle + rays[0, 1] * row + rays[0, 2]
        ry = rays[1, 0] * middle + rays[1, 1] * row + rays[1, 2]
        ux, uy = z * (rays[0, 0] - rx * slope * z), z * (rays[1, 0] - ry * slope * z)
        vx, vy = z * (rays[0, 1] - rx * drop * z), z * (rays[1, 1] - ry * drop * z)
        wide, long = math.sqrt(ux * ux + uy * uy), math.sqrt(vx * vx + vy * vy)
        if not (abs(wide - last_wide) <= 1e-4 * wide and abs(long - last_long) <= 1e-4 * long):
            last_wide, last_long = wide, long
            per_wide, per_long = 1.0 / wide, 1.0 / long
            strength_1 = _faded(deviations[0], sides[0], per_wide, per_long)
            strength_2 = _faded(deviations[1], sides[1], per_wide, per_long)
            strength_3 = _faded(deviations[2], sides[2], per_wide, per_long)
            strength_4 = _faded(deviations[3], sides[3], per_wide, per_long)
            # Squares are as large as the narrow side of a pixel, so that every pixel has its own.
            narrow = min(wide, long)
            if strength_1 > _FAINTEST:
                scale_1, x_1, y_1 = _scale(0.5 * sides[0], _GRAIN, narrow, eye[0], eye[1])
            if strength_2 > _FAINTEST:
                scale_2, x_2, y_2 = _scale(sides[1] / _PER_CELL, _SMOOTH, narrow / _PER_CELL, eye[0], eye[1])
        place_0 = (eye[0] + rx * z - middle * ux, eye[1] + ry * z - middle * uy)
        _add_patches((sides[2], strength_3), (sides[3], strength_4), place_0, (ux, uy), begin, after, smooth, work)
        # Grain and mottling.
        if strength_1 > _FAINTEST:
            _set_tile_places(work, rays, row, begin, after, (scale_1, x_1, y_1, _GRAIN))
            amount = np.float32(strength_1)
            for i in range(np.uint64(begin), np.uint64(after)):
                texture[i] += amount * grain[place[i]]
        if strength_2 > _FAINTEST:
            _set_tile_places(work, rays, row, begin, after, (scale_2, x_2, y_2, _SMOOTH))
            amount = np.float32(strength_2)
            for i in range(np.uint64(begin), np.uint64(after)):
                texture[i] += amount * smooth[place[i]]
        begin = after


@kernel
def _add_patches(
    patches: tuple[float, float],
    large: tuple[float, float],
    place: tuple[float, float],
    step: tuple[float, float],
    begin: int,
    after: int,
    smooth: Array,
    work: Row,
) -> None:
    """Set texture and tint to patches and large patches, linear from one end of a piece to the other.

    Of both kinds the side [m] and the strength are given; the place on the ground [m] is that of column 0, and the step
    from one column to the next.
    """
    texture, tint = work.texture, work.tint
    side, strength = patches
    large_side, large_strength = large
    node = begin // _PIECE * _PIECE
    x, y = place[0] + node * step[0], place[1] + node * step[1]
    here, large_here = strength * _smooth_at(smooth, x, y, side), large_strength * _smooth_at(smooth, x, y, large_side)
    while node < after:
        x, y = place[0] + (node + _PIECE) * step[0], place[1] + (node + _PIECE) * step[1]
        there = strength * _smooth_at(smooth, x, y, side)
        large_there = large_strength * _smooth_at(smooth, x, y, large_side)
        level, tint_level = np.float32(1.0 + here + large_here), np.float32(large_here)
        change = np.float32((there + large_there - here - large_here) / _PIECE)
        tint_change = np.float32((large_there - large_here) / _PIECE)
        for i in range(np.uint64(max(begin, node)), np.uint64(min(node + _PIECE, after))):
            pixels = np.float32(np.int32(i) - np.int32(node))
            texture[i] = level + change * pixels
            tint[i] = tint_level + tint_change * pixels
        here, large_here = there, large_there
        node += _PIECE


@kernel
def _set_tile_places(
    work: Row, rays: NDArray[np.float64], row: float, begin: int, after: int, tile: tuple[float, float, float, int]
) -> None:
    """Set places of pixels in a tile: size of its numbers [m], where on it the camera is, and how many a side has."""
    depth, place = work.depth, work.place
    scale, x, y, side = tile
    gx, gy = np.float32(rays[0, 0] * begin + rays[0, 1] * row + rays[0, 2]), np.float32(rays[0, 0])
    hx, hy = np.float32(rays[1, 0] * begin + rays[1, 1] * row + rays[1, 2]), np.float32(rays[1, 0])
    ox, oy, per_scale, first = np.float32(x + _FAR), np.float32(y + _FAR), np.float32(1.0 / scale), np.int32(begin)
    for i in range(np.uint64(begin), np.uint64(after)):
        step = np.float32(np.int32(i) - first)
        far = depth[i] * per_scale
        a = np.int32(ox + (gx + gy * step) * far) & (side - 1)
        b = np.int32(oy + (hx + hy * step) * far) & (side - 1)
        place[i] = np.uint32(b * side + a)


@kernel
def _faded(deviation: float, side: float, per_wide: float, per_long: float) -> float:
    """Deviation that is left of independent squares' once averaged over a footprint of such inverse extents [1/m]."""
    return deviation * math.sqrt(min(side * per_wide, 1.0) * min(side * per_long, 1.0))


@kernel
def _doubled(side: float, narrow: float) -> float:
    """Side doubled until it is about the narrow side of a footprint or more."""
    while side * math.sqrt(2.0) < narrow:
        side *= 2.0
    return side


@kernel
def _smooth_at(tile: Array, x: float, y: float, side: float) -> float:
    """Smooth noise with cells of a side [m], between its numbers too."""
    x, y = x * (_PER_CELL / side), y * (_PER_CELL / side)
    left, top = math.floor(x), math.floor(y)
    a, b, mask = x - left, y - top, _SMOOTH - 1
    i, j = int(left) & mask, int(top) & mask
    k, m = (i + 1) & mask, (j + 1) & mask
    upper = tile[j * _SMOOTH + i] * (1.0 - a) + tile[j * _SMOOTH + k] * a
    lower = tile[m * _SMOOTH + i] * (1.0 - a) + tile[m * _SMOOTH + k] * a
    return float(upper * (1.0 - b) + lower * b)


@kernel
def _scale(side: float, count: int, narrow: float, x: float, y: float) -> tuple[float, float, float]:
    """Size of a number of a tile on the ground [m], and where on a tile of so many numbers the camera is."""
    scale = _doubled(side, narrow)
    period = scale * count
    return scale, (x - period * math.floor(x / period)) / scale, (y - period * math.floor(y / period)) / scale
