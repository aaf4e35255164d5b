"""Where a camera is mounted."""

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
