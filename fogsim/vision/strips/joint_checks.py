"""When strips of an image are no road in fog though some fog fits them, and when a frame needs all hypotheses."""

import math
from dataclasses import dataclass

import numpy as np

from fogsim.core.linear_algebra import matrix_product
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.vision.light.luminance import linear_table
from fogsim.vision.light.medians import median
from fogsim.vision.strips.joint_fit import EVERY, JointFit
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import StripGeometry

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
        return fit.misfit <= _WORSE * self.misfit and float(fit.used.mean()) >= self.used - _FEWER


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
    near = fit.used[0] & (fit.extinction * geometry.distance < 1.5)
    if not near.any():
        return False
    return median(curves.scatter[0][near]) > MAX_SCATTER * (fit.airlight - fit.road)


def is_ramp(curves: StripCurves, geometry: StripGeometry, camera: Camera) -> bool:
    """Whether the own lane's pixel values rise evenly from row to row, as drawn backgrounds do and fog does not."""
    seen = curves.variance[0] > 0
    if int(seen.sum()) < 3:
        return False
    table = linear_table(camera.response, camera.bits, camera.black_level)
    values = np.interp(curves.luminance[0][seen], table, np.arange(table.size)) * (255.0 / (table.size - 1))
    rows = geometry.below[seen] - geometry.below[seen].mean()
    slope = float(matrix_product(rows, values)) / float(matrix_product(rows, rows))
    rest = values - values.mean() - slope * rows
    rise = -slope * float(np.ptp(rows))
    return rise > _LEAST_RISE and float(np.sqrt(np.mean(rest**2))) < _STRAIGHT * rise
