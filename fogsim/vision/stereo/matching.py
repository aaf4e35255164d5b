"""Contrasts of edges and their disparities between two parallel pictures."""

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.light.luminance import linear_luminance

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
Floats = NDArray[np.float64]

_BLOCK = 11
"""Side of the blocks that are compared, odd [px]."""

_ACROSS = 7
"""Width over which the contrast of an edge is taken [px]: its blur by lens and sampling lies within."""

_UNIQUE = 10
"""By how much the best disparity must beat others [%]."""

_NEAREST = 10.0
"""Nearest distance whose disparities are searched [m]."""

_ROOM = 16
"""Numbers of disparities that are searched come in multiples of this [px]."""

_BELOW_ROAD = 1.35
"""Disparity over that of a flat road in the same row below which nothing can be: under the road [-]."""


class SeenEdges(NamedTuple):
    """Edges that both pictures show."""

    disparity: Floats  # (n,): By how much farther left the second camera has each [px]
    contrast: Floats  # (n,): Local contrast (L_bright − L_dark) / L_bright [-]


def seen_edges(left: Pixels, right: Pixels, camera: Camera, baseline: float, least: float) -> SeenEdges:
    """Find edges across which contrast is at least so much, and their disparities.

    Blocks are compared by the sum of absolute differences of their horizontal gradients (OpenCV's StereoBM, after
    Konolige 1998, Small vision systems).

    Takes `baseline` [m].
    """
    light = linear_luminance(left, camera.response, camera.bits, camera.black_level)
    smooth = cv2.blur(light, (3, 3))
    strip = np.ones((1, _ACROSS), np.uint8)
    bright, dark = cv2.dilate(smooth, strip), cv2.erode(smooth, strip)
    contrast = (bright - dark) / np.maximum(bright, 1e-6)
    slope = np.abs(cv2.filter2D(smooth, -1, np.array([[-1.0, 0.0, 0.0, 0.0, 1.0]])))
    is_edge = (slope >= cv2.dilate(slope, np.ones((1, 5), np.uint8))) & (contrast >= least)
    shift = _disparities(_grey(left), _grey(right), camera.focal_length * baseline / _NEAREST)
    # What lies under the road, or so near that its disparity was not sought, is a false match.
    road = _road_disparity(camera, baseline)[:, None]
    is_edge &= (shift > 0.0) & (_BELOW_ROAD * shift + 0.5 >= road) & (road * _NEAREST <= camera.focal_length * baseline)
    return SeenEdges(shift[is_edge].astype(np.float64), contrast[is_edge].astype(np.float64))


def _disparities(left: NDArray[np.uint8], right: NDArray[np.uint8], most: float) -> NDArray[np.float32]:
    """Disparities (rows, cols) [px]; negative where there is none."""
    matcher = cv2.StereoBM.create(_ROOM * math.ceil((most + 2.0) / _ROOM), _BLOCK)
    matcher.setMinDisparity(-1)
    matcher.setPreFilterCap(31)
    matcher.setUniquenessRatio(_UNIQUE)
    matcher.setDisp12MaxDiff(1)
    return np.asarray(matcher.compute(left, right), np.float32) / 16.0


def _grey(image: Pixels) -> NDArray[np.uint8]:
    """Grey picture of 8 bits, over the range that it has: faint contrasts of 10 and 12 bits are kept."""
    flat = image.astype(np.float32).mean(axis=2) if image.ndim == 3 else image.astype(np.float32)
    most = float(flat.max())
    return np.rint(flat * (255.0 / most)).astype(np.uint8) if most > 255.0 else flat.round().astype(np.uint8)


def _road_disparity(camera: Camera, baseline: float) -> Floats:
    """Disparity of a flat road in each row (rows,), 0 above the horizon [px]."""
    below = np.maximum(np.arange(camera.height) - camera.horizon_row, 0.0)
    return np.asarray(below * math.cos(camera.pitch) * baseline / camera.mount_height)
