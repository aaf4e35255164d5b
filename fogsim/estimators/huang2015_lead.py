"""Accurate visibility from pictures of the tracked vehicle ahead (Huang 2015, section 4.3)."""

import math
from dataclasses import replace
from functools import partial
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.huang2015_comparison import Comparison, crop_vehicle
from fogsim.estimators.huang2015_ratios import (
    RANGE_DEVIATION,
    Regressions,
    fitted_extinction,
    image_confidence,
    published_extinction,
    ratio_table,
)
from fogsim.estimators.huang2015_track import LeadTrack
from fogsim.estimators.image_check import ObservationCheck
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import LeadMeasurement, Observation
from fogsim.vision.day.confirmation import without_far_objects
from fogsim.vision.light.pixel_kernels import Pixels
from fogsim.vision.lines.horizon import PITCH_DEVIATION, PitchDeviation, calibrated_horizon
from fogsim.vision.region.road_image import CannotTellError
from fogsim.vision.vehicle.camera_range import CameraRange, registered_deviation

Floats = NDArray[np.float64]

_SPACING, _PUBLISHED_SPACING = 2.5, 5.0
"""Change of range between pictures that are kept [m]; the thesis clips one every 5 m."""

_LEAST_CHANGE = 10.0
"""Change of range below which nothing is said [m]: the shortest track of the thesis' table 5.1."""

_WORST = 1.0
"""Relative standard deviation of k beyond which it is as good as unknown [-]."""

_CURVE_STEP, _CURVE_END = 5.0, 200.0
"""Ranges of the confidence curve in the diagnostics [m]."""


