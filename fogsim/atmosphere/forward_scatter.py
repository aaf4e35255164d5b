"""Forward scattering by day: light that droplets turn by little still arrives, but blurred."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_COARSEST = 2.0
"""The image is averaged to pixels of at most one such part of the blur's width before it is blurred."""


def forward_scattered(
    transmitted: NDArray[np.float32], transmission: NDArray[np.float32], weight: float, width: float
) -> NDArray[np.float32]:
    """What forward scattering adds to the light that a scene sends through fog.

    Of the transmitted light D = L0 T, the share w (1 − T) is exchanged for its own blur h ∗ D, h being a Gaussian:
    nothing in clear air, most for what lies deep in the fog. Where D is even, nothing changes. Forward lobes of fog
    droplets are 1° to 2° wide; weight and width are assumptions, not measurements.

    Parameters
    ----------
    transmitted : (rows, cols, 3) float32
        L0 T [cd/m²].
    transmission : (rows, cols) float32
        T.
    weight : float
        w, 0 … 0.3.
    width : float
        Standard deviation of the blur [px].

    Returns
    -------
    (rows, cols, 3) float32
        To be added to the radiance at the camera [cd/m²].
    """
    rows, columns = transmission.shape
    block = max(1, int(width / _COARSEST))
    small = _block_means(transmitted, block)
    down, across = _spread(rows, small.shape[0], block, width), _spread(columns, small.shape[1], block, width)
    blurred = np.stack([down @ small[..., c] @ across.T for c in range(3)], axis=-1)
    return np.asarray((weight * (1.0 - transmission))[..., None] * (blurred - transmitted), dtype=np.float32)


def _block_means(image: NDArray[np.float32], block: int) -> NDArray[np.float32]:
    """Averages over squares; those at the far edges are filled up with the outermost pixels."""
    rows, columns = image.shape[:2]
    padded = np.pad(image, ((0, -rows % block), (0, -columns % block), (0, 0)), mode="edge")
    shape = (padded.shape[0] // block, block, padded.shape[1] // block, block, 3)
    return np.asarray(padded.reshape(shape).mean(axis=(1, 3)))


@lru_cache(maxsize=8)
def _spread(fine: int, coarse: int, block: int, width: float) -> NDArray[np.float32]:
    """Matrix (fine, coarse) from averages of blocks to blurred pixels; its rows sum to 1."""
    middles = (np.arange(coarse) + 0.5) * block - 0.5
    away = (np.arange(fine)[:, None] - middles) / width
    weights = np.exp(-0.5 * np.square(away))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True), dtype=np.float32)


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
