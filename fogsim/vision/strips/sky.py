"""The sky above the horizon: its brightness there, and how much the lens darkens its corners."""

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.light.medians import median
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.strips import sky_kernels

Floats = NDArray[np.float64]

SATURATED_SHARE = 0.02
"""Share of the sky's pixels at the largest value from which on its brightness is not what its mean says [-]."""


UNKNOWN_VIGNETTING = 0.3
"""Standard deviation of a lens's vignetting where the sky does not show it [-]: most pictures are corrected."""

_UNEVEN, _LEAST_SEEN, _MOST_VIGNETTING = 0.02, 0.7, 1.5
"""Deviation of a lens's vignetting by skies that are brighter in the middle, least share of a sky's pixels that must
show it, and most that it can be [-]."""


@dataclass(frozen=True, slots=True)
class Sky:
    """The sky above the horizon."""

    luminance: float  # At the horizon, of its bright part [linear grey levels]
    # deviation, upward: standard deviation of its luminance at the horizon, downward and upward [linear grey levels]
    deviation: float
    upward: float
    noise: float  # Deviation of single pixels [linear grey levels]
    # saturated, clipped: shares of its pixels of which all channels, and of which some, have the largest value [-]
    saturated: float
    clipped: float
    # vignetting, vignetting_deviation: how much of what a simple lens takes from pixels off its axis (1 − cos⁴) this
    # one takes, and the standard deviation of that [-]
    vignetting: float = 0.0
    vignetting_deviation: float = UNKNOWN_VIGNETTING
    # Deviation of its luminance from place to place, relative to it [-]: by clouds, by dirt on the glass, by trees
    unevenness: float = 0.0
    # slope, slope_deviation: how it brightens upward, as a straight line, and the standard deviation of that [linear
    # grey levels per rad]
    slope: float = 0.0
    slope_deviation: float = math.inf
    # (float, float): Least and greatest height above the horizon at which that was seen [rad]
    heights: tuple[float, float] = (0.0, 0.0)

    @property
    def is_clipped(self) -> bool:
        """Whether the sky may be brighter than it looks."""
        return self.clipped > SATURATED_SHARE


_BRIGHTENS, _SEEN_TO_BRIGHTEN = 0.6, 0.6
"""Slope of a sky upward over its level from which on it surely brightens [1/rad], and least share of its pixels that
must show that [-]: it is far from what the mean of its rows says."""

_LENS_UNEVENNESS = 0.026
"""Unevenness of a sky up to which it is used to estimate a lens's vignetting [-]."""

_SKY_ROWS = 24
"""Rows of sky that are looked at."""

_SKY_HEIGHT = 0.2
"""How far above the horizon sky is looked at [rad]; as far as the image goes if that is less."""

_DARKER = 0.012
"""Darkening from a row to the next below beyond which it is no longer sky that is seen, as a share [-]."""

_UNSEEN, _CLOSE = 0.3, 0.01
"""Deviation of the sky's luminance for each radian that is hidden above the horizon [1/rad], but for so much [rad]."""

_MOST_HIDDEN = 0.14
"""Angle above the horizon up to which something may hide all of the sky, beyond which it is no road that lies ahead but
a wall or a wood [rad]."""

_PATCHY, _SCATTERED, _BRIGHTER = 0.35, 0.004, 0.3
"""Share of a row that is alike, and relative scatter of the rows, beyond which trees may be taken for sky; by how much
the sky may be brighter then, as a deviation [-]."""


