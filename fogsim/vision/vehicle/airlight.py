"""Airlight next to the vehicle ahead, and whether the sky or lamps light the road before it."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.light.daylight import BRIGHT_ROAD, CannotTellError
from fogsim.vision.light.medians import median, median_among

Floats = NDArray[np.float32]
Ints = NDArray[np.int64]
Rows = slice | Ints

_BRIGHT_ROAD = 1.1
"""Luminance of the road before the vehicle over that of the sky, from which on there is no daylight, or no road [-]."""

_GAP = 0.3
"""How far above the vehicle's foot, as heights, the road that is looked at ends before it: its shadow [m]."""

_HALF_STRIP = 0.6
"""Half the width of that strip of road as a thing of this size has at the vehicle [m]."""

_NEAREST, FARTHEST, _FARTHER, _ROWS = 4.0, 18.0, 1.8, 9
"""Nearest and farthest road on which the light of own lamps is looked for [m], the least ratio of the two, and how many
rows are read there."""

_SHADOW = 4.0
"""Length of the road before the vehicle ahead that it may darken, or its lamps light [m]."""

_LEAST_CONTRAST = 0.03
"""Contrast of a row of road to the sky that still shows how it falls [-]."""

_UNEVEN, SHARE = 0.1, 0.1
"""By how much the logarithm of that contrast may fall less than the fog says: where the road's reflectance changes [-],
and relative to the fall itself, where the road is not flat [-]."""


def road_before(camera: Camera, depth: float) -> tuple[slice, slice]:
    """Every fourth row, and the columns, of the road between the camera and a vehicle ahead in a level image.

    Takes `depth` [m].
    """
    scale = camera.focal_length / depth
    first = min(math.ceil(camera.horizon_row + camera.row_distance / depth + _GAP * scale), camera.height - 3)
    middle, half = camera.principal_point[0], max(_HALF_STRIP * scale, 4.0)
    cols = slice(max(math.floor(middle - half), 0), max(min(math.ceil(middle + half) + 1, camera.width), 0))
    return slice(max(first, 0), camera.height, 4), cols


def check_road(road: NDArray[np.float32], sky: float) -> None:
    """Refuse a road that is brighter than the sky: head lamps light it, or the image is upside-down.

    What they light is the vehicle, too, and the fog before it, which then has no airlight of the sky's: contrast to the
    sky no longer falls as Duntley's law has it.

    Takes `road` (rows, cols).
    """
    if road.size and median(road) > _BRIGHT_ROAD * sky:
        raise CannotTellError(BRIGHT_ROAD)


@dataclass(frozen=True, slots=True)
class RoadFall:
    """How the road's contrast to the airlight falls near the camera."""

    # way, contrast, share (n,): distances of rows of road [m], their contrast to their airlight, and that over the one
    # at the horizon [-]
    way: NDArray[np.float64]
    contrast: NDArray[np.float64]
    share: NDArray[np.float64]

    def is_lit(self, extinction: float, deviation: float) -> bool:
        """Whether it falls by so much less than in fog by day that lamps must light what is near.

        Takes `extinction`, `deviation` [1/m].
        """
        rise = self.rise(extinction - 2.0 * deviation)
        return bool(self.way.size) and rise > _UNEVEN + SHARE * extinction * float(np.ptp(self.way))

    def rise(self, extinction: float) -> float:
        """By how much the logarithm of the contrast to the horizon, had there been no fog, rises from near to far [-].

        Takes `extinction` [1/m].
        """
        if not self.way.size:
            return 0.0
        bare = 1.0 - self.share + self.share * self.contrast * np.exp(extinction * self.way)
        level = np.log(np.maximum(bare, _LEAST_CONTRAST))
        # The median of all slopes leaves out marks, a bonnet, a shadow.
        return _median_slope(self.way, level) * float(np.ptp(self.way))


