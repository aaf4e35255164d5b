"""Airlight: that of an overcast day, and how it dims under the fog overhead."""

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.frustum import FrustumGrid
from fogsim.atmosphere.fog.medium import medium_of
from fogsim.atmosphere.fog.optical_depth_kernels import extinctions_on_ray
from fogsim.values import FogField
from fogsim.values.fog import AIRLIGHT_SHARE

_AIRLIGHT_TINT = (0.98, 1.0, 1.02)
"""Airlight per channel relative to its luminance: fog droplets are grey, the overcast sky slightly bluish."""

_DEEPEST = 2000.0
"""Fog without end is taken to reach this far above the eye [m]."""
_LEVELS = 800


def airlight_from_illuminance(illuminance: float, share: float = AIRLIGHT_SHARE) -> tuple[float, float, float]:
    """Airlight of fog under an overcast sky, L∞ = share · E_h / π per channel (physics of Koschmieder's closed form).

    Parameters
    ----------
    illuminance : float
        Horizontal illuminance E_h [lx], not negative.
    share : float
        Airlight relative to a perfectly white horizontal diffuser; see `fogsim.values.fog.airlight_share`.

    Returns
    -------
    tuple of float
        Luminance per channel [cd/m²].

    Raises
    ------
    ValueError
        If the illuminance is negative or not finite.
    """
    if not (illuminance >= 0 and math.isfinite(illuminance)):
        raise ValueError(f"illuminance must be finite and not negative, got {illuminance!r}")
    luminance = share * illuminance / math.pi
    red, green, blue = (luminance * tint for tint in _AIRLIGHT_TINT)
    return (red, green, blue)


def airlight_source(field: FogField, grid: FrustumGrid) -> NDArray[np.float32] | None:
    """What fog scatters towards the eye beyond the field's even airlight.

    A layer that absorbs nothing, over dark ground, lets the share 1 / (1 + σ τ↑) of diffuse light through, with σ = ¾
    (1 − g) in Eddington's two-stream approximation (Meador and Weaver 1980, J. Atmos. Sci. 37, 630). Here the airlight
    of each place goes by that law, relative to the ground outside banks, where it is the field's; τ↑ is that of the
    vertical column that is as dense as the place itself.

    Returns luminance scattered in between the eye and each node, beyond L∞ (1 − T) [cd/m²]; None if there is no
    shading.
    """
    shading = field.airlight_shading
    if shading == 0 or (field.extinction == 0 and not field.banks):
        return None
    heights, equivalent, column = _equivalent_heights(field, float(grid.eye[2]))
    reach = np.minimum(grid.distances, grid.distances[-2])
    z = grid.eye[2] + grid.directions[..., 2:] * reach
    at_ground = field.extinction * np.interp(field.ground, heights, column)
    # Nodes below the base stand for the fog that begins there, over which lies as much as over the ground.
    is_below = z < field.base - 0.5 * field.base_edge
    overhead = np.where(is_below, at_ground, grid.extinction * np.interp(z, heights, equivalent))
    excess = (1.0 + shading * at_ground) / (1.0 + shading * overhead) - 1.0
    transmittance = np.exp(-grid.depth)
    lost = transmittance[..., :-1] - transmittance[..., 1:]
    gathered = np.zeros(grid.depth.shape, dtype=np.float32)
    np.cumsum(0.5 * (excess[..., 1:] + excess[..., :-1]) * lost, axis=-1, out=gathered[..., 1:])
    return gathered[..., None] * np.array(field.airlight, dtype=np.float32)


def _equivalent_heights(
    field: FogField, eye_height: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Heights [m], and what is overhead as a thickness of fog as dense as there, and as the densest at its height [m].

    Where there is no fog, both are the same, so that values can be interpolated across a sharp base.
    """
    low = min(field.ground, eye_height) - 10.0
    high = min(max(field.top + 0.5 * field.top_edge, low + 20.0), eye_height + _DEEPEST)
    heights = np.linspace(low, high, _LEVELS)
    bare = dataclasses.replace(field, extinction=1.0, banks=(), patches=None)
    profile = np.empty(_LEVELS)
    upright, below = np.array((0.0, 0.0, 1.0)), np.array((0.0, 0.0, low))
    extinctions_on_ray(below, upright, heights - low, medium_of(bare), profile)
    column = np.cumsum(profile[::-1])[::-1] * (heights[1] - heights[0])
    return heights, np.where(profile > 1e-6, column / np.maximum(profile, 1e-6), column), column
