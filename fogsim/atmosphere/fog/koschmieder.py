"""A drawn scene seen through fog by day: Koschmieder's law in closed form where the fog has one, else on a grid."""

import dataclasses
import functools
import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.airlight import airlight_source
from fogsim.atmosphere.fog.frustum import frustum_grid, radiance_through_grid
from fogsim.atmosphere.fog.koschmieder_kernels import BankedFog, fog_rows
from fogsim.atmosphere.fog.layer_airlight import LayeredFog, layered_fog_rows, slant_airlight
from fogsim.atmosphere.fog.medium import find_pixels_within, has_closed_form
from fogsim.core.jit import Bands, kernel
from fogsim.values import Camera, CameraPose, FogBank, FogField, FogShelter, View
from fogsim.values.obstruction import Obstructions, Tunnel
from fogsim.values.pinhole import ray_from_pixel

_COARSEST = 2.0
"""The image is averaged to pixels of at most one such part of the blur's width before it is blurred."""

_REACH = 4.0
"""Widths within which all of a Gaussian lies."""

_DARK = 1e-12
"""Luminance that is none [cd/m²]; numbers near the smallest that exist are very slow."""

_NONE, _HALF = np.float32(0.0), np.float32(0.5)


def _add_forward_scatter(
    luminance: NDArray[np.float32],
    airlight: tuple[float, float, float],
    transmittance: NDArray[np.float32],
    weight: float,
    width: float,
) -> None:
    """Add to an image what forward scattering does to the light that a scene sends through fog.

    Of D = (L0 − L∞) T, by which the scene differs from the airlight, the share w (1 − T) is exchanged for its own blur
    h ∗ D, h being a Gaussian: nothing in clear air, most for what lies deep in the fog. What is as bright as the
    airlight stays so, and fog next to something dark is darker. Forward lobes of fog droplets are 1° to 2° wide; weight
    and width are assumptions, not measurements.

    Takes `luminance` (rows, cols, 3) [cd/m²], `airlight` [cd/m²], `transmittance` (rows, cols), `width` [px].
    """
    block = max(1, int(width / _COARSEST))
    difference = luminance - np.array(airlight, np.float32)
    small = _block_means(difference, block)
    reach = math.ceil(_REACH * width / block)
    weights = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) * block / width)).astype(np.float32)
    across_first, blurred = np.empty_like(small), np.empty_like(small)
    _blur_rows(small, weights, across_first)
    _blur_rows(across_first.transpose(1, 0, 2), weights, blurred.transpose(1, 0, 2))
    exchange(luminance, difference, transmittance, blurred, block, np.float32(weight))


