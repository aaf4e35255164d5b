"""The vehicle ahead as huang2015 follows it: found once, then registered from frame to frame."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.estimators.huang2015_comparison import (
    RANGE_DEVIATION,
    Comparison,
    Picture,
    compared,
    compared_with_itself,
    expected_placement,
    known_placement,
    lowered,
    picture_of,
    placed,
)
from fogsim.estimators.huang2015_sighting import Crop, sighting_of, vehicle_crop
from fogsim.estimators.lead_ranges import LeadRanges
from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.region.road_image import CannotTellError
from fogsim.vision.vehicle.airlight import RoadFall
from fogsim.vision.vehicle.rear_localisation import RearBox, localise_rear

FOLLOWED = 0.4
"""Share of a new place that the expectation for the next frame takes over: pitch of the moment is no trend [-]."""

GROWTH, UNSURE = 1.25, 4.0
"""Factor by which contrast may seem to grow with range [-], and standard deviations that it may besides."""

SAME = 0.2
"""By how much a window that is found again may differ from what is known of it, in widths of the vehicle [-]."""

MOST_JUMP = 12.0
"""Change of range between frames by more than which the vehicle is another one [m]."""

SIGHTINGS = 64
"""Pictures of a vehicle that are kept."""

NEARER = 0.9
"""A vehicle that has come this much nearer than its reference picture, relative to that, becomes the reference [-]."""


class LeadTrack:
    """Pictures of one vehicle ahead, and where it was last.

    Parameters
    ----------
    camera : Camera
        The calibration as the vehicle was told it.
    setback : float
        From the own front bumper back to the camera [m].
    spacing : float
        Change of range that makes a new picture worth keeping [m].
    blur : float
        Standard deviation of the lens' blur beside the pixels' own size [px].
    range_deviation : float
        Standard deviation by which ranges are smoothed [m]; 0 leaves them as they are.

    Attributes
    ----------
    road : RoadFall or None
        How the contrast of the nearest road falls in the last frame; None before the first.
    """

    def __init__(self, camera: Camera, setback: float, spacing: float, blur: float, range_deviation: float) -> None:
        self._camera = camera
        self._setback = setback
        self._spacing = spacing
        self._blur = blur
        self._ranges = LeadRanges(range_deviation)
        self._reference: Picture | None = None
        self._kept: list[Picture] = []
        self._comparisons: list[Comparison] = []
        self._offset = (0.0, 0.0)
        self._last_distance = math.nan
        self.road: RoadFall | None = None

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """Every kept picture against the reference at its likely range, nearest first."""
        found = self._comparisons
        measured = np.array([c.distance for c in found]) - self._setback
        likely = self._ranges.smoothed([c.number for c in found], measured) + self._setback
        placed = (replace(c, distance=float(d)) for c, d in zip(found, likely, strict=True))
        return tuple(sorted(placed, key=lambda c: c.distance))

    @property
    def window(self) -> RearBox | None:
        """Where the vehicle was seen last; None if it never was."""
        if self._reference is None:
            return None
        return self._expected(self._last_distance, self._reference)

    def follows(self, distance: float) -> bool:
        """Whether a range can be that of the same vehicle as before."""
        return self._reference is not None and abs(distance + self._setback - self._last_distance) <= MOST_JUMP

    def see(self, image: NDArray[np.uint8] | NDArray[np.uint16], told: LeadMeasurement, time: float) -> None:
        """Look for the vehicle in the next frame.

        Parameters
        ----------
        image : (rows, cols) or (rows, cols, 3) uint8 or uint16
            An image of the camera.
        told : LeadMeasurement
            Range and relative speed by the radar.
        time : float
            [s].

        Raises
        ------
        CannotTellError
            If it is not there to be seen.
        """
        distance = told.distance + self._setback
        number = self._ranges.add(time, told)
        crop = vehicle_crop(image, self._camera, distance)
        self.road = crop.road
        if self._reference is None:
            self._begin(crop, distance, number)
        else:
            self._follow(crop, distance, number, self._reference)

    def _begin(self, crop: Crop, distance: float, number: int) -> None:
        window = localise_rear(crop.luminance, crop.origin, self._camera, distance, crop.noise)
        if window is None:
            raise CannotTellError("no vehicle stands out where the range says that there is one")
        picture = picture_of(replace(sighting_of(crop, distance, window, self._blur), number=number))
        comparison = compared_with_itself(picture)
        if comparison.mean >= 1.0:
            # Fog only ever brings a vehicle nearer to the sky's light; lamps alone are brighter.
            raise CannotTellError("what stands where the range says is brighter than the sky: no vehicle by day")
        self._reference, self._kept, self._comparisons = picture, [picture], [comparison]
        self._remember(window.column, window.foot, distance)

    def _follow(self, crop: Crop, distance: float, number: int, reference: Picture) -> None:
        expected = self._expected(distance, reference)
        sighting = replace(sighting_of(crop, distance, expected, self._blur), number=number)
        picture, most = picture_of(sighting), self._most_contrast(distance)
        prior = expected_placement(reference.sighting, picture.sighting)
        comparison = compared(reference, picture, prior, most)
        if comparison is None or _exceeds(comparison, most):
            raise CannotTellError("the vehicle ahead was lost")
        at, by = comparison.regression.placement, prior.placement
        moved = (at.column - by.column) / picture.scale, (at.row - by.row) / picture.scale
        self._remember(expected.column + moved[0], expected.foot + moved[1], distance)
        # Noise of the ranges makes some steps look shorter than they are.
        least = self._spacing - min(0.25 * self._spacing, 4.0 * RANGE_DEVIATION)
        if all(abs(distance - kept.sighting.distance) >= least for kept in self._kept):
            found = placed(picture, sighting, at)
            self._keep(found, replace(comparison, variance=found.variance), reference)
            if distance < NEARER * reference.sighting.distance:
                self._renew(crop, self._kept[-1])

    def _most_contrast(self, distance: float) -> float:
        """Contrast that fog leaves at most: not more than nearer by, but for errors."""
        nearer = [c.fallen[0] + UNSURE * c.fallen[1] for c in self._comparisons if c.distance <= distance]
        return GROWTH * min(nearer, default=math.inf)

    def _keep(self, picture: Picture, comparison: Comparison, reference: Picture) -> None:
        self._kept.append(picture)
        self._comparisons.append(comparison)
        if len(self._kept) > SIGHTINGS:
            oldest = next(i for i, kept in enumerate(self._kept) if kept is not reference)
            del self._kept[oldest], self._comparisons[oldest]

    def _renew(self, crop: Crop, nearest: Picture) -> None:
        """Take the nearest picture for the reference of all: it shows the most, and best where the vehicle stands."""
        known = self._expected(nearest.sighting.distance, nearest)
        found = localise_rear(crop.luminance, crop.origin, self._camera, nearest.sighting.distance, crop.noise)
        if found is not None and _is_same(found, known):
            lower = (found.foot - known.foot) / known.width
            index = next(i for i, kept in enumerate(self._kept) if kept is nearest)
            self._kept = [lowered(kept, lower) for kept in self._kept]
            nearest = self._kept[index]
            self._offset = (self._offset[0], self._offset[1] + found.foot - known.foot)
        self._compare_anew(nearest)

    def _compare_anew(self, reference: Picture) -> None:
        """Compare all pictures with a new reference."""
        own = compared_with_itself(reference)
        others = [kept for kept in self._kept if kept is not reference]
        found = [
            (kept, compared(reference, kept, known_placement(reference.sighting, kept.sighting))) for kept in others
        ]
        pairs = [(kept, comparison) for kept, comparison in found if comparison is not None]
        self._reference = reference
        self._kept = [reference, *(kept for kept, _ in pairs)]
        self._comparisons = [own, *(comparison for _, comparison in pairs)]

    def _remember(self, column: float, foot: float, distance: float) -> None:
        """Keep lateral offset [m] and what pitch the foot shows [px]: they change least from frame to frame."""
        across = (column - self._camera.principal_point[0]) * distance / self._camera.focal_length
        pitch = foot - self._camera.horizon_row - self._camera.row_distance / distance
        share = FOLLOWED if math.isfinite(self._last_distance) else 1.0
        before = self._offset
        self._offset = (before[0] + share * (across - before[0]), before[1] + share * (pitch - before[1]))
        self._last_distance = distance

    def _expected(self, distance: float, reference: Picture) -> RearBox:
        camera, near = self._camera, reference.sighting
        return RearBox(
            column=camera.principal_point[0] + self._offset[0] * camera.focal_length / distance,
            foot=camera.horizon_row + camera.row_distance / distance + self._offset[1],
            width=near.width / reference.scale * near.distance / distance,
        )


def _is_same(found: RearBox, known: RearBox) -> bool:
    """Whether two windows of one picture are of one vehicle."""
    apart = max(abs(found.column - known.column), abs(found.foot - known.foot), abs(found.width - known.width))
    return apart < SAME * known.width


def _exceeds(comparison: Comparison, most: float) -> bool:
    contrast, deviation = comparison.fallen
    return contrast > most + UNSURE * deviation
