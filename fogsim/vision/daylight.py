"""Whether the sky lights the road, as daytime methods need, or lamps do."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.luminance import linear_luminance
from fogsim.vision.median import median, quantile

Pixels = NDArray[np.uint8] | NDArray[np.uint16]

BRIGHT_SHARE = 0.75
"""Share of the sky that is no brighter than what counts as its brightness: woods and glows may cover the rest [-]."""

SKY_ELEVATIONS, SKY_ROWS = (0.12, 0.25), 12
"""Between which angles above the horizon that is looked at [rad], for lamps light the fog along the horizon most, and
in how many rows."""

NEAREST, FARTHEST, ROAD_ROWS = 6.0, 12.0, 9
"""Between which distances the road is looked at, the farther one being at least half as much again as the nearest that
is seen [m], and in how many rows."""

HALF_LANE, ASIDE = 1.2, (4.0, 7.0)
"""Half the width of the own lane's middle, and the strips beside it that low beams light least [m]."""

LAMP, LAMPS_SHARE, DARK_SKY = 250.0, 0.004, 140.0
"""Luminance of what may be a lamp in the sky, least share of the sky's pixels that lamps cover [-], and most luminance
that the sky has in the median where lamps stand out of it [linear grey levels]."""

BEAM = 1.15
"""Luminance of the own lane over that of both sides from which on it may be a beam's [-]."""


def lit_by_lamps(level: Pixels, camera: Camera) -> str:
    """Say what shows that lamps light the road; empty if the sky may.

    What the sky alone lights is never brighter than the sky, however bright its surface and however dense the fog: a
    perfectly white road has the mean luminance of the sky, and air along the way at most that of the sky behind it.
    Oncoming lamps brighten the fog along the horizon, so the sky is measured above that. Street lamps brighten the sky,
    too; but they stand out of it, and own lamps still light the own lane more than what lies beside it.

    Parameters
    ----------
    level : (rows, cols) or (rows, cols, 3) uint8 or uint16
        A level image, its horizon inside.
    camera : Camera
        The told calibration.
    """
    sky = _rows_of(level, _sky_rows(camera), camera)
    distance, lane = _road_rows(level, camera)
    if not sky.size or not lane.size:
        return ""
    if median(_strip(lane, distance, camera, (-HALF_LANE, HALF_LANE))) > quantile(sky, BRIGHT_SHARE):
        return "the road is brighter than the sky, so lamps light it: this is a daytime method"
    shining = float(np.count_nonzero(sky >= LAMP)) >= LAMPS_SHARE * sky.size and median(sky) < DARK_SKY
    if shining and _has_beam(lane, distance, camera):
        return "lamps light the sky and the road: this is a daytime method"
    return ""


def _sky_rows(camera: Camera) -> NDArray[np.int64]:
    """Rows well above the horizon; the upper half of what is above it where the image ends below them."""
    low, high = (camera.horizon_row - angle * camera.focal_length for angle in SKY_ELEVATIONS)
    top = max(math.floor(high), 0)
    bottom = max(math.floor(low), math.floor(0.5 * (top + camera.horizon_row)))
    return np.unique(np.linspace(top, max(bottom, top), SKY_ROWS).astype(np.int64))


def _road_rows(level: Pixels, camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Distances of rows of near road, and their luminance."""
    last = camera.height - 1
    nearest = max(camera.row_distance / max(last - camera.horizon_row, 1.0), NEAREST)
    distance = np.geomspace(nearest, max(FARTHEST, 1.5 * nearest), ROAD_ROWS)
    rows = np.minimum(np.rint(camera.horizon_row + camera.row_distance / distance).astype(np.int64), last)
    return distance, _rows_of(level, np.maximum(rows, 0), camera)


def _rows_of(level: Pixels, rows: NDArray[np.int64], camera: Camera) -> NDArray[np.float32]:
    return linear_luminance(level[rows], camera.response, camera.bits)


def _strip(
    road: NDArray[np.float32], distance: NDArray[np.float64], camera: Camera, sides: tuple[float, float]
) -> NDArray[np.float64]:
    """Median luminance of a strip between two sides [m, positive to the right] on each row, NaN where none is seen."""
    middle, found = camera.principal_point[0], np.full(distance.size, np.nan)
    for row, scale in enumerate(camera.focal_length / distance):
        first, last = max(math.ceil(middle + sides[0] * scale), 0), math.floor(middle + sides[1] * scale)
        if last - first >= 0.5 * (sides[1] - sides[0]) * scale and first < camera.width:
            found[row] = median(road[row, first : last + 1])
    return found


def _has_beam(road: NDArray[np.float32], distance: NDArray[np.float64], camera: Camera) -> bool:
    """Whether the own lane is brighter than both of its sides."""
    lane = _strip(road, distance, camera, (-HALF_LANE, HALF_LANE))
    left, right = (_strip(road, distance, camera, side) for side in ((-ASIDE[1], -ASIDE[0]), ASIDE))
    beside = np.maximum(left, right)
    seen = np.isfinite(lane / np.maximum(beside, 1e-3))
    return bool(seen.any() and median(lane[seen] / np.maximum(beside[seen], 1e-3)) > BEAM)
