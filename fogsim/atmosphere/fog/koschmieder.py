"""A drawn scene seen through fog by day: Koschmieder's law in closed form where the fog has one, else on a grid."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.airlight import airlight_source
from fogsim.atmosphere.fog.forward_scatter import add_forward_scatter, pixel_width
from fogsim.atmosphere.fog.frustum import frustum_grid, radiance_through_grid
from fogsim.atmosphere.fog.koschmieder_kernels import BankedFog, fog_rows
from fogsim.atmosphere.fog.layer_airlight import slant_airlight
from fogsim.atmosphere.fog.layer_airlight_kernels import LayeredFog, layered_fog_rows
from fogsim.atmosphere.fog.medium import has_closed_form
from fogsim.atmosphere.fog.shelters import is_sheltered, sheltered_pixels
from fogsim.core.jit import Bands
from fogsim.values import Camera, CameraPose, FogBank, FogField, View
from fogsim.values.pinhole import ray_from_pixel

USUAL_DROPLETS = "moderate_radiation"
"""Small droplets, as `Droplets` calls them."""


def daytime_luminance(
    view: View, field: FogField, camera: Camera, pose: CameraPose, droplets: str = USUAL_DROPLETS
) -> NDArray[np.float32]:
    """Luminance at a camera, L = L0 T + L∞ (1 − T), with the field's forward scattering.

    Returns linear luminance per channel [cd/m²] (rows, cols, 3).
    """
    if field.ground_albedo is not None:
        return fogged_radiance(view, field, pose.position, ray_from_pixel(camera, pose), droplets)
    radiance = _through_fog(view, field, camera, pose)
    if field.forward_scatter > 0:
        width = pixel_width(field.forward_scatter_width, camera.focal_length)
        share = transmittance(view, field, camera, pose)
        add_forward_scatter(radiance, field.airlight, share, field.forward_scatter, width)
    return radiance


def transmittance(view: View, field: FogField, camera: Camera, pose: CameraPose) -> NDArray[np.float32]:
    """Transmittance T = e^(−τ) up to what each pixel shows; for the sky, of the whole path to the fog's end.

    Returns 0 … 1.
    """
    # A white scene in fog that adds no light of its own is seen as its transmittance.
    white = dataclasses.replace(view, radiance=np.ones_like(view.radiance), lamp_response=None)
    dark = dataclasses.replace(field, airlight=(0.0, 0.0, 0.0), ground_albedo=None)
    return np.ascontiguousarray(_through_fog(white, dark, camera, pose)[..., 0])


def _through_fog(view: View, field: FogField, camera: Camera, pose: CameraPose) -> NDArray[np.float32]:
    """What arrives through the fog, from inside tunnels or into them.

    A tunnel's fog is kept away wider than its walls, for the sake of who looks out of it: from outside, only rays that
    pass through the tunnel itself are sheltered.
    """
    radiance = _through_field(view, field, camera, pose)
    if not field.shelters or is_sheltered(field.shelters, pose.position):
        return radiance
    open_air = _through_field(view, dataclasses.replace(field, shelters=()), camera, pose)
    within = sheltered_pixels(field.shelters, view, camera, pose)
    open_air[within] = radiance[within]
    return open_air


def _through_field(view: View, field: FogField, camera: Camera, pose: CameraPose) -> NDArray[np.float32]:
    """Closed form where it holds, from below the fog's top and through even fog or banks; else the grid."""
    if has_closed_form(field) and pose.position[2] <= field.top:
        return fogged_radiance(view, field, pose.position, ray_from_pixel(camera, pose))
    grid = frustum_grid(field, camera, pose)
    return radiance_through_grid(view, grid, field.airlight, airlight_source(field, grid))


def fogged_radiance(
    view: View,
    field: FogField,
    eye: tuple[float, float, float],
    ray_map: NDArray[np.float64],
    droplets: str = USUAL_DROPLETS,
) -> NDArray[np.float32]:
    """Luminance that reaches the camera through daytime fog: L = L0 e^(−τ) + L∞ (1 − e^(−τ)) (Koschmieder 1924).

    L∞ goes by elevation and path where the field has an albedo of the ground (see `layer_airlight`).

    Parameters
    ----------
    view : View
        The scene without air: linear luminance per channel [cd/m²] and distance along the ray [m].
    field : FogField
        The fog.
    eye : tuple of float
        Optical centre (x, y, z) [m].
    ray_map : (3, 3) float64
        Takes a pixel (u, v, 1) to its viewing ray in the world, of any length.
    droplets : str
        See `daytime_luminance`.

    Returns
    -------
    (rows, cols, 3) float32
        Linear luminance per channel at the camera [cd/m²].
    """
    radiance = np.ascontiguousarray(view.radiance, dtype=np.float32)
    if field.extinction == 0 and not field.banks:
        return radiance.copy()
    out = np.empty_like(radiance)
    rows, columns = view.distance.shape
    lines, fogged = radiance.reshape(rows, 3 * columns), out.reshape(rows, 3 * columns)
    distance, rays = np.ascontiguousarray(view.distance, dtype=np.float32), np.ascontiguousarray(ray_map, np.float32)
    fog, layer = _banked_fog(field, eye), None if field.ground_albedo is None else _layered_fog(field, eye, droplets)

    def add_fog(_: int, top: int, bottom: int) -> None:
        if layer is None:
            fog_rows(lines, distance, rays, fog, top, bottom, fogged)
        else:
            layered_fog_rows(lines, distance, rays, layer, top, bottom, fogged)

    Bands().work(add_fog, rows, columns)
    return out


def _banked_fog(field: FogField, eye: tuple[float, float, float]) -> BankedFog:
    return BankedFog(
        headroom=np.float32(field.top - eye[2]),
        extinction=np.float32(field.extinction),
        banks=_bank_rows(field.banks, eye),
        airlight=np.array(field.airlight, dtype=np.float32),
    )


def _layered_fog(field: FogField, eye: tuple[float, float, float], droplets: str) -> LayeredFog:
    around = slant_airlight(field, eye[2], droplets)
    return LayeredFog(
        headroom=np.float32(field.top - eye[2]),
        extinction=np.float32(field.extinction),
        airlight=np.array(field.airlight, dtype=np.float32),
        share=around.share,
        sky=np.float32(around.sky),
    )


def _bank_rows(banks: tuple[FogBank, ...], eye: tuple[float, float, float]) -> NDArray[np.float32]:
    rows = np.empty((len(banks), 6), dtype=np.float32)
    for row, bank in zip(rows, banks, strict=True):
        station = (eye[0] - bank.origin[0]) * bank.axis[0] + (eye[1] - bank.origin[1]) * bank.axis[1]
        row[:] = (*bank.axis, station - bank.start, station - bank.end, bank.edge, bank.extra_extinction)
    return rows
