"""Response curves of cameras and their inverses: what the camera and the reading of its images share."""

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Response

GAMMA = 2.2
"""Exponent of `Response.GAMMA` [-]."""


def respond(exposure: NDArray[np.float64], response: Response, black_level: float = 0.0) -> NDArray[np.float64]:
    """Signal for a relative exposure, both 0 … 1 (sRGB: IEC 61966-2-1)."""
    if black_level > 0:
        exposure = black_level + (1.0 - black_level) * exposure
    match response:
        case Response.LINEAR:
            return exposure
        case Response.GAMMA:
            return np.asarray(exposure ** (1.0 / GAMMA))
        case Response.SRGB:
            bright = 1.055 * np.maximum(exposure, 0.0031308) ** (1.0 / 2.4) - 0.055
            return np.where(exposure <= 0.0031308, 12.92 * exposure, bright)


def eight_bit(image: NDArray[np.uint8] | NDArray[np.uint16], bits: int) -> NDArray[np.uint8]:
    """Return an image in 8 bits, as screens show it; one that has them is returned itself."""
    return (image >> (bits - 8)).astype(np.uint8) if bits > 8 else image.astype(np.uint8, copy=False)


def exposure_of(signal: NDArray[np.float64], response: Response, black_level: float = 0.0) -> NDArray[np.float64]:
    """Relative exposure behind a signal, both 0 … 1: the inverse of `respond` (sRGB: IEC 61966-2-1).

    Of a signal below the black level, as noise makes some, it is negative, so that means over pixels stay right.
    """
    linear = signal
    if response is Response.GAMMA:
        linear = np.asarray(signal**GAMMA)
    elif response is Response.SRGB:
        linear = np.where(signal <= 0.04045, signal / 12.92, ((signal + 0.055) / 1.055) ** 2.4)
    return (linear - black_level) / (1.0 - black_level) if black_level > 0 else linear
