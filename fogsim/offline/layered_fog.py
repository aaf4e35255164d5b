"""Airlight by elevation and path on images from disk: fog in a layer over land of one albedo."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import Droplets, slant_airlight, slant_share
from fogsim.errors import InputError
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField
from fogsim.values.fog import airlight_share
from fogsim.values.pinhole import ray_from_pixel

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FogLayer:
    """Fog between land of an albedo [-] and an overcast sky, up to a height [m]."""

    ground_albedo: float
    height: float

    def __post_init__(self) -> None:
        """Raise InputError if a number is out of range."""
        if not 0.0 <= self.ground_albedo <= 1.0:
            raise InputError(f"--ground-albedo must lie within 0 … 1, got {self.ground_albedo!r}")
        if not 0.0 < self.height < np.inf:
            raise InputError(f"--layer-height must be a positive length in metres, got {self.height!r}")

    @property
    def level(self) -> float:
        """Airlight seen level over the luminance of the sky above, on the mean that of a white surface below it [-]."""
        return airlight_share(self.ground_albedo)

    def light(self, distance: Floats, sine: Floats, visibility: float, mount_height: float) -> tuple[Floats, Floats]:
        """Share of the fog-free light that is left, and added airlight over its level value [-], both (rows, cols).

        From distance along the ray [m] (``inf`` for sky), sine of its elevation, V_met and camera height [m]. The sky's
        share includes what makes it brighter above fog than without. InputError if the camera is above the layer or the
        fog is too dense.
        """
        extinction = extinction_from_visibility(visibility)
        field = FogField(extinction, (0.0, 0.0, 0.0), top=self.height, ground_albedo=self.ground_albedo)
        around = slant_airlight(field, mount_height, Droplets.MODERATE_RADIATION)
        out_of_fog = (self.height - mount_height) / np.maximum(sine, 1e-9)
        lost = -np.expm1(-extinction * np.minimum(distance, out_of_fog))
        kept = (1.0 - lost) * np.where(np.isinf(distance), around.sky, 1.0)
        return kept, lost * slant_share(around, sine, lost)


def elevation_sines(camera: Camera) -> Floats:
    """Sines of the elevations of a pinhole's rays, (rows, cols)."""
    rows, columns = np.indices((camera.height, camera.width), dtype=np.float64)
    rays = ray_from_pixel(camera, CameraPose((0.0, 0.0, camera.mount_height), 0.0))
    x, y, z = (rays[axis, 0] * columns + rays[axis, 1] * rows + rays[axis, 2] for axis in range(3))
    return np.asarray(z / np.sqrt(x * x + y * y + z * z))
