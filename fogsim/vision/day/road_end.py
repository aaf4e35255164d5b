"""How the road ends toward the horizon: fading in fog, or at something that hides it and the sky."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera
from fogsim.vision.day.row_data import CLIPPED, curves_of, near_horizon
from fogsim.vision.day.row_kernels import RowData
from fogsim.vision.light.pixel_kernels import even_column
from fogsim.vision.lines.horizon import Horizon

Floats = NDArray[np.float64]

_FADED, _SEEN = 0.02, 0.06
"""Shares by which the road differs from the lowest sky where it has faded from view, and where it surely is seen."""

_SKY_ROWS, _NEAREST = 5, 20.0
"""Rows of sky that are compared with, and least depth at which a road is taken to end [m]."""

_HALF_WIDTH, _NARROWEST, _MOST_COLUMNS = 4.0, 8.0, 80
"""Half the width that is read of a row: a vehicle hides less than half of that [m]; least of it, and most pixels [px].
"""


_EVEN_SKY, _DENSEST_BANK = 0.02, extinction_from_visibility(20.0)
"""Darkening of a sky downward below which nothing stands before it [-], and extinction of the densest bank that may
hide the road ahead [1/m]; chosen on walls across the roads of pool 0 of `benchmarks/photograph_pictures.py`."""


class RoadEnd(NamedTuple):
    """What ends the road."""

    sky_drop: float = 1.0  # How much darker the sky is next to the horizon than where it is brightest [-]
    density: float = 0.0  # Extinction that fog must have where the road fades before the horizon, 0 else [1/m]

    @property
    def is_sky_even(self) -> bool:
        """Whether nothing stands before the sky, or something before all of it."""
        return self.sky_drop < _EVEN_SKY

    @property
    def is_sharp(self) -> bool:
        """Whether the road ends more sharply than fog hides it."""
        return self.density > _DENSEST_BANK


UNSEEN_END = RoadEnd()
"""What is known of it where neither road nor sky is seen."""


def road_end(image: NDArray[Any], rows: RowData, camera: Camera, horizon: Horizon) -> RoadEnd:
    """Read what ends the road (`image` (rows, cols, channels))."""
    near = near_horizon(horizon.standard_deviation)
    sky = rows.light[0, rows.last < horizon.row - near]
    drop = 1.0 - float(sky[-1] / sky.max()) if sky.any() else 1.0
    first = math.floor(horizon.row - near) - _SKY_ROWS
    last = math.ceil(horizon.row + camera.row_distance / _NEAREST)
    if first < 0 or last >= camera.height:
        return RoadEnd(drop)
    lens = np.array([camera.principal_point[0], horizon.row, _HALF_WIDTH / camera.mount_height])
    signal = _row_means(image, first, last, lens) / (2**camera.bits - 1)
    curve = curves_of(camera).light[0]
    light = np.interp(signal, np.linspace(0.0, 1.0, curve.size), curve)
    brightness = float(np.median(light[:_SKY_ROWS]))
    if not brightness > 0.0 or signal[:_SKY_ROWS].max() > CLIPPED:
        return RoadEnd(drop)
    darker = np.asarray(1.0 - light / brightness, np.float64)
    return RoadEnd(drop, _density(darker, np.arange(first, last, dtype=np.float64) - horizon.row, near, camera))


def _density(darker: Floats, below: Floats, near: float, camera: Camera) -> float:
    """Mean extinction between where the road is seen and where it has faded [1/m] (`darker`, `below` (n,))."""
    apart = np.abs(darker)
    seen, faded = int(np.argmax(apart > _SEEN)), int(np.argmax(apart >= _FADED)) - 1
    if not 0 <= faded < seen or below[faded] <= near or (darker[faded + 1 : seen] * darker[seen] < 0.0).any():
        return 0.0
    ends = np.interp([_FADED, _SEEN], apart[faded : seen + 1], below[faded : seen + 1])
    return math.log(_SEEN / _FADED) / (camera.row_distance * float(1.0 / ends[0] - 1.0 / ends[1]))


@kernel
def _row_means(image: NDArray[Any], first: int, last: int, lens: Floats) -> Floats:
    """Mean of the middle half of each row of the road [pixel values]."""
    out, values = np.empty(last - first), np.empty(_MOST_COLUMNS)
    for row in range(first, last):
        reach = max(lens[2] * (row - lens[1]), _NARROWEST)
        left, right = max(lens[0] - reach, 0.0), min(lens[0] + reach, image.shape[1] - 1.0)
        count = min(max(int(right - left) + 1, 1), _MOST_COLUMNS)
        for b in range(count):
            values[b] = image[row, even_column(b, count, left - 0.5, right + 0.5), image.shape[2] // 2]
        out[row - first] = np.sort(values[:count])[count // 4 : count - count // 4].mean()
    return out
