"""From pixel values to linear luminance: the inverse of the camera's response, and the weights of the colours."""

import math
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.units import LUMINANCE_WEIGHTS
from fogsim.values.camera import Camera, Response
from fogsim.values.camera_response import exposure_of
from fogsim.vision.light import pixel_kernels
from fogsim.vision.light.pixel_kernels import LinearPixels, Pixels


@lru_cache(maxsize=6 * len(Response))
def linear_table(response: Response, bits: int = 8, black_level: float = 0.0) -> NDArray[np.float32]:
    """Light behind each pixel value, in linear grey levels that are the same for every bit depth.

    Returns linear grey levels, read-only: 0 at the black level, 255 the last. sRGB: IEC 61966-2-1.
    """
    share = np.arange(2**bits, dtype=np.float64) / (2**bits - 1)
    table: NDArray[np.float32] = (255.0 * exposure_of(share, response, black_level)).astype(np.float32)
    table.flags.writeable = False
    return table


def linear_pixels(image: Pixels, camera: Camera) -> LinearPixels:
    """Pair an image with the inverse of its camera's response; no pixel is touched (`image` (rows, cols))."""
    pixels: NDArray[Any] = np.ascontiguousarray(image if image.ndim == 3 else image[:, :, None])
    return LinearPixels(pixels, _tables(camera.response, camera.bits, camera.black_level, image.ndim == 3))


@lru_cache(maxsize=6 * len(Response))
def _tables(response: Response, bits: int, black_level: float, is_colour: bool) -> NDArray[np.float32]:
    """What each channel adds to the luminance (channels, levels); it is shared."""
    weights = np.array(LUMINANCE_WEIGHTS if is_colour else (1.0,), np.float32)
    return weights[:, None] * linear_table(response, bits, black_level)


def linear_luminance(image: Pixels, response: Response, bits: int = 8, black_level: float = 0.0) -> NDArray[np.float32]:
    """Undo a camera's response and weigh the colours to luminance (ITU-R BT.709).

    Returns linear grey levels 0 … 255 at every bit depth; of a grey image and of a colour image with three equal
    channels the same (rows, cols). Takes `image` (rows, cols).
    """
    expected = np.uint8 if bits == 8 else np.uint16
    if image.dtype != expected:
        raise InputError(f"an image of {bits} bits must have dtype {np.dtype(expected)}, got {image.dtype}")
    # A copy of the cached table: numba would compile a second kernel for a read-only array.
    table = linear_table(response, bits, black_level).copy()
    pixels: NDArray[Any] = np.ascontiguousarray(image)
    luminance_of = pixel_kernels.grey_luminance if pixels.ndim == 2 else pixel_kernels.colour_luminance
    return luminance_of(pixels, table)


_LEAST, _MOST = 0.002, 0.98
"""Shares of clipped pixels below which nothing is missing, and above which what is missing cannot be known [-]."""

_LOWER = 0.3
"""Which of the pixels that are not clipped lie below the lower of the two lights that are looked at [-]."""

_ROUNDS = 16
"""Rounds of the search for the light behind a clipped mean: each halves its error at least."""

_NORMAL = NormalDist()


@dataclass(frozen=True, slots=True)
class Clipping:
    """What clipping does to an even surface."""

    loss: float  # By how much its mean luminance comes out too low [linear grey levels]
    # Deviation of the luminance of single pixels, were none clipped; 0 where none is, or all [linear grey levels]
    noise: float
    spread: float  # The same of their single channels [linear grey levels]


def clipping(pixels: Pixels, camera: Camera) -> Clipping:
    """Loss of light by clipping, from how many pixels are clipped and how far the others lie below.

    Noise about a light near the largest value is cut off on one side. Of a normal law μ, σ the shares p₁ and p₂ below
    two lights c₁ and c₂ give both: cᵢ = μ + σ Φ⁻¹(pᵢ).

    Takes `pixels` (n,).
    """
    channels = pixels.reshape(pixels.shape[0], -1)
    weights = LUMINANCE_WEIGHTS if channels.shape[1] == 3 else (1.0,)
    loss = variance = spread = 0.0
    for index, weight in enumerate(weights):
        lost, noise = _censored(channels[:, index], camera)
        loss += weight * lost
        variance += (weight * noise) ** 2
        spread += weight * noise
    return Clipping(loss, math.sqrt(variance), spread)


def darker_by(fall: float, headroom: float, spread: float) -> tuple[float, float]:
    """By how much pixels of an even surface are darker than the airlight, of how much they seem to be.

    Returns how much darker they are, and what of the seeming was lost light.
    """
    if spread <= 0.0:
        return fall, 0.0
    true = fall
    for _ in range(_ROUNDS):
        above = (headroom + true) / spread
        lost = spread * (_NORMAL.pdf(above) - above * (1.0 - _NORMAL.cdf(above)))
        true = fall - lost
    return true, fall - true


def _censored(values: Pixels, camera: Camera) -> tuple[float, float]:
    """By how much the mean of one channel is too low, and its noise."""
    top = 2**camera.bits - 1
    share = np.count_nonzero(values == top) / max(values.size, 1)
    if not _LEAST <= share <= _MOST:
        return 0.0, 0.0
    upto = np.cumsum(np.bincount(values, minlength=top + 1)) / values.size
    # Two values between which pixel values change, and the shares of pixels below them: rounding changes neither.
    lower = int(np.argmin(np.abs(upto[: top - 1] - _LOWER * upto[top - 1])))
    if upto[lower] < _LEAST:
        return 0.0, 0.0
    high, low = (
        float(v)
        for v in 255.0 * exposure_of(np.array([top - 0.5, lower + 0.5]) / top, camera.response, camera.black_level)
    )
    above, below = _NORMAL.inv_cdf(1.0 - share), _NORMAL.inv_cdf(float(upto[lower]))
    if above - below < _LEAST:
        return 0.0, 0.0
    noise = (high - low) / (above - below)
    mean = float(linear_table(camera.response, camera.bits, camera.black_level)[values].mean(dtype=np.float64))
    return high - above * noise - mean, noise
