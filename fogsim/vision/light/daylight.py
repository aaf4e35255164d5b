"""Whether the sky lights the road, as daytime methods need, or lamps do."""

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.medians import median_among, quantile_among
from fogsim.vision.light.pixel_kernels import LinearPixels, Pixels, pixel_luminance

_BRIGHT_SHARE = 0.75
"""Share of the sky that is no brighter than what counts as its brightness: woods and glows may cover the rest [-]."""

_SKY_ELEVATIONS, _SKY_ROWS, _SKY_STEP = (0.12, 0.25), 12, 4
"""Between which angles above the horizon that is looked at [rad], for lamps light the fog along the horizon most, in
how many rows, and in every which column [px]."""

_NEAREST, FARTHEST, _ROAD_ROWS = 6.0, 12.0, 9
"""Between which distances the road is looked at, the farther one being at least half as much again as the nearest that
is seen [m], and in how many rows."""

_HIDES_ABOVE = 20.0
"""Distance within which a vehicle ahead may hide sky or roof above the lane [m]."""

_HALF_LANE, _ASIDE = 1.2, (4.0, 7.0)
"""Half the width of the own lane's middle, and the strips next to it that low beams light least [m]."""

_LAMP, _LAMPS_SHARE, _DARK_SKY = 250.0, 0.004, 140.0
"""Luminance of what may be a lamp in the sky, least share of the sky's pixels that lamps cover [-], and most luminance
that the sky has in the median where lamps stand out of it [linear grey levels]."""

_BEAM = 1.15
"""Luminance of the own lane over that of both sides from which on it may be a beam's [-]."""

_OVERHEAD = 0.08
"""Angle from straight ahead within which there is open sky above the lane, or a roof [rad]."""


@dataclass(frozen=True, slots=True)
class _View:
    """Where a camera sees the sky and the near road."""

    rows: NDArray[np.int64]  # Rows of the sky, from the top down, and of the road, from near to far
    # (3, 2, rows of the road) int64: first and last column of the lane and of the strips to its left and right, the
    # last before the first where one is not seen
    strips: NDArray[np.int64]


def lit_by_lamps(level: Pixels, camera: Camera, lead: LeadMeasurement | None = None) -> str:
    """Say what shows that lamps light the road; empty if the sky may.

    What the sky alone lights is never brighter than the sky, however bright its surface and however dense the fog: a
    perfectly white road has the mean luminance of the sky, and air along the way at most that of the sky behind it.
    Oncoming lamps brighten the fog along the horizon, so the sky is measured above that. Street lamps brighten the sky,
    too; but they stand out of it, and own lamps still light the own lane more than its sides. In a tunnel the
    ceiling over the lane is darker than the road, though bright walls may be seen at the height of the sky; the dark
    rear of a truck right ahead says nothing of that kind.

    Takes `level` (rows, cols).
    """
    view = _view_of(camera)
    middle, aside = camera.principal_point[0], _OVERHEAD * camera.focal_length
    first, last = max(math.ceil(middle - aside), 0), max(math.floor(middle + aside) + 1, 0)
    hidden = first >= min(last, camera.width) or (lead is not None and lead.distance < _HIDES_ABOVE)
    pixels = linear_pixels(level, camera)
    return _SHOWN[_lit(pixels, view.rows, view.strips, 0 if hidden else first, 0 if hidden else last)]


_SHOWN = (
    "",
    "the road is brighter than the sky: lamps or direct sun light it, and it does not show the fog",
    "lamps or a low sun light the sky and the road: this is a method for an even daylight",
)
"""What may show that lamps light the road."""


@kernel
def _lit(image: LinearPixels, rows: NDArray[np.int64], strips: NDArray[np.int64], first: int, last: int) -> int:
    """Which of `_SHOWN` a view's rows (n,) show, with columns of what is overhead, if any."""
    cols, above_road, road = image.pixels.shape[1], rows[:-_ROAD_ROWS], rows[-_ROAD_ROWS:]
    lane = _row_medians(image, road, strips[0])
    sky = _pixels(image, above_road, 0, cols, _SKY_STEP)
    above = quantile_among(sky, _BRIGHT_SHARE)
    if last > first:
        overhead = _pixels(image, above_road, first, min(last, cols), 1)
        above = min(above, quantile_among(overhead, _BRIGHT_SHARE))
    # The median of the rows: those that are not seen count as the brightest.
    seen, dark = 0, 0
    for value in lane:
        seen += not np.isnan(value)
        dark += value <= above
    if dark <= lane.size // 2 < seen:
        return 1
    shining = 0
    for light in sky:
        shining += light >= _LAMP
    if shining < _LAMPS_SHARE * sky.size or quantile_among(sky, 0.5) >= _DARK_SKY:
        return 0
    return 2 if _has_beam(lane, _row_medians(image, road, strips[1]), _row_medians(image, road, strips[2])) else 0


