"""The glow about tail lamps as a table: what `night_glow` is told of the formula of lamps' glow in fog."""

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.glow import glow
from fogsim.atmosphere.lamps.lobes import light_origins, mean_intensity
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.estimators.night.tail_glow import ANGLES, DEPTHS
from fogsim.values.light import Beam

Floats = NDArray[np.float64]

_DIRECTIONS = np.radians((-80.0, -45.0, -30.0, -20.0, -10.0, -5.0, 0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 80.0))
_ELEVATIONS = np.radians((-30.0, -15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 30.0))
_SHARES = (
    ((0.012, 0.03, 0.06, 0.12, 0.35, 0.9, 1.0), (0.03, 0.12, 0.3, 0.7, 1.0)),
    ((0.005, 0.03, 0.08, 0.2, 0.75, 0.92, 1.0), (0.02, 0.1, 0.25, 0.75, 1.0)),
)
"""Least intensities aside and above, from the outermost direction inward, of what UNECE R148 asks of tail and stop
lamps, and of rear fog lamps, over that along the axis; beyond its grids, what its fields of visibility ask."""


def tail_glow_table() -> dict[str, NDArray[np.float32]]:
    """Compute the table, which `tools/make_tail_glows.py` writes.

    Returns
    -------
    dict of str to float32 array
        ``plain`` (fogs, t, g): glow about a lamp that shines alike in all directions, times R² over its intensity, for
        `DEPTHS` and `ANGLES`; ``shone`` (fogs, 2, t, g, sides): mean intensity of tail and stop lamps and of rear fog
        lamps over the axial one, in what is seen of the glow at each place about them.
    """
    plain = [glow(DEPTHS[:, None], ANGLES, droplets) for droplets in Droplets]
    shone = [[_shone(aside, above, droplets) for aside, above in _SHARES] for droplets in Droplets]
    return {"plain": np.array(plain, np.float32), "shone": np.array(shone, np.float32)}


def _shone(aside: tuple[float, ...], above: tuple[float, ...], droplets: Droplets) -> Floats:
    """Mean intensity (t, g, SIDES) over the axial one of what is seen of a lamp's glow straight behind it."""
    across = np.array([*aside, *aside[-2::-1]])
    upward = np.array([*above, *above[-2::-1]])
    lobe = Beam(_DIRECTIONS, _ELEVATIONS, upward[:, None] * across)
    origins, straight = light_origins(droplets), np.zeros(1)
    mean = mean_intensity(lobe, straight, straight, droplets)[0]
    row = np.clip(np.interp(np.log(DEPTHS), origins.log_depth, np.arange(len(mean))), 0.0, len(mean) - 1.001)
    low, part = row.astype(np.int64), (row % 1.0)[:, None, None]
    at_depth = mean[low] * (1.0 - part) + mean[low + 1] * part
    column = np.interp(np.log(ANGLES), np.log(origins.angle), np.arange(len(origins.angle)))
    column = np.clip(column, 0.0, len(origins.angle) - 1.001)
    left, rest = column.astype(np.int64), (column % 1.0)[:, None]
    return np.asarray(at_depth[:, left] * (1.0 - rest) + at_depth[:, left + 1] * rest)
