"""A view through fog without lamps, by whichever way the field asks for."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.airlight_shading import airlight_source
from fogsim.atmosphere.fog.extinction import is_plain
from fogsim.atmosphere.fog.forward_scatter import add_forward_scatter, pixel_width
from fogsim.atmosphere.fog.frustum import frustum_grid, radiance_through_grid
from fogsim.atmosphere.fog.koschmieder import fogged_radiance
from fogsim.values import Camera, CameraPose, FogField, View
from fogsim.values.pinhole import ray_from_pixel


def daytime_radiance(view: View, field: FogField, camera: Camera, pose: CameraPose) -> NDArray[np.float32]:
    """Radiance at a camera, L = L0 T + L∞ (1 − T), with the field's forward scattering.

    Parameters
    ----------
    view : View
        The scene without air.
    field : FogField
        The fog, at one time (see `field_at`).
    camera, pose
        The camera.

    Returns
    -------
    (rows, cols, 3) float32
        Linear radiance [cd/m²].
    """
    radiance = _through_fog(view, field, camera, pose)
    if field.forward_scatter > 0:
        width = pixel_width(field.forward_scatter_width, camera.focal_length)
        share = transmission(view, field, camera, pose)
        add_forward_scatter(radiance, field.airlight, share, field.forward_scatter, width)
    return radiance


def transmission(view: View, field: FogField, camera: Camera, pose: CameraPose) -> NDArray[np.float32]:
    """Transmission T = e^(−τ) up to what each pixel shows; for the sky, of the whole path to the fog's end.

    Parameters
    ----------
    view : View
        Distances are taken from it.
    field : FogField
        The fog, at one time.
    camera, pose
        The camera.

    Returns
    -------
    (rows, cols) float32
        0 … 1.
    """
    # A white scene in fog that adds no light of its own is seen as its transmission.
    white = dataclasses.replace(view, radiance=np.ones_like(view.radiance), lamp_response=None)
    dark = dataclasses.replace(field, airlight=(0.0, 0.0, 0.0))
    return np.ascontiguousarray(_through_fog(white, dark, camera, pose)[..., 0])


def _through_fog(view: View, field: FogField, camera: Camera, pose: CameraPose) -> NDArray[np.float32]:
    """Closed form where it holds, from below the fog's top and through even fog or banks; else the grid."""
    if is_plain(field) and pose.position[2] <= field.top:
        return fogged_radiance(view, field, pose.position, ray_from_pixel(camera, pose))
    grid = frustum_grid(field, camera, pose)
    return radiance_through_grid(view, grid, field.airlight, airlight_source(field, grid))
