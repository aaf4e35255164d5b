"""The veil taken away, given the transmission, and noise smoothed before it is amplified."""

import numpy as np

from fogsim.restoration import light_kernels
from fogsim.restoration.guided_filter import box_mean
from fogsim.restoration.light_kernels import Smoothing
from fogsim.restoration.picture import Floats, FoggyPicture, Pixels, written_values
from fogsim.restoration.tone_map import tone_curve
from fogsim.units import LUMINANCE_WEIGHTS

STRIDE = 4
"""Every how manyeth pixel of every how manyeth row is looked at for noise and tones."""

RADIUS, MORE_NOISE, COLOUR_NOISE = 2, 4.0, 2.0
"""Windows in which noise is smoothed are 2 r + 1 wide [px]; what counts as noise, in its variance: local variances
scatter, and three channels have more of it than their mean. Chosen on pool 0 of benchmarks/restoration.py."""


def without_veil(picture: FoggyPicture, transmission: Floats, *, smooths: bool, tone_map: bool) -> Pixels:
    """Undo Koschmieder's law, R = A + (I − A) / t, in pixel values.

    Returns like the picture's (rows, cols, channels) uint8. Takes `transmission` (rows, cols).
    """
    tables = picture.relative_tables()
    smoothing = _smoothing(picture, tables, transmission) if smooths else _no_smoothing()
    curve = None
    if tone_map:
        light = light_kernels.restored_light(picture.pixels, tables, transmission, smoothing, STRIDE)
        curve = tone_curve(light, transmission[::STRIDE, ::STRIDE], picture)
    values = written_values(picture, curve)
    scale = ((len(values) - 1) * picture.airlight).astype(np.float32)
    return light_kernels.restored_pixels(picture.pixels, tables, transmission, smoothing, scale, values)


def _smoothing(picture: FoggyPicture, tables: Floats, transmission: Floats) -> Smoothing:
    """Local statistics of the luminance, and its noise where least light comes through: the median variance there."""
    weights = np.array(LUMINANCE_WEIGHTS if len(tables) == 3 else (1.0,), np.float32)
    light = light_kernels.luminance(picture.pixels, tables * weights[:, None])
    mean, square = box_mean(light, RADIUS), box_mean(light * light, RADIUS)
    some = (slice(None, None, STRIDE), slice(None, None, STRIDE))
    veiled = transmission[some] < 1.5 / picture.most_gain
    if not veiled.any():
        return _no_smoothing()
    noise = max(float(np.median((square[some] - mean[some] ** 2)[veiled])), 0.0)
    return Smoothing(light, mean, square, np.float32(MORE_NOISE * noise), np.float32(COLOUR_NOISE))


def _no_smoothing() -> Smoothing:
    nothing = np.empty((0, 0), np.float32)
    return Smoothing(nothing, nothing, nothing, np.float32(0.0), np.float32(0.0))
