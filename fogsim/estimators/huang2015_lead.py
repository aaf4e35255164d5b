"""Accurate visibility from pictures of the tracked vehicle ahead (Huang 2015, section 4.3)."""

import math
from dataclasses import replace
from functools import partial
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.huang2015_comparison import (
    Comparison,
    RearPatch,
    compare,
    compare_with_itself,
    crop_vehicle,
    cut_patch,
    expected_placement,
    known_placement,
    lower,
    placed_at,
    shrink_broad,
)
from fogsim.estimators.huang2015_ratios import (
    RANGE_DEVIATION,
    Regressions,
    fitted_extinction,
    image_confidence,
    published_extinction,
    ratio_table,
)
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.tracked_vehicle import SmoothedRanges, TrackedVehicle
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import LeadMeasurement, Observation
from fogsim.vision.day.confirmation import without_far_objects
from fogsim.vision.light.pixel_kernels import Pixels
from fogsim.vision.lines.horizon import PITCH_DEVIATION, CannotTellError, PitchDeviation, calibrated_horizon
from fogsim.vision.vehicle.airlight import RoadFall
from fogsim.vision.vehicle.rear_localisation import RearBox, localise_rear
from fogsim.vision.vehicle.vehicle_crop import CameraRange, VehicleCrop, registered_deviation

_FOLLOWED = 0.4
"""Share of a new place that the expectation for the next frame takes over: pitch of the moment is no trend [-]."""

_GROWTH, _UNSURE = 1.25, 4.0
"""Factor by which contrast may seem to grow with range [-], and standard deviations that it may besides."""

_SAME = 0.2
"""By how much a window that is found again may differ from what is known of it, in widths of the vehicle [-]."""

_MOST_JUMP = 12.0
"""Change of range between frames by more than which the vehicle is another one [m]."""

_PICTURES = 64
"""Pictures of a vehicle that are kept."""

_NEARER = 0.9
"""A vehicle that has come this much nearer than its reference picture, relative to that, becomes the reference [-]."""


