"""Contrast restoration by the optical depth of a flat road and of what stands on it."""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.values.camera import Camera
from fogsim.values.pinhole import OWN_FRAME, camera_axes
from fogsim.vision.restoration import light_kernels, planar_kernels
from fogsim.vision.restoration.picture import Floats, FoggyPicture

FARTHEST = 1e6
"""Distance that stands for the sky's [m]."""

_BLOCK = 4
"""Side of the blocks searched for things that stand on the road [px]: noise makes single pixels meaningless."""

_DARK, _SURE = 0.5, 0.04
"""Share of the road's luminance below which the foot of something may be, and how far below black, relative to the
airlight, something must come out to be no road [-]; chosen on pool 0 of benchmarks/restoration.py."""

_BRIGHT_HEIGHT = 1.0
"""Height over which something dark may be bright and still one [m]: a boot between shadow and rear window."""

_SEEN, _USUAL_ROAD, _DARKEST_ROAD = 0.5, 0.25, 0.05
"""Least transmission at which road shows its luminance; its luminance relative to the airlight where no road does, and
its lower limit [-]."""


def planar(picture: FoggyPicture) -> Floats:
    """Restore contrast by R = I e^(kd) + A (1 − e^(kd)), with d of a flat road and of what stands on it.

    The law is that of Hautière, Tarel & Aubert 2007 (CVPR, eq. 2). The road's d follows from mount height, pitch and
    roll. A pixel that is darker than the veil before the road there is nearer than the road, t ≥ 1 − I / A; a run of
    such up a column of blocks has the d of its foot. The bound on the gain is soft, t = √(e^(−2kd) + 1 / most_gain²).

    Returns transmission (rows, cols).
    """
    if picture.extinction is None:
        raise InputError("planar restores by an extinction coefficient k [1/m], and none is given")
    tables, least = picture.relative_tables(), 1.0 / picture.most_gain
    distance, far = road_distance(picture.camera)
    plane: Floats = np.asarray(cv2.exp(np.float32(-picture.extinction) * distance), np.float32)
    standing, road = _standing(picture, tables, far, least)
    return planar_kernels.bounded_transmission(picture.pixels, tables, plane, standing, least, road)


def _standing(picture: FoggyPicture, tables: Floats, far: Floats, least: float) -> tuple[Floats, float]:
    """By how much the transmission of what stands on the road is more than the road's, and the road's luminance."""
    more = np.zeros(picture.pixels.shape[:2], np.float32)
    if min(far.shape) == 0:
        return more, _USUAL_ROAD
    light = light_kernels.least_block_means(picture.pixels, tables, _BLOCK)
    plane = np.hypot(np.exp(np.float32(-(picture.extinction or 0.0)) * far), np.float32(least))
    road = _road_luminance(light, plane)
    tall = _BRIGHT_HEIGHT * picture.camera.focal_length / _BLOCK
    stands = planar_kernels.standing_transmission(light, plane, far, tall, least, road, _DARK, _SURE)
    raised = np.maximum(cv2.dilate(stands, np.ones((3, 3), np.uint8)) - plane, np.float32(0.0))
    rows, cols = (_BLOCK * side for side in raised.shape)
    more[:rows, :cols] = cv2.resize(raised, (cols, rows), interpolation=cv2.INTER_LINEAR)
    return more, road


def _road_luminance(light: Floats, road: Floats) -> float:
    """Median luminance of what is near below the horizon, restored as road, relative to the airlight."""
    near = road > _SEEN
    if not near.any():
        return _USUAL_ROAD
    return max(float(np.median(1.0 + (light[near] - 1.0) / road[near])), _DARKEST_ROAD)


@lru_cache(maxsize=4)
def road_distance(camera: Camera) -> tuple[Floats, Floats]:
    """Distance along the rays to a flat road, of pixels and of blocks of them.

    Returns distances [m], read-only; `FARTHEST` at and above the horizon (rows, cols).
    """
    whole = _distance(camera, np.arange(camera.height, dtype=np.float64), np.arange(camera.width, dtype=np.float64))
    rows, cols = (
        np.arange(side // _BLOCK, dtype=np.float64) * _BLOCK + 0.5 * (_BLOCK - 1)
        for side in (camera.height, camera.width)
    )
    blocks = _distance(camera, rows, cols)
    for array in (whole, blocks):
        array.flags.writeable = False
    return whole, blocks


def _distance(camera: Camera, rows: NDArray[np.float64], cols: NDArray[np.float64]) -> Floats:
    """Distance H / −sin(elevation) of each ray."""
    u0, v0 = camera.principal_point
    right, down = (cols[None, :] - u0) / camera.focal_length, (rows[:, None] - v0) / camera.focal_length
    across, lower, ahead = camera_axes(camera, OWN_FRAME)[:, 2].tolist()
    under = -(across * right + lower * down + ahead)
    length = np.sqrt(1.0 + right**2 + down**2)
    road = under * FARTHEST > camera.mount_height * length
    return np.where(road, camera.mount_height * length / np.where(road, under, 1.0), FARTHEST).astype(np.float32)
