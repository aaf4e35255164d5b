"""Fog from the luminance of the road in a single daytime image (Negru & Nedevschi, ICCP 2013)."""

import math
from collections import deque
from dataclasses import replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.negru2013_band import SeenBand, fog_slope, road_band, road_curve
from fogsim.parameters import Range, checked_parameters
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import Observation
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.medians import median
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.deriche import CannyDeriche
from fogsim.vision.lines.edges import Edges
from fogsim.vision.lines.gradient_lines import consensus_vanishing_point
from fogsim.vision.lines.horizon import PITCH_DEVIATION, Horizon, PitchDeviation, calibrated_horizon, weighted_mean
from fogsim.vision.lines.road_lines import road_vanishing_point
from fogsim.vision.lines.vanishing_point import VanishingPoint
from fogsim.vision.region.inflection import FogModel, best_inflection, printed_inflection
from fogsim.vision.region.profile import RoadCurve, band_profile
from fogsim.vision.region.road_image import MIN_CONTRAST, MIN_ROWS, SATURATED, CannotTellError, RoadImage, road_image
from fogsim.vision.strips.joint_checks import CLEAR, LEAST_CONTRAST, MAX_MISFIT, no_road
from fogsim.vision.strips.joint_fit import JointFit, fit_jointly
from fogsim.vision.strips.joint_prior import joint_prior
from fogsim.vision.strips.sky import sky_above
from fogsim.vision.strips.strip_curves import lowest_road_row, strip_curves, without_clipped
from fogsim.vision.strips.strip_geometry import band_geometry

MAX_ASIDE = 0.1
"""Share of the image's width by which a clear road may lie beside the vanishing column [-]."""

MIDDLE, LEAST_MIDDLE = 0.3, 200.0
"""How far to either side of the vanishing column a band is sought, a share of the image's width and at least [px]."""

MAX_ABOVE = 0.05
"""Share of the image's height that a clear road's region may reach above the assumed horizon [-]."""

NEAR_HORIZON = 4.0  # [px] a region that ends this close below the horizon has seen the whole road
REACH = math.radians(4.0)  # [rad] about the assumed vanishing point, within which lines of the road may pass
ALBEDO_DEVIATION = 0.015  # [-] of k by slow changes of the road's reflectance, which one row's inflection does not show
MAX_RESIDUAL = 0.12  # [-] of the fitted contrast: more is no curve of Koschmieder's
MIN_USED = 0.6  # [-] least share of the band's rows that must fit
SURE_OF_FOG = 4.5  # [-] least k in its standard deviations
USUAL_HEIGHT = 1.3  # [m] of a camera, for which the lengths of the fit are meant
MODEL_DEVIATION = 0.02  # [-] of k by what the model leaves out: dark corners, marks, a road that is not quite flat


