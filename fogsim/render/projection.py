"""From the world to clip coordinates for a pinhole whose pixel centres lie at integer coordinates."""

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.render.drawing import NEAR
from fogsim.values.camera import Camera, CameraPose
from fogsim.values.pinhole import camera_axes, ray_from_pixel

Wide = NDArray[np.float64]


class Lens(NamedTuple):
    """Where the camera is and how it looks."""

    eye: Wide  # (3,): Where it is [m]
    axes: Wide  # (3, 3): Its axes in the world as rows
    rays: Wide  # (3, 3): From a pixel (column, row, 1) to its viewing ray, 1 long along the optical axis
    lens: Wide  # (3,): Focal length and principal point [px]
    planes: Wide  # (5, 3): Inward unit normals in the world of the planes that bound the picture, the forward one last


# The parts of a renderer ask for the same one in turn.
@functools.lru_cache(maxsize=8)
def lens_of(camera: Camera, pose: CameraPose) -> Lens:
    """Geometry of a picture; the arrays belong to all who asked and are not to be written to."""
    axes = camera_axes(camera, pose)
    lens, planes = _of_camera(camera)
    return Lens(
        np.array(pose.position, np.float64), axes, ray_from_pixel(camera, pose), lens, matrix_product(planes, axes)
    )


@functools.lru_cache(maxsize=8)
def _of_camera(camera: Camera) -> tuple[Wide, Wide]:
    """What does not depend on where the camera is: its numbers and its planes."""
    return np.array((camera.focal_length, *camera.principal_point)), _frustum(camera)


def _frustum(camera: Camera) -> Wide:
    """Inward unit normals (5, 3) of the planes that bound the picture, in camera axes, the forward one last."""
    (u0, v0), focal = camera.principal_point, camera.focal_length
    planes = np.array(
        [
            (focal, 0.0, u0 + 0.5),
            (-focal, 0.0, camera.width - 0.5 - u0),
            (0.0, focal, v0 + 0.5),
            (0.0, -focal, camera.height - 0.5 - v0),
            (0.0, 0.0, 1.0),
        ]
    )
    return np.asarray(planes / np.sqrt((planes * planes).sum(axis=1))[:, None], np.float64)


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
