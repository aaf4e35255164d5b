"""From luminance to pixel values: metering, exposure, photon and read noise, response and quantisation."""

import math
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import Bands, kernel
from fogsim.units import LUMINANCE_WEIGHTS
from fogsim.values import Camera, Response
from fogsim.values.camera_response import respond

_MEAN, _FIRST, _THIRD, _FIFTH = 510.0, 6.5477767300336385e-3, 1.2394842240073496e-9, 2.7005539623815466e-14
"""What makes the sum of four evenly distributed bytes, less its mean, a normal deviate: an odd polynomial fitted to the
quantiles of both, of variance 1 and kurtosis 2.997; its distribution is within 0.0008 of the normal one everywhere."""

_BLOCK = 1024
"""Samples that go through the stages together: few enough for their buffers to stay in the nearest cache."""

_MOST_EXPOSURE = np.float32(4.0)
"""Exposure to which light is clipped before the noise, relative to saturation: beyond any doubt that it saturates."""

_RED, _GREEN, _BLUE = (np.float32(share) for share in LUMINANCE_WEIGHTS)


class Exposure(NamedTuple):
    """How light becomes a signal, and the noise in it."""

    gain: np.float32  # Exposure relative to saturation per luminance [m²/cd]
    # shot_variance, read_variance: variance of the shot noise per exposure, and of the read noise, relative to
    # saturation²
    shot_variance: np.float32
    read_variance: np.float32
    black_level: np.float32  # What the sensor reads without light, relative to saturation
    # first_key, second_key: what tells the noise of one frame from that of another
    first_key: np.uint32
    second_key: np.uint32


@kernel
def _develop(
    luminance: NDArray[np.float32],
    exposure: Exposure,
    response: NDArray[np.uint8] | NDArray[np.uint16],
    begin: int,
    end: int,
    out: NDArray[np.uint8] | NDArray[np.uint16],
) -> None:
    """Pixel values `out` of the samples (samples,) from `begin` to before `end`; `luminance` [cd/m²]."""
    gain, shot_variance, read_variance = exposure.gain, exposure.shot_variance, exposure.read_variance
    black_level = exposure.black_level
    top, half = np.float32(response.shape[0] - 1), np.float32(0.5)
    zero, one = np.float32(0.0), np.float32(1.0)
    index = np.empty(_BLOCK, np.uint32)
    mean, first, third, fifth = np.float32(_MEAN), np.float32(_FIRST), np.float32(_THIRD), np.float32(_FIFTH)
    for start in range(begin, end, _BLOCK):
        count = min(_BLOCK, end - start)
        light, pixels = luminance[start : start + count], out[start : start + count]
        _hash_counters(np.uint32(start), count, exposure.first_key, exposure.second_key, index)
        for i in range(count):
            signal = light[i] * gain
            # Written so that what is not a number counts as black, and never as an index into nowhere.
            signal = signal if signal > zero else zero
            signal = signal if signal < _MOST_EXPOSURE else _MOST_EXPOSURE
            pairs = (index[i] & np.uint32(0x00FF00FF)) + ((index[i] >> np.uint32(8)) & np.uint32(0x00FF00FF))
            off = np.float32(np.int32((pairs & np.uint32(0xFFFF)) + (pairs >> np.uint32(16)))) - mean
            square = off * off
            noise = off * (first + square * (third + square * fifth))
            signal += noise * np.float32(math.sqrt(shot_variance * signal + read_variance))
            signal += black_level
            signal = signal if signal > zero else zero
            signal = signal if signal < one else one
            index[i] = np.uint32(np.int32(signal * top + half))
        for i in range(count):
            pixels[i] = response[index[i]]


@kernel
def _hash_counters(
    start: np.uint32, count: int, first_key: np.uint32, second_key: np.uint32, index: NDArray[np.uint32]
) -> None:
    """Evenly distributed numbers of 32 bits for the samples from `start` on.

    A counter through multiply and xor-shift with full avalanche (the constants are those of Wellons' lowbias32), in 32
    bits, which vector units multiply. The second key enters midway: with a first one alone, the noise of one frame
    could be that of another, shifted.
    """
    for i in range(count):
        mixed = np.uint32((start + np.uint32(i)) ^ first_key)
        mixed ^= mixed >> np.uint32(16)
        mixed = np.uint32(mixed * np.uint32(0x7FEB352D))
        mixed ^= mixed >> np.uint32(15)
        mixed = np.uint32(mixed + second_key)
        mixed = np.uint32(mixed * np.uint32(0x846CA68B))
        index[i] = mixed ^ (mixed >> np.uint32(16))


