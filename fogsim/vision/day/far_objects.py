"""What stands at the horizon against fog that is claimed: it can be darker than the airlight only if it is near."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.light.luminance import linear_luminance
from fogsim.vision.lines.horizon import Horizon

_BLOCKS = 80
"""Groups of columns that are judged, across the image."""

_ABOVE = 5
"""Rows above the horizon that are looked at [px]: at the height of the camera's eye, where no crown overhangs."""

_SKY_HEIGHT, _BRIGHTEST = 0.5, 0.9
"""Rows above the horizon from which the airlight is taken, over the image's, and the quantile of their light [-]."""

_OWN_LANE = 0.2
"""Columns to either side of the way ahead that do not count, over the image's: vehicles have dark windows above bright
bodies [-]."""

_DARKER, _BRIGHTER = 0.8, 0.15
"""Light over the airlight below which something stands there, and by how much the ground before it must be brighter to
show that it stands farther away [-]."""

_LEAST_ROWS = 3
"""Rows of ground that show that."""

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
    if first < 0 or last <= top or ground + _LEAST_ROWS >= camera.height or not extinction > 0.0:
        return 0.0
    light = linear_luminance(level[top:], camera.response, camera.bits, camera.black_level)
    per_block = max(light.shape[1] // _BLOCKS, 1)
    count = light.shape[1] // per_block
    blocks = light[:, : count * per_block].reshape(light.shape[0], count, per_block).mean(axis=2)
    aside = np.abs((np.arange(count) + 0.5) * per_block - camera.principal_point[0]) > _OWN_LANE * camera.width
    blocks = blocks[:, aside]
    airlight = float(np.quantile(blocks[: last - top], _BRIGHTEST)) if aside.any() else 0.0
    if not airlight > 0.0:
        return 0.0
    blocks = blocks / airlight
    above, below = blocks[first - top : last - top].mean(axis=0), blocks[ground - top :]
    depth = -np.log1p(-np.clip(above, 0.0, _DARKER)) / extinction
    foot = camera.row_distance / np.maximum(depth, 1e-3)
    rows = np.arange(below.shape[0])[:, None] + ground - horizon.row
    before = (rows < foot - margin) & (below > above + _BRIGHTER)
    counted = (rows < foot - margin).sum(axis=0)
    seen = (above < _DARKER) & (counted >= _LEAST_ROWS) & (before.sum(axis=0) > 0.5 * counted)
    return float(seen.mean())