class _LeadTrack(TrackedVehicle[Comparison]):
    """Pictures of one vehicle ahead, and where it was last; the reference is kept, and renewed as it comes nearer.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    setback : float
        From the own front bumper back to the camera [m].
    spacing : float
        Change of range that makes a new picture worth keeping [m].
    blur : float
        Standard deviation of the lens' blur next to the pixels' own size [px].
    range_deviation : float
        Standard deviation by which ranges are smoothed [m]; 0 leaves them as they are.

    Attributes
    ----------
    road : RoadFall or None
        How the contrast of the nearest road falls in the last frame; None before the first.
    """

    def __init__(self, camera: Camera, setback: float, spacing: float, blur: float, range_deviation: float) -> None:
        super().__init__(SmoothedRanges(range_deviation), _PICTURES, offset=setback, keeps_reference=True)
        self._camera = camera
        self._setback = setback
        self._spacing = spacing
        self._blur = blur
        self._offset = (0.0, 0.0)
        self._last_distance = math.nan
        self.road: RoadFall | None = None

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """Every kept picture against the reference at its likely range, nearest first."""
        likely = zip(self.detections, self.likely_distances(), strict=True)
        return tuple(sorted((replace(c, distance=float(d)) for c, d in likely), key=lambda c: c.distance))

    @property
    def window(self) -> RearBox | None:
        """Where the vehicle was seen last; None if it never was."""
        return None if self.reference is None else self._expected(self._last_distance, self.reference.picture)

    def follows(self, distance: float) -> bool:
        """Whether a range can be that of the same vehicle as before (`distance` [m])."""
        return self.reference is not None and abs(distance + self._setback - self._last_distance) <= _MOST_JUMP

    def see(self, image: Pixels, measured: LeadMeasurement, time: float, deviation: float | None = None) -> None:
        """Look for the vehicle in the next frame (`image` (rows, cols), `time` [s], `deviation` [m])."""
        distance = measured.distance + self._setback
        number = self._ranges.add(time, measured)
        crop = crop_vehicle(image, self._camera, distance)
        self.road = crop.road
        if self.reference is None:
            self._begin(crop, number)
        else:
            self._follow(crop, number, self.reference.picture, deviation)
        self._missed = 0

    def _begin(self, crop: VehicleCrop, number: int) -> None:
        window = localise_rear(crop.luminance, crop.origin, self._camera, crop.depth, crop.noise)
        if window is None:
            raise CannotTellError("no vehicle stands out where the range says that there is one")
        comparison = compare_with_itself(shrink_broad(cut_patch(crop, window, number, self._blur)))
        if comparison.mean >= 1.0:
            # Fog only ever brings a vehicle nearer to the sky's light; lamps alone are brighter.
            raise CannotTellError("what stands where the range says is brighter than the sky: no vehicle by day")
        self.reference, self.detections = comparison, [comparison]
        self._remember(window.column, window.foot, crop.depth)

    def _follow(self, crop: VehicleCrop, number: int, reference: RearPatch, deviation: float | None) -> None:
        distance = crop.depth
        expected = self._expected(distance, reference)
        full = cut_patch(crop, expected, number, self._blur)
        picture, most = shrink_broad(full), self._most_contrast(distance)
        prior = expected_placement(reference, picture, deviation or RANGE_DEVIATION)
        comparison = compare(reference, picture, prior, most)
        if comparison is None or _exceeds(comparison, most):
            raise CannotTellError("the vehicle ahead was lost")
        if deviation is not None:
            distance *= prior.placement.scale / comparison.regression.placement.scale
            picture = replace(picture, distance=distance)
            comparison = replace(comparison, picture=picture, distance=distance)
        at, by = comparison.regression.placement, prior.placement
        moved = (at.column - by.column) / picture.scale, (at.row - by.row) / picture.scale
        self._remember(expected.column + moved[0], expected.foot + moved[1], distance)
        # Noise of the ranges makes some steps look shorter than they are.
        least = self._spacing - min(0.25 * self._spacing, 4.0 * RANGE_DEVIATION)
        if all(abs(distance - kept.distance) >= least for kept in self.detections):
            self._keep(replace(comparison, picture=placed_at(picture, full, at)))
            if distance < _NEARER * reference.distance:
                self._renew(crop, self.detections[-1].picture)

    def _most_contrast(self, distance: float) -> float:
        """Contrast that fog leaves at most: not more than nearer by, but for errors."""
        nearer = [c.fallen[0] + _UNSURE * c.fallen[1] for c in self.detections if c.distance <= distance]
        return _GROWTH * min(nearer, default=math.inf)

    def _renew(self, crop: VehicleCrop, nearest: RearPatch) -> None:
        """Take the nearest picture for the reference of all: it shows the most, and best where the vehicle stands."""
        known = self._expected(nearest.distance, nearest)
        found = localise_rear(crop.luminance, crop.origin, self._camera, nearest.distance, crop.noise)
        if found is not None and _is_same(found, known):
            widths = (found.foot - known.foot) / known.width
            self.detections = [replace(c, picture=lower(c.picture, widths)) for c in self.detections]
            self._offset = (self._offset[0], self._offset[1] + found.foot - known.foot)
        self._compare_all(self.detections[-1])

    def _compare(self, reference: Comparison, detection: Comparison) -> Comparison | None:
        if detection.picture is reference.picture:
            return compare_with_itself(reference.picture)
        return compare(reference.picture, detection.picture, known_placement(reference.picture, detection.picture))

    def _remember(self, column: float, foot: float, distance: float) -> None:
        """Keep lateral offset [m] and what pitch the foot shows [px]: they change least from frame to frame."""
        across = (column - self._camera.principal_point[0]) * distance / self._camera.focal_length
        pitch = foot - self._camera.horizon_row - self._camera.row_distance / distance
        share = _FOLLOWED if math.isfinite(self._last_distance) else 1.0
        before = self._offset
        self._offset = (before[0] + share * (across - before[0]), before[1] + share * (pitch - before[1]))
        self._last_distance = distance

    def _expected(self, distance: float, reference: RearPatch) -> RearBox:
        camera = self._camera
        return RearBox(
            column=camera.principal_point[0] + self._offset[0] * camera.focal_length / distance,
            foot=camera.horizon_row + camera.row_distance / distance + self._offset[1],
            width=reference.width / reference.scale * reference.distance / distance,
        )


def _is_same(found: RearBox, known: RearBox) -> bool:
    """Whether two windows of one picture are of one vehicle."""
    apart = max(abs(found.column - known.column), abs(found.foot - known.foot), abs(found.width - known.width))
    return apart < _SAME * known.width


def _exceeds(comparison: Comparison, most: float) -> bool:
    contrast, deviation = comparison.fallen
    return contrast > most + _UNSURE * deviation


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

    def _new_track(self) -> _LeadTrack:
        smoothed_by = 0.0 if self._as_published or self._camera_range is not None else RANGE_DEVIATION
        return _LeadTrack(self._camera, self._setback, self._spacing, self._blur, smoothed_by)

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
