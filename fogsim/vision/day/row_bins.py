"""Where the day model reads rows of sky and road."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.day.bin_kernels import RowBins

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SKY_HEIGHT, _SKY_BINS, SKY_WIDTH = 0.25, 8, 0.56
"""How far above the horizon sky is read [rad], in how many bins, over what share of the columns."""

_HALF_LANE = 1.15
"""Half the width of the road's strip [m]."""

_OUTER = 2.4
"""Half the width of the strip in which contrast is looked for [m]."""

_NEAR_HORIZON, _SINGLE, STEP = 3.2, 6, 0.12
"""Deviations of the horizon within which rows are read one by one, how many more of them, and the relative height of
the bins below [-]."""


@lru_cache(maxsize=64)
def row_bins(camera: Camera, deviation: float, horizon: float) -> RowBins:
    """Lay bins over the image of a camera (`deviation` [px])."""
    bottom = camera.height - 1
    around = _NEAR_HORIZON * deviation + 1.0
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
        0.5 * SKY_WIDTH * camera.width,
        np.maximum(_HALF_LANE * (middle - horizon) / camera.mount_height, max(2.0, 0.006 * camera.focal_length)),
    )
    wider = np.maximum(half, _OUTER * np.maximum(middle - horizon, 0.0) / camera.mount_height)
    sides = []
    for reach in (half, wider):
        # Of a mirrored camera these are the mirrored columns.
        sides.append(np.clip(np.ceil(u0 - reach - 1e-6), 0, camera.width - 1).astype(np.int64))
        sides.append(np.clip(np.floor(u0 + reach + 1e-6), 0, camera.width - 1).astype(np.int64))
    return RowBins(first.astype(np.int64), last.astype(np.int64), *sides)
