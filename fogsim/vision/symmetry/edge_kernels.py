"""Edges of a piece of a picture as points between pixels, each with its direction, above the picture's own noise."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float32]
Picture = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]

X, Y, NX, NY, SNR = range(5)
"""Columns of edge points: place [px], unit gradient [-], gradient over its noise [-]."""


@kernel
def shrunk(image: Picture, top: int, left: int, rows: int, cols: int, factor: int) -> Floats:
    """Cut a piece out of a picture, each value the mean over a square of pixels.

    Returns their means (channels, rows, cols). Takes `image` (all rows, all cols, channels) uint8, `top`, `left` [px],
    `factor` [px].
    """
    piece = np.empty((image.shape[2], rows, cols), np.float32)
    share = np.float32(1.0 / (factor * factor))
    for row in range(rows):
        for col in range(cols):
            for channel in range(image.shape[2]):
                total = np.float32(0.0)
                for i in range(top + row * factor, top + (row + 1) * factor):
                    for j in range(left + col * factor, left + (col + 1) * factor):
                        total += np.float32(image[i, j, channel])
                piece[channel, row, col] = total * share
    return piece


@kernel
def clearest_gradients(piece: Floats, share: float, least: float) -> tuple[Floats, Floats, Floats]:
    """Gradient of whichever channel shows it clearest above its own noise.

    Returns gradient along columns and rows and its length, over the standard deviation of a component by noise [-]
    (rows, cols). Takes `piece` (channels, rows, cols), `least` [1/px].
    """
    along, down, length = gradients(piece[0])
    _scale(along, down, length, 1.0 / gradient_noise(length, share, least))
    for channel in range(1, piece.shape[0]):
        x, y, both = gradients(piece[channel])
        _scale(x, y, both, 1.0 / gradient_noise(both, share, least))
        for row in range(length.shape[0]):
            for col in range(length.shape[1]):
                if both[row, col] > length[row, col]:
                    along[row, col], down[row, col] = x[row, col], y[row, col]
                    length[row, col] = both[row, col]
    return along, down, length


@kernel
def _scale(along: Floats, down: Floats, length: Floats, by: float) -> None:
    for row in range(length.shape[0]):
        for col in range(length.shape[1]):
            along[row, col] *= by
            down[row, col] *= by
            length[row, col] *= by


@kernel
def gradients(piece: Floats) -> tuple[Floats, Floats, Floats]:
    """Gradient by derivatives of a binomial window, of standard deviation 1 px across and 0.7 px along.

    Returns derivatives along columns and rows, and the length of both [1/px]; 0 within 2 px of the border (rows, cols).
    Takes `piece` (rows, cols).
    """
    rows, cols = piece.shape
    smooth, slope = np.zeros_like(piece), np.zeros_like(piece)
    sixteenth, eighth, two = np.float32(1 / 16), np.float32(1 / 8), np.float32(2.0)
    four, six = np.float32(4.0), np.float32(6.0)
    for row in range(2, rows - 2):
        for col in range(cols):
            a, b, c = piece[row - 2, col], piece[row - 1, col], piece[row, col]
            d, e = piece[row + 1, col], piece[row + 2, col]
            smooth[row, col] = (a + e + four * (b + d) + six * c) * sixteenth
            slope[row, col] = (e - a + two * (d - b)) * eighth
    along, down, length = np.zeros_like(piece), np.zeros_like(piece), np.zeros_like(piece)
    for row in range(2, rows - 2):
        for col in range(2, cols - 2):
            a, b, c = smooth[row, col - 2], smooth[row, col - 1], smooth[row, col + 1]
            gx = (smooth[row, col + 2] - a + two * (c - b)) * eighth
            gy = slope[row, col - 2] + slope[row, col + 2] + four * (slope[row, col - 1] + slope[row, col + 1])
            gy = (gy + six * slope[row, col]) * sixteenth
            along[row, col], down[row, col] = gx, gy
            length[row, col] = math.sqrt(gx * gx + gy * gy)
    return along, down, length


@kernel
def gradient_noise(length: Floats, share: float, least: float) -> float:
    """Standard deviation of each component of the gradient by noise [1/px] (`length` (rows, cols), `least` [1/px])."""
    # A quarter of the pixels tells as well.
    inner = length[2:-2:2, 2:-2:2].copy().ravel()
    if inner.size == 0:
        return least
    # The quantile of a Rayleigh distribution says its scale.
    quantile = np.partition(inner, int(share * inner.size))[int(share * inner.size)]
    return max(float(quantile) / math.sqrt(-2.0 * math.log(1.0 - share)), least)


@kernel
def edge_points(along: Floats, down: Floats, length: Floats, least: float) -> tuple[Floats, NDArray[np.int32]]:
    """Ridges of the gradient, each placed between pixels by a parabola across it.

    Takes `along`, `down`, `length` (rows, cols).
    """
    rows, cols = length.shape
    number = np.full((rows, cols), -1, np.int32)
    points = np.empty((rows * cols, 5), np.float32)
    found = 0
    for row in range(3, rows - 3):
        for col in range(3, cols - 3):
            here = length[row, col]
            if here < least:
                continue
            gx, gy = along[row, col], down[row, col]
            nx, ny = gx / here, gy / here
            before, after = _interpolated(length, row - ny, col - nx), _interpolated(length, row + ny, col + nx)
            if before > here or after >= here:
                continue
            bend = before - 2.0 * here + after
            shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
            points[found, X], points[found, Y] = col + shift * nx, row + shift * ny
            points[found, NX], points[found, NY], points[found, SNR] = nx, ny, here
            number[row, col] = found
            found += 1
    return points[:found].copy(), number


@kernel
def _interpolated(values: Floats, row: float, col: float) -> float:
    i, j = int(row), int(col)
    down, right = row - i, col - j
    upper = values[i, j] * (1.0 - right) + values[i, j + 1] * right
    lower = values[i + 1, j] * (1.0 - right) + values[i + 1, j + 1] * right
    return float(upper * (1.0 - down) + lower * down)
