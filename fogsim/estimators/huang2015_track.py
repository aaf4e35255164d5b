"""The vehicle ahead as huang2015 follows it: found once, then registered from frame to frame."""

import math
from dataclasses import replace

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
from fogsim.estimators.huang2015_ratios import RANGE_DEVIATION
from fogsim.estimators.tracked_vehicle import SmoothedRanges, TrackedVehicle
from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.light.pixel_kernels import Pixels
from fogsim.vision.region.road_image import CannotTellError
from fogsim.vision.vehicle.airlight import RoadFall
from fogsim.vision.vehicle.rear_localisation import RearBox, localise_rear
from fogsim.vision.vehicle.vehicle_crop import VehicleCrop

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


class LeadTrack(TrackedVehicle[Comparison]):
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