@kernel
def block_means(fine: NDArray[np.float32], side: int, out: NDArray[np.float32]) -> None:
    """Mean of each block of side × side samples (`fine` (side · rows, side · cols · 3), `out` (rows, cols, 3))."""
    rows, cols, _ = out.shape
    share = np.float32(1.0 / (side * side))
    total = np.empty(fine.shape[1], np.float32)
    for row in range(rows):
        total[:] = fine[side * row]
        for k in range(1, side):
            line = fine[side * row + k]
            # A loop of its own for each line of samples, so that the compiler makes vector instructions of it.
            for i in range(total.shape[0]):
                total[i] += line[i]
        for col in range(cols):
            block, pixel = total[3 * side * col : 3 * side * (col + 1)], out[row, col]
            for channel in range(3):
                light = np.float32(0.0)
                for k in range(side):
                    light += block[3 * k + channel]
                pixel[channel] = light * share


@kernel
def _luminance_samples(image: NDArray[np.float32], stride: int, out: NDArray[np.float32]) -> None:
    """Luminance [cd/m²] of every stride-th pixel of every stride-th row, from the middle of the first block."""
    rows, cols = out.shape
    for row in range(rows):
        line = image[row * stride + stride // 2]
        for col in range(cols):
            pixel = line[col * stride + stride // 2]
            out[row, col] = _RED * pixel[0] + _GREEN * pixel[1] + _BLUE * pixel[2]


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
    """Take an image (rows, cols, 3) of pixel values 0 … 2^bits − 1 from a radiance of that shape [cd/m²].

    Photon noise is drawn as normal with the Poisson distribution's variance, which at the tens of electrons and more
    that fog gives is the same (EMVA 1288: σ² = σ_read² + electrons). No draw is further than 4.5 σ from the mean.
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
        _develop(light, exposure, table, begin, end, values)

    Bands().work(expose_rows, rows, columns)
    return out


def unexposed(camera: Camera) -> Pixels:
    """What a camera hands out before its first exposure: a black picture (rows, cols, 3) uint8, read-only."""
    shape = (camera.height, camera.width, 3)
    black: Pixels = np.zeros(shape, np.uint8) if camera.bits == 8 else np.zeros(shape, np.uint16)
    black.setflags(write=False)
    return black


@cache
def response_table(response: Response, bits: int = 8) -> Pixels:
    """Pixel value for exposure in even steps from 0 to saturation, read-only."""
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
    _luminance_samples(np.ascontiguousarray(radiance, dtype=np.float32), stride, samples)
    if metering is Metering.HIGHLIGHTS:
        ordered, place = samples.reshape(-1), int(_HIGHLIGHT_SHARE * (samples.size - 1))
        ordered.partition(place)
        return float(ordered[place])
    return math.exp(float(np.mean(np.log(np.maximum(samples, _DARKEST_METERED, dtype=np.float64)))))


def wanted_saturation(luminance: float, auto: AutoExposure) -> float:
    """Saturation that puts a metered luminance at the target, as far as the camera's limits allow [cd/m²]."""
    return min(max(luminance / auto.target, auto.darkest), auto.brightest)


def followed(saturation: float, wanted: float, auto: AutoExposure, period: float) -> float:
    """Saturation one frame (`period` [s]) later: of first order in its logarithm, as photographers' stops [cd/m²]."""
    share = -math.expm1(-period / auto.time_constant) if auto.time_constant > 0 else 1.0
    return float(saturation * (wanted / saturation) ** share)


def sensor_at(sensor: Sensor, saturation: float, auto: AutoExposure) -> Sensor:
    """Sensor at an exposure (`saturation` [cd/m²]).

    Exposure time makes no noise. Where even the longest is too short the signal is amplified, and the fewer electrons
    that then fill a pixel's range make it noisier. What the read-out adds after the amplifier counts for ever less
    electrons, as EMVA 1288 cameras show.
    """
    share, noise = min(1.0, saturation / auto.ungained), sensor.read_noise
    if sensor.gained_read_noise is not None:
        before = sensor.gained_read_noise
        noise = math.sqrt(before**2 + (noise**2 - before**2) * share**2)
    well, others = sensor.full_well * share, (sensor.bits, sensor.black_level, sensor.gained_read_noise)
    return Sensor(saturation, well, noise, *others)
