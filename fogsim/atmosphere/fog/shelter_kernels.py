"""Which pixels of a picture look into tunnels: compiled loops over plain arrays."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

FARTHEST = 1e5
"""What is farther is the sky [m]."""

_BELOW = 1.0
"""How far below its road a portal reaches [m]: what is drawn may lie a little lower."""

_Array = NDArray[np.float64]
_Picture = NDArray[np.float32]


@kernel
def ray(rays: _Array, u: int, v: int) -> tuple[float, float, float]:
    """Unit vector along a pixel's viewing ray (`rays` (3, 3), `u`, `v` [px])."""
    a = rays[0, 0] * u + rays[0, 1] * v + rays[0, 2]
    b = rays[1, 0] * u + rays[1, 1] * v + rays[1, 2]
    c = rays[2, 0] * u + rays[2, 1] * v + rays[2, 2]
    length = math.sqrt(a * a + b * b + c * c)
    return a / length, b / length, c / length


@kernel
def find_pixels_within(
    distance: _Picture, rays: _Array, eye: _Array, portals: _Array, within: NDArray[np.bool_]
) -> None:
    """Find the pixels whose rays pass through a tunnel's portal before they end.

    Takes `distance`, `rays`, `eye` [m], `portals` (n, 7) [m], `within` (rows, cols) bool.
    """
    for number in range(len(portals)):
        x, y, z = portals[number, 0] - eye[0], portals[number, 1] - eye[1], portals[number, 2] - eye[2]
        east, north, half_width, height = portals[number, 3:]
        ahead, aside = x * east + y * north, y * east - x * north
        for v in range(distance.shape[0]):
            for u in range(distance.shape[1]):
                a = rays[0, 0] * u + rays[0, 1] * v + rays[0, 2]
                b = rays[1, 0] * u + rays[1, 1] * v + rays[1, 2]
                c = rays[2, 0] * u + rays[2, 1] * v + rays[2, 2]
                reach = ahead / (a * east + b * north)
                is_through = reach > 0.0 and abs(reach * (b * east - a * north) - aside) < half_width
                is_before = reach * reach * (a * a + b * b + c * c) < distance[v, u] * distance[v, u]
                if is_through and is_before and -_BELOW < reach * c - z < height:
                    within[v, u] = True
