"""Compiled search of what stands on the road, column by column from the road up."""

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float32]
Pixels = NDArray[np.uint8] | NDArray[np.uint16]

_MIXED = 0.8
"""Share of the road's luminance below which a block under something is partly that [-]."""


@kernel
def standing_transmission(
    light: Floats, plane: Floats, distance: Floats, tall: float, least: float, road: float, dark: float, sure: float
) -> Floats:
    """Transmission of what stands on the road, (rows, cols) float32; 0 where nothing is found.

    Restored as road, what stands on it becomes darker the farther the road behind it is. A run of such pixels up a
    column stands where the lowest of them is, if some pixel of it comes out darker than black.

    Takes `light` (rows, cols), `plane` (rows, cols), `distance` (rows, cols) [m], `tall` [px·m].
    """
    rows, cols = light.shape
    out = np.zeros((rows, cols), np.float32)
    for col in range(cols):
        foot, last, found = -1, -1, False
        for row in range(rows - 1, -1, -1):
            restored = 1.0 + (light[row, col] - 1.0) / plane[row, col]
            if restored < dark * road:
                if foot < 0:
                    foot = row
                last = row
                found = found or restored < -sure
            elif foot >= 0 and (last - row > tall / distance[foot, col] or (not found and restored < 2.0 * road)):
                if found:
                    _fill(out, light, plane, col, foot, last, least, road)
                foot, found = -1, False
        if found:
            _fill(out, light, plane, col, foot, last, least, road)
    return out


@kernel
def _fill(out: Floats, light: Floats, plane: Floats, col: int, foot: int, last: int, least: float, road: float) -> None:
    """Give a run the transmission of its foot, or what its own darkness demands if it has none on the road."""
    stands = np.float32(0.0)
    if plane[foot, col] > 1.01 * least:
        below = min(foot + 1, len(plane) - 1)
        restored = 1.0 + (light[below, col] - 1.0) / plane[below, col]
        # It stands within the block below, which is partly road, or at that block's upper edge.
        share = np.float32(1.0 if restored < _MIXED * road else 0.5)
        stands = share * plane[below, col] + (np.float32(1.0) - share) * plane[foot, col]
    for row in range(last, foot + 1):
        out[row, col] = max(stands, np.float32(1.0) - light[row, col])


@kernel
def bounded_transmission(
    pixels: Pixels, tables: Floats, plane: Floats, standing: Floats, least: float, road: float
) -> Floats:
    """Transmission of road and of what stands on it, no less than a bound, (rows, cols) float32.

    The bound is soft, √(t² + t_min²): where it is hard, the road ends in an edge across it.

    Takes `pixels` (rows, cols, channels) uint8, `tables` (channels, levels), `plane` (rows, cols), `standing` (rows,
    cols).
    """
    rows, cols, channels = pixels.shape
    out = np.empty((rows, cols), np.float32)
    square, one, none = np.float32(least * least), np.float32(1.0), np.float32(0.0)
    for row in range(rows):
        for col in range(cols):
            through = plane[row, col]
            out[row, col] = min(np.sqrt(through * through + square), one)
    for row in range(rows):
        for col in range(cols):
            if standing[row, col] > none:
                light = one
                for channel in range(channels):
                    light = min(light, tables[channel, pixels[row, col, channel]])
                restored = one + (light - one) / out[row, col]
                share = np.float32(2.0) * (one - restored / np.float32(road))
                out[row, col] += min(max(share, none), one) * standing[row, col]
                out[row, col] = min(out[row, col], one)
    return out
