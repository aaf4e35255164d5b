"""Luminance of strips of road, bin by bin: what the joint fit of fog looks at."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.light.luminance import linear_table
from fogsim.vision.light.medians import median
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.strips import strip_kernels
from fogsim.vision.strips.sky import Sky, even_rows
from fogsim.vision.strips.strip_geometry import StripGeometry

Floats = NDArray[np.float64]

_GRAIN = 0.5
"""Size of pieces of road whose albedo counts as independent next to the patches [m]."""

_ALL_PIXELS = np.array([[-math.inf], [math.inf]])
"""Limits that every pixel is within [linear grey levels]."""

_HALF_VEHICLE = 1.3
"""Half the width that a tracked vehicle ahead may hide, its offset in the lane included [m]."""


@dataclass(frozen=True, slots=True)
class StripCurves:
    """Luminance of each strip by bin."""

    luminance: Floats  # (strips, n): Mean of the core of each bin [linear grey levels]
    # (strips, n): Its variance apart from what patches and drift of the albedo do; 0 where there is no datum
    variance: Floats
    # (strips, n): Mean distance of all single pixels from the bin's median, marks and the like included [linear grey
    # levels]
    scatter: Floats

    def only(self, strips: list[int]) -> "StripCurves":
        """Some of the strips."""
        return StripCurves(self.luminance[strips], self.variance[strips], self.scatter[strips])


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
    vehicle = np.array([math.inf, -math.inf, -math.inf])
    if math.isfinite(free):
        reach, u0 = _HALF_VEHICLE * camera.focal_length / free, camera.principal_point[0]
        vehicle = np.array([u0 - reach, u0 + reach, camera.horizon_row + camera.row_distance / free])
    if known is None:
        out = np.zeros((len(geometry.left), 3, geometry.first.size))
    else:
        out = np.stack([known.luminance, known.variance, known.scatter], axis=1)
    rows, table = (
        np.stack([geometry.first, geometry.last]),
        linear_table(camera.response, camera.bits, camera.black_level),
    )
    metres = (geometry.right - geometry.left) * (geometry.distance / camera.focal_length)
    pieces = np.maximum(metres / _GRAIN, 1.0) * np.maximum(geometry.extent / _GRAIN, 1.0)
    if limits is None:
        limits = np.broadcast_to(_ALL_PIXELS, (len(out), 2, geometry.first.size)).copy()
    for strip, values in enumerate(out):
        bins = strip_kernels.StripBins(rows, np.stack([geometry.left[strip], geometry.right[strip]]), pieces[strip])
        strip_kernels.strip_bins(image, table, bins, vehicle, limits[strip], noise, values, known is not None)
    return StripCurves(out[:, 0], out[:, 1], out[:, 2])


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
    level = strip_kernels.middle_levels(image, rows)
    # Three rows each side of a gap of two, since a bonnet's edge is bent.
    mean = (level[:-2] + level[1:-1] + level[2:]) / 3.0
    change = mean[5:] - mean[:-5]
    apart = np.abs(change - median(change))
    steps = np.flatnonzero(apart > max(_BONNET_STEP * airlight, _BONNET_OUTLIER * median(apart)))
    return int(rows[min(steps[-1] + 6, rows.size - 1)]) if steps.size else bottom


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
    return replace(curves, variance=np.where(curves.luminance > _CLIPPED, 0.0, curves.variance))


def without_rows_below(curves: StripCurves, geometry: StripGeometry, lowest: int) -> StripCurves:
    """Leave out bins that reach below a row."""
    return replace(curves, variance=np.where(geometry.last > lowest, 0.0, curves.variance))
