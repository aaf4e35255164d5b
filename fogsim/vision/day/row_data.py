"""Bins of rows of an image, and what they show under each response that the camera may have."""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera, Response
from fogsim.values.camera_response import exposure_of, respond
from fogsim.vision.day.row_kernels import RowData
from fogsim.vision.light.medians import median_among
from fogsim.vision.light.pixel_kernels import even_column

Floats = NDArray[np.float64]

_POINTS = 1025
"""Signals, evenly from 0 to 1, at which a curve is tabulated."""

MOST_SLOPE = 12.0
"""Most light per signal that a curve is taken to have [-]: the ends of S-curves are flat."""

STATED = 0.3
"""Chance that a camera has the response that its description states [-]."""

_OTHERS = {
    "srgb": 0.12,
    "s .7": 0.18,
    "shoulder 1.5": 0.15,
    "log 50": 0.08,
    "film 1": 0.14,
    "film": 0.12,
    "2.5": 0.06,
    "1.8": 0.05,
}
"""How likely the other curves are, before they are scaled to the rest of 1 [-]: sRGB, an S-curve over it, a soft
shoulder, a logarithm, film curves, which are most like those of camera makers, and powers."""

_OTHER_LINEAR = 0.02
"""The same for light itself [-]."""


_BLACK_POINTS = (0.2, 0.35, 0.5)
"""Signals that were stretched to black, over those stretched to white: of clear air, and of thin and dense fog [-]."""

STRETCHED = slice(-len(_BLACK_POINTS), None)
"""Where the curves of stretched levels are."""

_STRETCHED = 0.3
"""Chance that levels were stretched, where some pixels are black: so may dark things be [-]."""

_BLACK, _SPREAD, _LEAST_BLACK = 1.0 / 255.0, 8, 0.001
"""Signal up to which a pixel counts as black [-], distance of the pixels that are read [px], and least share of black
ones where levels were stretched: that usually clips 0.5 % [-]."""


class Curves(NamedTuple):
    """Inverse response curves, those of stretched levels last."""

    light: Floats  # Light behind evenly spaced signals, relative to full scale
    slope: Floats  # Its derivative by the signal
    chance: Floats  # (curves,): How likely each is, 0 for those of stretched levels; their sum is 1
    stretched: Floats  # (curves,): The same where levels may be stretched


@lru_cache(maxsize=8)
def curves_of(camera: Camera) -> Curves:
    """Curves that a camera may have, the stated one first."""
    signal = np.linspace(0.0, 1.0, _POINTS)
    others = (
        dict(_OTHERS) if camera.response is not Response.SRGB else {n: c for n, c in _OTHERS.items() if n != "srgb"}
    )
    if camera.response is not Response.LINEAR:
        others["linear"] = _OTHER_LINEAR
    light = [exposure_of(signal, camera.response, camera.black_level)]
    light += [_inverse(name, signal) for name in others]
    light += [exposure_of(black + (1.0 - black) * signal, Response.SRGB) for black in _BLACK_POINTS]
    weights, none = np.array(list(others.values())), np.zeros(len(_BLACK_POINTS))
    slope = np.clip(np.gradient(np.array(light), signal, axis=1), 1.0 / MOST_SLOPE, MOST_SLOPE)
    chance = np.concatenate([[STATED], (1.0 - STATED) * weights / weights.sum(), none])
    stretched = (1.0 - _STRETCHED) * chance
    stretched[STRETCHED] = _STRETCHED / none.size
    return Curves(np.array(light), slope, chance, stretched)


def chances_of(image: NDArray[Any], camera: Camera) -> Floats:
    """(curves,) float64: how likely each of a camera's curves is; without black pixels, no levels were stretched.

    Takes `image` (rows, cols, channels).
    """
    curves, black = curves_of(camera), image[::_SPREAD, ::_SPREAD] <= _BLACK * (2**camera.bits - 1)
    return curves.stretched if black.mean() > _LEAST_BLACK else curves.chance


