"""When strips of an image are no road in fog though some fog fits them, and when a frame needs all hypotheses."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.vision.light.luminance import linear_table
from fogsim.vision.strips.joint_fit import EVERY, JointFit
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import StripGeometry

Floats = NDArray[np.float64]

_PERIOD = 0.5
"""Time after which all hypotheses are tried again [s]."""

_WORSE, _FEWER = 1.3, 0.05
"""How many times as large the misfit may be as in the last full look, and by how much smaller the share of bins in use,
for even fog still to suffice [-]."""


@dataclass(frozen=True, slots=True)
class Left:
    """What a full look has left: albedos, and even fog with its misfit and its share of bins in use [-]."""

    time: float = -math.inf
    albedos: tuple[int, ...] = EVERY
    misfit: float = -math.inf
    used: float = math.inf

    def is_due(self, time: float) -> bool:
        """Whether all hypotheses are to be tried in an image of a time [s]."""
        return not self.time < time < self.time + _PERIOD

    def suffices(self, fit: JointFit) -> bool:
        """Whether even fog still explains the road about as well as in the full look."""
        used = np.count_nonzero(fit.used) / fit.used.size
        return fit.misfit <= _WORSE * self.misfit and bool(used >= self.used - _FEWER)


def left_by(time: float, fit: JointFit) -> Left:
    """What a full look at a time [s] has left whose fit is of even fog without shade."""
    return Left(time, fit.albedos, fit.misfit, float(fit.used.mean()))


LEAST_CONTRAST = 0.08
"""Least contrast of the road to the airlight for fog to show [-]."""

MAX_MISFIT = 4.0
"""Mean square of the standardised residuals beyond which the curve is none of Koschmieder's [-]."""

CLEAR = OPTICAL_DEPTH_AT_VISIBILITY / 300.0
"""Extinction that an estimate which may as well be none must surely be below to say "little fog" [1/m]."""

MAX_SCATTER = 0.22
"""Scatter across the own lane relative to its contrast to the airlight, beyond which it is no road [-]: marks, shadows
and texture make at most 0.15, boards, stripes and writing at least 0.3."""

_STRAIGHT, _LEAST_RISE = 0.018, 10.0
"""Deviation from a straight line, relative to that line's rise, below which a curve is a ramp [-], and least rise for
that to be seen [pixel values of 8 bits]. Fog of whatever density leaves at least 0.028: its curve is hollow near the
camera and level at the horizon."""


def no_road(fit: JointFit, curves: StripCurves, geometry: StripGeometry, camera: Camera) -> str:
    """Say why strips can be no road in fog; empty if they can."""
    if is_scattered(fit, curves, geometry):
        return "what is ahead is too patchy for a road"
    return "it brightens evenly from row to row, as no fog does" if is_ramp(curves, geometry, camera) else ""


def is_scattered(fit: JointFit, curves: StripCurves, geometry: StripGeometry) -> bool:
    """Whether single pixels across the own lane differ as much among themselves as road and airlight do."""
    return _is_scattered(
        fit.used[0], geometry.distance, curves.scatter[0], 1.5, fit.extinction, fit.airlight - fit.road
    )


@kernel
def _is_scattered(
    used: NDArray[np.bool_], distance: Floats, scatter: Floats, depth: float, extinction: float, contrast: float
) -> bool:
    near = used & (extinction * distance < depth)
    return bool(near.any() and np.median(scatter[near]) > MAX_SCATTER * contrast)


def is_ramp(curves: StripCurves, geometry: StripGeometry, camera: Camera) -> bool:
    """Whether the own lane's pixel values rise evenly from row to row, as drawn backgrounds do and fog does not."""
    table = linear_table(camera.response, camera.bits, camera.black_level)
    return _is_straight(curves.luminance[0], curves.variance[0], geometry.below, table)


@kernel
def _is_straight(luminance: Floats, variance: Floats, below: Floats, table: NDArray[np.float32]) -> bool:
    """`is_ramp` of rows (n,) where their variance is not 0."""
    rows, values, count = np.empty(below.size), np.empty(below.size), 0
    for i in range(below.size):
        if variance[i] > 0.0:
            rows[count], values[count] = below[i], _pixel_value(luminance[i], table) * (255.0 / (table.size - 1))
            count += 1
    if count < 3:
        return False
    rows, values = rows[:count] - rows[:count].mean(), values[:count] - values[:count].mean()
    slope = (rows * values).sum() / (rows * rows).sum()
    rise = -slope * (rows.max() - rows.min())
    return bool(rise > _LEAST_RISE and math.sqrt(((values - slope * rows) ** 2).mean()) < _STRAIGHT * rise)


@kernel
def _pixel_value(luminance: float, table: NDArray[np.float32]) -> float:
    """Pixel value of a luminance, linear between those of a table that never falls."""
    low, high = 0, table.size - 1
    if luminance >= table[high]:
        return float(high)
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle] <= luminance:
            low = middle
        else:
            high = middle
    return low + max(luminance - float(table[low]), 0.0) / (float(table[low + 1]) - float(table[low]))