def sky_above(image: LinearPixels, camera: Camera, margin: float) -> Sky | None:
    """Look at the sky in the middle two thirds of the image above the horizon.

    Returns None if there are no such rows, or something high hides the sky all along them. Takes `margin` [px].
    """
    bottom = min(math.floor(camera.horizon_row - margin), camera.height - 1)
    top = max(0, math.floor(camera.horizon_row - _SKY_HEIGHT * camera.focal_length))
    if bottom - top < 1:
        return None
    rows = even_rows(top, bottom, _SKY_ROWS)
    side = camera.width // 6
    noise = sky_kernels.pixel_noise(image, rows)
    bright, share = sky_kernels.sky_rows(image, rows, side, camera.width - side, max(noise, 0.3))
    height = (camera.horizon_row - rows.astype(np.float64)) / camera.focal_length
    darker = max(_DARKER, 2.0 * noise / max(float(bright.max()), 1e-9))
    level, _, scatter, lowest = sky_kernels.level_at_horizon(bright, height, darker)
    if lowest > _MOST_HIDDEN:
        return None
    saturated, clipped = sky_kernels.saturation(image, rows, side)
    # Where the sky is clipped it looks the same though a lens darkens it.
    free = np.flatnonzero(height >= lowest)[::-2] if clipped <= SATURATED_SHARE else np.zeros(0, np.int64)
    shading = _shading(image, camera, rows[free], bright[free], noise, _Shading(level, scatter))
    level, scatter = shading.level, shading.deviation
    unseen = _UNSEEN * max(float(lowest) - margin / camera.focal_length - _CLOSE, 0.0) * level
    deviation = math.hypot(scatter, unseen)
    # What looks everywhere different is a wood rather than a sky, which is no darker than that.
    covered = median(share) < _PATCHY and scatter > _SCATTERED * level
    upward = _BRIGHTER * level if covered else deviation
    seen = height[free] if free.size else np.zeros(1)
    return Sky(
        luminance=level,
        deviation=deviation,
        upward=upward,
        noise=noise,
        saturated=saturated,
        clipped=clipped,
        vignetting=shading.vignetting,
        vignetting_deviation=shading.vignetting_deviation,
        unevenness=shading.unevenness,
        slope=shading.slope,
        slope_deviation=shading.slope_deviation,
        heights=(float(seen.min()), float(seen.max())),
    )


@dataclass(frozen=True, slots=True)
class _Shading:
    """A sky's brightness at the horizon, vignetting, their deviations, unevenness, and its slope upward."""

    level: float
    deviation: float
    vignetting: float = 0.0
    vignetting_deviation: float = UNKNOWN_VIGNETTING
    unevenness: float = 0.0
    slope: float = 0.0
    slope_deviation: float = math.inf


def _shading(
    image: LinearPixels, camera: Camera, rows: NDArray[np.int64], bright: Floats, noise: float, unseen: _Shading
) -> _Shading:
    """Sky of even slopes behind a lens, or what is known without them where it does not fill most of its rows."""
    if rows.size < 2 or median(bright) <= 0.0:
        return unseen
    height = (camera.horizon_row - rows) / camera.focal_length
    axis = np.array([*camera.principal_point, camera.horizon_row, camera.focal_length])
    found, covariance, seen, scatter = sky_kernels.sky_shading(image, rows, axis, bright, noise)
    level = float(found[0])
    unevenness = scatter / level if level > 0.0 else 0.0
    if seen < (_SEEN_TO_BRIGHTEN if found[2] > _BRIGHTENS * level else _LEAST_SEEN) or level <= 0.0:
        return replace(unseen, unevenness=unevenness)
    vignetting, deviation = 0.0, UNKNOWN_VIGNETTING
    # What looks like a lens's shade under a more uneven sky are houses on both sides, which fade upward.
    if unevenness <= _LENS_UNEVENNESS:
        vignetting = min(max(float(found[4]) / level, 0.0), _MOST_VIGNETTING)
        deviation = min(math.hypot(_UNEVEN, math.sqrt(covariance[4, 4]) / level), UNKNOWN_VIGNETTING)
    # Mean slope over the heights that are seen.
    ends = float(height.min() + height.max())
    variance = covariance[2, 2] + 2.0 * ends * covariance[2, 3] + ends**2 * covariance[3, 3]
    slope = (float(found[2] + ends * found[3]), math.sqrt(max(variance, 0.0)))
    return _Shading(level, math.sqrt(covariance[0, 0]), vignetting, deviation, unevenness, *slope)


@functools.lru_cache(maxsize=64)
def even_rows(first: int, last: int, count: int) -> NDArray[np.int64]:
    """Rows evenly from the first to the last, downward; the array is shared, so never to be written."""
    return np.unique(np.linspace(first, last, count).astype(np.int64))
