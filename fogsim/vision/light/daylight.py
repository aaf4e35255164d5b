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
from fogsim.vision.light.pixel_kernels import LinearPixels, Pixels, even_column, pixel_luminance

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

_UNLIT, _DARK_SIDE, _SIDES, _DARK_SHARE = 0.04, 0.35, 0.2, 0.9
"""Luminances of the near road and of what is to both sides, over that of the sky ahead, up to which no sky lights them:
seen out of a tunnel; the part of the columns that are a side, and the least share of both that is so dark [-]. Roads in
clear air have at least 0.07 on pool 0 of `benchmarks/photograph_pictures.py`, those in drawn tunnels at most 0.016."""

_BEAM = 1.15
"""Luminance of the own lane over that of both sides from which on it may be a beam's [-]."""

_OVERHEAD = 0.08
"""Angle from straight ahead within which there is open sky above the lane, or a roof [rad]."""


class CannotTellError(Exception):
    """No mistake of anyone's: the honest answer to some images, which an estimator turns into an invalid estimate."""


TOO_DARK = "too dark above the horizon for a daytime method: it is night, or something hides the sky"
BRIGHT_ROAD = "something hides the sky, or lamps or direct sun make the road brighter than the sky"

_OPEN_ROWS, _OPEN_COLS, _LOWEST, _SKY_ALIKE = 24, 64, 0.02, 0.12
"""Rows and columns that are searched for sky which something leaves open, the least angle of theirs above the horizon
[rad], and by how much that sky's luminance varies [-]."""

_LEAST_OPEN, _LEAST_SEEN, _LEAST_COLS = 0.45, 0.12, 0.5
"""Least shares of that sky over the lane up to the lower of `_SKY_ELEVATIONS`, of all rows, and of columns that show
it [-]. A tunnel leaves 0.2 over the lane, between its walls; the blurred edge of a visor darkens what is open to less
than 0.45 (pool 1 of `benchmarks/camera_kinds.py`)."""

_BETWEEN, _HIDDEN, _DARKER_ROAD = 0.4, 0.6, 0.85
"""Most pixels that are somewhat darker than that sky, over those of it, for glow fades upward and what hides the sky
has an edge; luminances over the sky's below which something hides it, and up to which a road surely is darker [-].
Chosen on pool 0 of `benchmarks/camera_kinds.py`, with mirrors, visors and bands, and on FogSim's nights [-]."""


@dataclass(frozen=True, slots=True)
class _View:
    """Where a camera sees the sky and the near road."""

    rows: NDArray[np.int64]  # Rows of the sky, from the top down, and of the road, from near to far
    # (3, 2, rows of the road) int64: first and last column of the lane and of the strips to its left and right, the
    # last before the first where one is not seen
    strips: NDArray[np.int64]
    low: NDArray[np.int64]  # Rows from the sky's highest down to the horizon
    near: int  # Number of the first of these that is below the sky's rows


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
    hidden = first >= last or first >= camera.width or (lead is not None and lead.distance < _HIDES_ABOVE)
    pixels = linear_pixels(level, camera)
    over = (0, 0) if hidden else (first, last)
    return _SHOWN[_lit(pixels, view.rows, view.strips, over, view.low, view.near)]


_SHOWN = (
    "",
    BRIGHT_ROAD,
    "lamps or a low sun light the sky and the road: this is a method for an even daylight",
    "something dark hides the sky on all sides and leaves the road unlit, as a tunnel does",
)
"""What may show that lamps light the road."""