@kernel
def _median_slope(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Median of the slopes between all pairs of points."""
    slopes, count = np.empty(x.size * (x.size - 1) // 2), 0
    for i in range(x.size):
        for j in range(i + 1, x.size):
            slopes[count] = (y[j] - y[i]) / (x[j] - x[i])
            count += 1
    return median_among(slopes)


_NOWHERE = RoadFall(*(np.zeros(0) for _ in range(3)))


def road_fall(
    luminance_of: Callable[[Rows, slice], Floats],
    camera: Camera,
    depth: float,
    sky: float,
    share: NDArray[np.float64] | None = None,
) -> RoadFall:
    """Measure how the contrast of the road's nearest metres to the sky falls.

    By day (A − L)/A = (1 − R/A) e^(−kd) on a road of one reflectance. Head lamps make the nearest metres brightest, so
    it falls less or even grows, at illuminances where the road is still darker than the sky.

    Returns without rows where too little of the road is seen; then nothing is lit. Takes `depth` [m], `share` (rows,).
    """
    nearest = max(camera.row_distance / max(camera.height - 1.0 - camera.horizon_row, 1.0), _NEAREST)
    farthest = min(FARTHEST, depth - _SHADOW)
    if farthest < _FARTHER * nearest:
        return _NOWHERE
    at, rows, left, right = _road_rows(camera, nearest, farthest)
    first = int(left.min())
    contrast = _contrasts(luminance_of(rows, slice(first, int(right.max()))), left - first, right - first, sky)
    seen = contrast > _LEAST_CONTRAST
    if np.count_nonzero(seen) < _ROWS // 2:
        return _NOWHERE
    return RoadFall(at[seen], contrast[seen], np.ones(at.size)[seen] if share is None else share[rows[seen]])


@functools.lru_cache(maxsize=64)
def _road_rows(camera: Camera, nearest: float, farthest: float) -> tuple[NDArray[np.float64], Ints, Ints, Ints]:
    """Distances of rows of road between two of them [m], those rows, and their columns (n,); the arrays are shared."""
    at = np.linspace(nearest, farthest, _ROWS)
    rows = np.clip(np.rint(camera.horizon_row + camera.row_distance / at).astype(int), 0, camera.height - 1)
    middle, half = camera.principal_point[0], np.maximum(_HALF_STRIP * camera.focal_length / at, 4.0)
    left = np.maximum(np.floor(middle - half).astype(int), 0)
    return at, rows, left, np.clip(np.ceil(middle + half).astype(int) + 1, 0, camera.width)


@kernel
def _contrasts(light: Floats, left: Ints, right: Ints, sky: float) -> NDArray[np.float64]:
    """Contrast to the sky of the median of each row between two columns; 0 where there is none."""
    out = np.zeros(left.size)
    for i in range(left.size):
        if right[i] > left[i]:
            out[i] = 1.0 - float(np.float32(median_among(light[i, left[i] : right[i]]))) / sky
    return out


_BLOCKS, _BRIGHT_SHARE = 12, 0.8
"""Blocks of columns of the sky, and the quantile of their brightness that is the airlight: trees hide the others."""

_HALF_TRUCK = 1.6
"""How much of the sky next to the axis a high vehicle ahead can hide [m]."""

_ALIKE = 0.03
"""How far from the light of all of the sky a pixel's may be, relative to it, next to noise [-]: trees are darker."""

_LEAST_SEEN = 0.05
"""Share of a block's pixels that must be of that light for the block to count [-]."""


def neighbouring_airlight(light: NDArray[np.float32], about: float, noise: float, axis: float, hidden: float) -> float:
    """Brightness of the sky where neither trees, however faint, nor the vehicle ahead stand before it.

    A bright part of an even sky, and not its brightest pixels: at a range where the fog leaves 2 % of a contrast, an
    airlight that is wrong by 0.2 % is a tenth of it.

    Returns In the unit of the luminance. Takes `light` (rows, cols), `axis`, `hidden` [px].
    """
    return _neighbouring(light, about, noise, axis, hidden)


@kernel
def _neighbouring(light: NDArray[np.float32], about: float, noise: float, axis: float, hidden: float) -> float:
    """`neighbouring_airlight`, by blocks that are the same from either side: they share a column at their border."""
    width, means = light.shape[1], np.empty(_BLOCKS)
    first, last, is_free, free = np.empty(_BLOCKS, np.int64), np.empty(_BLOCKS, np.int64), np.zeros(_BLOCKS), 0
    for i in range(_BLOCKS):
        first[i], last[i] = width * i // _BLOCKS, -(-width * (i + 1) // _BLOCKS)
        is_free[i] = last[i] > first[i] and abs(0.5 * (first[i] + last[i] - 1) - axis) > hidden
        free += int(is_free[i])
    count = 0
    for i in range(_BLOCKS):
        if last[i] > first[i] and (is_free[i] or free < _BLOCKS // 3):
            means[count] = _mean(light[:, first[i] : last[i]], about, noise)
            count += not np.isnan(means[count])
    if count == 0:
        return about
    ordered, place = np.sort(means[:count]), _BRIGHT_SHARE * (count - 1)
    below = int(place)
    return float(ordered[below] + (place - below) * (ordered[min(below + 1, count - 1)] - ordered[below]))


@kernel
def _mean(part: NDArray[np.float32], about: float, noise: float) -> float:
    """Mean of the pixels of the sky in a part; NaN if too few are."""
    core, count = np.empty(part.size, np.float32), 0
    reach, least = np.float32(_ALIKE * about + 4.0 * noise), max(_LEAST_SEEN * part.size, 1.0)
    for row in range(part.shape[0]):
        for col in range(part.shape[1]):
            core[count] = part[row, col]
            count += abs(part[row, col] - np.float32(about)) <= reach
    if count < least:
        return np.nan
    middle = float(np.float32(median_among(core[:count])))
    # What is cut off about a first middle is lopsided, so that it is looked for again about the next.
    for reach in (np.float32(max(4.0 * noise, 1.0)), np.float32(max(3.0 * noise, 1.0))):
        count, total = 0, 0.0
        for row in range(part.shape[0]):
            for col in range(part.shape[1]):
                if abs(part[row, col] - np.float32(middle)) <= reach:
                    total += float(part[row, col])
                    count += 1
        if count < least:
            return np.nan
        middle = total / count
    return middle


def hidden_at_side(focal_length: float, depth: float) -> float:
    """How far from the axis a vehicle ahead may hide the sky [px] (`focal_length` [px], `depth` [m])."""
    return _HALF_TRUCK * focal_length / depth if math.isfinite(depth) else 0.0