@checked_parameters
class Huang2015Lead:
    """Contrast of the tracked vehicle ahead against its range (Huang 2015, section 4.3).

    The radar's range and the calibration give where the vehicle's rear must be; its edges and symmetry show where it
    is, and from then on its picture is registered from frame to frame. Where its range changes, its variance falls as
    e^(−2kd) (eq. 4.15). The confidence of an image at a range is what is left of that variance. Without a radar,
    ``range_from="camera"`` measures ranges in the image.

    As published, variances of the windows are compared two by two: a table of ratios by difference of range, those
    beyond ± 50 % of their row's median dropped, means, least squares over k ≤ 0.09 1/m. Camera noise adds to every
    variance (dense fog comes out too thin) and detail is lost with distance (thin fog comes out too dense). Corrected,
    the nearest picture is shrink as the camera would, placed to a fraction of a pixel by the vehicle's outline, and
    each farther picture compared with it in two ways. The slope of its regression, noise taken out, falls as e^(−kd);
    so does the mean contrast to the sky up to the roof, in which dark pixels count most, as no shading or loss of
    detail makes them bright. Where the two contradict each other, detail was misplaced. Pixels that changed (lit
    lamps) are left out, slopes of pictures that show other detail are, too, and changes of exposure are taken out by
    the sky.

    Errors of the thesis: eqs. 4.12 to 4.14 and 5.2 lack squares, eq. 4.14 has d₁ for d₂, eq. 4.16 is near over far
    where table 4.2 is far over near, the k grid excludes visibilities below 33 m, and 25 … 90 m every 5 m are 14
    pictures, not 13, over 65 m, not 75 m. Eq. 4.15 is right.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    as_published : bool
        Ratios of variances instead of regressions.
    setback : float
        From the own front bumper, where ranges begin, back to the camera [m]; it hardly matters.
    blur : float
        Standard deviation of the lens' blur next to the pixels' own size [px]. Detail that it takes from far pictures
        would be taken for fog: with 0.7 px that are not given, 120 m come out as some 105 m.
    spacing : float, optional
        Change of range between pictures that are kept [m]: 2.5 m, as published 5 m.
    range_from : {"sensor", "camera"}
        Whether ranges are the sensor's, or measured in the image: by the vehicle's width, known or from where it stands
        on a level road. Ranges from the camera have an error in common, which the deviation of k includes.
    vehicle_width : float, optional
        Width of the vehicle for ranges from the camera, where it is known [m].
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one, for ranges from the camera [rad].
    """

    method = "huang2015_lead"

    def __init__(
        self,
        camera: Camera,
        *,
        as_published: bool = False,
        setback: Annotated[float, Range(0.0, 10.0, "m")] = 0.0,
        blur: Annotated[float, Range(0.0, 10.0, "px")] = 0.0,
        spacing: Annotated[float, Range(0.1, 100.0, "m")] | None = None,
        range_from: Literal["sensor", "camera"] = "sensor",
        vehicle_width: Annotated[float, Range(0.5, 4.0, "m")] | None = None,
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
    ) -> None:
        if vehicle_width is not None and range_from == "sensor":
            raise InputError('vehicle_width needs range_from="camera": ranges of the sensor need no width')
        usual = _PUBLISHED_SPACING if as_published else _SPACING
        self._spacing = usual if spacing is None else spacing
        self._blur = blur
        self._camera, self._check = camera, ObservationCheck(camera)
        self._as_published = as_published
        self._horizon = calibrated_horizon(camera, pitch_deviation)
        by_camera = range_from == "camera"
        self._setback = 0.0 if by_camera else setback
        self._camera_range = CameraRange(camera, vehicle_width, pitch_deviation) if by_camera else None
        self.reset()

    def reset(self) -> None:
        """Forget the vehicle ahead."""
        self._check.reset()
        self._forget()
        self._tracks = 0

    def _forget(self) -> None:
        self._track = self._new_track()
        if self._camera_range is not None:
            self._camera_range.reset()

    @property
    def tracks(self) -> int:
        """How many vehicles have been begun to be followed since the last reset."""
        return self._tracks

    def _new_track(self) -> LeadTrack:
        smoothed_by = 0.0 if self._as_published or self._camera_range is not None else RANGE_DEVIATION
        return LeadTrack(self._camera, self._setback, self._spacing, self._blur, smoothed_by)

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from this and all earlier pictures of the vehicle ahead.

        Parameters
        ----------
        observation : Observation
            Its image is used, and the range of its lead vehicle unless ranges are from the camera.

        Returns
        -------
        Estimate
            Diagnostics: ``distances``, ``contrasts`` and ``variances`` (n,) of the kept pictures [m], [-] over the
            nearest and [linear grey levels²], ``window`` (column, foot, width) [px], ``range_change`` [m], and where
            valid ``confidence_distances`` (m,) [m] and ``confidence`` (m,) [-], the image confidence curve from range
            0; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`), or the range is NaN.
        """
        image = self._check.kernel_image(observation)
        try:
            lead, deviation = self._range(image, observation.lead)
            # Ranges from the camera are of one vehicle until it is forgotten.
            is_known = self._camera_range is not None and self._track.reference is not None
            if not (is_known or self._track.follows(lead.distance)):
                self._track = self._new_track()
                self._tracks += 1
            self._track.see(image, lead, observation.time, deviation)
        except CannotTellError as reason:
            self._miss()
            return Estimate.invalid(self.method, str(reason))
        own = self._estimate()
        return own if self._as_published else without_far_objects(own, image, self._camera, self._horizon)

    def _range(self, image: Pixels, lead: LeadMeasurement | None) -> tuple[LeadMeasurement, float | None]:
        """Range of the vehicle ahead, and its standard deviation if it is from the camera [m]."""
        if self._camera_range is not None:
            distance, deviation = self._camera_range.measure(partial(crop_vehicle, image, self._camera))
            return LeadMeasurement(distance, math.nan), deviation
        if lead is None:
            raise CannotTellError("no vehicle is tracked ahead")
        if math.isnan(lead.distance):
            raise InputError("the distance of a lead measurement must be a number, got NaN")
        return lead, None

    def _miss(self) -> None:
        if self._track.miss():
            self._forget()

    def _estimate(self) -> Estimate:
        found = self._track.comparisons
        distances = np.array([c.distance for c in found])
        change = float(np.ptp(distances))
        window = self._track.window
        diagnostics: dict[str, object] = {
            "distances": distances,
            "contrasts": np.array([c.contrast for c in found]),
            "variances": np.array([c.variance for c in found]),
            "window": None if window is None else (window.column, window.foot, window.width),
            "range_change": change,
        }
        if change < _LEAST_CHANGE or distances.size < (2 if self._as_published else 3):
            return Estimate.invalid(self.method, "the vehicle's range has not changed enough", **diagnostics)
        measured = self._published() if self._as_published else self._corrected()
        if measured is None or not math.isfinite(measured[1]):
            return Estimate.invalid(self.method, "the vehicle's contrast follows no law of fog", **diagnostics)
        extinction, deviation = self._scaled(*measured)
        road = self._track.road
        if not self._as_published and road is not None and road.is_lit(extinction, deviation):
            return Estimate.invalid(self.method, "lamps light the road: this is a daytime method", **diagnostics)
        curve = np.arange(0.0, _CURVE_END + _CURVE_STEP, _CURVE_STEP)
        diagnostics |= {"confidence_distances": curve, "confidence": image_confidence(extinction, curve)}
        return Estimate(self.method, extinction, deviation, diagnostics=diagnostics)

    def _scaled(self, extinction: float, deviation: float) -> tuple[float, float]:
        """Extinction and its deviation [1/m] with the scale of ranges from the camera and its deviation."""
        if self._camera_range is None:
            return extinction, deviation
        scale, by_scale = self._camera_range.scale, self._camera_range.scale_deviation
        return extinction / scale, math.hypot(deviation, by_scale * extinction) / scale

    def _published(self) -> tuple[float, float] | None:
        found = [c for c in self._track.comparisons if c.variance > 0]
        table = ratio_table(np.array([c.distance for c in found]), np.array([c.variance for c in found]), self._spacing)
        if table.ratio.size < 1:
            return None
        extinction, deviation = published_extinction(table)
        return extinction, max(deviation, 1e-6)

    def _corrected(self) -> tuple[float, float] | None:
        found = self._track.comparisons
        data = _regressions(found)
        if self._camera_range is not None:
            data = replace(data, range_deviation=registered_deviation(self._camera, data.distance))
        fit = fitted_extinction(data)
        if fit is None:
            return None
        if fit.extinction <= fit.deviation:
            # No fog that differs surely from none; what it may be is in the deviation.
            return max(fit.extinction, 0.0), fit.deviation
        return (fit.extinction, fit.deviation) if fit.deviation <= _WORST * fit.extinction else None


def _regressions(found: tuple[Comparison, ...]) -> Regressions:
    def column(name: str) -> Floats:
        return np.array([getattr(c, name) for c in found])

    return Regressions(
        distance=column("distance"),
        slope=column("contrast"),
        slope_deviation=column("deviation"),
        mean=column("mean"),
        mean_deviation=column("mean_deviation"),
        near_mean=column("near_mean"),
    )