@kernel
def _lit(
    image: LinearPixels,
    rows: NDArray[np.int64],
    strips: NDArray[np.int64],
    over: tuple[int, int],
    low: NDArray[np.int64],
    near: int,
) -> int:
    """Which of `_SHOWN` a view's rows (n,) show, with columns of what is overhead, if any."""
    cols, above_road, road = image.pixels.shape[1], rows[:-_ROAD_ROWS], rows[-_ROAD_ROWS:]
    over = over[0], min(over[1], cols)
    lane = _row_medians(image, road, strips[0])
    sky = _pixels(image, above_road, 0, cols, _SKY_STEP)
    above = quantile_among(sky, _BRIGHT_SHARE)
    if over[1] > over[0]:
        overhead = _pixels(image, above_road, over[0], over[1], 1)
        above = min(above, quantile_among(overhead, _BRIGHT_SHARE))
    # The median of the rows: those that are not seen count as the brightest.
    seen = 0
    for value in lane:
        seen += not np.isnan(value)
    is_seen = seen > lane.size // 2
    if (
        is_seen
        and not _is_darker(lane, above)
        and not _is_darker(lane, _DARKER_ROAD * _open_sky(image, low, near, over))
    ):
        return 1
    shining = 0
    for light in sky:
        shining += light >= _LAMP
    if is_seen and _is_enclosed(image, low, near, over, lane):
        return 3
    if shining < _LAMPS_SHARE * sky.size or quantile_among(sky, 0.5) >= _DARK_SKY:
        return 0
    return 2 if _has_beam(lane, _row_medians(image, road, strips[1]), _row_medians(image, road, strips[2])) else 0


@kernel
def _is_darker(lane: NDArray[np.float64], light: float) -> bool:
    """Whether more than half of the lane's rows are no brighter than a luminance."""
    dark = 0
    for value in lane:
        dark += value <= light
    return dark > lane.size // 2


@kernel
def _is_enclosed(
    image: LinearPixels, rows: NDArray[np.int64], near: int, over: tuple[int, int], lane: NDArray[np.float64]
) -> bool:
    """Whether the lane and both sides are too dark for the light that shows over the lane to come from a sky.

    Takes `rows` (n,) int64, see `_open_sky`.
    """
    if over[1] <= over[0] or not _is_darker(lane, _UNLIT * _LAMP):
        return False
    light = quantile_among(_pixels(image, rows[near:], over[0], over[1], 1), _BRIGHT_SHARE)
    if not _is_darker(lane, _UNLIT * light):
        return False
    cols = image.pixels.shape[1]
    side = int(_SIDES * cols)
    for first in (0, cols - side):
        seen, dark = _pixels(image, rows, first, first + side, _SKY_STEP), 0
        for value in seen:
            dark += value <= _DARK_SIDE * light
        if dark < _DARK_SHARE * seen.size:
            return False
    return True


@kernel
def _open_sky(image: LinearPixels, rows: NDArray[np.int64], near: int, over: tuple[int, int]) -> float:
    """Luminance of an even sky that shows over the lane below what hides it higher up; 0 if there is none.

    Takes `rows` (n,) int64, those from number `near` on below `_SKY_ELEVATIONS`.
    """
    if over[1] <= over[0]:
        return 0.0
    lane = _pixels(image, rows[near:], over[0], over[1], 1)
    light, alike = quantile_among(lane, _BRIGHT_SHARE), 0
    for value in lane:
        alike += abs(value - light) < _SKY_ALIKE * light
    if light >= _LAMP or alike < _LEAST_OPEN * lane.size:
        return 0.0
    cols, seen, between, wide = image.pixels.shape[1], 0, 0, 0
    for j in range(_OPEN_COLS):
        col, before = even_column(j, _OPEN_COLS, -0.5, cols - 0.5), seen
        for row in rows:
            share = pixel_luminance(image, row, col) / light
            seen += abs(share - 1.0) < _SKY_ALIKE
            between += _HIDDEN < share <= 1.0 - _SKY_ALIKE
        wide += seen > before + 1
    is_wide = seen >= _LEAST_SEEN * rows.size * _OPEN_COLS and wide >= _LEAST_COLS * _OPEN_COLS
    return light if is_wide and between <= _BETWEEN * seen else 0.0


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
    low, near, high = (camera.horizon_row - angle * camera.focal_length for angle in (_LOWEST, *_SKY_ELEVATIONS))
    above = np.unique(np.linspace(max(high, 0.0), max(low, 0.0), _OPEN_ROWS).astype(np.int64))
    strips = np.array([_strip(distance, camera, *side) for side in sides])
    return _View(seen, strips, above, min(int(np.searchsorted(above, near)), above.size - 1))


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
