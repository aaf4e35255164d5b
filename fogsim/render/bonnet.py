"""The bonnet of the camera's own car, at the lower edge of the picture."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Camera, View
from fogsim.values.pinhole import OWN_FRAME, ray_from_pixel

REFLECTANCE = 0.06
"""Of dark paint, alike in all directions [-]."""

_CLEAR_COAT = 0.04
"""Share of light that the clear coat mirrors straight down; more at grazing angles, by Schlick's formula [-]."""

_ROUNDING = 0.5
"""How far back from the front edge the bonnet's corners are rounded [m]."""

_NEAREST = 0.35
"""Distance ahead of the camera at which the bonnet begins: before it are windscreen and scuttle, as dark [m]."""


@dataclass(frozen=True, slots=True)
class Bonnet:
    """A flat bonnet with rounded corners, as high as its front edge, which is all of it that hides something."""

    reach: float  # How far ahead of the camera its front edge is [m]
    height: float = 0.75  # Its height above the road [m]
    half_width: float = 0.8  # Half its width [m]


class _Seen(NamedTuple):
    """Pixels that see the bonnet, flat and in order, how far away it is there [m], and what it mirrors there [-]."""

    pixels: NDArray[np.intp]
    distance: NDArray[np.float32]
    mirrored: NDArray[np.float32]


def with_bonnet(view: View, camera: Camera, bonnet: Bonnet, instance: int, illuminance: float) -> View:
    """A drawn view with the own bonnet before it, lit by the sky alone: own head lamps shine away from it.

    Takes `illuminance` [lx].
    """
    seen = _seen(camera, bonnet)
    if not len(seen.pixels):
        return view
    radiance, distance, labels = view.radiance.copy(), view.distance.copy(), view.instance.copy()
    light = illuminance / math.pi * (REFLECTANCE + seen.mirrored)
    radiance.reshape(-1, 3)[seen.pixels] = light[:, None]
    distance.reshape(-1)[seen.pixels] = seen.distance
    labels.reshape(-1)[seen.pixels] = instance
    response = None
    if view.lamp_response is not None:
        response = view.lamp_response.copy()
        response.reshape(-1, 3)[seen.pixels] = 0.0
    return replace(view, radiance=radiance, distance=distance, instance=labels, lamp_response=response)


@lru_cache(8)
def _seen(camera: Camera, bonnet: Bonnet) -> _Seen:
    rows, columns = np.mgrid[: camera.height, : camera.width].astype(np.float64)
    pixels = np.stack((columns.ravel(), rows.ravel(), np.ones(rows.size)), axis=1)
    rays = np.asarray(matrix_product(pixels, np.ascontiguousarray(ray_from_pixel(camera, OWN_FRAME).T)))
    lengths = np.sqrt((rays**2).sum(axis=1))
    falls = np.maximum(-rays[:, 2], 1e-9)
    scale = (camera.mount_height - bonnet.height) / falls
    ahead, aside = scale * rays[:, 0], scale * rays[:, 1]
    corner = np.maximum(ahead - (bonnet.reach - _ROUNDING), 0.0) / _ROUNDING
    inside = (corner**2 + (aside / bonnet.half_width) ** 2 < 1.0) | (ahead < _NEAREST)
    found = np.flatnonzero((rays[:, 2] < 0.0) & (scale > 0.0) & (rays[:, 0] > 0.0) & inside)
    steepness = falls[found] / lengths[found]
    mirrored = _CLEAR_COAT + (1.0 - _CLEAR_COAT) * (1.0 - steepness) ** 5
    return _Seen(found, (scale * lengths)[found].astype(np.float32), mirrored.astype(np.float32))
