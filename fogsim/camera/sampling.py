"""Antialiasing: a scene drawn and fogged with several samples a pixel side, averaged as light before it is exposed.

The average is taken of the light that has come through the fog, each sample at its own distance. So a silhouette
gets no fringe, as it does where colour is averaged and fogged at one distance for all.
"""

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.camera.exposure_kernels import block_means
from fogsim.values import Camera, View


def supersampled(camera: Camera, side: int) -> Camera:
    """Camera with side × side pixels in the place of each.

    The centre of pixel u lies at integer u, so its left border is at u − ½ and what was at u is now at side · (u + ½) −
    ½.
    """
    u0, v0 = (side * (centre + 0.5) - 0.5 for centre in camera.principal_point)
    return dataclasses.replace(
        camera,
        width=side * camera.width,
        height=side * camera.height,
        focal_length=side * camera.focal_length,
        principal_point=(u0, v0),
    )


def averaged(radiance: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """Mean luminance of each pixel's samples.

    Returns linear luminance per channel of the pixels [cd/m²]; the samples themselves where there is one a pixel (rows,
    cols, 3). Takes `radiance` (side · rows, side · cols, 3) [cd/m²].
    """
    if side == 1:
        return radiance
    rows, cols = radiance.shape[0] // side, radiance.shape[1] // side
    out = np.empty((rows, cols, 3), np.float32)
    lines = np.ascontiguousarray(radiance[: side * rows], dtype=np.float32).reshape(side * rows, -1)
    block_means(lines, side, out)
    return out


def middle_samples(view: View, side: int) -> View:
    """View with one sample a pixel: the one in the middle, or for an even number the next to its lower right.

    Samples are chosen, not averaged: a mean of distances is the distance of nothing.
    """
    if side == 1:
        return view
    pick = slice(side // 2, None, side)
    layers: dict[str, Any] = {field.name: getattr(view, field.name) for field in dataclasses.fields(view)}
    kept: dict[str, Any] = {
        name: layer if layer is None else np.ascontiguousarray(layer[pick, pick]) for name, layer in layers.items()
    }
    return dataclasses.replace(view, **kept)
