"""From radiance to an 8-bit image: exposure, photon and read noise, response and quantisation."""

from dataclasses import dataclass
from functools import cache
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from fogsim.camera.kernels import NORMAL_TABLE_BITS, RESPONSE_STEPS, develop
from fogsim.response import respond
from fogsim.values import Response


@dataclass(frozen=True, slots=True)
class Sensor:
    """What an image sensor does to light.

    Attributes
    ----------
    saturation_luminance : float
        Luminance that just fills a pixel at the fixed exposure [cd/m²].
    full_well : float
        Electrons that fill a pixel [e⁻]; a filled pixel's photon noise is 1 / √full_well.
    read_noise : float
        Standard deviation of the read-out noise [e⁻].
    """

    saturation_luminance: float
    full_well: float = 10_000.0
    read_noise: float = 5.0


def expose(
    radiance: NDArray[np.float32], sensor: Sensor, response: Response, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Take an image.

    Photon noise is drawn as normal with the Poisson distribution's variance, which at the tens of electrons and more
    that fog gives is the same (EMVA 1288: σ² = σ_read² + electrons).

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
    (rows, cols, 3) uint8
        Pixel values.
    """
    out = np.empty(radiance.shape, dtype=np.uint8)
    develop(
        np.ascontiguousarray(radiance, dtype=np.float32),
        1.0 / sensor.saturation_luminance,
        1.0 / sensor.full_well,
        (sensor.read_noise / sensor.full_well) ** 2,
        int(rng.integers(1 << 62)),
        _normal_table(),
        response_table(response),
        out,
    )
    return out


@cache
def _normal_table() -> NDArray[np.float32]:
    """Standard normal deviates at the middles of 2^16 equally likely classes."""
    count = 1 << NORMAL_TABLE_BITS
    inverse = NormalDist().inv_cdf
    table = np.array([inverse((i + 0.5) / count) for i in range(count)], dtype=np.float32)
    table.setflags(write=False)
    return table


@cache
def response_table(response: Response) -> NDArray[np.uint8]:
    """Pixel value for exposure in even steps from 0 to saturation.

    Returns
    -------
    (2^14 + 1,) uint8
        Read-only.
    """
    exposure = np.linspace(0.0, 1.0, RESPONSE_STEPS + 1)
    table = np.round(255.0 * respond(exposure, response)).astype(np.uint8)
    table.setflags(write=False)
    return table
