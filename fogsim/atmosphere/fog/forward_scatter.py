"""Forward scattering by day: light that droplets turn by little still arrives, but blurred."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

_COARSEST = 2.0
"""The image is averaged to pixels of at most one such part of the blur's width before it is blurred."""

_REACH = 4.0
"""Widths within which all of a Gaussian lies."""

_DARK = 1e-12
"""Luminance that is none [cd/m²]; numbers near the smallest that exist are very slow."""

_NONE, _HALF = np.float32(0.0), np.float32(0.5)


def add_forward_scatter(
    luminance: NDArray[np.float32],
    airlight: tuple[float, float, float],
    transmittance: NDArray[np.float32],
    weight: float,
    width: float,
) -> None:
    """Add to an image what forward scattering does to the light that a scene sends through fog.

    Of D = (L0 − L∞) T, by which the scene differs from the airlight, the share w (1 − T) is exchanged for its own blur
    h ∗ D, h being a Gaussian: nothing in clear air, most for what lies deep in the fog. What is as bright as the
    airlight stays so, and fog next to something dark is darker. Forward lobes of fog droplets are 1° to 2° wide; weight
    and width are assumptions, not measurements.

    Takes `luminance` (rows, cols, 3) [cd/m²], `airlight` [cd/m²], `transmittance` (rows, cols), `width` [px].
    """
    block = max(1, int(width / _COARSEST))
    difference = luminance - np.array(airlight, np.float32)
    small = _block_means(difference, block)
    reach = math.ceil(_REACH * width / block)
    weights = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) * block / width)).astype(np.float32)
    across_first, blurred = np.empty_like(small), np.empty_like(small)
    blur_rows(small, weights, across_first)
    blur_rows(across_first.transpose(1, 0, 2), weights, blurred.transpose(1, 0, 2))
    exchange(luminance, difference, transmittance, blurred, block, np.float32(weight))


def _block_means(image: NDArray[np.float32], block: int) -> NDArray[np.float32]:
    """Averages over squares; those at the far edges are filled up with the outermost pixels."""
    rows, columns = image.shape[:2]
    padded = np.pad(image, ((0, -rows % block), (0, -columns % block), (0, 0)), mode="edge")
    shape = (padded.shape[0] // block, block, padded.shape[1] // block, block, 3)
    # One axis after the other: that is faster than both at once.
    means = padded.reshape(shape).sum(axis=1).sum(axis=2) / block**2
    means[np.abs(means) < _DARK] = 0.0
    return np.ascontiguousarray(means, dtype=np.float32)


def pixel_width(angle: float, focal_length: float) -> float:
    """Width of a blur on the image [px]: at least half a pixel, so that it can be drawn.

    Takes `angle` [rad], `focal_length` [px].
    """
    return max(focal_length * math.tan(angle), 0.5)


@kernel
def blur_rows(image: NDArray[np.float32], weights: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Convolve each row of an image; what the weights miss at the edges is shared among the rest.

    Takes `image`, `out` (rows, cols, 3), `weights` (2 n + 1,).
    """
    columns, reach = image.shape[1], weights.shape[0] // 2
    for u in range(columns):
        first, last = max(0, u - reach), min(columns, u + reach + 1)
        whole = np.float32(0.0)
        for n in range(first, last):
            whole += weights[n - u + reach]
        for v in range(image.shape[0]):
            for c in range(3):
                total = np.float32(0.0)
                for n in range(first, last):
                    total += weights[n - u + reach] * image[v, n, c]
                out[v, u, c] = total / whole


@kernel
def exchange(
    luminance: NDArray[np.float32],
    difference: NDArray[np.float32],
    transmittance: NDArray[np.float32],
    blurred: NDArray[np.float32],
    block: int,
    weight: np.float32,
) -> None:
    """Exchange a share w (1 − T) of a difference for its blur.

    Takes `luminance`, `difference` (rows, cols, 3) [cd/m²], `transmittance` (rows, cols), `blurred` (block rows, block
    cols, 3) [cd/m²], `block` [px].
    """
    rows, columns = blurred.shape[0], blurred.shape[1]
    part = np.float32(1.0) / np.float32(block)
    for v in range(transmittance.shape[0]):
        down = min(max((np.float32(v) + _HALF) * part - _HALF, _NONE), np.float32(rows - 1))
        upper = min(int(down), max(rows - 2, 0))
        lower = min(upper + 1, rows - 1)
        b = down - np.float32(upper)
        for u in range(transmittance.shape[1]):
            across = min(max((np.float32(u) + _HALF) * part - _HALF, _NONE), np.float32(columns - 1))
            left = min(int(across), max(columns - 2, 0))
            right = min(left + 1, columns - 1)
            a = across - np.float32(left)
            share = weight * (np.float32(1.0) - transmittance[v, u])
            for c in range(3):
                above = blurred[upper, left, c] + (blurred[upper, right, c] - blurred[upper, left, c]) * a
                below = blurred[lower, left, c] + (blurred[lower, right, c] - blurred[lower, left, c]) * a
                luminance[v, u, c] += share * (above + (below - above) * b - difference[v, u, c])
