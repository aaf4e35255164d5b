"""The per-pixel loops of airlight by elevation and path, row by row."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.koschmieder_kernels import ENDLESS, bilinear, transmittances
from fogsim.core.jit import kernel

BEND = 0.05
"""Sine of an elevation at which a table's lines of sight are half as dense as at the horizon: s / (|s| + `BEND`)."""

ELEVATIONS, PATHS = 81, 33
"""Lines of sight of a table, evenly spaced in their bent sines; and paths on each, evenly in 1 − T from 0 to 1."""

_LEVEL = np.float32(1e-12)
_ONE = np.float32(1.0)
_BEND = np.float32(BEND)
_MIDDLE = np.float32(0.5 * (ELEVATIONS - 1))
_PER_BENT = np.float32(0.5 * (ELEVATIONS - 1) * (1.0 + BEND))
_LAST_LOOK = np.float32(ELEVATIONS - 1.001)
_LAST_PATH = np.float32(PATHS - 1.001)
_PER_LOST = np.float32(PATHS - 1)


class LayeredFog(NamedTuple):
    """A plane layer of even fog, as it lies about an eye."""

    headroom: np.float32  # Height of the fog's top above the eye [m]
    extinction: np.float32  # Extinction coefficient [1/m]
    airlight: NDArray[np.float32]  # (3,): Its level per channel [cd/m²]
    share: NDArray[np.float32]  # Airlight over that level by elevation and path
    sky: np.float32  # Factor of the luminance of the sky


@kernel
def layered_fog_rows(
    luminance: NDArray[np.float32],
    distance: NDArray[np.float32],
    ray_map: NDArray[np.float32],
    fog: LayeredFog,
    top: int,
    bottom: int,
    out: NDArray[np.float32],
) -> None:
    """Fog rows of an image, L = L0 T + A (1 − T), A by elevation and path.

    Takes `luminance`, `out` (rows, cols · 3) [cd/m²], `distance` (rows, cols) [m], `ray_map` (3, 3).
    """
    columns = distance.shape[1]
    look, depth = np.empty(columns, np.float32), np.empty(columns, np.float32)
    transmittance, power = np.empty(columns, np.float32), np.empty(columns, np.int32)
    red, green, blue = fog.airlight[0], fog.airlight[1], fog.airlight[2]
    for v in range(top, bottom):
        for u in range(columns):
            a, b = np.float32(u), np.float32(v)
            x = ray_map[0, 0] * a + ray_map[0, 1] * b + ray_map[0, 2]
            y = ray_map[1, 0] * a + ray_map[1, 1] * b + ray_map[1, 2]
            z = ray_map[2, 0] * a + ray_map[2, 1] * b + ray_map[2, 2]
            size = math.sqrt(x * x + y * y + z * z)
            depth[u] = fog.extinction * min(distance[v, u], np.float32(ENDLESS), fog.headroom * size / max(z, _LEVEL))
            place = z / (abs(z) + _BEND * size) * _PER_BENT + _MIDDLE
            look[u] = min(max(place, np.float32(0.0)), _LAST_LOOK)
        transmittances(depth, power, transmittance)
        for u in range(columns):
            through = transmittance[u]
            lost = _ONE - through
            scattered = lost * bilinear(fog.share, look[u], min(lost * _PER_LOST, _LAST_PATH))
            through *= fog.sky if math.isinf(distance[v, u]) else _ONE
            out[v, 3 * u] = luminance[v, 3 * u] * through + red * scattered
            out[v, 3 * u + 1] = luminance[v, 3 * u + 1] * through + green * scattered
            out[v, 3 * u + 2] = luminance[v, 3 * u + 2] * through + blue * scattered
