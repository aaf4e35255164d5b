"""The air between a scene and a camera: what fog and lamplight make of a drawn view."""

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.frustum import frustum_grid, radiance_through_grid
from fogsim.atmosphere.koschmieder import fogged_radiance
from fogsim.atmosphere.medium import field_at, is_plain
from fogsim.atmosphere.shading import airlight_source
from fogsim.pinhole import ray_from_pixel
from fogsim.values import Camera, CameraPose, FogField, Lights, View

_UNLIT = Lights.none()


class Air:
    """The fog of a scenario, as a camera looks through it.

    The radiance at the camera is L = (L₀ + R E_own) T + S: the drawn radiance L₀ and what surfaces return of the own
    lamps' light (their response R times the illuminance E_own that reaches them), attenuated by T = e^(−τ), and the
    light S that the fog scatters into the line of sight (airlight by day, the lamps' veil and halos at night).

    Parameters
    ----------
    field : FogField
        The fog.
    """

    def __init__(self, field: FogField) -> None:
        self._field = field

    def radiance(
        self, view: View, camera: Camera, pose: CameraPose, lights: Lights = _UNLIT, time: float = 0.0
    ) -> NDArray[np.float32]:
        """Radiance that reaches a camera.

        Parameters
        ----------
        view : View
            The scene without air: linear radiance [cd/m²] and distance along the ray [m].
        camera : Camera
            Its true calibration.
        pose : CameraPose
            Where it is.
        lights : Lights
            Lit lamps.
        time : float
            Time since the run began [s], for fog that drifts or changes.

        Returns
        -------
        (rows, cols, 3) float32
            Linear radiance at the camera [cd/m²].
        """
        del lights
        field = field_at(self._field, time)
        if is_plain(field) and pose.position[2] <= field.top:
            return fogged_radiance(view, field, pose.position, ray_from_pixel(camera, pose))
        grid = frustum_grid(field, camera, pose)
        return radiance_through_grid(view, grid, field.airlight, airlight_source(field, grid))
