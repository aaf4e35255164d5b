"""From luminance to pixel values: metering, exposure, photon and read noise, response and quantisation."""

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fogsim.camera.exposure_kernels import Exposure, develop, luminance_samples
from fogsim.core.jit import Bands
from fogsim.values import Camera, Response
from fogsim.values.camera_response import respond

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
"""Pixel values: of 8 bits, or of 10 or 12 in 16."""

_RESPONSE_STEPS = {8: 1 << 13, 10: 1 << 15, 12: 1 << 17}
"""Resolution of the response table by bit depth: finer than a level even in the steepest part of the sRGB curve."""

_SAMPLES = 2400
"""About as many pixels as are metered, evenly spread: every 121st of a 640 × 480 image."""

_HIGHLIGHT_SHARE = 0.95
"""Quantile of luminance that `Metering.HIGHLIGHTS` goes by: bright surfaces and sky, yet not the lamps among them."""

_DARKEST_METERED = 1e-4
"""Luminance that darker pixels count as [cd/m²], so that black has a logarithm."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """What an image sensor does to light."""

    saturation_luminance: float  # Luminance that just fills a pixel at its exposure [cd/m²]
    full_well: float = 10_000.0  # Electrons that fill a pixel [e⁻]; a filled pixel's photon noise is 1 / √full_well
    read_noise: float = 5.0  # Standard deviation of the read-out noise [e⁻]
    bits: int = 8  # Bit depth: 8, 10 or 12
    black_level: float = 0.0  # Share of full scale at which it reads no light [-]
    # Read-out noise at very high gain [e⁻], where what comes after the amplifier no longer counts; None for the same
    gained_read_noise: float | None = None


def expose(radiance: NDArray[np.float32], sensor: Sensor, response: Response, rng: np.random.Generator) -> Pixels:
    """Take an image.

    Photon noise is drawn as normal with the Poisson distribution's variance, which at the tens of electrons and more
    that fog gives is the same (EMVA 1288: σ² = σ_read² + electrons). No draw is further than 4.5 σ from the mean.

    Returns pixel values 0 … 2^bits − 1 (rows, cols, 3) uint8. Takes `radiance` (rows, cols, 3) [cd/m²].
    """
    table = response_table(response, sensor.bits)
    out = np.empty(radiance.shape, dtype=table.dtype)
    key = int(rng.integers(1 << 62))
    rows, columns, _ = radiance.shape
    light, values = np.ascontiguousarray(radiance, dtype=np.float32).reshape(-1), out.reshape(-1)
    scale = 1.0 - sensor.black_level
    exposure = Exposure(
        gain=np.float32(scale / sensor.saturation_luminance),
        shot_variance=np.float32(scale / sensor.full_well),
        read_variance=np.float32((scale * sensor.read_noise / sensor.full_well) ** 2),
        black_level=np.float32(sensor.black_level),
        first_key=np.uint32(key & 0xFFFFFFFF),
        second_key=np.uint32(key >> 32),
    )

    def expose_rows(_: int, top: int, bottom: int) -> None:
        begin, end = 3 * columns * top, 3 * columns * bottom
        develop(light, exposure, table, begin, end, values)

    Bands().work(expose_rows, rows, columns)
    return out


def unexposed(camera: Camera) -> Pixels:
    """What a camera hands out before its first exposure: a black picture, read-only.

    Returns zeros (rows, cols, 3) uint8.
    """
    shape = (camera.height, camera.width, 3)
    black: Pixels = np.zeros(shape, np.uint8) if camera.bits == 8 else np.zeros(shape, np.uint16)
    black.setflags(write=False)
    return black


@cache
def response_table(response: Response, bits: int = 8) -> Pixels:
    """Pixel value for exposure in even steps from 0 to saturation.

    Returns read-only.
    """
    exposure = np.linspace(0.0, 1.0, _RESPONSE_STEPS[bits] + 1)
    levels = np.round((2**bits - 1) * respond(exposure, response))
    table: Pixels = levels.astype(np.uint8) if bits == 8 else levels.astype(np.uint16)
    table.setflags(write=False)
    return table


class Metering(StrEnum):
    """What of a picture sets its exposure: its bright parts (95th percentile), or the mean of its log luminance."""

    HIGHLIGHTS = "highlights"
    LOG_AVERAGE = "log_average"


@dataclass(frozen=True, slots=True)
class AutoExposure:
    """How a camera sets its own exposure."""

    metering: Metering  # What of a picture counts
    target: float  # Exposure at which the metered luminance is held, relative to saturation, 0 … 1
    # Time in which 63 % of a change of light, in its logarithm, is followed [s]; 0 for the next frame
    time_constant: float
    brightest: float  # Saturation luminance of the shortest exposure [cd/m²]
    ungained: float  # Saturation luminance of the longest exposure time without gain [cd/m²]
    darkest: float  # Saturation luminance of the longest exposure time with the most gain [cd/m²]


def metered_luminance(radiance: NDArray[np.float32], metering: Metering) -> float:
    """Luminance that stands for a picture [cd/m²] (`radiance` (rows, cols, 3) [cd/m²])."""
    rows, cols = radiance.shape[:2]
    stride = max(1, round(math.sqrt(rows * cols / _SAMPLES)))
    samples = np.empty((rows // stride, cols // stride), np.float32)
    luminance_samples(np.ascontiguousarray(radiance, dtype=np.float32), stride, samples)
    if metering is Metering.HIGHLIGHTS:
        place = int(_HIGHLIGHT_SHARE * (samples.size - 1))
        return float(np.partition(samples.ravel(), place)[place])
    return math.exp(float(np.mean(np.log(np.maximum(samples, _DARKEST_METERED, dtype=np.float64)))))


def wanted_saturation(luminance: float, auto: AutoExposure) -> float:
    """Saturation luminance that puts a metered luminance at the target, as far as the camera's limits allow [cd/m²].

    Takes `luminance` [cd/m²].
    """
    return min(max(luminance / auto.target, auto.darkest), auto.brightest)


def followed(saturation: float, wanted: float, auto: AutoExposure, period: float) -> float:
    """Saturation luminance one frame later: of first order in its logarithm, as photographers' stops are [cd/m²].

    Takes `saturation`, `wanted` [cd/m²], `period` [s].
    """
    share = -math.expm1(-period / auto.time_constant) if auto.time_constant > 0 else 1.0
    return float(saturation * (wanted / saturation) ** share)


def sensor_at(sensor: Sensor, saturation: float, auto: AutoExposure) -> Sensor:
    """Sensor at an exposure.

    Exposure time makes no noise. Where even the longest is too short the signal is amplified, and the fewer electrons
    that then fill a pixel's range make it noisier. What the read-out adds after the amplifier counts for ever less
    electrons, as EMVA 1288 cameras show.

    Takes `saturation` [cd/m²].
    """
    share, noise = min(1.0, saturation / auto.ungained), sensor.read_noise
    if sensor.gained_read_noise is not None:
        before = sensor.gained_read_noise
        noise = math.sqrt(before**2 + (noise**2 - before**2) * share**2)
    return replace(sensor, saturation_luminance=saturation, full_well=sensor.full_well * share, read_noise=noise)
