"""What stands at the horizon that fog would hide."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.medians import quantile
from fogsim.vision.light.pixel_kernels import LinearPixels, row_luminance
from fogsim.vision.lines.horizon import Horizon

_BLOCKS = 80
"""Groups of columns that are judged, across the image."""

_ABOVE = 5
"""Rows above the horizon that are looked at [px]: what shows there is as high as the camera."""

_BELOW_CROWNS = 2.5
"""Mounting height up to which that stands on the ground [m]: above, crowns overhang what is seen below them."""

_SKY_HEIGHT, _BRIGHTEST = 0.5, 0.9
"""Rows above the horizon from which the airlight is taken, over the image's, and the quantile of their light [-]."""

_OWN_LANE = 0.2
"""Columns to either side of the way ahead that do not count, over the image's: vehicles have dark windows above bright
bodies [-]."""

_DARKER, _BRIGHTER, _LEAST_ROWS = 0.8, 0.15, 3
"""Light over the airlight below which something stands there, and by how much the ground before it must be brighter to
show that it stands farther away [-], in how many rows."""

_MOST_FAR = 0.2
"""Share of the image's width in which things show that fog would hide, from which on there is no such fog [-]."""

STANDS_OUT = "what stands at the horizon is darker than fog would leave it"


def stands_out(level: NDArray[Any], camera: Camera, horizon: Horizon, extinction: float) -> bool:
    """Whether much is seen that fog of an extinction would hide; see `share_of_far_objects`."""
    return share_of_far_objects(level, camera, horizon, extinction) > _MOST_FAR


def share_of_far_objects(level: NDArray[Any], camera: Camera, horizon: Horizon, extinction: float) -> float:
    """Share of the image's width in which something is seen that fog of an extinction would hide [-].

    At the depth d fog leaves no light below A (1 − e^(−k d)), so that something of the light L is nearer than −ln(1 − L
    / A) / k, and its foot lies as far below the horizon. Where the ground between there and the horizon is seen, it is
    farther.

    Takes `level` (rows, cols), `extinction` [1/m].
    """
    margin = 2.0 * horizon.standard_deviation + 1.0
    first, last = math.floor(horizon.row - margin) - _ABOVE, math.floor(horizon.row - margin)
    ground = math.ceil(horizon.row + margin)
    top = max(math.floor(last - _SKY_HEIGHT * camera.height), 0)
    is_seen = first >= 0 and last > top and ground + _LEAST_ROWS < camera.height and extinction > 0.0
    if not is_seen or camera.mount_height > _BELOW_CROWNS:
        return 0.0
    pixels = linear_pixels(level, camera)
    per_block = max(camera.width // _BLOCKS, 1)
    middles = (np.arange(camera.width // per_block) + 0.5) * per_block
    aside = np.flatnonzero(np.abs(middles - camera.principal_point[0]) > _OWN_LANE * camera.width)
    sky = _block_means(pixels, top, last, per_block, aside)
    brightest = sky.max(initial=0.0)
    # With the airlight, which is no brighter, less is dark.
    if not brightest > 0.0 or _over(sky[first - top :], brightest).min() >= _DARKER:
        return 0.0
    airlight = quantile(sky, _BRIGHTEST)
    if not airlight > 0.0:
        return 0.0
    above = _over(sky[first - top :], airlight)
    if above.min() >= _DARKER:
        return 0.0
    depth = -np.log1p(-np.clip(above, 0.0, _DARKER)) / extinction
    ends = np.ceil(camera.row_distance / np.maximum(depth, 1e-3) - margin + horizon.row).astype(np.int64)
    ends = np.minimum(np.where(above < _DARKER, ends, ground), camera.height)
    below = _block_means(pixels, ground, max(int(ends.max()), ground), per_block, aside)
    rows, counted = np.arange(ground, ground + len(below))[:, None], ends - ground
    brighter = ((rows < ends) & (below > airlight * (above + _BRIGHTER))).sum(axis=0)
    return float(((counted >= _LEAST_ROWS) & (brighter > 0.5 * counted)).mean())


def _over(sky: NDArray[np.float32], airlight: float) -> NDArray[np.float64]:
    """Mean of each block of some rows over the airlight (blocks,) [-]."""
    return np.asarray((sky / airlight).mean(axis=0, dtype=np.float64))


@kernel
def _block_means(
    image: LinearPixels, first: int, end: int, width: int, blocks: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Mean luminance of rows of some blocks of so many columns (rows, blocks)."""
    means, line = np.empty((end - first, blocks.size), np.float32), np.empty(width, np.float32)
    for row in range(first, end):
        for i in range(blocks.size):
            row_luminance(image.pixels[:, blocks[i] * width : (blocks[i] + 1) * width], image.tables, row, line)
            total = 0.0
            for value in line:
                total += float(value)
            means[row - first, i] = total / width
    return means
