"""The geometry of a pinhole camera whose pixel centres lie at integer coordinates: what renderer and camera share.

The parts of a picture ask for the same in turn: the arrays belong to all who asked and are not to be written to.
"""

import functools
import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.values.camera import Camera, CameraPose

OWN_FRAME = CameraPose((0.0, 0.0, 0.0), 0.0)
"""The pose in which directions are those relative to the own vehicle, wherever it is."""


@functools.lru_cache(maxsize=8)
def camera_axes(camera: Camera, pose: CameraPose) -> NDArray[np.float64]:
    """Axes of a camera in the world: rows right, down and forward, unit vectors (east, north, up)."""
    pitch = camera.pitch - pose.grade
    east, north = math.cos(pose.heading), math.sin(pose.heading)
    ahead, under = math.cos(pitch), math.sin(pitch)
    # Written out: numpy's cross product of two vectors takes longer than the rest of a small picture's set-up.
    forward = (east * ahead, north * ahead, -under)
    level = (north, -east, 0.0)
    down = (-east * under, -north * under, -ahead)
    # A positive roll turns the right side of the image down, so the camera itself turns the other way.
    cosine, sine = math.cos(camera.roll), math.sin(camera.roll)
    right = [cosine * across - sine * below for across, below in zip(level, down, strict=True)]
    lower = [sine * across + cosine * below for across, below in zip(level, down, strict=True)]
    return np.array((right, lower, forward))


@functools.lru_cache(maxsize=8)
def ray_from_pixel(camera: Camera, pose: CameraPose) -> NDArray[np.float64]:
    """Matrix from a pixel (u, v, 1) [px] to its viewing ray in the world, which is 1 long along the axis."""
    return np.asarray(matrix_product(camera_axes(camera, pose).T, _camera_ray_from_pixel(camera)))


@functools.lru_cache(maxsize=8)
def _camera_ray_from_pixel(camera: Camera) -> NDArray[np.float64]:
    """Matrix from a pixel (u, v, 1) [px] to its viewing ray in the camera's axes."""
    (u0, v0), focal = camera.principal_point, camera.focal_length
    return np.array([[1 / focal, 0.0, -u0 / focal], [0.0, 1 / focal, -v0 / focal], [0.0, 0.0, 1.0]])
