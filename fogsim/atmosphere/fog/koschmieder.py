"""A drawn scene seen through fog by day."""

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.koschmieder_kernels import fog_pixels
from fogsim.jit import Bands
from fogsim.values import FogBank, FogField, View


def fogged_radiance(
    view: View, field: FogField, eye: tuple[float, float, float], ray_map: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Radiance that reaches the camera through daytime fog: L = L0 e^(−τ) + L∞ (1 − e^(−τ)) (Koschmieder 1924).

    Parameters
    ----------
    view : View
        The scene without air: linear radiance [cd/m²] and distance along the ray [m].
    field : FogField
        The fog.
    eye : tuple of float
        Optical centre (x, y, z) [m].
    ray_map : (3, 3) float64
        Takes a pixel (u, v, 1) to its viewing ray in the world, of any length.

    Returns
    -------
    (rows, cols, 3) float32
        Linear radiance at the camera [cd/m²].
    """
    radiance = np.ascontiguousarray(view.radiance, dtype=np.float32)
    if field.extinction == 0 and not field.banks:
        return radiance.copy()
    out = np.empty_like(radiance)
    rows, columns = view.distance.shape
    lines, fogged = radiance.reshape(rows, 3 * columns), out.reshape(rows, 3 * columns)
    distance, rays = np.ascontiguousarray(view.distance, dtype=np.float32), np.ascontiguousarray(ray_map, np.float32)
    headroom, extinction = np.float32(field.top - eye[2]), np.float32(field.extinction)
    banks, airlight = _bank_rows(field.banks, eye), np.array(field.airlight, dtype=np.float32)

    def fog(_: int, top: int, bottom: int) -> None:
        fog_pixels(lines, distance, rays, headroom, extinction, banks, airlight, top, bottom, fogged)

    Bands().work(fog, rows, columns)
    return out


def _bank_rows(banks: tuple[FogBank, ...], eye: tuple[float, float, float]) -> NDArray[np.float32]:
    rows = np.empty((len(banks), 6), dtype=np.float32)
    for row, bank in zip(rows, banks, strict=True):
        station = (eye[0] - bank.origin[0]) * bank.axis[0] + (eye[1] - bank.origin[1]) * bank.axis[1]
        row[:] = (*bank.axis, station - bank.start, station - bank.end, bank.edge, bank.extra_extinction)
    return rows
