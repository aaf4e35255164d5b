"""Random texture as tiles that repeat; every number of a tile has mean 0 and deviation 1 over the tile."""

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

GRAIN = 256
"""Side of the tile of independent numbers."""

SMOOTH = 128
"""Side of the tile of smooth noise."""

PER_CELL = 8
"""Numbers of the smooth tile from one random value to the next."""


class Noise(NamedTuple):
    """Tiles; the squares of a tile lie row after row."""

    grain: NDArray[np.float32]  # Independent numbers
    smooth: NDArray[np.float32]  # Value noise


@functools.cache
def tiles() -> Noise:
    """Make the tiles, the same ones always."""
    rng = np.random.default_rng(20260)
    grain = rng.uniform(-1.0, 1.0, (GRAIN, GRAIN))
    cells = rng.uniform(-1.0, 1.0, (SMOOTH // PER_CELL, SMOOTH // PER_CELL))
    share = np.arange(SMOOTH) % PER_CELL / PER_CELL
    weight, low = share * share * (3.0 - 2.0 * share), np.arange(SMOOTH) // PER_CELL
    high = (low + 1) % len(cells)
    rows = cells[low] * (1.0 - weight[:, None]) + cells[high] * weight[:, None]
    smooth = rows[:, low] * (1.0 - weight) + rows[:, high] * weight
    return Noise(_normalised(grain), _normalised(smooth))


def _normalised(tile: NDArray[np.float64]) -> NDArray[np.float32]:
    centred = tile - tile.mean()
    flat: NDArray[np.float32] = (centred / centred.std()).astype(np.float32).ravel()
    flat.flags.writeable = False
    return flat
