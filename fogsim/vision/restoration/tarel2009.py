"""Visibility restoration by the veil that has no black pixel and no road behind it (NBPC+PA)."""

import cv2
import numpy as np

from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.vision.restoration import light_kernels
from fogsim.vision.restoration.dark_channel import least_channel
from fogsim.vision.restoration.picture import Floats, FoggyPicture

_WHITE_OBJECTS = 11
"""s_v: side of the window of both medians, the largest white object [px]."""

_KEPT = 0.95
"""p: share of the veil that is taken away."""

_LEAST_VISIBILITY = 50.0
"""V_min: the densest fog that the planar assumption allows for [m]."""


def tarel2009(picture: FoggyPicture) -> Floats:
    """Restore contrast by the largest veil that leaves no black pixel, and no more than a road at V_min would have.

    W is the smallest channel; A its median over s_v, b = A − median |W − A| (Tarel & Hautière 2009, ICCV, eqs. 8, 9,
    which keep edges); c(v) = 1 − exp(ln(0.05) λ / (V_min max(v − v_h, 0))) the planar assumption (Tarel et al. 2010,
    IEEE IV, eq. 11). Veil V = p max(min(W, b, c), 0); the rest is (I − V) / (1 − V). It works on light relative to the
    airlight, which is the papers' white balance; their medians are taken of 8 bits; their smoothing and tone map are
    left out.

    Returns transmission 1 − V (rows, cols).
    """
    tables = picture.relative_tables()
    least = least_channel(light_kernels.relative_light(picture.pixels, tables))
    middle = _median(least)
    bounded = np.minimum(least, middle - _median(np.abs(least - middle)))
    veil = np.float32(_KEPT) * np.maximum(np.minimum(bounded, _road_veil(picture)[:, None]), np.float32(0.0))
    return np.asarray(np.clip(1.0 - veil, 1.0 / picture.most_gain, 1.0), np.float32)


def _road_veil(picture: FoggyPicture) -> Floats:
    """Planar assumption c(v) of each row; it knows no roll."""
    camera = picture.camera
    below = np.maximum(np.arange(camera.height) - camera.horizon_row, 1e-9)
    depth = OPTICAL_DEPTH_AT_VISIBILITY * camera.row_distance / (_LEAST_VISIBILITY * below)
    return np.asarray(-np.expm1(-depth), np.float32)


def _median(values: Floats) -> Floats:
    """Median over windows, in 8 bits."""
    levels = np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
    return np.asarray(cv2.medianBlur(levels, _WHITE_OBJECTS), np.float32) / np.float32(255.0)
