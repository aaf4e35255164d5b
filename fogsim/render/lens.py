"""Where a camera is and how it looks, as kernels want it."""

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
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
