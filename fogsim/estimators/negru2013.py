"""Fog from the luminance of the road in a single daytime image (Negru & Nedevschi, ICCP 2013)."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.negru2013_band import SeenBand, fog_limits, fog_slope, narrowed_curve, road_band, road_curve
from fogsim.estimators.repairs import Repair, chosen
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import LeadMeasurement, Observation
from fogsim.vision.day.confirmation import Confirmation
from fogsim.vision.day.day_fit import free_road
from fogsim.vision.light.daylight import CannotTellError
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.edges import CannyDeriche, Edges
from fogsim.vision.lines.horizon import (
    PITCH_DEVIATION,
    SCALE_DEVIATION,
    Horizon,
    PitchDeviation,
    ScaleDeviation,
    calibrated_horizon,
)
from fogsim.vision.lines.road_lines import seen_horizon
from fogsim.vision.lines.vanishing_point import VanishingPoint, consensus_vanishing_point
from fogsim.vision.region.inflection import (
    FogModel,
    best_inflection,
    inflection_with_deviation,
    printed_inflection,
)
from fogsim.vision.region.law import block_signs, check_law, detection_limit, fog_or_clear, seen_up_to
from fogsim.vision.region.profile import RoadCurve, band_profile
from fogsim.vision.region.road_image import MIN_ROWS, RoadImage, road_image
from fogsim.vision.region.road_region import GrowthLimits, constant_limits
from fogsim.vision.strips.strip_curves import lowest_road_row

_GROWTH_SHARE = 0.8
"""ρ of the published region growing [-]; the paper takes its limits from Hautière et al. (2006), without values."""

_MIDDLE, _LEAST_MIDDLE = 0.3, 200.0
"""How far to either side of the vanishing column a band is sought, a share of the image's width and at least [px]."""

REACH = math.radians(4.0)  # [rad] about the assumed vanishing point, within which lines of the road may pass
_ALBEDO_DEVIATION = (
    0.015  # [-] of k by slow changes of the road's reflectance, which one row's inflection does not show
)
_HALF_PAVED, _OTHER_GROUND = 4.0, 0.2
"""How far to either side the ground is as the road is [m], and relative deviation of k where the band leaves it at
twice the inflection's height below the horizon or lower: another albedo begins there [-]."""

_BETWEEN = 1.0
"""Rows about the horizon that are neither road nor sky [px]."""


class Negru2013Repair(Repair):
    """What the corrected negru2013 does otherwise than the paper."""

    SIGNS = (
        "signs",
        "eqs. 17 and 18 have the wrong sign of dI/dv for rows that count downward (A∞ = 162 where the truth is 200), so"
        " most choose a row that is no inflection, or none",
        "the signs that follow from eq. 15",
    )
    LINEAR_LUMINANCE = (
        "linear_luminance",
        "pixel values stand for luminance",
        "the camera's response is undone, for Koschmieder's law is of light",
    )
    FOG_DRAWS_NO_EDGES = (
        "fog_draws_no_edges",
        "edges include the fog's own gradient, which stops the region where it is steepest or where road meets sky",
        "each row's gradient is taken away as far as fog can make it",
    )
    GROWTH_BY_FOG = (
        "growth_by_fog",
        "pixels join the region that are similar to the seed and to the pixel below; how similar is not printed",
        "similar is what differs by no more than the steepest fog of its row, airlight / (e (v − v_h)), and noise",
    )
    BAND_AHEAD = (
        "band_ahead",
        "the widest vertical band, wherever it lies, which may be verge, and far away is wider than the road",
        "a band of limited width nearest to the vanishing point, which narrows with the road (± 2.5 m), above the own"
        " bonnet",
    )
    SUBPIXEL_HORIZON = (
        "subpixel_horizon",
        "the vanishing point is the centre of mass of intersections of Hough's whole-pixel lines, and far off",
        "lines within the pixel, weighed against the calibration",
    )
    SUBPIXEL_INFLECTION = (
        "subpixel_inflection",
        "the inflection is one of the rows, and 1 px is 20 % of V_met at 300 m (λ = 1000 px·m); its level and slope are"
        " those of that row alone",
        "candidates lie between rows as well, each one's level and slope are those of eqs. 15 to 18 over the rows about"
        " it, and the one whose model leaves least of the curve counts, as published",
    )
    LEAD_LEFT_OUT = (
        "lead_left_out",
        "a vehicle ahead joins the region or ends it",
        "the band lies next to the tracked vehicle",
    )
    SINGLE_FRAMES = (
        "single_frames",
        "of the last N frames the best counts, which holds on to old fog (hundreds of frames for the horizon)",
        "each frame stands alone with its deviation; averaging is the fusion's",
    )
    CONFIRMED = (
        "confirmed",
        "the curve of the road alone is fog or clear air, whatever else the image shows, and the camera is exact",
        "the day model of road and sky must show fog, or contrast far away, as well; the interval spans both models,"
        " and what height, focal length and response leave open",
    )