def _block_means(image: NDArray[np.float32], block: int) -> NDArray[np.float32]:
    """Averages over squares; those at the far edges are filled up with the outermost pixels."""
    rows, columns = image.shape[:2]
    padded = np.pad(image, ((0, -rows % block), (0, -columns % block), (0, 0)), mode="edge")
    shape = (padded.shape[0] // block, block, padded.shape[1] // block, block, 3)
    # One axis after the other: that is faster than both at once.
    means = padded.reshape(shape).sum(axis=1).sum(axis=2) / block**2
    means[np.abs(means) < _DARK] = 0.0
    return np.ascontiguousarray(means, dtype=np.float32)


def _pixel_width(angle: float, focal_length: float) -> float:
    """Width of a blur on the image [px]: at least half a pixel, so that it can be drawn.

    Takes `angle` [rad], `focal_length` [px].
    """
    return max(focal_length * math.tan(angle), 0.5)


@kernel
def _blur_rows(image: NDArray[np.float32], weights: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Convolve each row of an image; what the weights miss at the edges is shared among the rest.

    Takes `image`, `out` (rows, cols, 3), `weights` (2 n + 1,).
    """
    columns, reach = image.shape[1], weights.shape[0] // 2
    for u in range(columns):
        first, last = max(0, u - reach), min(columns, u + reach + 1)
        whole = np.float32(0.0)
        for n in range(first, last):
            whole += weights[n - u + reach]
        for v in range(image.shape[0]):
            for c in range(3):
                total = np.float32(0.0)
                for n in range(first, last):
                    total += weights[n - u + reach] * image[v, n, c]
                out[v, u, c] = total / whole


@kernel
def exchange(
    luminance: NDArray[np.float32],
    difference: NDArray[np.float32],
    transmittance: NDArray[np.float32],
    blurred: NDArray[np.float32],
    block: int,
    weight: np.float32,
) -> None:
    """Exchange a share w (1 − T) of a difference for its blur.

    Takes `luminance`, `difference` (rows, cols, 3) [cd/m²], `transmittance` (rows, cols), `blurred` (block rows, block
    cols, 3) [cd/m²], `block` [px].
    """
    rows, columns = blurred.shape[0], blurred.shape[1]
    part = np.float32(1.0) / np.float32(block)
    for v in range(transmittance.shape[0]):
        down = min(max((np.float32(v) + _HALF) * part - _HALF, _NONE), np.float32(rows - 1))
        upper = min(int(down), max(rows - 2, 0))
        lower = min(upper + 1, rows - 1)
        b = down - np.float32(upper)
        for u in range(transmittance.shape[1]):
            across = min(max((np.float32(u) + _HALF) * part - _HALF, _NONE), np.float32(columns - 1))
            left = min(int(across), max(columns - 2, 0))
            right = min(left + 1, columns - 1)
            a = across - np.float32(left)
            share = weight * (np.float32(1.0) - transmittance[v, u])
            for c in range(3):
                above = blurred[upper, left, c] + (blurred[upper, right, c] - blurred[upper, left, c]) * a
                below = blurred[lower, left, c] + (blurred[lower, right, c] - blurred[lower, left, c]) * a
                luminance[v, u, c] += share * (above + (below - above) * b - difference[v, u, c])


def _is_sheltered(shelters: tuple[FogShelter, ...], place: tuple[float, float, float]) -> bool:
    """Whether a place is in a tunnel (`place` [m])."""
    above = (place[0], place[1], place[2] + 0.01)
    return bool(Obstructions(_boxes(shelters)).way_through([place], [above])[0] > 0.0)


def _sheltered_pixels(
    shelters: tuple[FogShelter, ...], view: View, camera: Camera, pose: CameraPose
) -> NDArray[np.bool_]:
    """Pixels whose rays pass through a tunnel before they end (rows, cols)."""
    distance, rays = np.ascontiguousarray(view.distance, np.float32), ray_from_pixel(camera, pose)
    within = np.zeros(distance.shape, np.bool_)
    find_pixels_within(distance, rays, np.array(pose.position, np.float64), _portals(shelters), within)
    return within


@functools.lru_cache(maxsize=8)
def _boxes(shelters: tuple[FogShelter, ...]) -> NDArray[np.float64]:
    return np.concatenate([Tunnel(np.array(one.line), one.half_width, one.height).boxes() for one in shelters])


@functools.lru_cache(maxsize=8)
def _portals(shelters: tuple[FogShelter, ...]) -> NDArray[np.float64]:
    """Where each tunnel begins and ends (2 n, 7); see `find_pixels_within`."""
    rows = list[tuple[float, ...]]()
    for one in shelters:
        for (x, y, z), (inner_x, inner_y, _) in (one.line[:2], one.line[:-3:-1]):
            length = math.hypot(inner_x - x, inner_y - y)
            rows.append((x, y, z, (inner_x - x) / length, (inner_y - y) / length, one.half_width, one.height))
    return np.array(rows)


_USUAL_DROPLETS = "moderate_radiation"
"""Small droplets, as `Droplets` calls them."""


def daytime_luminance(
    view: View, field: FogField, camera: Camera, pose: CameraPose, droplets: str = _USUAL_DROPLETS
) -> NDArray[np.float32]:
    """Luminance at a camera, L = L0 T + L∞ (1 − T), with the field's forward scattering.

    Returns linear luminance per channel [cd/m²] (rows, cols, 3).
    """
    if field.ground_albedo is not None:
        return fogged_radiance(view, field, pose.position, ray_from_pixel(camera, pose), droplets)
    radiance = _through_fog(view, field, camera, pose)
    if field.forward_scatter > 0:
        width = _pixel_width(field.forward_scatter_width, camera.focal_length)
        share = transmittance(view, field, camera, pose)
        _add_forward_scatter(radiance, field.airlight, share, field.forward_scatter, width)
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
    if not field.shelters or _is_sheltered(field.shelters, pose.position):
        return radiance
    open_air = _through_field(view, dataclasses.replace(field, shelters=()), camera, pose)
    within = _sheltered_pixels(field.shelters, view, camera, pose)
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
    droplets: str = _USUAL_DROPLETS,
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


def _headroom(field: FogField, eye: tuple[float, float, float]) -> np.float32:
    """Height of the fog's top above the eye [m], never 0: rays down from the top itself are in the fog."""
    return np.float32(max(field.top - eye[2], 1e-6))


def _banked_fog(field: FogField, eye: tuple[float, float, float]) -> BankedFog:
    return BankedFog(
        headroom=_headroom(field, eye),
        extinction=np.float32(field.extinction),
        banks=_bank_rows(field.banks, eye),
        airlight=np.array(field.airlight, dtype=np.float32),
    )


def _layered_fog(field: FogField, eye: tuple[float, float, float], droplets: str) -> LayeredFog:
    around = slant_airlight(field, eye[2], droplets)
    return LayeredFog(
        headroom=_headroom(field, eye),
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
