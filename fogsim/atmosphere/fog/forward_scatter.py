"""Forward scattering by day: light that droplets turn by little still arrives, but blurred."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.forward_scatter_kernels import blur_rows, exchange

_COARSEST = 2.0
"""The image is averaged to pixels of at most one such part of the blur's width before it is blurred."""

_REACH = 4.0
"""Widths within which all of a Gaussian lies."""

_DARK = 1e-12
"""Radiance that is none [cd/m²]; numbers near the smallest that exist are very slow."""


def add_forward_scatter(
    radiance: NDArray[np.float32],
    airlight: tuple[float, float, float],
    transmission: NDArray[np.float32],
    weight: float,
    width: float,
) -> None:
    """Add to an image what forward scattering does to the light that a scene sends through fog.

    Of D = (L0 − L∞) T, by which the scene differs from the airlight, the share w (1 − T) is exchanged for its own blur
    h ∗ D, h being a Gaussian: nothing in clear air, most for what lies deep in the fog. What is as bright as the
    airlight stays so, and fog beside something dark is darker. Forward lobes of fog droplets are 1° to 2° wide; weight
    and width are assumptions, not measurements.

    Parameters
    ----------
    radiance : (rows, cols, 3) float32
        Radiance at the camera [cd/m²]; added to in place.
    airlight : tuple of float
        L∞ per channel [cd/m²].
    transmission : (rows, cols) float32
        T.
    weight : float
        w, 0 … 0.3.
    width : float
        Standard deviation of the blur [px].
    """
    block = max(1, int(width / _COARSEST))
    difference = radiance - np.array(airlight, np.float32)
    small = _block_means(difference, block)
    reach = math.ceil(_REACH * width / block)
    weights = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) * block / width)).astype(np.float32)
    across_first, blurred = np.empty_like(small), np.empty_like(small)
    blur_rows(small, weights, across_first)
    blur_rows(across_first.transpose(1, 0, 2), weights, blurred.transpose(1, 0, 2))
    exchange(radiance, difference, transmission, blurred, block, np.float32(weight))


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

    Parameters
    ----------
    angle : float
        Its width in directions [rad].
    focal_length : float
        Focal length [px].
    """
    return max(focal_length * math.tan(angle), 0.5)
