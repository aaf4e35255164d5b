"""Luminance of strips of road, bin by bin: what the joint fit of fog looks at."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.light.luminance import linear_table
from fogsim.vision.light.medians import MOST_SAMPLES, median_of_few
from fogsim.vision.light.pixel_kernels import LinearPixels, even_column, pixel_luminance
from fogsim.vision.strips.sky import Sky, even_rows
from fogsim.vision.strips.strip_geometry import StripGeometry

Floats = NDArray[np.float64]

_GRAIN = 0.5
"""Size of pieces of road whose albedo counts as independent next to the patches [m]."""

_LEAST_DEVIATION = 0.1
"""Least deviation of a bin's mean: what quantisation leaves [linear grey levels]."""

_QUIET, _SMOOTHED = 0.3, 1.0
"""Pixel noise, in levels, below which an image was compressed, and the deviation that this leaves in a mean [-]."""

_KEPT = 2.5
"""Half-width of the core of a row, in its robust standard deviations: marks and other narrow things lie outside."""

_MOST_COLUMNS = 128
"""Columns of a row that are looked at for airlight, or up to twice as many."""

_HALF_VEHICLE = 1.3
"""Half the width that a tracked vehicle ahead may hide, its offset in the lane included [m]."""


class StripCurves(NamedTuple):
    """Luminance of each strip by bin."""

    luminance: Floats  # (strips, n): Mean of the core of each bin [linear grey levels]
    # (strips, n): Its variance apart from what patches and drift of the albedo do; 0 where there is no datum
    variance: Floats
    # (strips, n): Mean distance of all single pixels from the bin's median, marks and the like included [linear grey
    # levels]
    scatter: Floats

    def only(self, strips: list[int]) -> "StripCurves":
        """Some of the strips; the first ones are not copied."""
        which = slice(len(strips)) if strips == [*range(len(strips))] else strips
        return StripCurves(self.luminance[which], self.variance[which], self.scatter[which])


def strip_curves(
    image: LinearPixels,
    geometry: StripGeometry,
    noise: float,
    camera: Camera,
    free: float = math.inf,
    known: StripCurves | None = None,
    limits: Floats | None = None,
) -> StripCurves:
    """Read the strips (`noise` [linear grey levels], `free` [m], `limits` (strips, 2, n) [linear grey levels])."""
    vehicle = (math.inf, -math.inf, -math.inf)
    if math.isfinite(free):
        reach, u0 = _HALF_VEHICLE * camera.focal_length / free, camera.principal_point[0]
        vehicle = (u0 - reach, u0 + reach, camera.horizon_row + camera.row_distance / free)
    table = linear_table(camera.response, camera.bits, camera.black_level)
    out = np.zeros((3, *geometry.left.shape)) if known is None else np.array(known)
    if limits is None:
        limits = np.zeros((0, 2, 0))
    _read_strips(image, table, geometry, camera.focal_length, vehicle, limits, noise, out, known is not None)
    return StripCurves(*out)


