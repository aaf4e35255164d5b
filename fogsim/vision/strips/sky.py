"""The sky above the horizon: its brightness there, and how much the lens darkens its corners."""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of, times
from fogsim.values.camera import Camera
from fogsim.vision.light.medians import MOST_SAMPLES, median_among, sort_few
from fogsim.vision.light.pixel_kernels import (
    SATURATED_SHARE,
    LinearPixels,
    even_column,
    pixel_luminance,
    saturation,
    sun_in_sky,
)

_SKY_SHARE, _SKY_WIDTH = 7, 0.012
"""Part of a row (one in so many) that sky must fill to be found, and half the width of its luminances, relative [-]."""

_LEAST_SKY_ROWS = 4
"""Rows of sky before it can end downward."""

_LEAST_SKY_HEIGHT, _STEEPEST_SKY = 0.04, 0.8
"""Height that rows must span to show how the sky brightens upward [rad], and most that it does [1/rad]."""


@kernel
def sky_rows(
    image: LinearPixels,
    rows: NDArray[np.int64],
    left: int,
    right: int,
    floor: float,
    has_sun: bool,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Brightness of the bright part of each row: of the sky, where trees and vehicles stand before it.

    Starts near the row's brightest and moves to the mean of what lies near, so that what is darker may cover most of
    the row; but at the row's middle where the sun is in the sky, which its glow brightens.

    Returns brightness [linear grey levels], and the share of each row that is as bright (n,). Takes `rows` (n,) int64,
    `floor` [linear grey levels].
    """
    bright, share = np.zeros(rows.size), np.zeros(rows.size)
    count = min(MOST_SAMPLES, right - left)
    samples, ordered = np.empty(count, np.float32), np.empty(count, np.float32)
    for i in range(rows.size):
        for j in range(count):
            samples[j] = pixel_luminance(image, rows[i], even_column(j, count, left - 0.5, right - 0.5))
        sort_few(samples, ordered)
        centre, kept = float(ordered[count // 2 if has_sun else count - 1 - count // _SKY_SHARE]), 0
        reach = max(2.5 * floor, _SKY_WIDTH * centre)
        for _ in range(4):
            total, kept, before = 0.0, 0, centre
            for value in ordered:
                if abs(float(value) - centre) <= reach:
                    total += float(value)
                    kept += 1
            centre = total / kept
            if centre == before:
                break
        bright[i], share[i] = centre, kept / count
    return bright, share


@kernel
def level_at_horizon(
    bright: NDArray[np.float64], height: NDArray[np.float64], step: float
) -> tuple[float, float, float, float]:
    """Brightness of the sky at the horizon, from that of rows above it (Theil and Sen's robust straight line).

    Where rows darken downward by more than `step` from one to the next, something stands before the sky, and the rows
    below say nothing.

    Returns brightness at height 0, slope, robust deviation of the rows from the line, height of the lowest row in use.
    Takes `bright` (n,), `height` (n,).
    """
    drops = np.zeros(bright.size)
    count = 1
    for i in range(1, bright.size):
        usual = max(median_among(drops[1:i]), 0.0) if i > 1 else 0.0
        drops[i] = bright[i - 1] - bright[i]
        twice = bright[max(i - 2, 0)] - bright[i]
        least = step * bright[i - 1]
        if count >= _LEAST_SKY_ROWS and (drops[i] > least + 2.0 * usual or twice > 1.5 * least + 4.0 * usual):
            break
        count = i + 1
    slopes = np.zeros(count * (count - 1) // 2 + 1)
    number = 0
    for i in range(count):
        for j in range(i):
            slopes[number] = (bright[i] - bright[j]) / (height[i] - height[j])
            number += 1
    middle, slope = median_among(bright[:count]), 0.0
    if height[0] - height[count - 1] > _LEAST_SKY_HEIGHT:
        slope = min(max(median_among(slopes[:number]), -_STEEPEST_SKY * middle), _STEEPEST_SKY * middle)
    rest = bright[:count] - slope * height[:count]
    level = median_among(rest)
    return level, slope, 1.4826 * median_among(np.abs(rest - level)), height[count - 1]


@kernel
def pixel_noise(image: LinearPixels, rows: NDArray[np.int64]) -> float:
    """Robust deviation of single pixels, from the differences of neighbours [linear grey levels].

    Takes `rows` (n,) int64.
    """
    cols = image.pixels.shape[1]
    per_row = max((cols - 1) // 2, 1)
    step = max(per_row // 32, 1)
    apart = np.empty(rows.size * (per_row // step + 1))
    count = 0
    for row in rows:
        for col in range(((cols - 2) % (2 * step)) // 2, cols - 1, 2 * step):
            if count < apart.size:
                apart[count] = abs(pixel_luminance(image, row, col) - pixel_luminance(image, row, col + 1))
                count += 1
    # The root of the mean square of the lower three quarters stands for all: medians of whole numbers jump.
    ordered = np.sort(apart[:count])
    kept = max((3 * count) // 4, 1)
    square = 0.0
    for i in range(kept):
        square += ordered[i] * ordered[i]
    # For a normal difference of deviation √2 σ, the lower three quarters have a mean square of 0.3692 · 2 σ².
    return math.sqrt(square / kept / (2.0 * 0.3692))


_SHADING_SCALES = (0.06, 0.02, 0.006, 0.006)
"""Deviations beyond which a pixel weighs little in each iteration of the fit of a sky's shading, relative to it [-]."""

_TILT, _BRIGHTENING, _VIGNETTING = 0.3, 1.5, 0.5
"""Standard deviations of a sky's slopes sideways and upward [1/rad], and of its fall toward the corners [-], before it
is looked at, relative to it."""

_LEAST_BEND, _BENDING = 0.1, 2.5
"""Standard deviation of the bend of a sky's slope upward where there is none, relative to the sky [1/rad²], and that of
the bend over a slope [1/rad]."""

_SHADING_COLS = 32
"""Pixels of each row that are looked at."""

_ALIKE = 4.0
"""How many of those pixels err together, since a sky is not quite even [-]."""


@kernel
def sky_shading(
    image: LinearPixels, rows: NDArray[np.int64], axis: NDArray[np.float64], bright: NDArray[np.float64], noise: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float]:
    """Sky as L = a + b x + c y + e y² − d (1 − cos⁴ of the angle to the camera's axis), in Cauchy's norm.

    Returns a, b, c, e, d, their covariance, the share of pixels that lie near, and the robust deviation of all of them
    next to their noise [linear grey levels] (5, 5). Takes `rows` (n,) int64, `axis` (4,) [px], `bright` (n,) [linear
    grey levels], `noise` [linear grey levels].
    """
    cols, count = image.pixels.shape[1], _SHADING_COLS
    level = median_among(bright)
    height = (axis[2] - rows) / axis[3]
    found = np.array([level, 0.0, 0.0, 0.0, 0.0])
    covariance: NDArray[np.float64] = np.eye(5)
    seen, off, aside = np.empty((rows.size, count)), np.empty((rows.size, count)), np.empty(count)
    for j in range(count):
        col = even_column(j, count, -0.5, cols - 0.5)
        aside[j] = (col - axis[0]) / axis[3]
        for i in range(rows.size):
            seen[i, j] = pixel_luminance(image, rows[i], col)
            y = (axis[1] - rows[i]) / axis[3]
            off[i, j] = 1.0 - 1.0 / (1.0 + aside[j] * aside[j] + y * y) ** 2
    number = 0
    for relative in _SHADING_SCALES:
        spread = (relative * level) ** 2 + (2.0 * noise) ** 2
        normal, right = np.zeros((5, 5)), np.zeros(5)
        normal[0, 0] = 1e-6
        bend = _LEAST_BEND + _BENDING * abs(found[2]) / level
        for a, deviation in ((1, _TILT), (2, _BRIGHTENING), (3, bend), (4, _VIGNETTING)):
            normal[a, a] = spread / (deviation * level) ** 2
        number, squares = _add_sky(seen, off, aside, height, found, spread, normal, right)
        inverse = inverse_of(normal)
        found = times(inverse, right)
        covariance = inverse * (_ALIKE * max(squares / max(number, 1), noise * noise))
    return found, covariance, number / seen.size, _scatter(seen, off, aside, height, found, noise)


@kernel
def _scatter(
    seen: NDArray[np.float64],
    off: NDArray[np.float64],
    aside: NDArray[np.float64],
    height: NDArray[np.float64],
    found: NDArray[np.float64],
    noise: float,
) -> float:
    """Robust deviation of pixels from a sky's shading, next to that of their noise."""
    apart = np.empty(seen.size)
    for i in range(height.size):
        for j in range(aside.size):
            apart[i * aside.size + j] = abs(seen[i, j] - _shaded(aside[j], height[i], off[i, j], found))
    return math.sqrt(max((1.4826 * median_among(apart)) ** 2 - noise * noise, 0.0))


@kernel
def _shaded(x: float, height: float, off: float, found: NDArray[np.float64]) -> float:
    """Luminance of a sky of some shading at a place (`off` 1 − cos⁴ of its angle to the camera's axis)."""
    return float(found[0] + found[1] * x + (found[2] + found[3] * height) * height - found[4] * off)


@kernel
def _add_sky(
    seen: NDArray[np.float64],
    off: NDArray[np.float64],
    aside: NDArray[np.float64],
    height: NDArray[np.float64],
    found: NDArray[np.float64],
    spread: float,
    normal: NDArray[np.float64],
    right: NDArray[np.float64],
) -> tuple[int, float]:
    """Add pixels to the normal equations of a sky's shading; returns how many lie near, and their squares."""
    number, squares, shapes = 0, 0.0, np.ones(5)
    square, weight = np.empty(aside.size), np.empty(aside.size)
    for i in range(height.size):
        # In a loop of its own, which is vectorised, for these are divisions.
        for j in range(aside.size):
            rest = seen[i, j] - _shaded(aside[j], height[i], off[i, j], found)
            square[j] = rest * rest
            weight[j] = 1.0 / (1.0 + square[j] / spread) ** 2
        shapes[2], shapes[3] = height[i], height[i] ** 2
        for j in range(aside.size):
            if square[j] < 4.0 * spread:
                number += 1
                squares += square[j]
            shapes[1], shapes[4] = aside[j], -off[i, j]
            for a in range(5):
                share = weight[j] * shapes[a]
                right[a] += weight[j] * seen[i, j] * shapes[a]
                for b in range(a, 5):
                    normal[a, b] += share * shapes[b]
    for a in range(5):
        for b in range(a):
            normal[a, b] = normal[b, a]
    return number, squares


Floats = NDArray[np.float64]

UNKNOWN_VIGNETTING = 0.3
"""Standard deviation of a lens's vignetting where the sky does not show it [-]: most pictures are corrected."""

_UNEVEN, _LEAST_SEEN, _MOST_VIGNETTING = 0.02, 0.7, 1.5
"""Deviation of a lens's vignetting by skies that are brighter in the middle, least share of a sky's pixels that must
show it, and most that it can be [-]."""


class Sky(NamedTuple):
    """The sky above the horizon."""

    luminance: float  # At the horizon, of its bright part [linear grey levels]
    # deviation, upward: standard deviation of its luminance at the horizon, downward and upward [linear grey levels]
    deviation: float
    upward: float
    noise: float  # Deviation of single pixels [linear grey levels]
    # saturated, clipped: shares of its pixels of which the least saturated channel, and of which any, has the largest
    # value [-]
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
    has_sun: bool = False  # Whether the sun shines in it, or a lamp

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

_STEEPEST_FALL, _FALLEN = 5.0, 1.0 / math.sqrt(3.0)
"""Most that a sky in fog darkens downward, over its level [1/rad] (3.4 in nine photographs above roads), and deviation
of its luminance at the horizon downward, over how much darker what may be sky is above it [-]: of an even law."""

_MOST_HIDDEN = 0.14
"""Angle above the horizon up to which something may hide all of the sky, beyond which it is no road that lies ahead but
a wall or a wood [rad]."""

_PATCHY, _SCATTERED, _BRIGHTER = 0.35, 0.004, 0.3
"""Share of a row that is alike, and relative scatter of the rows, beyond which trees may be taken for sky; by how much
the sky may be brighter then, as a deviation [-]."""


_TEXTURE, _FINER = 0.02, 4.0
"""Noise of single pixels relative to the luminance, and over that of the road, beyond which a wood, a hill or a wall
stands before the sky [-]: a camera's noise, in light, is up to 3.2 times as much in the sky as on the road on pool 0 of
`benchmarks/camera_kinds.py`."""


def sky_above(image: LinearPixels, camera: Camera, margin: float) -> Sky | None:
    """Look at the sky in the middle two thirds of the image above the horizon.

    Returns None if there are no such rows, or something high or textured hides the sky all along them. Takes `margin`
    [px].
    """
    bottom = min(math.floor(camera.horizon_row - margin), camera.height - 1)
    top = max(0, math.floor(camera.horizon_row - _SKY_HEIGHT * camera.focal_length))
    if bottom - top < 1:
        return None
    axis = np.array([*camera.principal_point, camera.horizon_row, camera.focal_length])
    found = _read_sky(image, even_rows(top, bottom, _SKY_ROWS), axis, margin)
    if found.noise > _TEXTURE * found.luminance:
        below = even_rows(min(math.ceil(camera.horizon_row + margin), camera.height - 1), camera.height - 1, _SKY_ROWS)
        if found.noise > _FINER * pixel_noise(image, below):
            return None
    return None if math.isnan(found.luminance) else found


@kernel
def _read_sky(image: LinearPixels, rows: NDArray[np.int64], axis: Floats, margin: float) -> Sky:
    """`sky_above` of rows (n,), given principal point, horizon and focal length [px]; NaN where it is hidden."""
    side, noise = image.pixels.shape[1] // 6, pixel_noise(image, rows)
    saturated, clipped = saturation(image, rows, side)
    has_sun = clipped > SATURATED_SHARE and sun_in_sky(image, rows, side)
    if has_sun:
        saturated = clipped = 0.0
    bright, share = sky_rows(image, rows, side, image.pixels.shape[1] - side, max(noise, 0.3), has_sun)
    height, most = np.empty(rows.size), 1e-9
    for i in range(rows.size):
        height[i], most = (axis[2] - rows[i]) / axis[3], max(most, bright[i])
    level, _, scatter, lowest = level_at_horizon(bright, height, max(_DARKER, 2.0 * noise / most))
    if lowest > _MOST_HIDDEN and not has_sun:
        level = np.nan
    # Where the sky is clipped it looks the same though a lens darkens it.
    seen, last, free, light = 0, rows.size - 1, np.empty(rows.size, np.int64), np.empty(rows.size)
    while last >= 0 and height[last] < lowest:
        last -= 1
    for i in range(last, -1, -2):
        if clipped <= SATURATED_SHARE:
            free[seen], light[seen] = rows[i], bright[i]
            seen += 1
    shading = _shading(image, free[:seen], axis, light[:seen], noise, level, scatter)
    hidden = max(lowest - margin / axis[3] - _CLOSE, 0.0)
    upward = math.hypot(shading.deviation, _UNSEEN * hidden * shading.level)
    # What darkens gently below may be sky as well.
    end, fall = last, _STEEPEST_FALL * (height[0] - height[-1]) / (rows.size - 1) * shading.level
    while 0 <= end < rows.size - 1 and bright[end] - bright[end + 1] < fall:
        end += 1
    fallen = max(shading.level - bright[end], 0.0) if hidden > 0.0 else 0.0
    deviation = math.hypot(upward, _FALLEN * fallen)
    # What looks everywhere different is a wood rather than a sky, which is no darker than that.
    covered = np.median(share) < _PATCHY and shading.deviation > _SCATTERED * shading.level
    upward = _BRIGHTER * shading.level if covered else upward
    heights = ((axis[2] - free[0]) / axis[3], (axis[2] - free[seen - 1]) / axis[3]) if seen else (0.0, 0.0)
    level_and_noise = (shading.level, deviation, upward, noise, saturated, clipped)
    lens = (shading.vignetting, shading.vignetting_deviation, shading.unevenness)
    return Sky(*level_and_noise, *lens, shading.slope, shading.slope_deviation, heights, has_sun)


class _Shading(NamedTuple):
    """A sky's brightness at the horizon, vignetting, their deviations, unevenness, and its slope upward."""

    level: float
    deviation: float
    vignetting: float
    vignetting_deviation: float
    unevenness: float
    slope: float
    slope_deviation: float


@kernel
def _shading(
    image: LinearPixels,
    rows: NDArray[np.int64],
    axis: Floats,
    bright: Floats,
    noise: float,
    level: float,
    deviation: float,
) -> _Shading:
    """Sky of even slopes behind a lens, or what is known without them where it does not fill most of its rows."""
    if rows.size < 2 or np.median(bright) <= 0.0:
        return _Shading(level, deviation, 0.0, UNKNOWN_VIGNETTING, 0.0, 0.0, np.inf)
    found, covariance, seen, scatter = sky_shading(image, rows, axis, bright, noise)
    unevenness = scatter / found[0] if found[0] > 0.0 else 0.0
    least = _SEEN_TO_BRIGHTEN if found[2] > _BRIGHTENS * found[0] else _LEAST_SEEN
    if seen < least or found[0] <= 0.0 or np.isnan(level):
        return _Shading(level, deviation, 0.0, UNKNOWN_VIGNETTING, unevenness, 0.0, np.inf)
    vignetting, unsure = 0.0, UNKNOWN_VIGNETTING
    # What looks like a lens's shade under a more uneven sky are houses on both sides, which fade upward.
    if unevenness <= _LENS_UNEVENNESS:
        vignetting = min(max(found[4] / found[0], 0.0), _MOST_VIGNETTING)
        unsure = min(math.hypot(_UNEVEN, math.sqrt(covariance[4, 4]) / found[0]), UNKNOWN_VIGNETTING)
    # Mean slope over the heights that are seen.
    ends = (axis[2] - rows[0]) / axis[3] + (axis[2] - rows[-1]) / axis[3]
    variance = covariance[2, 2] + 2.0 * ends * covariance[2, 3] + ends**2 * covariance[3, 3]
    slope, slope_deviation = found[2] + ends * found[3], math.sqrt(max(variance, 0.0))
    return _Shading(found[0], math.sqrt(covariance[0, 0]), vignetting, unsure, unevenness, slope, slope_deviation)


@functools.lru_cache(maxsize=64)
def even_rows(first: int, last: int, count: int) -> NDArray[np.int64]:
    """Rows evenly from the first to the last, downward; the array is shared, so never to be written."""
    return np.unique(np.linspace(first, last, count).astype(np.int64))
