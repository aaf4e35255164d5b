"""Strips of road along the vehicle's axis, and rows of sky above it: what the joint fit of fog looks at."""

import functools
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision import strip_kernels
from fogsim.vision.median import median
from fogsim.vision.response import linear_table

Floats = NDArray[np.float64]
Pixels = NDArray[np.uint8] | NDArray[np.uint16]

LANES = ((-1.4, 1.4), (-4.9, -2.1), (2.1, 4.9))
"""Sides of the strips to the right of the vehicle's axis [m]: the own lane's middle, and those of its neighbours."""

HALF_ROAD = 2.5
"""How far to either side of the vehicle's axis a band is surely road [m]."""

WHOLE_ROWS = 28.0
"""Rows below the horizon up to which every row is a bin of its own [px]; from there bins grow with the distance."""

GRAIN = 0.5
"""Size of pieces of road whose albedo counts as independent beside the patches [m]."""

LEAST_DEVIATION = 0.1
"""Least deviation of a bin's mean: what quantisation leaves [linear grey levels]."""

HALF_VEHICLE = 1.3
"""Half the width that a tracked vehicle ahead may hide, its offset in the lane included [m]."""

CHANNEL_WEIGHTS = (0.2126, 0.7152, 0.0722)
"""Weights of red, green and blue in luminance (ITU-R BT.709) [-]."""


@dataclass(frozen=True, slots=True)
class StripGeometry:
    """Where the strips lie in the image of a camera on a flat road, nearest bin of rows first.

    Attributes
    ----------
    first, last : (n,) int64
        Rows of each bin.
    below, half : (n,) float64
        Middle of each bin below the told horizon, and half its height [px].
    distance, extent : (n,) float64
        Depth of each bin along the road, and how much road it covers [m].
    left, right : (strips, n) float64
        Columns between which each strip lies.
    path : (strips, n) float64
        λ times the slant: over the rows below the horizon, the length of the ray [px·m].
    """

    first: NDArray[np.int64]
    last: NDArray[np.int64]
    below: Floats
    half: Floats
    distance: Floats
    extent: Floats
    left: Floats
    right: Floats
    path: Floats

    @property
    def rows(self) -> Floats:
        """(n,) float64: height of each bin [px]."""
        return 2.0 * self.half


def strip_geometry(camera: Camera, nearest: float, lanes: tuple[tuple[float, float], ...] = LANES) -> StripGeometry:
    """Lay strips over the image of a camera.

    Parameters
    ----------
    camera : Camera
        The told calibration; its roll is taken as undone.
    nearest : float
        Rows below the horizon from which the road is looked at [px].
    lanes : tuple of (float, float)
        Sides of each strip to the right of the vehicle's axis [m].
    """
    first, last = _row_bins(camera, nearest, camera.height - 1)
    below: Floats = 0.5 * (first + last).astype(np.float64) - camera.horizon_row
    half: Floats = 0.5 * (last - first + 1).astype(np.float64)
    u0 = camera.principal_point[0]
    # A lateral offset x at depth z, seen from a camera that looks down, is α x / z columns off the axis.
    across = camera.focal_length / camera.row_distance * below
    sides = np.array(lanes)
    left, right = u0 + sides[:, :1] * across, u0 + sides[:, 1:] * across
    left, right = _inside(left, right, camera.width)
    slant = _mean_slant((left - u0) / camera.focal_length, (right - u0) / camera.focal_length, below, camera)
    return StripGeometry(
        first=first,
        last=last,
        below=below,
        half=half,
        distance=camera.row_distance / below,
        extent=camera.row_distance * 2.0 * half / np.maximum(below**2 - half**2, 1e-9),
        left=left,
        right=right,
        path=camera.row_distance * slant,
    )