@kernel
def _core(samples: NDArray[np.float32], ordered: NDArray[np.float32], floor: float) -> tuple[float, float, float]:
    """Mean and deviation of what lies near the median of samples; mean distance of all from it.

    `ordered` is as many numbers of room.
    """
    count, middle = samples.size, median_of_few(samples, ordered)
    # The nearest half of sorted samples is a run of them: take ends away, the farther first, until it is left.
    low, high, apart = 0, count - 1, np.float32(0.0)
    for _ in range(count - count // 2):
        below, above = middle - ordered[low], ordered[high] - middle
        apart = max(below, above)
        if below > above:
            low += 1
        else:
            high -= 1
    reach = _KEPT * max(1.4826 * float(apart), floor)
    total, square, kept, away = 0.0, 0.0, 0, 0.0
    for value in ordered:
        offset = float(value) - middle
        away += abs(offset)
        if abs(offset) <= reach:
            total += offset
            square += offset * offset
            kept += 1
    mean = total / kept
    return middle + mean, math.sqrt(max(square / kept - mean * mean, 0.0)), away / count


@kernel
def _read_strips(
    image: LinearPixels,
    table: NDArray[np.float32],
    geometry: StripGeometry,
    focal: float,
    vehicle: tuple[float, float, float],
    limits: Floats,
    noise: float,
    out: Floats,
    again: bool,
) -> None:
    """Luminance of the core of each bin of rows of the strips, its variance, and the scatter of the whole bin.

    Takes `table` (levels,), `focal` [px], `vehicle` (left, right, foot) [px], `limits` (strips, 2, n), none for all
    pixels, `noise` [linear grey levels], `out` (3, strips, n).
    """
    first, last, every = geometry.first, geometry.last, np.array([-math.inf, math.inf])
    samples, ordered = np.empty(MOST_SAMPLES, np.float32), np.empty(MOST_SAMPLES, np.float32)
    for s in range(geometry.left.shape[0]):
        for i in range(first.size):
            low, high, height = geometry.left[s, i], geometry.right[s, i], last[i] - first[i] + 1
            width, hides = high - low, first[i] <= vehicle[2]
            if again and (not hides or high < vehicle[0] - 1.0 or low > vehicle[1] + 1.0 or out[1, s, i] <= 0.0):
                continue
            out[:, s, i] = 0.0
            if width < 2.0:
                continue
            bounds = limits[s, :, i] if limits.size else every
            hidden = vehicle if hides else (math.inf, -math.inf, 0.0)
            # An even number: the middle one of an odd number would lie between two columns.
            pairs = int(min(width * height, float(MOST_SAMPLES))) // 2
            taken = _sampled(image, (low, high), (first[i], last[i]), hidden, bounds, pairs, samples)
            if taken < 2 or taken < 0.5 * pairs:
                continue
            mean, deviation, scatter = _core(samples[:taken], ordered[:taken], max(noise, 2.0 * _LEAST_DEVIATION))
            pieces = max(width * (geometry.distance[i] / focal) / _GRAIN, 1.0) * max(geometry.extent[i] / _GRAIN, 1.0)
            texture = max(deviation**2 - noise**2, 0.0) / min(float(taken), pieces)
            out[0, s, i], out[2, s, i] = mean, scatter
            out[1, s, i] = noise**2 / taken + texture + _LEAST_DEVIATION**2
            out[1, s, i] += _coarseness(mean, deviation, noise, table)


@kernel
def _sampled(
    image: LinearPixels,
    sides: tuple[float, float],
    rows: tuple[int, int],
    hidden: tuple[float, float, float],
    limits: Floats,
    pairs: int,
    samples: NDArray[np.float32],
) -> int:
    """Pixels between two sides and limits of luminance that a vehicle does not hide; returns how many there are."""
    cols, step, row, taken = image.pixels.shape[1], 0.5 * (sides[1] - sides[0]) / pairs, rows[0], 0
    for j in range(pairs):
        # Rows of the bin in turn, columns evenly from both sides inward: a mirrored image gives the same.
        apart = (j + 0.5) * step + 0.5
        for col in (math.floor(sides[0] + apart), math.ceil(sides[1] - apart)):
            if not hidden[0] <= col <= hidden[1]:
                value = pixel_luminance(image, row, min(max(col, 0), cols - 1))
                if limits[0] <= value <= limits[1]:
                    samples[taken] = value
                    taken += 1
        row = row + 1 if row < rows[1] else rows[0]
    return taken


@kernel
def _coarseness(mean: float, deviation: float, noise: float, table: NDArray[np.float32]) -> float:
    """Variance of means by rounding to levels, and by compression, which does away with noise and faint gradients."""
    place = min(max(int(np.searchsorted(table, mean)) - 1, 0), table.size - 2)
    level = max(float(table[place + 1] - table[place]), 1e-6)
    # Rounding does not average out where nothing dithers it: 1/√12 of a level without noise, nothing from half on.
    rounding = math.exp(-4.0 * (math.pi * deviation / level) ** 2) / 12.0
    quiet = max(1.0 - noise / (_QUIET * level), 0.0)
    return level**2 * (rounding + (_SMOOTHED * quiet) ** 2)


_BONNET_SHARE, _BONNET_ROWS = 0.3, 60
"""Share of the road's rows that the own bonnet may cover, and how many of them are looked at."""

_BONNET_STEP, _BONNET_OUTLIER = 0.03, 6.0
"""Least step of luminance at the bonnet's edge, relative to the airlight, and in median changes over as many rows."""


def lowest_road_row(image: LinearPixels, camera: Camera, airlight: float) -> int:
    """Lowest row that shows road, above the own vehicle's bonnet or dashboard (`airlight` [linear grey levels])."""
    bottom = camera.height - 1
    top = math.floor(bottom - _BONNET_SHARE * (bottom - camera.horizon_row))
    rows = even_rows(bottom, top, _BONNET_ROWS)[::-1]
    if rows.size < 8:
        return bottom
    edge = _bonnet_edge(_middle_levels(image, rows), _BONNET_STEP * airlight)
    return bottom if edge < 0 else int(rows[min(edge + 6, rows.size - 1)])


@kernel
def _bonnet_edge(level: Floats, least: float) -> int:
    """The last step of more than the least from row to row (n,) that stands out; −1 without any."""
    # Three rows each side of a gap of two, since a bonnet's edge is bent.
    mean = (level[:-2] + level[1:-1] + level[2:]) / 3.0
    change = mean[5:] - mean[:-5]
    apart = np.abs(change - np.median(change))
    least = max(least, _BONNET_OUTLIER * np.median(apart))
    last = -1
    for i in range(apart.size):
        last = i if apart[i] > least else last
    return last


def mean_curves(frames: tuple[tuple[StripCurves, Sky], ...]) -> StripCurves:
    """Average the curves of successive frames at the last one's exposure, which the sky shows."""
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


_CLIPPED = 0.95 * 255.0
"""Brighter than this a row has lost some of its light where the sky is clipped [linear grey levels]."""


def without_clipped(curves: StripCurves) -> StripCurves:
    """Leave out bins so bright that their noise, or one of their colours, is clipped."""
    return curves._replace(variance=np.where(curves.luminance > _CLIPPED, 0.0, curves.variance))


def without_rows_below(curves: StripCurves, geometry: StripGeometry, lowest: int) -> StripCurves:
    """Leave out bins that reach below a row."""
    return curves._replace(variance=np.where(geometry.last > lowest, 0.0, curves.variance))


@kernel
def _middle_levels(image: LinearPixels, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """Median luminance of the middle third of rows [linear grey levels] (`rows` (n,) int64)."""
    cols = image.pixels.shape[1]
    samples, ordered = np.empty(24, np.float32), np.empty(24, np.float32)
    left, right, out = cols // 3 - 0.5, cols - cols // 3 - 0.5, np.empty(rows.size)
    for i in range(rows.size):
        for j in range(samples.size):
            samples[j] = pixel_luminance(image, rows[i], even_column(j, samples.size, left, right))
        out[i] = median_of_few(samples, ordered)
    return out


@kernel
def airlight_shares(
    image: LinearPixels, rows: NDArray[np.int64], columns: tuple[int, int], airlight: float, alike: float
) -> NDArray[np.float64]:
    """Shares of rows' pixels that are as bright as the airlight [-].

    Takes `rows` (n,) int64, `columns` (int, int), `airlight` [linear grey levels].
    """
    shares: NDArray[np.float64] = np.zeros(rows.size)
    step = max((columns[1] - columns[0]) // _MOST_COLUMNS, 1)
    for i in range(rows.size):
        count = 0
        for column in range(columns[0], columns[1], step):
            count += 1
            shares[i] += abs(pixel_luminance(image, rows[i], column) - airlight) < alike * airlight
        shares[i] /= max(count, 1)
    return shares
