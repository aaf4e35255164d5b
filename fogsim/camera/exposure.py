"""From radiance to pixel values: exposure, photon and read noise, response and quantisation."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fogsim.camera.kernels import develop
from fogsim.jit import Bands
from fogsim.values import Response
from fogsim.values.camera_response import respond

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
"""Pixel values: of 8 bits, or of 10 or 12 in 16."""

RESPONSE_STEPS = {8: 1 << 13, 10: 1 << 15, 12: 1 << 17}
"""Resolution of the response table by bit depth: finer than a level even in the steepest part of the sRGB curve."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """What an image sensor does to light.

    Attributes
    ----------
    saturation_luminance : float
        Luminance that just fills a pixel at its exposure [cd/m²].
    full_well : float
        Electrons that fill a pixel [e⁻]; a filled pixel's photon noise is 1 / √full_well.
    read_noise : float
        Standard deviation of the read-out noise [e⁻].
    bits : int
        Bit depth: 8, 10 or 12.
    """

    saturation_luminance: float
    full_well: float = 10_000.0
    read_noise: float = 5.0
    bits: int = 8


def expose(radiance: NDArray[np.float32], sensor: Sensor, response: Response, rng: np.random.Generator) -> Pixels:
    """Take an image.

    Photon noise is drawn as normal with the Poisson distribution's variance, which at the tens of electrons and more
    that fog gives is the same (EMVA 1288: σ² = σ_read² + electrons). No draw is further than 4.5 σ from the mean.

    Parameters
    ----------
    radiance : (rows, cols, 3) float32
        Linear radiance at the camera [cd/m²].
    sensor : Sensor
        The sensor.
    response : Response
        Curve from exposure to pixel value.
    rng : numpy.random.Generator
        Source of the noise; one draw is taken for a frame.

    Returns
    -------
    (rows, cols, 3) uint8, or uint16 for more than 8 bits
        Pixel values 0 … 2^bits − 1.
    """
    table = response_table(response, sensor.bits)
    out = np.empty(radiance.shape, dtype=table.dtype)
    key = int(rng.integers(1 << 62))
    rows, columns, _ = radiance.shape
    light, values = np.ascontiguousarray(radiance, dtype=np.float32).reshape(-1), out.reshape(-1)
    gain, per_electron = np.float32(1.0 / sensor.saturation_luminance), np.float32(1.0 / sensor.full_well)
    read_variance = np.float32((sensor.read_noise / sensor.full_well) ** 2)
    keys = np.uint32(key & 0xFFFFFFFF), np.uint32(key >> 32)

    def expose_rows(_: int, top: int, bottom: int) -> None:
        begin, end = 3 * columns * top, 3 * columns * bottom
        develop(light, gain, per_electron, read_variance, *keys, table, begin, end, values)

    Bands().work(expose_rows, rows, columns)
    return out


@cache
def response_table(response: Response, bits: int = 8) -> Pixels:
    """Pixel value for exposure in even steps from 0 to saturation.

    Parameters
    ----------
    response : Response
        The curve.
    bits : int
        Bit depth: 8, 10 or 12.

    Returns
    -------
    (RESPONSE_STEPS[bits] + 1,) uint8, or uint16 for more than 8 bits
        Read-only.
    """
    exposure = np.linspace(0.0, 1.0, RESPONSE_STEPS[bits] + 1)
    levels = np.round((2**bits - 1) * respond(exposure, response))
    table: Pixels = levels.astype(np.uint8) if bits == 8 else levels.astype(np.uint16)
    table.setflags(write=False)
    return table
