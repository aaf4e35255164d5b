"""From the world to clip coordinates for a pinhole whose pixel centres lie at integer coordinates."""

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.render.drawing import NEAR
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.pinhole import camera_axes, ray_from_pixel


def clip_from_camera(camera: Camera) -> NDArray[np.float64]:
    """Projection (4, 4) from camera axes to clip coordinates, whose rows run downward like those of an image.

    The far plane lies at infinity; pixel (u, v) has its centre at window coordinates (u + 1/2, v + 1/2).
    """
    u0, v0 = camera.principal_point
    projection = np.zeros((4, 4))
    projection[0, 0] = 2.0 * camera.focal_length / camera.width
    projection[0, 2] = 2.0 * (u0 + 0.5) / camera.width - 1.0
    projection[1, 1] = 2.0 * camera.focal_length / camera.height
    projection[1, 2] = 2.0 * (v0 + 0.5) / camera.height - 1.0
    projection[2, 2], projection[2, 3] = 1.0, -2.0 * NEAR
    projection[3, 2] = 1.0
    return projection


def clip_from_offset(camera: Camera, pose: CameraPose) -> NDArray[np.float64]:
    """Projection (4, 4) of offsets from the camera in world axes [m] to clip coordinates."""
    turn = np.eye(4)
    turn[:3, :3] = camera_axes(camera, pose)
    return matrix_product(clip_from_camera(camera), turn)


def highest_terrain_row(camera: Camera, pose: CameraPose) -> int:
    """First row of the picture [px] in which any ray points below the horizon; the picture's height if none does."""
    up = ray_from_pixel(camera, pose)[2]
    ends = np.array([-0.5, camera.width - 0.5])
    rows = np.arange(camera.height)[:, None]
    below = np.any(up[0] * ends + up[1] * rows + up[2] < 0.0, axis=1)
    return int(np.argmax(below)) if below.any() else camera.height