@checked_parameters
class Negru2013:
    """Inflection point of the road's luminance curve (Negru & Nedevschi 2013, section IV).

    Edges, a region grown upward from the road, the widest vertical band that crosses it, the median of each of its
    rows, the row of steepest change whose model fits best: the extinction is k = 2 (v_i − v_h) / λ.

    As published (`as_published`), the horizon is the vanishing point of the Hough lines that most agree on one, of the
    last `horizon_frames` frames that with the highest score (that of the calibration until there is one), k is read
    off the inflection's row, and of the last `inflection_frames` frames the one whose curve fits best counts.
    `printed_signs` also takes eqs. 17 and 18 as they are printed, whose signs are wrong for rows that count downward
    (they give A = 162 where the truth is 200, and mostly choose a wrong row). What the corrected form (the default)
    does otherwise is listed in `Negru2013Repair`, and can be switched one by one.

    A region without an inflection gives k = 0 with the detection limit as its deviation. An image that shows no road by
    day gives an invalid estimate with the reason in its diagnostics, in either form.
    Daytime only, flat road, road darker than the airlight.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    as_published : bool
        Make no repairs, except that of the signs, without which every estimate is far off.
    repairs : {'all', 'none'} or list of str
        Which of the repairs are made.
    printed_signs : bool
        Take eqs. 17 and 18 with their wrong signs, whatever else is repaired.
    growth : float
        G_max, the largest step of luminance between rows, as published [linear grey levels]. The paper prints none; 8
        has the least mean error in the last table of `fogsim reproduce negru2013`, whose drives are not its scenes.
    vanishing_point : bool
        Look for the vanishing point of the road's lines; else the calibration alone gives the horizon.
    horizon_frames, inflection_frames : int
        Frames of the temporal schemes, where frames do not stand alone.
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    scale_deviation : float
        Relative standard deviation of focal length × mount height, with which distances on the road go [-].

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
        repairs: Literal["all", "none"] | Sequence[Negru2013Repair] = "all",
        printed_signs: bool = False,
        growth: Annotated[float, Range(0.0, 255.0)] = 8.0,
        vanishing_point: bool = True,
        horizon_frames: Annotated[int, Range(1, 100_000)] = 500,
        inflection_frames: Annotated[int, Range(1, 10_000)] = 5,
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
        scale_deviation: ScaleDeviation = SCALE_DEVIATION,
    ) -> None:
        self._check = ObservationCheck(camera)
        self._camera, self._assumed = camera, calibrated_horizon(camera, pitch_deviation)
        made = chosen(Negru2013Repair, repairs, as_published=as_published, published=(Negru2013Repair.SIGNS,))
        self._repairs = made - {Negru2013Repair.SIGNS} if printed_signs else made
        self._confirmation = Confirmation(camera, self._assumed, scale_deviation)
        self._growth = growth
        self._looks_for_lines = vanishing_point
        alone = Negru2013Repair.SINGLE_FRAMES in self._repairs
        self._detector = CannyDeriche()
        self._points: deque[VanishingPoint] = deque(maxlen=1 if alone else int(horizon_frames))
        self._models: deque[FogModel] = deque(maxlen=1 if alone else int(inflection_frames))

    def reset(self) -> None:
        """Forget the vanishing points and inflections of earlier frames."""
        self._check.reset()
        self._confirmation.reset()
        self._points.clear()
        self._models.clear()

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one image.

        Parameters
        ----------
        observation : Observation
            Its image is used, and (repaired) the range of its lead vehicle to look next to it.

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
        image = self._check.kernel_image(observation)
        diagnostics: dict[str, object] = {"horizon_row": self._camera.horizon_row}
        try:
            own = self._read(image, observation.lead, diagnostics)
        except CannotTellError as reason:
            return Estimate.invalid(self.method, str(reason), **diagnostics)
        if Negru2013Repair.CONFIRMED not in self._repairs:
            return own
        return self._confirmation.of(own, image, free_road(observation.lead), observation.time)

    def _read(
        self,
        image: NDArray[np.uint8] | NDArray[np.uint16],
        lead: LeadMeasurement | None,
        diagnostics: dict[str, object],
    ) -> Estimate:
        road, pixels = self._road(image)
        slope = fog_slope(road, self._assumed)
        edges = self._edges(road, slope)
        horizon, axis = self._horizon(edges, road, pixels)
        diagnostics["horizon_row"] = horizon.row
        ahead = Negru2013Repair.BAND_AHEAD in self._repairs
        hiding = lead if Negru2013Repair.LEAD_LEFT_OUT in self._repairs else None
        try:
            band = road_band(road, edges, self._limits(road, edges, slope), self._camera, widest=not ahead, lead=hiding)
        except CannotTellError:
            return self._no_fog(0.0, horizon, diagnostics)
        diagnostics["band"] = (band.left, band.right, band.top + road.first_row, band.bottom + road.first_row)
        seen = SeenBand(road, horizon, band, band_profile(road.luminance, band.moved(-road.first_column)))
        diagnostics["profile"] = seen.profile
        curve = narrowed_curve(seen, axis, self._camera) if ahead else road_curve(seen, self._camera)
        paved = abs(0.5 * (band.left + band.right) - axis) * self._camera.row_distance
        paved /= _HALF_PAVED * self._camera.focal_length
        if curve.weight.sum() < MIN_ROWS // 2:
            raise CannotTellError("too little road is seen")
        whole = Negru2013Repair.SUBPIXEL_INFLECTION not in self._repairs
        model = self._whole_row(curve, seen) if whole else self._between_rows(curve, seen, paved)
        if model is None:
            return self._no_fog(float(curve.below_horizon[0]), horizon, diagnostics)
        self._models.append(model)
        model = min(self._models, key=lambda m: m.residual / max(m.airlight - m.road, 1e-9))
        inflection = horizon.row + 0.5 * model.extinction * self._camera.row_distance
        found = {"inflection_row": inflection, "airlight": model.airlight, "road": model.road}
        return Estimate(self.method, model.extinction, model.standard_deviation, diagnostics=diagnostics | found)

    def _no_fog(self, top: float, horizon: Horizon, diagnostics: dict[str, object]) -> Estimate:
        """Clear air to the detection limit of a road seen up to some rows below the horizon [px]."""
        limit = detection_limit(top, horizon.standard_deviation, self._camera.row_distance)
        return Estimate(self.method, 0.0, limit, diagnostics=diagnostics)

    def _road(self, image: NDArray[np.uint8] | NDArray[np.uint16]) -> tuple[RoadImage, LinearPixels]:
        """Road from a little above the horizon down to the image's bottom or (repaired) the own bonnet."""
        linear = Negru2013Repair.LINEAR_LUMINANCE in self._repairs
        if Negru2013Repair.BAND_AHEAD not in self._repairs:
            road = road_image(image, self._camera, self._assumed, linear=linear)
            return road, linear_pixels(road.level, self._camera)
        # A band may lie in the middle only: the verges would but cost time.
        centre, reach = self._camera.principal_point[0], max(_MIDDLE * self._camera.width, _LEAST_MIDDLE)
        columns = max(math.ceil(centre - reach), 0), min(math.floor(centre + reach) + 1, self._camera.width)
        road = road_image(image, self._camera, self._assumed, columns, linear=linear)
        pixels = linear_pixels(road.level, self._camera)
        lowest = lowest_road_row(pixels, self._camera, road.airlight)
        return road.above(lowest), pixels

    def _whole_row(self, curve: RoadCurve, seen: SeenBand) -> FogModel | None:
        """Fog from the row of the inflection; None where there is none."""
        inflection = best_inflection if Negru2013Repair.SIGNS in self._repairs else printed_inflection
        model = inflection(curve)
        if model is None:
            return None
        by_horizon = model.horizon_sensitivity * seen.horizon.standard_deviation
        deviation = math.hypot(model.standard_deviation, by_horizon, _ALBEDO_DEVIATION * model.extinction)
        return replace(model, standard_deviation=deviation)

    def _between_rows(self, curve: RoadCurve, seen: SeenBand, paved: float) -> FogModel | None:
        """Fog from the inflection between rows; None where what there is may as well be none.

        The band is on the road from `paved` rows below the horizon downward.
        """
        apart = np.abs(curve.below_horizon) > _BETWEEN
        curve = RoadCurve(*curve[:3], curve.weight * apart, curve.row_distance)
        deviation_of_row = seen.horizon.standard_deviation
        extinction, deviation, square = inflection_with_deviation(
            curve, block_signs(), deviation_of_row, Negru2013Repair.SIGNS not in self._repairs
        )
        if not extinction > 0.0:
            return None
        beside = min(max(2.0 * paved / (extinction * curve.row_distance) - 1.0, 0.0), 1.0)
        deviation = math.hypot(deviation, _OTHER_GROUND * beside * extinction)
        if not fog_or_clear(extinction, deviation)[0] > 0.0:
            return None
        try:
            airlight, dark = check_law(curve, extinction, seen.road)
        except CannotTellError:
            # What hides the road is the better reason.
            seen_up_to(curve)
            raise
        per_row = -2.0 / curve.row_distance
        return FogModel(extinction, dark, airlight, deviation, per_row, math.sqrt(square))

    def _edges(self, road: RoadImage, slope: NDArray[np.float32]) -> Edges:
        edges = self._detector(road.luminance, slope if Negru2013Repair.FOG_DRAWS_NO_EDGES in self._repairs else None)
        if edges.threshold > road.contrast:
            raise CannotTellError("noise or texture drowns the contrast of road and airlight")
        return edges

    def _limits(self, road: RoadImage, edges: Edges, slope: NDArray[np.float32]) -> GrowthLimits:
        if Negru2013Repair.GROWTH_BY_FOG not in self._repairs:
            return constant_limits(slope.size, self._growth, self._growth * _GROWTH_SHARE, self._growth)
        return fog_limits(road, edges, slope)

    def _horizon(self, edges: Edges, road: RoadImage, pixels: LinearPixels) -> tuple[Horizon, float]:
        """Horizon and vanishing column: assumed and seen ones, weighed (repaired), or the best of late (published)."""
        straight_ahead = self._camera.principal_point[0]
        if not self._looks_for_lines:
            return self._assumed, straight_ahead
        if Negru2013Repair.SUBPIXEL_HORIZON in self._repairs:
            horizon, seen = seen_horizon(pixels, self._camera, self._assumed)
            return horizon, straight_ahead if seen is None else seen.column
        guess = (straight_ahead - road.first_column, self._assumed.row - road.first_row)
        reach = max(REACH * self._camera.focal_length, 8.0)
        point = consensus_vanishing_point(edges.gradient, edges.pixels, guess, reach)
        if point is not None:
            row, column = point.row + road.first_row, point.column + road.first_column
            self._points.append(replace(point, row=row, column=column))
        best = max(self._points, key=lambda p: p.support, default=None)
        if best is None or not 1.0 <= best.row <= self._camera.height - 1 - MIN_ROWS:
            return self._assumed, straight_ahead
        return best.horizon, best.column
