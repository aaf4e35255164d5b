"""From pixels to rays in the world and where a camera is mounted."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.values import Camera, CameraPose


def mounted_pose(camera: Camera, front_bumper: NDArray[np.float64], heading: float, setback: float) -> CameraPose:
    """Pose of a camera that is mounted behind a vehicle's front bumper, on its axis.

    Parameters
    ----------
    camera : Camera
        Its calibration, for the height of its mount.
    front_bumper : (3,) float64
        Middle of the front bumper on the road surface [m].
    heading : float
        Direction of travel, counterclockwise from east [rad].
    setback : float
        Distance of the optical centre behind the front bumper [m].
    """
    x = float(front_bumper[0]) - setback * math.cos(heading)
    y = float(front_bumper[1]) - setback * math.sin(heading)
    return CameraPose(position=(x, y, float(front_bumper[2]) + camera.mount_height), heading=heading)


def rotation(camera: Camera, pose: CameraPose) -> NDArray[np.float64]:
    """Rotation from the camera's axes (right, down, forward) to the world's (east, north, up).

    Returns
    -------
    (3, 3) float64
        Orthonormal; its columns are the camera's axes in the world.
    """
    pitch = camera.pitch - pose.grade
    ch, sh, cp, sp = math.cos(pose.heading), math.sin(pose.heading), math.cos(pitch), math.sin(pitch)
    right = np.array([sh, -ch, 0.0])
    forward = np.array([ch * cp, sh * cp, -sp])
    down = np.cross(forward, right)
    cr, sr = math.cos(camera.roll), math.sin(camera.roll)
    # A positive roll turns the image's right side down: the camera's own right axis rises.
    return np.column_stack((cr * right - sr * down, sr * right + cr * down, forward))


def ray_map(camera: Camera, pose: CameraPose) -> NDArray[np.float64]:
    """Map from a pixel (u, v, 1) to its viewing ray in the world.

    Returns
    -------
    (3, 3) float64
        The ray's forward component in the camera's frame is 1, so its length is distance along the ray over depth.
    """
    u0, v0 = camera.principal_point
    f = camera.focal_length
    inverse = np.array([[1 / f, 0.0, -u0 / f], [0.0, 1 / f, -v0 / f], [0.0, 0.0, 1.0]])
    return np.asarray(rotation(camera, pose) @ inverse)
