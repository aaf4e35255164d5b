"""The airlight of a picture, from the picture itself."""

import cv2
import numpy as np

from fogsim.units import LUMINANCE_WEIGHTS
from fogsim.values.camera import Camera
from fogsim.vision.restoration.picture import Floats, Light, Pixels, light_table

_NEAR_BAND, _BAND = 0.015, 0.15
"""Rows above the horizon that the airlight is sought in, as shares of the image's: foggy skies brighten upward, and
where trees or houses hide the horizon, only what is above them is sky."""

HIDDEN = 0.5
"""Luminance of the near band over the whole band's below which something hides the horizon [-]: real skies in fog
darken less over it (docs/explanation/airlight.md)."""

_BRIGHTEST = 1 / 3
"""Share of the band, the brightest, whose median is taken: trees and vehicles are darker [-]."""

_SIDE = 4
"""Side of the blocks whose means count [px]."""

_DARKEST = 0.001
"""Airlight of a black picture, relative to full scale [-]."""


def horizon_airlight(pixels: Pixels, camera: Camera, full: int) -> Light:
    """Airlight from what is just above the horizon, or from higher up where that is hidden.

    The median of the brightest third of each band, of each channel.

    Returns light relative to full scale (channels,). Takes `pixels` (rows, cols, channels) uint8.
    """
    rows = pixels.shape[0]
    bottom = round(min(max(camera.horizon_row, _BAND * rows), rows))
    near, whole = (
        _brightest(pixels[max(bottom - max(round(band * rows), _SIDE), 0) : max(bottom, 1)], camera, full)
        for band in (_NEAR_BAND, _BAND)
    )
    hidden = _luminance(near[None])[0] < HIDDEN * _luminance(whole[None])[0]
    return np.maximum(whole if hidden else near, _DARKEST).astype(np.float64)


def _brightest(pixels: Pixels, camera: Camera, full: int) -> Floats:
    """Median light of the brightest third of the blocks of a band."""
    light = _blocks(pixels, camera, full)
    brightness = _luminance(light)
    return np.asarray(np.median(light[brightness >= np.quantile(brightness, 1.0 - _BRIGHTEST)], axis=0), np.float32)


def dark_channel_airlight(pixels: Pixels, camera: Camera, full: int) -> Light:
    """Airlight by the dark channel: the brightest of the thousandth of blocks whose darkest neighbour is brightest.

    He, Sun & Tang 2011 (IEEE TPAMI 33(12), section 4.4), on means of blocks of 4 × 4 pixels and neighbourhoods of 4 × 4
    of them, since single pixels are noise.
    """
    rows, cols = max(pixels.shape[0] // _SIDE, 1), max(pixels.shape[1] // _SIDE, 1)
    light = _blocks(pixels, camera, full)
    dark = cv2.erode(light.min(axis=1).reshape(rows, cols), np.ones((_SIDE, _SIDE), np.uint8)).reshape(-1)
    candidates = np.argsort(dark, kind="stable")[-max(1, round(0.001 * pixels.shape[0] * pixels.shape[1])) :]
    brightest = candidates[np.argmax(_luminance(light[candidates]))]
    return np.asarray(np.maximum(light[brightest], _DARKEST), np.float64)


def _blocks(pixels: Pixels, camera: Camera, full: int) -> Floats:
    """Mean light of blocks, (blocks, channels)."""
    rows, cols, channels = pixels.shape
    table = light_table(camera.response, full, camera.black_level).astype(np.float32)
    size = (max(cols // _SIDE, 1), max(rows // _SIDE, 1))
    return np.asarray(cv2.resize(table[pixels], size, interpolation=cv2.INTER_AREA), np.float32).reshape(-1, channels)


def _luminance(light: Floats) -> Floats:
    return light[:, 0] if light.shape[1] == 1 else (light * np.array(LUMINANCE_WEIGHTS, np.float32)).sum(axis=1)
