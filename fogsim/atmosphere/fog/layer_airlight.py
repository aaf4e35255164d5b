"""Airlight by elevation and path in a plane layer of even fog, as radiative transfer has it.

Fog that absorbs nothing, between a Lambertian ground and a CIE overcast sky. What is scattered toward the eye at a
place, over E / π (E is the illuminance of the ground), goes by the optical thickness of the layer, the place's share
of it, the elevation of the line of sight and, linearly, by the albedo of the ground; `tools/make_airlight_table.py`
made the table of it.
"""

import math
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.koschmieder_kernels import ENDLESS, bilinear, transmittances
from fogsim.core.jit import kernel
from fogsim.errors import InputError
from fogsim.values import FogField
from fogsim.values.fog import SideLight, airlight_share

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


_PIECES = 4
"""Places on a line of sight between two paths of the table."""


@dataclass(frozen=True, slots=True)
class LayerTable:
    """Source functions in layers, over E / π."""

    thickness: NDArray[np.float64]  # (n,): Optical thickness of the layer, ascending [-]
    place: NDArray[np.float64]  # (m,): Optical height above the ground over the thickness, from 0 to 1 [-]
    elevation: NDArray[np.float64]  # (k,): Of the line of sight, from −π/2 to π/2 [rad]
    # black, per_albedo (n, m, k): over black ground, and what an albedo of 1 adds [-]
    black: NDArray[np.float64]
    per_albedo: NDArray[np.float64]
    # reflectance, transmittance (n,): of the layer, for the light of the ground and for that of an overcast sky [-]
    reflectance: NDArray[np.float64]
    transmittance: NDArray[np.float64]
    # vertical_black, vertical_per_albedo (n,): light of a vertical surface near the ground over E, as `black` and
    # `per_albedo` [-]
    vertical_black: NDArray[np.float64]
    vertical_per_albedo: NDArray[np.float64]


@cache
def layer_table(droplets: str) -> LayerTable:
    """The table that FogSim carries."""
    with (files("fogsim.atmosphere") / "data" / "airlight.npz").open("rb") as file, np.load(file) as found:
        return LayerTable(
            thickness=found["thickness"],
            place=found["place"],
            elevation=np.radians(found["elevation"]),
            black=found[f"{droplets}_black"].astype(np.float64),
            per_albedo=found[f"{droplets}_per_albedo"].astype(np.float64),
            reflectance=found[f"{droplets}_reflectance"],
            transmittance=found[f"{droplets}_transmittance"],
            vertical_black=found[f"{droplets}_vertical_black"],
            vertical_per_albedo=found[f"{droplets}_vertical_per_albedo"],
        )


def side_light(field: FogField, droplets: str) -> SideLight:
    """Light of surfaces in a layer that are not level, near the ground.

    Parameters
    ----------
    field : FogField
        The fog at one time, with an albedo of the ground.
    droplets : str
        A member of `Droplets`.

    Raises
    ------
    InputError
        If the table does not have so thick a layer.
    """
    table, albedo = layer_table(droplets), field.ground_albedo or 0.0
    at = math.log(layer_thickness(field.extinction, field.top - field.ground))
    upright = np.interp(at, np.log(table.thickness), table.vertical_black + albedo * table.vertical_per_albedo)
    return SideLight(float(upright), albedo)


@dataclass(frozen=True, slots=True)
class SlantAirlight:
    """What the fog adds between an eye and places around it."""

    # Airlight over the field's: mean source function on a path, by the bent sine of its elevation and by what it takes
    # from the light, 1 − T (see `layer_airlight_kernels`)
    share: NDArray[np.float32]
    # Luminance of the sky above the fog over that of a sky which gives the ground the same illuminance without fog
    sky: float


def sines() -> NDArray[np.float64]:
    """Sines of the elevations of `SlantAirlight.share`: dense at the horizon."""
    bent = np.linspace(-1.0, 1.0, ELEVATIONS) / (1.0 + BEND)
    return np.clip(BEND * bent / (1.0 - np.abs(bent)), -1.0, 1.0)