@kernel
def _pixels(image: LinearPixels, rows: NDArray[np.int64], first: int, end: int, step: int) -> NDArray[np.float32]:
    """Pixels in every which column from both sides inward: of a mirrored image the same."""
    out, count = np.empty(rows.size * (end - first + 1), np.float32), 0
    for row in rows:
        for col in range(0, (end - first + 1) // 2, step):
            out[count] = pixel_luminance(image, row, first + col)
            count += 1
        for col in range(0, (end - first) // 2, step):
            out[count] = pixel_luminance(image, row, end - 1 - col)
            count += 1
    return out[:count]


@functools.lru_cache(maxsize=8)
def _view_of(camera: Camera) -> _View:
    last = camera.height - 1
    nearest = max(camera.row_distance / max(last - camera.horizon_row, 1.0), _NEAREST)
    distance = np.geomspace(nearest, max(FARTHEST, 1.5 * nearest), _ROAD_ROWS)
    rows = np.minimum(np.rint(camera.horizon_row + camera.row_distance / distance).astype(np.int64), last)
    sides = ((-_HALF_LANE, _HALF_LANE), (-_ASIDE[1], -_ASIDE[0]), _ASIDE)
    seen = np.concatenate((_sky_rows(camera), np.maximum(rows, 0)))
    return _View(seen, np.array([_strip(distance, camera, *side) for side in sides]))


def _sky_rows(camera: Camera) -> NDArray[np.int64]:
    """Rows well above the horizon; the upper half of what is above it where the image ends below them."""
    low, high = (camera.horizon_row - angle * camera.focal_length for angle in _SKY_ELEVATIONS)
    top = max(math.floor(high), 0)
    bottom = max(math.floor(low), math.floor(0.5 * (top + camera.horizon_row)))
    return np.unique(np.linspace(top, max(bottom, top), _SKY_ROWS).astype(np.int64))


def _strip(
    distance: NDArray[np.float64], camera: Camera, left: float, right: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Columns of a strip between two sides [m, positive to the right], at least half of them seen."""
    middle, scale = camera.principal_point[0], camera.focal_length / distance
    first = np.maximum(np.ceil(middle + left * scale), 0.0)
    last = np.minimum(np.floor(middle + right * scale), camera.width - 1.0)
    seen = (np.floor(middle + right * scale) - first >= 0.5 * (right - left) * scale) & (first < camera.width)
    return first.astype(np.int64), np.where(seen, last, first - 1.0).astype(np.int64)


@kernel
def _row_medians(image: LinearPixels, rows: NDArray[np.int64], strip: NDArray[np.int64]) -> NDArray[np.float64]:
    """Median of each row of a strip of road, NaN where it is not seen (`strip` (2, rows))."""
    out, seen = np.full(rows.size, np.nan), np.empty(image.pixels.shape[1], np.float32)
    for i in range(rows.size):
        left, right = strip[0, i], strip[1, i]
        if right >= left:
            for col in range(left, right + 1):
                seen[col - left] = pixel_luminance(image, rows[i], col)
            out[i] = median_among(seen[: right - left + 1])
    return out


@kernel
def _has_beam(lane: NDArray[np.float64], left: NDArray[np.float64], right: NDArray[np.float64]) -> bool:
    """Whether the own lane is brighter than both of its sides."""
    ratio, count = np.empty(lane.size), 0
    for row in range(lane.size):
        beside = max(left[row], right[row]) if not np.isnan(left[row] + right[row]) else np.nan
        share = lane[row] / max(beside, 1e-3)
        if np.isfinite(share) and np.isfinite(beside):
            ratio[count] = share
            count += 1
    return bool(count > 0 and median_among(ratio[:count]) > _BEAM)
