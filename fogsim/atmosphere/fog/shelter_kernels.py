"""Which pixels of a picture look into tunnels: compiled loops over plain arrays."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.obstruction.box_kernels import share_inside

FARTHEST = 1e5
"""What is farther is the sky [m]."""

_Array = NDArray[np.float64]
_Picture = NDArray[np.float32]


@kernel
def ray(rays: _Array, u: int, v: int) -> tuple[float, float, float]:
    """Unit vector along a pixel's viewing ray.

    Parameters
    ----------
    rays : (3, 3) float64
        Takes a pixel (u, v, 1) to its viewing ray, of any length.
    u, v : int
        Column and row [px].
    """
    a = rays[0, 0] * u + rays[0, 1] * v + rays[0, 2]
    b = rays[1, 0] * u + rays[1, 1] * v + rays[1, 2]
    c = rays[2, 0] * u + rays[2, 1] * v + rays[2, 2]
    length = math.sqrt(a * a + b * b + c * c)
    return a / length, b / length, c / length


@kernel
def find_pixels_within(distance: _Picture, rays: _Array, eye: _Array, boxes: _Array, within: NDArray[np.bool_]) -> None:
    """Find the pixels whose rays pass through a tunnel's space before they end.

    Parameters
    ----------
    distance, rays, eye
        Distance along the ray of each pixel (rows, cols) [m], the matrix (3, 3) that takes a pixel (u, v, 1) to its
        viewing ray, and where the camera is (3,) [m].
    boxes : (m, 10) float64
        The space.
    within : (rows, cols) bool
        Made true where they do.
    """
    end = np.empty(3)
    for v in range(distance.shape[0]):
        for u in range(distance.shape[1]):
            a, b, c = ray(rays, u, v)
            reach = min(float(distance[v, u]), FARTHEST)
            end[0], end[1], end[2] = eye[0] + a * reach, eye[1] + b * reach, eye[2] + c * reach
            for box in boxes:
                if share_inside(eye, end, box) > 0.0:
                    within[v, u] = True
                    break
