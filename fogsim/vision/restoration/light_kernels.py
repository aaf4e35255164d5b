"""Compiled passes over pixels: light by look-up, Koschmieder's law undone, light written again.

Every kernel is called with C-contiguous arrays of the dtypes in its docstring.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
Floats = NDArray[np.float32]


class Smoothing(NamedTuple):
    """What is smoothed where the gain is large: luminance toward its mean, colours toward grey."""

    # luminance, mean, square (rows, cols): luminance relative to the airlight, and means of it and of its square over
    # windows; (0, 0) without smoothing
    luminance: Floats
    mean: Floats
    square: Floats
    # Variance of the luminance that is taken for noise where nothing comes through; 0 smooths nothing
    noise: np.float32
    # How many times that, in the sum of the channels' squared differences to the luminance, is noise of colour
    colour: np.float32


@kernel
def relative_light(pixels: Pixels, tables: Floats) -> Floats:
    """Light relative to the airlight, (rows, cols, channels) float32.

    Takes `pixels` (rows, cols, channels) uint8, `tables` (channels, levels).
    """
    rows, cols, channels = pixels.shape
    out = np.empty((rows, cols, channels), np.float32)
    for row in range(rows):
        for col in range(cols):
            for channel in range(channels):
                out[row, col, channel] = tables[channel, pixels[row, col, channel]]
    return out


@kernel
def least_block_means(pixels: Pixels, tables: Floats, side: int) -> Floats:
    """Smallest channel of the mean relative light of square blocks, (rows // side, cols // side) float32.

    Takes `pixels` (rows, cols, channels) uint8, `tables` (channels, levels), `side` [px].
    """
    rows, cols, channels = pixels.shape[0] // side, pixels.shape[1] // side, pixels.shape[2]
    out = np.empty((rows, cols), np.float32)
    sums = np.empty((channels, cols), np.float32)
    for row in range(rows):
        sums[:] = np.float32(0.0)
        for below in range(side):
            for col in range(cols):
                for right in range(side):
                    for channel in range(channels):
                        value = pixels[row * side + below, col * side + right, channel]
                        sums[channel, col] += tables[channel, value]
        for col in range(cols):
            least = sums[0, col]
            for channel in range(1, channels):
                least = min(least, sums[channel, col])
            out[row, col] = least / np.float32(side * side)
    return out


@kernel
def luminance(pixels: Pixels, tables: Floats) -> Floats:
    """Weighted sum of the channels' light, (rows, cols) float32.

    Takes `pixels` (rows, cols, channels) uint8, `tables` (channels, levels).
    """
    rows, cols, channels = pixels.shape
    out = np.empty((rows, cols), np.float32)
    for row in range(rows):
        for col in range(cols):
            total = np.float32(0.0)
            for channel in range(channels):
                total += tables[channel, pixels[row, col, channel]]
            out[row, col] = total
    return out


@kernel
def restored_light(pixels: Pixels, tables: Floats, transmission: Floats, smoothing: Smoothing, stride: int) -> Floats:
    """Koschmieder's law undone, relative to the airlight, of every so manyeth pixel of every so manyeth row.

    Returns 1 + (I − 1) / t. Takes `stride` [px].
    """
    rows, cols, channels = pixels.shape
    out = np.empty(((rows + stride - 1) // stride, (cols + stride - 1) // stride, channels), np.float32)
    for row in range(0, rows, stride):
        for col in range(0, cols, stride):
            last = pixels[row, col, channels - 1]
            red, green, blue = _restored(
                tables[0, pixels[row, col, 0]],
                tables[channels // 2, pixels[row, col, channels // 2]],
                tables[channels - 1, last],
                transmission[row, col],
                smoothing,
                row,
                col,
            )
            out[row // stride, col // stride, 0] = red
            if channels == 3:
                out[row // stride, col // stride, 1] = green
                out[row // stride, col // stride, 2] = blue
    return out


@kernel
def restored_pixels(
    pixels: Pixels, tables: Floats, transmission: Floats, smoothing: Smoothing, scale: Floats, values: Pixels
) -> Pixels:
    """Koschmieder's law undone, in pixel values, (rows, cols, channels) of the dtype of `values`.

    Takes `pixels` (rows, cols, channels) uint8, `tables` (channels, levels), `transmission` (rows, cols), `scale`
    (channels,), `values` (steps,) uint8.
    """
    rows, cols, channels = pixels.shape
    out = np.empty((rows, cols, channels), values.dtype)
    for row in range(rows):
        for col in range(cols):
            if channels == 3:
                red, green, blue = _restored(
                    tables[0, pixels[row, col, 0]],
                    tables[1, pixels[row, col, 1]],
                    tables[2, pixels[row, col, 2]],
                    transmission[row, col],
                    smoothing,
                    row,
                    col,
                )
                out[row, col, 0] = _value(red, scale[0], values)
                out[row, col, 1] = _value(green, scale[1], values)
                out[row, col, 2] = _value(blue, scale[2], values)
            else:
                grey = tables[0, pixels[row, col, 0]]
                grey, _, _ = _restored(grey, grey, grey, transmission[row, col], smoothing, row, col)
                out[row, col, 0] = _value(grey, scale[0], values)
    return out


@kernel
def _value(light: Any, scale: Any, values: Pixels) -> Any:
    """Pixel value of light."""
    place = light * scale + np.float32(0.5)
    # The bound stands first: it, and not NaN, is what a comparison with NaN gives.
    return values[np.int64(min(np.float32(len(values) - 1), max(np.float32(0.0), place)))]


@kernel
def _restored(
    red: Any, green: Any, blue: Any, through: Any, smoothing: Smoothing, row: int, col: int
) -> tuple[Any, Any, Any]:
    """Light of one pixel without the veil, relative to the airlight."""
    one, none = np.float32(1.0), np.float32(0.0)
    gain = one / through
    noise = smoothing.noise * (one - through)
    if noise <= none:
        return one + (red - one) * gain, one + (green - one) * gain, one + (blue - one) * gain
    here, mean = smoothing.luminance[row, col], smoothing.mean[row, col]
    variance = smoothing.square[row, col] - mean * mean
    kept = max(one - noise / max(variance, noise), none)
    red, green, blue = red - here, green - here, blue - here
    colour = red * red + green * green + blue * blue
    hue = colour / (colour + smoothing.colour * noise)
    smoothed = one + (mean + kept * (here - mean) - one) * gain
    hue *= gain
    return smoothed + hue * red, smoothed + hue * green, smoothed + hue * blue
