"""Whether the sky lights the road, as daytime methods need, or lamps do."""

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.light.luminance import linear_luminance
from fogsim.vision.light.medians import columns_apart, median, quantile, span_medians
from fogsim.vision.light.pixel_kernels import Pixels

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

Strip = tuple[NDArray[np.int64], NDArray[np.int64]]


@dataclass(frozen=True, slots=True)
class _View:
    """Where a camera sees the sky and the near road."""

    rows: NDArray[np.int64]  # Rows of the sky, from the top down, and of the road, from near to far
    # lane, left, right (rows of the road,) int64: first and last column of a strip of the road, the last before the
    # first where the strip is not seen
    lane: Strip
    left: Strip
    right: Strip


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
    luminance = linear_luminance(level[view.rows], camera.response, camera.bits, camera.black_level)
    sky, road = columns_apart(luminance[:-_ROAD_ROWS], _SKY_STEP), luminance[-_ROAD_ROWS:]
    lane = _row_medians(road, view.lane)
    middle, aside = camera.principal_point[0], _OVERHEAD * camera.focal_length
    first, last = max(math.ceil(middle - aside), 0), max(math.floor(middle + aside) + 1, 0)
    overhead = np.ascontiguousarray(luminance[:-_ROAD_ROWS, first:last])
    hidden = overhead.size == 0 or (lead is not None and lead.distance < _HIDES_ABOVE)
    above = quantile(sky if hidden else overhead, _BRIGHT_SHARE)
    if median(lane) > min(above, quantile(sky, _BRIGHT_SHARE)):
        return "the road is brighter than the sky: lamps or direct sun light it, and it does not show the fog"
    shining = float(np.count_nonzero(sky >= _LAMP)) >= _LAMPS_SHARE * sky.size and median(sky) < _DARK_SKY
    if shining and _has_beam(lane, _row_medians(road, view.left), _row_medians(road, view.right)):
        return "lamps light the sky and the road: this is a daytime method"
    return ""


@functools.lru_cache(maxsize=8)
def _view_of(camera: Camera) -> _View:
    last = camera.height - 1
    nearest = max(camera.row_distance / max(last - camera.horizon_row, 1.0), _NEAREST)
    distance = np.geomspace(nearest, max(FARTHEST, 1.5 * nearest), _ROAD_ROWS)
    rows = np.minimum(np.rint(camera.horizon_row + camera.row_distance / distance).astype(np.int64), last)
    sides = ((-_HALF_LANE, _HALF_LANE), (-_ASIDE[1], -_ASIDE[0]), _ASIDE)
    seen = np.concatenate((_sky_rows(camera), np.maximum(rows, 0)))
    return _View(seen, *(_strip(distance, camera, *side) for side in sides))


def _sky_rows(camera: Camera) -> NDArray[np.int64]:
    """Rows well above the horizon; the upper half of what is above it where the image ends below them."""
    low, high = (camera.horizon_row - angle * camera.focal_length for angle in _SKY_ELEVATIONS)
    top = max(math.floor(high), 0)
    bottom = max(math.floor(low), math.floor(0.5 * (top + camera.horizon_row)))
    return np.unique(np.linspace(top, max(bottom, top), _SKY_ROWS).astype(np.int64))


def _strip(distance: NDArray[np.float64], camera: Camera, left: float, right: float) -> Strip:
    """Columns of a strip between two sides [m, positive to the right], at least half of them seen."""
    middle, scale = camera.principal_point[0], camera.focal_length / distance
    first = np.maximum(np.ceil(middle + left * scale), 0.0)
    last = np.minimum(np.floor(middle + right * scale), camera.width - 1.0)
    seen = (np.floor(middle + right * scale) - first >= 0.5 * (right - left) * scale) & (first < camera.width)
    return first.astype(np.int64), np.where(seen, last, first - 1.0).astype(np.int64)


def _row_medians(road: NDArray[np.float32], strip: Strip) -> NDArray[np.float64]:
    """Median of each row (rows, cols) of a strip, NaN where it is not seen."""
    found = span_medians(road, np.ones(road.shape, np.uint8), *strip, road.shape[1], 1)
    return np.where(found.number > 0, found.luminance, np.nan)


def _has_beam(lane: NDArray[np.float64], left: NDArray[np.float64], right: NDArray[np.float64]) -> bool:
    """Whether the own lane is brighter than both of its sides."""
    beside = np.maximum(left, right)
    seen = np.isfinite(lane / np.maximum(beside, 1e-3))
    return bool(seen.any() and median(lane[seen] / np.maximum(beside[seen], 1e-3)) > _BEAM)
