"""From luminance to pixel values, sample by sample: averaging, metering, exposure with noise, and response."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.units import LUMINANCE_WEIGHTS

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
def develop(
    luminance: NDArray[np.float32],
    exposure: Exposure,
    response: NDArray[np.uint8] | NDArray[np.uint16],
    begin: int,
    end: int,
    out: NDArray[np.uint8] | NDArray[np.uint16],
) -> None:
    """Pixel values of the samples from `begin` to before `end`.

    Takes `luminance` (samples,) [cd/m²], `response` (levels,) uint8, `out` (samples,) uint8.
    """
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
def luminance_samples(image: NDArray[np.float32], stride: int, out: NDArray[np.float32]) -> None:
    """Luminance of every stride-th pixel of every stride-th row, from the middle of the first block.

    Takes `image` (rows, cols, 3) [cd/m²], `out` [cd/m²].
    """
    rows, cols = out.shape
    for row in range(rows):
        line = image[row * stride + stride // 2]
        for col in range(cols):
            pixel = line[col * stride + stride // 2]
            out[row, col] = _RED * pixel[0] + _GREEN * pixel[1] + _BLUE * pixel[2]