@checked_parameters
class Negru2013:
    """Inflection point of the road's luminance curve (Negru & Nedevschi 2013, section IV).

    Edges, a region grown upward from the road, the widest vertical band that crosses it, the median of each of its
    rows, the row of steepest change whose model fits best: the extinction is k = 2 (v_i − v_h) / λ.

    As published (`as_published`), the horizon is the vanishing point of the Hough lines that most agree on one, of the
    last `horizon_frames` frames that with the highest score (that of the calibration until there is one), k is read
    off the inflection's row, and of the last `inflection_frames` frames the one whose curve fits best counts.
    `printed_signs` also takes eqs. 17 and 18 as they are printed, whose signs are wrong for rows that count downward
    (they give A = 162 where the truth is 200, and mostly choose a wrong row).

    Corrected (the default), lines are fitted within the pixel and the frame's own vanishing point is weighed against
    the calibration; luminance is linear, because Koschmieder's law is; the fog's own gradient draws no edges; the band
    is of limited width and near the vanishing point, where the road is; and k, R and A are those of least squares over
    the whole curve, instead of those that one row gives. Frames stand alone: averaging is the fusion's job, with the
    uncertainties.

    A region that reaches the horizon without an inflection gives k = 0 with the detection limit as its deviation;
    whatever else stands in the way gives an invalid estimate with the reason in its diagnostics. Daytime only, flat
    road, road darker than the airlight.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    as_published : bool
        Follow the paper where it is less accurate than what is known today.
    printed_signs : bool
        With `as_published`: take its eqs. 17 and 18 with their wrong signs.
    vanishing_point : bool
        Look for the vanishing point of the road's lines; else the calibration alone gives the horizon.
    horizon_frames, inflection_frames : int
        With `as_published`: frames of the temporal schemes.
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    method = "negru2013"

    def __init__(
        self,
        camera: Camera,
        *,
        as_published: bool = False,
        printed_signs: bool = False,
        vanishing_point: bool = True,
        horizon_frames: Annotated[int, Range(1, 100_000)] = 500,
        inflection_frames: Annotated[int, Range(1, 10_000)] = 5,
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
    ) -> None:
        self._check = ObservationCheck(camera)
        # The fit takes the distances of a camera of the usual height: flat roads scale with it.
        self._camera, self._usual = camera, replace(camera, mount_height=USUAL_HEIGHT)
        self._assumed = calibrated_horizon(camera, pitch_deviation)
        self._as_published, self._looks_for_lines = as_published, vanishing_point
        self._model = printed_inflection if printed_signs else best_inflection
        self._detector = CannyDeriche()
        self._points: deque[VanishingPoint] = deque(maxlen=int(horizon_frames))
        self._models: deque[FogModel] = deque(maxlen=int(inflection_frames))

    def reset(self) -> None:
        """Forget the vanishing points and inflections of earlier frames."""
        self._check.reset()
        self._points.clear()
        self._models.clear()

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one image.

        Parameters
        ----------
        observation : Observation
            Its image is all that is used.

        Returns
        -------
        Estimate
            Diagnostics: ``horizon_row`` and ``inflection_row`` [px], ``band`` (left, right, top, bottom) [px],
            ``airlight`` and ``road`` [linear grey levels, 0 … 255], ``profile`` (n,) of the band's rows; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.image_of(observation)
        diagnostics: dict[str, object] = {"horizon_row": self._camera.horizon_row}
        try:
            road, pixels = self._road(image)
            slope = fog_slope(road, self._assumed)
            edges = self._edges(road, slope)
            horizon = self._horizon(edges, road, pixels)
            diagnostics["horizon_row"] = horizon.row
            band = road_band(road, edges, slope, self._camera)
            diagnostics["band"] = (band.left, band.right, band.top + road.first_row, band.bottom + road.first_row)
            here = replace(band, left=band.left - road.first_column, right=band.right - road.first_column)
            seen = SeenBand(road, pixels, horizon, band, band_profile(road.luminance, here))
            diagnostics["profile"] = seen.profile
            return self._published(seen, diagnostics) if self._as_published else self._corrected(seen, diagnostics)
        except CannotTellError as reason:
            return Estimate.invalid(self.method, str(reason), **diagnostics)

    def _road(self, image: NDArray[np.uint8] | NDArray[np.uint16]) -> tuple[RoadImage, LinearPixels]:
        """Road from a little above the horizon down to the image's bottom or (corrected) the own bonnet."""
        if self._as_published:
            road = road_image(image, self._camera, self._assumed)
            return road, linear_pixels(road.level, self._camera)
        # A band may lie in the middle only: the verges would but cost time.
        centre, reach = self._camera.principal_point[0], max(MIDDLE * self._camera.width, LEAST_MIDDLE)
        columns = max(math.ceil(centre - reach), 0), min(math.floor(centre + reach) + 1, self._camera.width)
        road = road_image(image, self._camera, self._assumed, columns)
        pixels = linear_pixels(road.level, self._camera)
        lowest = lowest_road_row(pixels, self._camera, road.airlight)
        luminance = road.luminance[: lowest + 1 - road.first_row]
        return replace(road, luminance=luminance, road=median(luminance[-1])), pixels

    def _published(self, seen: SeenBand, diagnostics: dict[str, object]) -> Estimate:
        """Fog from the row of the inflection, of the last frames the one whose curve fits best."""
        horizon, curve = seen.horizon, road_curve(seen, self._camera)
        model = _credible(self._inflection(curve), curve, seen.road)
        if model is None:
            self._check_clear_view(seen)
            # An inflection needs a row on either side: the topmost that could have been seen is the second.
            rows = max(float(curve.below_horizon[0]), 1.0) + 1.0
            limit = 2.0 / self._camera.row_distance * math.hypot(rows, horizon.standard_deviation)
            return Estimate(self.method, 0.0, limit, diagnostics=diagnostics)
        self._models.append(model)
        model = min(self._models, key=lambda m: m.residual / max(m.airlight - m.road, 1e-9))
        by_horizon = model.horizon_sensitivity * horizon.standard_deviation
        deviation = math.hypot(model.standard_deviation, by_horizon, ALBEDO_DEVIATION * model.extinction)
        inflection = horizon.row + 0.5 * model.extinction * self._camera.row_distance
        found = {"inflection_row": inflection, "airlight": model.airlight, "road": model.road}
        return Estimate(self.method, model.extinction, deviation, diagnostics={**diagnostics, **found})

    def _corrected(self, seen: SeenBand, diagnostics: dict[str, object]) -> Estimate:
        """Fog from all rows of the band, whose albedo may wander, and the sky."""
        fit = self._fit(seen)
        scale = USUAL_HEIGHT / self._camera.mount_height
        k = scale * fit.extinction
        deviation = math.hypot(scale * fit.extinction_deviation, MODEL_DEVIATION * k)
        found = {"airlight": fit.airlight, "road": fit.road, "horizon_row": self._camera.horizon_row + fit.shift}
        if k < SURE_OF_FOG * deviation:
            self._check_clear_view(seen)
            if k + SURE_OF_FOG * deviation > CLEAR:
                raise CannotTellError("the extinction is not observable: too little road is seen")
            return Estimate(self.method, 0.0, math.hypot(max(k, 0.0), deviation), diagnostics={**diagnostics, **found})
        found["inflection_row"] = found["horizon_row"] + 0.5 * k * self._camera.row_distance
        return Estimate(self.method, k, deviation, diagnostics={**diagnostics, **found})

    def _fit(self, seen: SeenBand) -> JointFit:
        """Fit of the band, in distances of a camera of the usual height."""
        camera, pixels, band, horizon = self._usual, seen.pixels, seen.band, seen.horizon
        sky = sky_above(pixels, camera, 3.0 * self._assumed.standard_deviation + 2.0)
        if sky is None:
            raise CannotTellError("no sky is seen above the horizon")
        rows = (band.top + seen.road.first_row, band.bottom + seen.road.first_row)
        nearest = max(1.0, horizon.standard_deviation) + max(horizon.row - camera.horizon_row, 0.0)
        geometry = band_geometry(camera, nearest, (band.left, band.right), rows)
        curves = strip_curves(pixels, geometry, sky.noise, camera)
        curves = without_clipped(curves) if sky.is_clipped else curves
        fit = fit_jointly(curves, geometry, joint_prior(sky, camera, horizon))
        if fit is None:
            raise CannotTellError("too little road is seen")
        if fit.road >= (1.0 - LEAST_CONTRAST) * fit.airlight:
            raise CannotTellError("the road is nearly as bright as the airlight, or brighter")
        if fit.used[0].sum() < MIN_USED * (curves.variance[0] > 0).sum():
            raise CannotTellError("the road ahead is hidden, or is none")
        if fit.misfit > MAX_MISFIT:
            raise CannotTellError("the road fades into the airlight, but not as Koschmieder's law has it")
        if why := no_road(fit, curves, geometry, camera):
            raise CannotTellError(why)
        return fit

    def _edges(self, road: RoadImage, slope: NDArray[np.float32]) -> Edges:
        edges = self._detector(road.luminance, slope)
        if edges.threshold > road.contrast:
            raise CannotTellError("noise or texture drowns the contrast of road and airlight")
        return edges

    def _horizon(self, edges: Edges, road: RoadImage, pixels: LinearPixels) -> Horizon:
        """Assumed horizon and vanishing point, weighed (corrected), or the best vanishing point of late (published)."""
        if not self._looks_for_lines:
            return self._assumed
        if not self._as_published:
            seen = road_vanishing_point(pixels, self._camera, self._assumed)
            return self._assumed if seen is None else weighted_mean(self._assumed, seen.horizon)
        guess = (self._camera.principal_point[0], self._assumed.row - road.first_row)
        reach = max(REACH * self._camera.focal_length, 8.0)
        point = consensus_vanishing_point(edges.gradient, edges.pixels, guess, reach)
        if point is not None:
            self._points.append(replace(point, row=point.row + road.first_row))
        best = max(self._points, key=lambda p: p.support, default=None)
        found = self._assumed if best is None else best.horizon
        return found if 1.0 <= found.row <= self._camera.height - 1 - MIN_ROWS else self._assumed

    def _check_clear_view(self, seen: SeenBand) -> None:
        """Refuse to say "no fog" of anything but the road itself, seen up to the horizon where it vanishes.

        Beside a vehicle close ahead, a dark flank or verge can look like a road without fog.
        """
        road, band, top = seen.road, seen.band, float(seen.below_horizon[0])
        if top > NEAR_HORIZON:
            raise CannotTellError("the road's region ends below the horizon, and no inflection lies in it")
        if median(seen.profile[:3]) > road.road + 0.5 * road.contrast:
            raise CannotTellError("the road fades into the airlight, but not as Koschmieder's law has it")
        aside = abs(0.5 * (band.left + band.right) - self._camera.principal_point[0])
        if aside > MAX_ASIDE * self._camera.width:
            raise CannotTellError("the road ahead is hidden: a dark surface is seen only beside it")
        if -top > MAX_ABOVE * self._camera.height:
            raise CannotTellError("what is seen of the road goes on above the horizon: it is no road")

    def _inflection(self, curve: RoadCurve) -> FogModel | None:
        if curve.weight.sum() < MIN_ROWS // 2:
            return None
        return self._model(curve)


def _credible(model: FogModel | None, curve: RoadCurve, road: RoadImage) -> FogModel | None:
    """Pass a model only if it is one of fog over this road and its inflection was seen.

    The airlight is what is seen at the horizon: where that is much brighter than the model says, the model has fitted
    a road that brightens with distance, and no fog.
    """
    if model is None or not 0.0 < model.extinction < math.inf:
        return None
    drop = model.airlight - model.road
    inflection = 0.5 * model.extinction * curve.row_distance
    seen = curve.below_horizon[0] + 1.0 <= inflection <= curve.below_horizon[-1]
    contrast = drop >= MIN_CONTRAST and model.residual <= MAX_RESIDUAL * drop
    # A saturated sky is at least as bright as it looks.
    excess = model.airlight - road.airlight
    airlight = excess >= -0.3 * road.contrast and (excess <= 0.3 * road.contrast or road.airlight >= SATURATED)
    return model if seen and contrast and airlight else None