_WHITE, BRIGHT = 7.3, 0.95
"""Light at which a film curve reaches full scale that is not scaled to do so at 1, and signal from which on its light
counts as full scale [-]."""


def _inverse(name: str, signal: Floats) -> Floats:
    light = np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 4000)])
    srgb = respond(light, Response.SRGB)
    kind, _, number = name.partition(" ")
    if kind == "s":
        out = srgb + float(number) * (srgb * srgb * (3.0 - 2.0 * srgb) - srgb)
    elif kind == "log":
        out = np.log1p(float(number) * light) / math.log1p(float(number))
    elif kind == "shoulder":
        # The eye's and many sensors' saturation: 1 − exp(−a light).
        bent = (1.0 - np.exp(-float(number) * light)) / (1.0 - np.exp(-float(number)))
        out = respond(bent, Response.SRGB)
    elif kind == "film":
        # Scaled to full scale at its end, or as cameras use it: there hardly anything is so bright.
        light = light if number else _WHITE * light
        bent = light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14)
        out = respond(bent / bent[-1], Response.SRGB)
        light = np.minimum(light / np.interp(BRIGHT, out, light), 1.0)
    elif kind == "linear":
        out = light
    elif kind == "srgb":
        out = srgb
    else:
        out = light ** (1.0 / float(kind))
    return np.asarray(np.interp(signal, out, light))


Ints = NDArray[np.int64]

_SKY_SHARE, _SKY_REACH = 7, 0.012
"""Part of a row of sky (one in so many) that is at least seen, and half the width of its pixel values, relative [-]."""

_MOST_COLUMNS, _MOST_ROWS = 80, 4
"""Most pixels of a row, and rows of a bin, that are read."""

_TAIL = 0.04
"""Share of the pixels of a strip beyond either level whose difference is its contrast [-]."""


class RowBins(NamedTuple):
    """Bins of rows, the highest first."""

    # first, last (n,) int64: rows
    first: Ints
    last: Ints
    # left, right (n,) int64: first and last columns
    left: Ints
    right: Ints
    # outer_left, outer_right (n,) int64: the same of a wider strip of road, over which contrast is looked for
    outer_left: Ints
    outer_right: Ints