def band_geometry(camera: Camera, nearest: float, columns: tuple[int, int], rows: tuple[int, int]) -> StripGeometry:
    """Take a vertical band of the image, as far as it is road, for the only strip.

    Parameters
    ----------
    camera : Camera
        The told calibration; its roll is taken as undone.
    nearest : float
        Rows below the horizon from which the road is looked at [px].
    columns, rows : (int, int)
        First and last of the band.
    """
    first, last = _row_bins(camera, max(nearest, rows[0] - camera.horizon_row), rows[1])
    below: Floats = 0.5 * (first + last).astype(np.float64) - camera.horizon_row
    half: Floats = 0.5 * (last - first + 1).astype(np.float64)
    u0, focal = camera.principal_point[0], camera.focal_length
    # Far away even a narrow band is wider than the road.
    reach = HALF_ROAD * focal / camera.row_distance * below[None, :]
    left, right = np.maximum(columns[0] - 0.5, u0 - reach), np.minimum(columns[1] + 0.5, u0 + reach)
    slant = _mean_slant((left - u0) / focal, (right - u0) / focal, below, camera)
    distance = camera.row_distance / below
    extent = camera.row_distance * 2.0 * half / np.maximum(below**2 - half**2, 1e-9)
    return StripGeometry(first, last, below, half, distance, extent, left, right, camera.row_distance * slant)


def _inside(left: Floats, right: Floats, width: int) -> tuple[Floats, Floats]:
    """Cut strips to the image; of what is mostly outside nothing is left."""
    low, high = np.clip(left, -0.5, width - 0.5), np.clip(right, -0.5, width - 0.5)
    return low, np.where(high - low < 0.3 * (right - left), low, high)


def _mean_slant(left: Floats, right: Floats, below: Floats, camera: Camera) -> Floats:
    """Length of the ray over the depth, averaged across each strip by Simpson's rule: near, a lane is wide."""
    y = (below + camera.horizon_row - camera.principal_point[1]) / camera.focal_length
    ends, middle = (np.sqrt(1.0 + x**2 + y**2) for x in (np.stack([left, right]), 0.5 * (left + right)))
    return np.asarray((ends[0] + 4.0 * middle + ends[1]) / 6.0)


