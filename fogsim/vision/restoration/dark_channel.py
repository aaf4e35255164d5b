"""Haze removal by the dark channel prior."""

import cv2
import numpy as np

from fogsim.core.linear_algebra import matrix_product
from fogsim.units import LUMINANCE_WEIGHTS
from fogsim.vision.restoration import light_kernels
from fogsim.vision.restoration.guided_filter import guided_filter
from fogsim.vision.restoration.picture import Floats, FoggyPicture

_PATCH = 15
"""Side of the patches that the darkest value is taken of [px] (section 4)."""

_KEPT = 0.95
"""ω: share of the haze that is taken away (section 4.1)."""

_RADIUS, _REGULARISER = 60, 1e-3
"""Of the guided filter that takes the place of soft matting [px, squared pixel values of 1] (He, Sun & Tang 2010)."""


def dark_channel(picture: FoggyPicture) -> Floats:
    """Restore contrast by t = 1 − ω min_patch min_c I_c / A_c (He, Sun & Tang 2011, IEEE TPAMI 33(12), eqs. 12, 16).

    The paper works on pixel values and bounds the gain by t₀ = 0.1; here it is light, as the law has it, and the bound
    is the picture's `most_gain`. The transmission is refined by the guided filter of the same authors.

    Returns transmission (rows, cols).
    """
    tables = picture.relative_tables()
    light = light_kernels.relative_light(picture.pixels, tables)
    dark = cv2.erode(least_channel(light), np.ones((_PATCH, _PATCH), np.uint8))
    coarse = np.float32(1.0) - np.float32(_KEPT) * np.asarray(dark, np.float32)
    grey = light[..., 0] if light.shape[2] == 1 else matrix_product(light, np.array(LUMINANCE_WEIGHTS, np.float32))
    refined = guided_filter(grey, coarse, _RADIUS, _REGULARISER)
    return np.asarray(np.clip(refined, 1.0 / picture.most_gain, 1.0), np.float32)


def least_channel(light: Floats) -> Floats:
    """Smallest channel of each pixel, (rows, cols) (`light` (rows, cols, channels))."""
    # Along the short last axis numpy's own minimum takes ten times as long.
    return np.asarray(np.minimum.reduce([light[..., channel] for channel in range(light.shape[2])]))
