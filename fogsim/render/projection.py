"""From the world to pixels and back for a pinhole whose pixel centres lie at integer coordinates."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera, CameraPose

NEAR = 0.4
"""Distance of the plane in front of the camera before which nothing is drawn [m]."""


def camera_axes(camera: Camera, pose: CameraPose) -> NDArray[np.float64]:
    """Axes of the camera in the world.

    Parameters
    ----------
    camera, pose
        The camera and where it is.

    Returns
    -------
    (3, 3) float64
        Rows: right, down and forward as unit vectors (east, north, up).
    """
    pitch = camera.pitch - pose.grade
    cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
    forward = np.array([cosine * math.cos(pitch), sine * math.cos(pitch), -math.sin(pitch)])
    level = np.array([sine, -cosine, 0.0])
    down = np.cross(forward, level)
    # A positive roll turns the right side of the image down, so the camera itself turns the other way.
    right = math.cos(camera.roll) * level - math.sin(camera.roll) * down
    return np.stack((right, np.cross(forward, right), forward))


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
    return clip_from_camera(camera) @ turn


def ray_from_pixel(camera: Camera, pose: CameraPose) -> NDArray[np.float64]:
    """Matrix (3, 3) from (u, v, 1) [px] to the ray of a pixel in the world, 1 long along the optical axis."""
    u0, v0 = camera.principal_point
    focal = camera.focal_length
    plane = np.array([[1 / focal, 0.0, -u0 / focal], [0.0, 1 / focal, -v0 / focal], [0.0, 0.0, 1.0]])
    return np.asarray(camera_axes(camera, pose).T @ plane, np.float64)


def highest_terrain_row(camera: Camera, pose: CameraPose) -> int:
    """First row of the picture [px] in which any ray points below the horizon; the picture's height if none does."""
    up = ray_from_pixel(camera, pose)[2]
    ends = np.array([-0.5, camera.width - 0.5])
    rows = np.arange(camera.height)[:, None]
    below = np.any(up[0] * ends + up[1] * rows + up[2] < 0.0, axis=1)
    return int(np.argmax(below)) if below.any() else camera.height