def _row_bins(camera: Camera, nearest: float, bottom: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    top = max(math.ceil(camera.horizon_row + nearest), 0)
    return strip_kernels.row_bins(camera.horizon_row, top, bottom, WHOLE_ROWS)


@dataclass(frozen=True, slots=True)
class LinearPixels:
    """An image with what makes light of its values.

    Attributes
    ----------
    pixels : (rows, cols, channels) uint8 or uint16
        Contiguous.
    tables : (channels, levels) float32
        Linear grey levels that each channel adds.
    """

    pixels: Pixels
    tables: NDArray[np.float32]


def linear_pixels(image: Pixels, camera: Camera) -> LinearPixels:
    """Pair an image with the inverse of its camera's response; no pixel is touched.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8 or uint16
        An image of the camera.
    camera : Camera
        The told calibration.
    """
    table = linear_table(camera.response, camera.bits)
    weights = np.array(CHANNEL_WEIGHTS if image.ndim == 3 else (1.0,), np.float32)
    pixels: NDArray[Any] = np.ascontiguousarray(image if image.ndim == 3 else image[:, :, None])
    return LinearPixels(pixels, weights[:, None] * table)


@dataclass(frozen=True, slots=True)
class StripCurves:
    """Luminance of each strip by bin.

    Attributes
    ----------
    luminance : (strips, n) float64
        Mean of the core of each bin [linear grey levels].
    variance : (strips, n) float64
        Its variance apart from what patches and drift of the albedo do; 0 where there is no datum.
    scatter : (strips, n) float64
        Mean distance of all single pixels from the bin's median, marks and the like included [linear grey levels].
    """

    luminance: Floats
    variance: Floats
    scatter: Floats


def strip_curves(
    image: LinearPixels, geometry: StripGeometry, noise: float, camera: Camera, free: float = math.inf
) -> StripCurves:
    """Read the strips.

    Parameters
    ----------
    image : LinearPixels
        The image.
    geometry : StripGeometry
        Where to look.
    noise : float
        Deviation of single pixels [linear grey levels].
    camera : Camera
        The told calibration.
    free : float
        Depth up to which the own lane is free; a tracked vehicle ahead hides what is behind [m].
    """
    hidden_from, hidden_to, foot = math.inf, -math.inf, -math.inf
    if math.isfinite(free):
        reach = HALF_VEHICLE * camera.focal_length / free
        hidden_from, hidden_to = camera.principal_point[0] - reach, camera.principal_point[0] + reach
        foot = camera.horizon_row + camera.row_distance / free
    rows, floor = (geometry.first, geometry.last), max(noise, 2.0 * LEAST_DEVIATION)
    read = [
        strip_kernels.strip_rows(image.pixels, image.tables, *rows, left, right, hidden_from, hidden_to, foot, floor)
        for left, right in zip(geometry.left, geometry.right, strict=True)
    ]
    mean, deviation, scatter, number = (np.stack(values) for values in zip(*read, strict=True))
    metres = (geometry.right - geometry.left) * geometry.distance / camera.focal_length
    pieces = np.maximum(metres / GRAIN, 1.0) * np.maximum(geometry.extent / GRAIN, 1.0)
    counted = np.maximum(number, 1)
    texture = np.maximum(deviation**2 - noise**2, 0.0) / np.minimum(counted, pieces)
    variance = noise**2 / counted + texture + LEAST_DEVIATION**2 + _coarseness(mean, deviation, noise, camera)
    return StripCurves(mean, np.where(number > 0, variance, 0.0), scatter)


QUIET, SMOOTHED = 0.3, 1.0
"""Pixel noise, in levels, below which an image was compressed, and the deviation that this leaves in a mean [-]."""


def _coarseness(mean: Floats, deviation: Floats, noise: float, camera: Camera) -> Floats:
    """Variance of means by rounding to levels, and by compression, which does away with noise and faint gradients."""
    table = linear_table(camera.response, camera.bits)
    level: Floats = np.maximum(np.interp(mean, table[:-1], np.diff(table)), 1e-6)
    # Rounding does not average out where nothing dithers it: 1/√12 of a level without noise, nothing from half on.
    rounding = np.exp(-4.0 * (np.pi * deviation / level) ** 2) / 12.0
    quiet = np.maximum(1.0 - noise / (QUIET * level), 0.0)
    return np.asarray(level**2 * (rounding + (SMOOTHED * quiet) ** 2))


BONNET_SHARE, BONNET_ROWS = 0.3, 60
"""Share of the road's rows that the own bonnet may cover, and how many of them are looked at."""

BONNET_STEP, BONNET_OUTLIER = 0.03, 6.0
"""Least step of luminance at the bonnet's edge, relative to the airlight, and in median changes over as many rows."""


def above_bonnet(image: LinearPixels, camera: Camera, airlight: float) -> int:
    """Lowest row that shows road, not the own vehicle's bonnet or dashboard.

    Parameters
    ----------
    image : LinearPixels
        A level image.
    camera : Camera
        The told calibration.
    airlight : float
        Luminance of the sky [linear grey levels].
    """
    bottom = camera.height - 1
    top = math.floor(bottom - BONNET_SHARE * (bottom - camera.horizon_row))
    rows = _even_rows(bottom, top, BONNET_ROWS)[::-1]
    if rows.size < 8:
        return bottom
    level = strip_kernels.middle_levels(image.pixels, image.tables, rows)
    # Three rows each side of a gap of two, since a bonnet's edge is bent.
    mean = np.convolve(level, np.full(3, 1.0 / 3.0), "valid")
    change = mean[5:] - mean[:-5]
    apart = np.abs(change - median(change))
    steps = np.flatnonzero(apart > max(BONNET_STEP * airlight, BONNET_OUTLIER * median(apart)))
    return int(rows[min(steps[-1] + 6, rows.size - 1)]) if steps.size else bottom


@functools.lru_cache(maxsize=64)
def _even_rows(first: int, last: int, count: int) -> NDArray[np.int64]:
    """Up to so many rows from the first to the last, evenly and downward; they belong to all who ask."""
    return np.unique(np.linspace(first, last, count).astype(np.int64))


SATURATED_SHARE = 0.02
"""Share of the sky's pixels at the largest value from which on its brightness is not what its mean says [-]."""


@dataclass(frozen=True, slots=True)
class Sky:
    """The sky above the horizon.

    Attributes
    ----------
    luminance : float
        At the horizon, of its bright part [linear grey levels].
    deviation, upward : float
        Standard deviation of its luminance at the horizon, downward and upward [linear grey levels].
    noise : float
        Deviation of single pixels [linear grey levels].
    saturated, clipped : float
        Shares of its pixels of which all channels, and of which some, have the largest value [-].
    """

    luminance: float
    deviation: float
    upward: float
    noise: float
    saturated: float
    clipped: float

    @property
    def is_clipped(self) -> bool:
        """Whether the sky may be brighter than it looks."""
        return self.clipped > SATURATED_SHARE


SKY_ROWS = 24
"""Rows of sky that are looked at."""

SKY_HEIGHT = 0.2
"""How far above the horizon sky is looked at [rad]; as far as the image goes if that is less."""

DARKER = 0.012
"""Darkening from a row to the next below beyond which it is no longer sky that is seen, as a share [-]."""

UNSEEN, CLOSE = 0.3, 0.01
"""Deviation of the sky's luminance for each radian that is hidden above the horizon [1/rad], but for so much [rad]."""

MOST_HIDDEN = 0.14
"""Angle above the horizon up to which something may hide all of the sky, beyond which it is no road that lies ahead but
a wall or a wood [rad]."""

PATCHY, SCATTERED, BRIGHTER = 0.35, 0.004, 0.3
"""Share of a row that is alike, and relative scatter of the rows, beyond which trees may be taken for sky; by how much
the sky may be brighter then, as a deviation [-]."""


def sky_above(image: LinearPixels, camera: Camera, margin: float) -> Sky | None:
    """Look at the sky in the middle two thirds of the image above the horizon.

    Parameters
    ----------
    image : LinearPixels
        The image.
    camera : Camera
        The told calibration.
    margin : float
        Rows above the horizon that are left out [px].

    Returns
    -------
    Sky or None
        None if there are no such rows, or something high hides the sky all along them.
    """
    bottom = min(math.floor(camera.horizon_row - margin), camera.height - 1)
    top = max(0, math.floor(camera.horizon_row - SKY_HEIGHT * camera.focal_length))
    if bottom - top < 1:
        return None
    rows = _even_rows(top, bottom, SKY_ROWS)
    side = camera.width // 6
    noise = strip_kernels.pixel_noise(image.pixels, image.tables, rows)
    bright, share = strip_kernels.sky_rows(image.pixels, image.tables, rows, side, camera.width - side, max(noise, 0.3))
    height = (camera.horizon_row - rows.astype(np.float64)) / camera.focal_length
    darker = max(DARKER, 2.0 * noise / max(float(bright.max()), 1e-9))
    level, _, scatter, lowest = strip_kernels.level_at_horizon(bright, height, darker)
    if lowest > MOST_HIDDEN:
        return None
    unseen = UNSEEN * max(float(lowest) - margin / camera.focal_length - CLOSE, 0.0) * level
    deviation = math.hypot(scatter, unseen)
    # What looks everywhere different is a wood rather than a sky, which is no darker than that.
    covered = median(share) < PATCHY and scatter > SCATTERED * level
    saturated, clipped = strip_kernels.saturation(image.pixels, image.tables.shape[1] - 1, rows, side)
    return Sky(level, deviation, BRIGHTER * level if covered else deviation, noise, saturated, clipped)


def mean_curves(frames: tuple[tuple[StripCurves, Sky], ...]) -> StripCurves:
    """Average the curves of successive frames at the last one's exposure, which the sky shows.

    Parameters
    ----------
    frames : tuple of (StripCurves, Sky)
        Oldest first.
    """
    if len(frames) == 1:
        return frames[0][0]
    gains = np.array([frames[-1][1].luminance / sky.luminance for _, sky in frames])[:, None, None]
    luminance = gains * np.stack([curves.luminance for curves, _ in frames])
    variance = gains**2 * np.stack([curves.variance for curves, _ in frames])
    seen = variance > 0
    count = np.maximum(seen.sum(axis=0), 1)
    mean = np.where(seen, luminance, 0.0).sum(axis=0) / count
    scatter = np.where(seen, gains * np.stack([curves.scatter for curves, _ in frames]), 0.0).sum(axis=0) / count
    return StripCurves(mean, np.where(seen, variance, 0.0).sum(axis=0) / count**2, scatter)


CLIPPED = 0.95 * 255.0
"""Brighter than this a row has lost some of its light where the sky is clipped [linear grey levels]."""


def without_clipped(curves: StripCurves) -> StripCurves:
    """Leave out bins so bright that their noise, or one of their colours, is clipped."""
    return replace(curves, variance=np.where(curves.luminance > CLIPPED, 0.0, curves.variance))


def without_rows_below(curves: StripCurves, geometry: StripGeometry, lowest: int) -> StripCurves:
    """Leave out bins that reach below a row."""
    return replace(curves, variance=np.where(geometry.last > lowest, 0.0, curves.variance))