@kernel
def _bright_part(seen: Floats) -> tuple[float, float]:
    """Mean of those pixels of sky that are alike near the brightest, and their mean distance from it (`seen` (n,))."""
    count = seen.size
    centre = seen[count - 1 - count // _SKY_SHARE]
    spread = seen[count - 1 - count // 20] - seen[count - 1 - count // 3]
    reach = max(_SKY_REACH * centre, min(1.5 * spread, 3.0 * _SKY_REACH * centre))
    apart = 0.0
    for _ in range(4):
        total, kept, apart = 0.0, 0, 0.0
        for value in seen:
            if abs(value - centre) <= reach:
                total += value
                apart += abs(value - centre)
                kept += 1
        centre, apart = total / max(kept, 1), apart / max(kept, 1)
    return centre, apart


@kernel
def _bin_medians(image: NDArray[Any], bins: RowBins, channel: int, sky_end: int, out: Floats) -> None:
    """Median of each bin, and the median distance from it [pixel values].

    Takes `image` (rows, cols, channels) uint8, `out` (3, n).
    """
    values = np.empty(_MOST_COLUMNS * _MOST_ROWS)
    for i in range(bins.first.size):
        rows = min(bins.last[i] - bins.first[i] + 1, _MOST_ROWS)
        columns = min(bins.right[i] - bins.left[i] + 1, _MOST_COLUMNS)
        count = 0
        for a in range(rows):
            row = bins.first[i] + (2 * a + 1) * (bins.last[i] - bins.first[i] + 1) // (2 * rows)
            for b in range(columns):
                column = even_column(b, columns, bins.left[i] - 0.5, bins.right[i] + 0.5)
                values[count] = image[row, column, channel]
                count += 1
        seen = np.sort(values[:count])
        middle = 0.5 * (seen[(count - 1) // 2] + seen[count // 2])
        apart = np.sort(np.abs(seen - middle))
        # Of values in whole levels the median jumps: the mean of the middle half stands for it.
        quarter = count // 4
        out[0, i] = seen[quarter : count - quarter].mean()
        out[1, i] = apart[count // 2]
        if bins.last[i] < sky_end:
            # Trees and houses hide sky on both sides: what is alike near the brightest counts.
            out[0, i], out[1, i] = _bright_part(seen)
        row = (bins.first[i] + bins.last[i]) // 2
        count = min(bins.outer_right[i] - bins.outer_left[i] + 1, _MOST_COLUMNS)
        for b in range(count):
            column = even_column(b, count, bins.outer_left[i] - 0.5, bins.outer_right[i] + 0.5)
            values[b] = image[row, column, channel]
        seen = np.sort(values[:count])
        tail = int(_TAIL * count)
        out[2, i] = seen[count - 1 - tail] - seen[tail]


_MIDDLE, _SIDE, _SIDE_END = 0.6, 1.3, 2.6
"""Half the width of the middle of the own lane, and where its sides begin and end, from its axis [m]."""

_MOST_APART, _STANDS = 10.0 / 255.0, 1.5 / 255.0
"""Difference of signals between middle and sides that counts at most, and mean one of what stands in the lane [-]."""

_TALLEST, _BEFORE, _FEWEST = 1.3, 4, 2
"""Height up to which it is looked at [m], bins of free road before it, and fewest bins that show it."""


@kernel
def _apart(image: NDArray[Any], row: int, scale: float, axis: float, channel: int) -> float:
    """How much the middle of the own lane differs from the side that it is more like [pixel values].

    Takes `image` (rows, cols, channels) uint8, `scale` [px/m], `axis` [px].
    """
    values, medians = np.empty(_MOST_COLUMNS), np.empty(3)
    spans = ((-_MIDDLE, _MIDDLE), (-_SIDE_END, -_SIDE), (_SIDE, _SIDE_END))
    for part in range(3):
        left, right = axis + spans[part][0] * scale, axis + spans[part][1] * scale
        left, right = max(left, 0.0), min(right, image.shape[1] - 1.0)
        if right < left:
            return 0.0
        count = min(int(right - left) + 1, _MOST_COLUMNS)
        for b in range(count):
            values[b] = image[row, even_column(b, count, left - 0.5, right + 0.5), channel]
        medians[part] = median_among(values[:count])
    return float(min(abs(medians[0] - medians[1]), abs(medians[0] - medians[2])))


@kernel
def _obstacle_foot(
    image: NDArray[Any], bins: RowBins, mount_height: float, place: tuple[float, float], full: float
) -> float:
    """Row in which something begins that stands in the own lane and is unlike the road on both sides; NaN if none.

    Takes `image` (rows, cols, channels) uint8, `mount_height` [m], `place`: the axis' column and the horizon's row
    [px], `full` [pixel values].
    """
    axis, horizon = place
    sky = np.searchsorted(bins.first, horizon, "right")
    count = bins.first.size - sky
    rows, apart = np.empty(count), np.empty(count)
    for i in range(count):
        rows[i] = (bins.first[sky + i] + bins.last[sky + i]) // 2
        scale = (rows[i] - horizon) / mount_height
        apart[i] = min(_apart(image, int(rows[i]), scale, axis, image.shape[2] // 2), _MOST_APART * full)
    most, foot = _STANDS * full, np.nan
    for i in range(_FEWEST + 1, count - _BEFORE + 1):
        end = float(bins.first[sky + i])
        stands, number = 0.0, 0
        for j in range(i):
            if mount_height * (end - rows[j]) < _TALLEST * (end - horizon):
                stands += apart[j]
                number += 1
        if number >= _FEWEST and stands / number - apart[i : i + _BEFORE].mean() > most:
            most, foot = stands / number - apart[i : i + _BEFORE].mean(), end
    return foot


def free_depth(image: NDArray[Any], bins: RowBins, camera: Camera, horizon: float) -> float:
    """Depth up to which nothing stands in the own lane that is unlike the road on both sides [m].

    Takes `image` (rows, cols, channels) uint8, `horizon` [px].
    """
    place = (camera.principal_point[0], horizon)
    foot = _obstacle_foot(image, bins, camera.mount_height, place, 2.0**camera.bits - 1.0)
    return math.inf if math.isnan(foot) else camera.row_distance / (foot - horizon)


_NOISE, _OF_SCATTER, _OF_SLOPE = 0.45 / 255.0, 0.25, 0.15
"""Noise of a bin's signal: of full scale, of its pixels' scatter, and of its change by row [-]."""

_CONTRAST_NOISE = 3.0
"""Contrast that noise makes across a row, in deviations of its pixels [-]."""

CLIPPED = 0.988
"""Signal from which on a bin counts as clipped [-]."""

_BRIGHTEST = 0.92
"""Share of bins that are no brighter than the light that priors are relative to [-]."""

_LEAST_LEVEL = 1e-4
"""Least of that light, over full scale: no daylight is so dark [-]."""

_BONNETS = (0.45, 0.3, 0.15, 0.05)
"""Shares of the rows below the horizon that a bonnet or a dashboard may cover [-]."""

_WALKS = np.array([[0.015], [0.04], [0.1]])
"""Deviations from bin to bin of signals that follow no law of fog [-]."""


def read_rows(image: NDArray[Any], bins: RowBins, camera: Camera, horizon: float) -> RowData:
    """Read the bins of an image (`image` (rows, cols, channels) uint8)."""
    found = np.empty((3, bins.first.size))
    wide = np.flatnonzero(bins.right - bins.left < 0.5 * _SKY_WIDTH * camera.width)
    sky_end = int(bins.first[wide[0]]) if wide.size else 0
    _bin_medians(image, bins, image.shape[2] // 2, sky_end, found)
    signal, scatter, across = found / (2**camera.bits - 1)
    middle = 0.5 * (bins.first + bins.last)
    by_row = np.zeros(signal.size)
    by_row[1:-1] = (signal[2:] - signal[:-2]) / (middle[2:] - middle[:-2])
    curves = curves_of(camera)
    place = np.clip(signal, 0.0, 1.0) * (_POINTS - 1)
    low = np.minimum(place.astype(np.int64), _POINTS - 2)
    share = place - low
    light, slope = (
        table.take(low, axis=1) * (1.0 - share) + table.take(low + 1, axis=1) * share
        for table in (curves.light, curves.slope)
    )
    noise = np.sqrt(_NOISE**2 + (_OF_SCATTER * scatter) ** 2 + (_OF_SLOPE * by_row) ** 2)
    clipped = signal > CLIPPED
    level = np.maximum(np.quantile(light, _BRIGHTEST, axis=1), _LEAST_LEVEL)
    contrast = np.stack([across, _CONTRAST_NOISE * np.hypot(1.5 * noise, 1.5 / 255.0)]) * slope[0] / level[0]
    cuts = _cuts(bins, camera, horizon)
    free = _free(signal, noise, clipped)
    return RowData(
        first=bins.first.astype(np.float64),
        last=bins.last.astype(np.float64),
        light=light,
        slope=slope,
        noise=np.where(clipped, 0.0, slope * noise),
        by_row=slope * by_row,
        level=level,
        least_airlight=light[:, clipped].min(axis=1) if clipped.any() else np.zeros(len(light)),
        contrast=contrast,
        cuts=cuts,
        free=free[cuts],
        none=float(free[0]),
    )


def _cuts(bins: RowBins, camera: Camera, horizon: float) -> NDArray[np.int64]:
    """Bins before which the road may end: at the horizon, at a bonnet, or not at all."""
    bottom = camera.height - 1
    sky = int((bins.last + 0.5 <= horizon).sum())
    ends = {int((bins.last < bottom - share * (bottom - horizon)).sum()) for share in _BONNETS}
    return np.array([sky, *sorted(end for end in ends if sky < end < bins.first.size), bins.first.size])


def _free(signal: Floats, noise: Floats, clipped: NDArray[np.bool_]) -> Floats:
    """(n + 1,) float64: logarithm of the chance of the signals of bins from each on, if they follow no law."""
    variance = _WALKS**2 + noise[1:] ** 2 + noise[:-1] ** 2
    steps = -0.5 * np.diff(signal) ** 2 / variance - 0.5 * np.log(2.0 * math.pi * variance)
    steps = np.where(clipped[1:], 0.0, steps)
    to_end = np.cumsum(steps[:, ::-1], axis=1)[:, ::-1]
    ends = np.concatenate([to_end[:, :1], to_end, np.zeros((len(_WALKS), 1))], axis=1)
    return np.asarray(np.logaddexp.reduce(ends, axis=0) - math.log(len(_WALKS)))


_SKY_HEIGHT, _SKY_BINS, _SKY_WIDTH = 0.25, 8, 0.56
"""How far above the horizon sky is read [rad], in how many bins, over what share of the columns."""

_HALF_LANE = 1.15
"""Half the width of the road's strip [m]."""

_OUTER = 2.4
"""Half the width of the strip in which contrast is looked for [m]."""

_NEAR_HORIZON, _SINGLE, STEP = 3.2, 6, 0.12
"""Deviations of the horizon within which rows are read one by one, how many more of them, and the relative height of
the bins below [-]."""


@lru_cache(maxsize=64)
def near_horizon(deviation: float) -> float:
    """Rows on either side of the horizon that may be sky or road (`deviation` [px])."""
    return _NEAR_HORIZON * deviation + 1.0


def row_bins(camera: Camera, deviation: float, horizon: float) -> RowBins:
    """Lay bins over the image of a camera (`deviation` [px])."""
    bottom = camera.height - 1
    around = near_horizon(deviation)
    step = max(round(deviation / 2.5), 1)
    edges = [math.floor(horizon - around)]
    top = max(math.floor(horizon - _SKY_HEIGHT * camera.focal_length), 0)
    for edge in horizon - np.geomspace(around, max(horizon - top, around + 2.0), _SKY_BINS + 1)[1:]:
        if edges[-1] - math.floor(edge) >= 1 and edge >= 0.0:
            edges.append(math.floor(edge))
    edges = edges[::-1]
    while edges[-1] < horizon + around + _SINGLE * step:
        edges.append(edges[-1] + step)
    while edges[-1] < bottom:
        edges.append(edges[-1] + max(math.ceil(STEP * (edges[-1] - horizon)), step))
    first, last = np.array(edges[:-1]), np.minimum(np.array(edges[1:]) - 1, bottom)
    kept = (first <= last) & (first >= 0)
    first, last = first[kept], last[kept]
    middle, u0 = 0.5 * (first + last), camera.principal_point[0]
    half = np.where(
        last < horizon - around,
        0.5 * _SKY_WIDTH * camera.width,
        np.maximum(_HALF_LANE * (middle - horizon) / camera.mount_height, max(2.0, 0.006 * camera.focal_length)),
    )
    wider = np.maximum(half, _OUTER * np.maximum(middle - horizon, 0.0) / camera.mount_height)
    sides = []
    for reach in (half, wider):
        # Of a mirrored camera these are the mirrored columns.
        sides.append(np.clip(np.ceil(u0 - reach - 1e-6), 0, camera.width - 1).astype(np.int64))
        sides.append(np.clip(np.floor(u0 + reach + 1e-6), 0, camera.width - 1).astype(np.int64))
    return RowBins(first.astype(np.int64), last.astype(np.int64), *sides)
