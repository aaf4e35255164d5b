"""Fog from strips of a grown road region: what stands in the corrected zhu2015 for the row where the region ends."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.region.road_image import CannotTellError
from fogsim.vision.strips.agreeing_strips import MODEL_DEVIATION, fit_agreeing
from fogsim.vision.strips.joint_checks import no_road
from fogsim.vision.strips.joint_fit import JointFit, JointPrior
from fogsim.vision.strips.sky import Sky, sky_above
from fogsim.vision.strips.strip_curves import StripCurves, strip_curves, without_clipped
from fogsim.vision.strips.strip_geometry import StripGeometry, strip_geometry

COVERED = 0.6
"""Share of a bin that the region must hold for it to be road [-]."""

FIRST_BINS, FIRST_COVERED = 12, 0.5
"""Nearest bins of a strip, and the share of them that must be road: a region that gets beside the road farther away,
where the fog hides its edge, has found the verge [-]."""

SKY_DEVIATION = 0.005
"""Relative deviation of the airlight at the horizon from the sky above it [-]."""

CLIPPED_LEVEL, CLIPPED_DEVIATION = 1.03, 0.1
"""How much brighter than it looks a clipped sky is taken to be, and its deviation upward, relative to it [-]."""

MIN_CONTRAST = 0.08
"""Least contrast of the road to the airlight for fog to show [-]."""

MAX_MISFIT = 4.0
"""Mean square of the standardised residuals beyond which the curve is none of Koschmieder's [-]."""

CLEAR = OPTICAL_DEPTH_AT_VISIBILITY / 300.0
"""Extinction that an estimate which may as well be none must surely be below [1/m]."""


def fitted_strips(
    pixels: LinearPixels, region: NDArray[np.uint8], first_row: int, camera: Camera, horizon: Horizon, free: float
) -> tuple[JointFit, float]:
    """Fit fog to strips of a region below a horizon.

    Parameters
    ----------
    pixels : LinearPixels
        The whole image, level.
    region : (rows, cols) uint8
        Non-zero on road.
    first_row : int
        Row of the whole image that is the region's row 0.
    camera : Camera
        The told calibration.
    horizon : Horizon
        Where the horizon was found.
    free : float
        Depth up to which the own lane is free of a tracked vehicle [m].

    Returns
    -------
    tuple of JointFit and float
        The fit, and the standard deviation of its extinction [1/m].

    Raises
    ------
    CannotTellError
        If the road is hidden, too bright, or follows no Koschmieder's law, or the fog does not show.
    """
    tilt = math.atan((camera.principal_point[1] - horizon.row) / camera.focal_length)
    level = replace(camera, pitch=tilt, roll=0.0)
    sky = sky_above(pixels, level, 3.0 * horizon.standard_deviation + 2.0)
    if sky is None:
        raise CannotTellError("no sky is seen above the horizon")
    geometry = strip_geometry(level, max(1.0, horizon.standard_deviation))
    curves = strip_curves(pixels, geometry, sky.noise, level, free)
    curves = _on_road(without_clipped(curves) if sky.is_clipped else curves, geometry, region, first_row)
    fit = fit_agreeing(curves, geometry, _prior(sky, horizon))
    if fit is None:
        raise CannotTellError("no road is seen")
    _check(fit, sky)
    if why := no_road(fit, curves, geometry, level):
        raise CannotTellError(why)
    return fit, math.hypot(fit.extinction_deviation, MODEL_DEVIATION * fit.extinction)


def _on_road(curves: StripCurves, geometry: StripGeometry, region: NDArray[np.uint8], first_row: int) -> StripCurves:
    """Leave out bins that are not on the region, and strips that begin beside it."""
    rows = (geometry.first + geometry.last) // 2 - first_row
    inside = np.cumsum(np.pad(region[rows] != 0, ((0, 0), (1, 0))), axis=1, dtype=np.int32)
    cols = region.shape[1]
    left = np.clip(np.ceil(geometry.left).astype(np.int64), 0, cols)
    right = np.clip(np.floor(geometry.right).astype(np.int64) + 1, left, cols)
    at = np.arange(rows.size)
    share = (inside[at, right] - inside[at, left]) / np.maximum(right - left, 1)
    road = (share >= COVERED) & (curves.variance > 0)
    for strip in range(1, len(road)):
        nearest = np.flatnonzero(curves.variance[strip] > 0)[:FIRST_BINS]
        if nearest.size == 0 or road[strip, nearest].mean() < FIRST_COVERED:
            road[strip] = False
    return replace(curves, variance=np.where(road, curves.variance, 0.0))


def _prior(sky: Sky, horizon: Horizon) -> JointPrior:
    airlight = sky.luminance
    below, above = (math.hypot(SKY_DEVIATION * airlight, apart) for apart in (sky.deviation, sky.upward))
    if sky.is_clipped:
        airlight *= CLIPPED_LEVEL
        below, above = below + airlight - sky.luminance, CLIPPED_DEVIATION * airlight
    return JointPrior(airlight, below, above, shift=0.0, shift_deviation=horizon.standard_deviation)


def _check(fit: JointFit, sky: Sky) -> None:
    if fit.road >= (1.0 - MIN_CONTRAST) * fit.airlight or fit.road >= 0.98 * sky.luminance:
        raise CannotTellError("the road is nearly as bright as the airlight, or brighter")
    if fit.misfit > MAX_MISFIT:
        raise CannotTellError("the road fades into the airlight, but not as Koschmieder's law has it")
    deviation = fit.extinction_deviation
    if fit.extinction < 2.0 * deviation and fit.extinction + 2.0 * deviation > CLEAR:
        raise CannotTellError("the extinction is not observable: too little road is seen")
