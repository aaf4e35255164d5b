"""Band-limited random factors on a periodic grid: the thick and thin places of patchy fog."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

CELLS = 5
"""Cells of the grid in one correlation length: between them, linear interpolation loses little."""

SHAPE = (32, 128, 128)
"""Cells (z, y, x) before the pattern repeats: 25 correlation lengths horizontally, 6 vertically."""


@lru_cache(maxsize=4)
def patch_factors(strength: float, seed: int) -> NDArray[np.float32]:
    """Log-normal factors with mean 1 over a periodic grid.

    Their logarithm is white noise through a Gaussian filter, so that it is Gaussian with the correlation
    e^(−(Δ/`CELLS`)²) over Δ cells.

    Parameters
    ----------
    strength : float
        Standard deviation of the logarithm [-].
    seed : int
        Seed of the noise.

    Returns
    -------
    (32, 128, 128) float32
        Positive factors over (z, y, x); read-only.
    """
    white = np.random.default_rng(seed).standard_normal(SHAPE, dtype=np.float32)
    squares = [np.square(2.0 * np.pi * np.fft.fftfreq(n)) for n in SHAPE[:2]]
    squares.append(np.square(2.0 * np.pi * np.fft.rfftfreq(SHAPE[2])))
    wave_number_squared = squares[0][:, None, None] + squares[1][:, None] + squares[2]
    # The spectrum of e^(−(Δ/c)²) is e^(−(c κ/2)²); the filter of amplitudes is its root.
    amplitude = np.exp(-wave_number_squared * CELLS**2 / 8.0)
    smooth = np.fft.irfftn(np.fft.rfftn(white) * amplitude, s=SHAPE, axes=(0, 1, 2))
    factors = np.exp(strength * (smooth - smooth.mean()) / smooth.std())
    factors = np.ascontiguousarray(factors / factors.mean(), dtype=np.float32)
    factors.setflags(write=False)
    return factors
