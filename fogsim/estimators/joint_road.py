"""Fog from the luminance of the road and the sky, fitted jointly with the horizon and an albedo that may wander."""

import math
from collections import deque

import numpy as np

from fogsim.errors import InputError
from fogsim.estimators.image_check import checked_count, checked_image
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import LeadMeasurement, Observation
from fogsim.vision.agreeing_strips import fit_agreeing
from fogsim.vision.horizon import PITCH_DEVIATION, Horizon, calibrated_horizon, levelled, weighed
from fogsim.vision.joint_checks import no_road
from fogsim.vision.joint_fit import JointFit, JointPrior
from fogsim.vision.joint_prior import joint_prior
from fogsim.vision.road_lines import meeting_lines
from fogsim.vision.strips import (
    LinearPixels,
    Sky,
    StripCurves,
    StripGeometry,
    above_bonnet,
    linear_pixels,
    mean_curves,
    sky_above,
    strip_curves,
    strip_geometry,
    without_clipped,
    without_rows_below,
)

MIN_COLS, MIN_ROWS = 32, 16
"""A road narrower than this, or lower below its horizon, shows no curve [px]."""

MIN_AIRLIGHT = 6.0
"""Sky darker than this is no day [linear grey levels]."""

MIN_CONTRAST = 0.08
"""Least contrast of the road to the airlight for fog to show [-]."""

MAX_MISFIT = 4.0
"""Mean square of the standardised residuals beyond which the curve is none of Koschmieder's [-]."""

MIN_USED = 0.4
"""Least share of the own lane's bins, as far as it is free, that must fit [-]."""

SURE_OF_FOG = 2.0
"""Least k in its standard deviations for an estimate of dense fog [-]."""

CLEAR = OPTICAL_DEPTH_AT_VISIBILITY / 300.0
"""Extinction that an unsure estimate must surely be below to say "little fog" [1/m]."""

MODEL_DEVIATION = 0.02
"""Relative deviation of k by what the model leaves out: a lens that darkens its corners by 5 to 10 %, which alone makes
2 to 5 %, marks, rounding, a road that is not quite flat [-]."""

RANGE_MARGIN = 0.5
"""By how much a lead vehicle's foot may be nearer than its range says [m]."""