def slant_airlight(field: FogField, eye_height: float, droplets: str) -> SlantAirlight:
    """Airlight around an eye in a layer.

    Parameters
    ----------
    field : FogField
        The fog at one time, with an albedo of the ground.
    eye_height : float
        z of the eye [m].
    droplets : str
        A member of `Droplets`.

    Raises
    ------
    InputError
        If the eye is above the layer, or the table does not have so thick a layer.
    """
    if eye_height > field.top:
        raise InputError(
            f"the eye, {eye_height - field.ground:.4g} m above the lowest road, is above the fog, whose top is "
            f"{field.top - field.ground:.4g} m high; airlight by elevation is known within the layer"
        )
    thickness = layer_thickness(field.extinction, field.top - field.ground)
    depth = max(eye_height - field.ground, 1e-3) * field.extinction
    return _slant_airlight(_stepped(thickness), _stepped(depth), field.ground_albedo or 0.0, droplets)


def _stepped(depth: float) -> float:
    """The next of depths 1 % apart, which changes no light by more than a thousandth.

    Roads that climb and fog that thickens take most of their frames' tables from memory so.
    """
    return math.exp(0.01 * round(100.0 * math.log(depth)))


def slant_share(around: SlantAirlight, sine: NDArray[np.float64], lost: NDArray[np.float64]) -> NDArray[np.float64]:
    """Airlight over its level on lines of sight, as `layered_fog_rows` has it at the pixels of a pinhole.

    Parameters
    ----------
    around : SlantAirlight
        Of an eye.
    sine : (...) float64
        Of the elevations of the lines of sight [-].
    lost : (...) float64
        What they take from the light, 1 − T [-].
    """
    look = 0.5 * (ELEVATIONS - 1) * (1.0 + (1.0 + BEND) * sine / (np.abs(sine) + BEND))
    path = lost * (PATHS - 1)
    a, b = np.minimum(look.astype(int), ELEVATIONS - 2), np.minimum(path.astype(int), PATHS - 2)
    up, on = look - a, path - b
    low = around.share[a, b] * (1.0 - on) + around.share[a, b + 1] * on
    high = around.share[a + 1, b] * (1.0 - on) + around.share[a + 1, b + 1] * on
    return np.asarray(low * (1.0 - up) + high * up)


def layer_thickness(extinction: float, height: float) -> float:
    """Optical thickness of a layer; of one too thin to be seen, that of the thinnest that is known.

    Parameters
    ----------
    extinction : float
        Extinction coefficient [1/m].
    height : float
        Height of the top above the ground [m].

    Raises
    ------
    InputError
        If it is thicker than the table knows.
    """
    thickness, known = extinction * height, layer_table("moderate_radiation").thickness
    if thickness > known[-1]:
        raise InputError(
            f"airlight by elevation is known for layers of optical thickness up to {known[-1]:g}, got {thickness:.4g} "
            f"(extinction {extinction:.3g} 1/m over {height:.4g} m)"
        )
    return max(thickness, float(known[0]))


@lru_cache(maxsize=128)
def _slant_airlight(thickness: float, depth: float, albedo: float, droplets: str) -> SlantAirlight:
    table = layer_table(droplets)
    log = np.log(table.thickness)
    low = min(int(np.searchsorted(log, math.log(thickness), side="right")) - 1, len(log) - 2)
    on = (math.log(thickness) - log[low]) / (log[low + 1] - log[low])

    def between(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(values[low] + (values[low + 1] - values[low]) * on)

    source = between(table.black) + albedo * between(table.per_albedo)
    share = path_means(table, source, thickness, depth) / airlight_share(albedo)
    brighter = (1.0 - albedo * between(table.reflectance)) / between(table.transmittance)
    return SlantAirlight(share.astype(np.float32), float(brighter))


def path_means(table: LayerTable, source: NDArray[np.float64], thickness: float, depth: float) -> NDArray[np.float64]:
    """What paths from an eye scatter in, over what they take from the light.

    Returns by the elevations of `sines` and by 1 − T, of paths that go on beyond ground and top as if in what is there
    [-]. Takes `source` (m, k).
    """
    slopes = sines()
    looks = np.arcsin(slopes)
    by_look = np.array([np.interp(looks, table.elevation, row) for row in source]).T
    pieces = (PATHS - 1) * _PIECES
    # dT = −T dτ: what a path scatters in is the source function's mean over the transmittance.
    path = -np.log1p(-(np.arange(pieces) + 0.5) / pieces)
    places = np.clip((depth + slopes[:, None] * path) / thickness, 0.0, 1.0)
    scattered = np.array([np.interp(at, table.place, row) for at, row in zip(places, by_look, strict=True)])
    sums = np.cumsum(scattered, axis=1)[:, _PIECES - 1 :: _PIECES] / _PIECES
    at_eye = [np.interp(depth / thickness, table.place, row) for row in by_look]
    return np.column_stack((at_eye, sums / np.arange(1, PATHS)))
