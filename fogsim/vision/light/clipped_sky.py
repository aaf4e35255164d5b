"""Light of an even sky, some of whose pixels are clipped: what the sensor cut off is put back."""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from fogsim.units import LUMINANCE_WEIGHTS
from fogsim.values.camera import Camera
from fogsim.values.camera_response import exposure_of
from fogsim.vision.light.luminance import linear_table
from fogsim.vision.light.pixel_kernels import Pixels

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
    upto = np.cumsum(np.bincount(values, minlength=top + 1)) / max(values.size, 1)
    share = 1.0 - float(upto[top - 1])
    if not _LEAST <= share <= _MOST:
        return 0.0, 0.0
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