class JointRoad:
    """Joint fit of extinction, airlight, horizon and wandering albedo to strips of road and rows of sky.

    The mean luminance of each row of three strips of road (the own lane's middle and those of both neighbours) follows
    Koschmieder's law L = A − (A − R(d)) e^(−kd) along the slant path d = λ √(1 + x² + y²) / (v − v_h). Fitted are k, A
    (prior: the sky), v_h (prior: the calibration) and R(d), which is a constant of each strip plus patches of its own
    plus a smooth drift that the strips share. Patches and drift correlate the rows, so the fit is generalised least
    squares by a Kalman filter along the road; how strong they are is averaged over by evidence. Rows that do not fit
    are left out, and what lies behind an obstacle on the road with them; a tracked lead vehicle hides its lane.

    Own method: no paper describes it. It stands on Hautière et al. 2006 and negru2013 for the geometry of fog on a
    flat road. Daytime only; the road must be darker than the airlight.

    Parameters
    ----------
    camera : Camera
        The calibration as the vehicle was told it.
    pitch_deviation : float
        Standard deviation of the true pitch about the told one [rad].
    frames : int
        How many of the last frames' curves are averaged; 1 lets every frame stand alone. More average patches out,
        and lag behind a change of fog by half as many frames.

    Raises
    ------
    InputError
        If `frames` is not a whole number ≥ 1 or the deviation is not positive.
    """

    method = "joint_road"

    def __init__(self, camera: Camera, *, pitch_deviation: float = PITCH_DEVIATION, frames: int = 1) -> None:
        if not (math.isfinite(pitch_deviation) and pitch_deviation > 0):
            raise InputError(f"pitch_deviation must be a positive angle in radians, got {pitch_deviation!r}")
        self._camera = camera
        self._horizon = calibrated_horizon(camera, pitch_deviation)
        self._impossible = _impossible(camera)
        self._geometry = strip_geometry(camera, max(1.0, self._horizon.standard_deviation))
        self._earlier: deque[tuple[StripCurves, Sky]] = deque(maxlen=checked_count("frames", frames, 1) - 1)

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._earlier.clear()

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one image, and the range of the lead vehicle if it is tracked.

        Parameters
        ----------
        observation : Observation
            Its image and its lead are used.

        Returns
        -------
        Estimate
            Diagnostics: ``horizon_row`` and ``told_horizon_row`` [px], ``inflection_row`` [px], ``airlight`` and
            ``road`` [linear grey levels, 0 … 255], ``misfit`` [-], ``band`` (left, right, top, bottom) of the own
            lane's rows in use [px]; or ``reason``.

        Raises
        ------
        InputError
            If the image is not of the camera's bit depth, not grey or colour, or not of the told camera's size.
        """
        image = checked_image(observation.image, self._camera)
        found: dict[str, object] = {
            "horizon_row": self._camera.horizon_row,
            "told_horizon_row": self._camera.horizon_row,
        }
        if self._impossible:
            return Estimate.invalid(self.method, self._impossible, **found)
        pixels = linear_pixels(levelled(image, self._camera), self._camera)
        sky = sky_above(pixels, self._camera, 3.0 * self._horizon.standard_deviation + 2.0)
        if sky is None or sky.luminance < MIN_AIRLIGHT:
            return Estimate.invalid(
                self.method, "too dark above the horizon, or no sky: this is a daytime method", **found
            )
        prior = joint_prior(sky, self._camera, self._seen_horizon(pixels))
        fit = self._fitted(pixels, sky, prior, _free_road(observation.lead))
        if isinstance(fit, str):
            return Estimate.invalid(self.method, fit, **found)
        return self._estimate(fit, found)

    def _fitted(self, pixels: LinearPixels, sky: Sky, prior: JointPrior, free: float) -> JointFit | str:
        """Fit of the road that is free up to a depth, or why there is none that is to be believed.

        What stands in the own lane hides, further on, the neighbours' lanes too: they are read again without it.
        """
        lowest = above_bonnet(pixels, self._camera, sky.luminance)
        latest, fit = self._read(pixels, sky, prior, lowest, free)
        doubt = "too little road is seen" if fit is None else self._doubt(fit, sky, latest[0], free)
        obstacle = math.inf if fit is None else _obstacle(fit, self._geometry)
        if not doubt and obstacle < free:
            latest, fit = self._read(pixels, sky, prior, lowest, obstacle)
            doubt = "too little road is seen" if fit is None else self._doubt(fit, sky, latest[0], obstacle)
        self._earlier.append(latest)
        return doubt if fit is None or doubt else fit

    def _read(
        self, pixels: LinearPixels, sky: Sky, prior: JointPrior, lowest: int, free: float
    ) -> tuple[tuple[StripCurves, Sky], JointFit | None]:
        """Curves of the strips, and the fit to them and those of the earlier frames."""
        curves = strip_curves(pixels, self._geometry, sky.noise, self._camera, free)
        curves = without_rows_below(curves, self._geometry, lowest)
        latest = (without_clipped(curves) if sky.is_clipped else curves, sky)
        return latest, fit_agreeing(mean_curves((*self._earlier, latest)), self._geometry, prior)

    def _seen_horizon(self, pixels: LinearPixels) -> Horizon:
        """Weigh the told horizon with the point in which the road's lines meet."""
        point = meeting_lines(pixels, self._camera, self._horizon)
        return self._horizon if point is None else weighed(self._horizon, point.horizon)

    def _doubt(self, fit: JointFit, sky: Sky, curves: StripCurves, free: float) -> str:
        """Say why a fit is not to be believed; empty if it is."""
        if fit.road >= (1.0 - MIN_CONTRAST) * fit.airlight or fit.road >= 0.98 * sky.luminance:
            return "the road is nearly as bright as the airlight, or brighter"
        if fit.misfit > MAX_MISFIT:
            return "the road fades, but not as Koschmieder's law has it"
        near = (curves.variance[0] > 0) & (self._geometry.distance < min(free, 1.5 / max(fit.extinction, 0.01)))
        if near.sum() < MIN_ROWS // 2 or fit.used[0][near].mean() < MIN_USED:
            return "the road ahead is hidden, or is none"
        if why := no_road(fit, curves, self._geometry, self._camera):
            return why
        upper = fit.extinction + 2.0 * fit.extinction_deviation
        if fit.extinction < SURE_OF_FOG * fit.extinction_deviation and upper > CLEAR:
            return "the extinction is not observable: too little road is seen"
        return ""

    def _estimate(self, fit: JointFit, found: dict[str, object]) -> Estimate:
        horizon = self._camera.horizon_row + fit.shift
        rows = self._geometry.first[fit.used[0]]
        left, right = self._geometry.left[0][fit.used[0]], self._geometry.right[0][fit.used[0]]
        found |= {"horizon_row": horizon, "airlight": fit.airlight, "road": fit.road, "misfit": fit.misfit}
        found["band"] = (int(left.min()), int(right.max()), int(rows.min()), int(self._geometry.last[0]))
        extinction = max(fit.extinction, 0.0)
        if extinction > 0:
            found["inflection_row"] = horizon + 0.5 * extinction * self._camera.row_distance
        deviation = math.hypot(fit.extinction_deviation, MODEL_DEVIATION * extinction)
        return Estimate(self.method, extinction, deviation, diagnostics=found)


def _impossible(camera: Camera) -> str:
    """Say why a camera can never show a foggy road; empty if it can."""
    if abs(camera.roll) > math.pi / 4:
        return "the camera lies on its side or is upside-down"
    if not 4.0 <= camera.horizon_row <= camera.height - 1:
        return f"the horizon (row {camera.horizon_row:.1f}) is outside the image"
    if camera.height - 1 - camera.horizon_row < MIN_ROWS or camera.width < MIN_COLS:
        return "the image is too small to show a curve"
    return ""


def _obstacle(fit: JointFit, geometry: StripGeometry) -> float:
    """Depth at which something stands in the own lane that the fit has found to hide what is behind [m]."""
    if not fit.hidden.any():
        return math.inf
    road = fit.used[0] & (geometry.distance < float(geometry.distance[np.argmax(fit.hidden)]))
    return float(geometry.distance[road].max()) if road.any() else math.inf


def _free_road(lead: LeadMeasurement | None) -> float:
    """Depth up to which the own lane is free of the tracked vehicle [m]."""
    if lead is None or not math.isfinite(lead.distance):
        return math.inf
    return max(lead.distance - RANGE_MARGIN, 1.0)
