"""Light of the sky beside the vehicle ahead, past the trees that stand before it."""

import math

import numpy as np
from numpy.typing import NDArray

BLOCKS, BRIGHT_BLOCKS = 12, 80.0
"""Blocks of columns of the sky, and the percentile of their brightness that is the airlight: trees hide the others."""

HALF_TRUCK = 1.6
"""How much of the sky beside the axis a high vehicle ahead can hide [m]."""

ALIKE = 0.03
"""How far from the light of all of the sky a pixel's may be, relative to it, beside noise [-]: trees are darker."""

LEAST_SEEN = 0.05
"""Share of a block's pixels that must be of that light for the block to count [-]."""


def airlight_beside(light: NDArray[np.float32], about: float, noise: float, axis: float, hidden: float) -> float:
    """Brightness of the sky where neither trees, however faint, nor the vehicle ahead stand before it.

    A bright part of an even sky, and not its brightest pixels: at a range where the fog leaves 2 % of a contrast, an
    airlight that is wrong by 0.2 % is a tenth of it.

    Parameters
    ----------
    light : (rows, cols) float32
        Luminance above the horizon.
    about, noise : float
        What the sky's light is about, and the deviation of single pixels of it, in the same unit.
    axis, hidden : float
        Column of the own axis, and how far from it the vehicle may stand [px].

    Returns
    -------
    float
        In the unit of the luminance.
    """
    columns = _blocks(light.shape[1])
    free = [block for block in columns if abs(0.5 * (block.start + block.stop - 1) - axis) > hidden]
    seen = free if len(free) >= BLOCKS // 3 else columns
    means = [_mean(light[:, block], about, noise) for block in seen]
    bright = [mean for mean in means if mean is not None]
    return float(np.percentile(bright, BRIGHT_BLOCKS)) if bright else about


def _blocks(width: int) -> list[slice]:
    """Blocks of columns that are the same from either side: they share a column where its middle is their border."""
    blocks = [slice(width * i // BLOCKS, -(-width * (i + 1) // BLOCKS)) for i in range(BLOCKS)]
    return [block for block in blocks if block.stop > block.start]


def _mean(part: NDArray[np.float32], about: float, noise: float) -> float | None:
    """Mean of the pixels of the sky in a part; None if too few are."""
    reach, middle = ALIKE * about + 4.0 * noise, about
    # What is cut off about a first middle is lopsided, so that it is looked for again about the next.
    for narrow in (reach, max(4.0 * noise, 1.0), max(3.0 * noise, 1.0)):
        core = part[np.abs(part - np.float32(middle)) <= narrow]
        if core.size < max(LEAST_SEEN * part.size, 1):
            return None
        middle = float(np.median(core)) if narrow is reach else float(core.mean(dtype=np.float64))
    return middle


def hidden_beside(focal_length: float, depth: float) -> float:
    """How far from the axis a vehicle at a depth [m] may hide the sky [px]."""
    return HALF_TRUCK * focal_length / depth if math.isfinite(depth) else 0.0
