"""The vehicle ahead as huang2015 follows it: found once, then registered from frame to frame."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.estimators.huang2015_sighting import Crop, Sighting, sighting_of, vehicle_crop
from fogsim.values.camera import Camera
from fogsim.vision.lead_window import LeadWindow, find_lead
from fogsim.vision.patch import Placement
from fogsim.vision.patch_match import SATURATED, PlacementPrior, Regression, register
from fogsim.vision.road_image import CannotTellError

RANGE_DEVIATION = 0.3
"""Standard deviation of the told range [m]."""

STEERING = 0.1
"""Change of the lateral offset between frames in widths of the vehicle [-]."""

FOLLOWED = 0.4
"""Share of a new place that the expectation for the next frame takes over: pitch of the moment is no trend [-]."""

GROWTH, UNSURE = 1.25, 4.0
"""Factor by which contrast may seem to grow with range [-], and standard deviations that it may besides."""

MOST_JUMP = 12.0
"""Change of range between frames by more than which the vehicle is another one [m]."""

SMALL = 0.6
"""Relative standard deviation of a contrast by how little a small picture shows [px]: over the vehicle's width."""

SIGHTINGS = 48
"""Pictures of a vehicle that are kept."""

NEARER = 0.9
"""A vehicle that has come this much nearer than its reference picture, relative to that, becomes the reference [-]."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """A sighting regressed on the reference.

    Attributes
    ----------
    distance : float
        From the camera to the vehicle's rear [m].
    contrast, deviation : float
        Contrast over that of the reference, changes of exposure taken out, and its standard deviation [-].
    mean_deviation : float
        Standard deviation of its mean luminance over the sky's; ``inf`` if a sky is saturated [-].
    sky, reference_sky : float
        Luminance of the sky in this picture and in the reference [linear grey levels].
    regression : Regression
        The regression.
    """

    distance: float
    contrast: float
    deviation: float
    mean_deviation: float
    sky: float
    reference_sky: float
    regression: Regression


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
    """

    def __init__(self, camera: Camera, setback: float, spacing: float, blur: float) -> None:
        self._camera = camera
        self._setback = setback
        self._spacing = spacing
        self._blur = blur
        self._reference: Sighting | None = None
        self._kept: list[Sighting] = []
        self._comparisons: list[Comparison] = []
        self._offset = (0.0, 0.0)
        self._last_distance = math.nan

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """Every kept picture against the reference, nearest first."""
        return tuple(sorted(self._comparisons, key=lambda c: c.distance))

    @property
    def window(self) -> LeadWindow | None:
        """Where the vehicle was seen last; None if it never was."""
        if self._reference is None:
            return None
        return self._expected(self._last_distance, self._reference)

    def follows(self, distance: float) -> bool:
        """Whether a range can be that of the same vehicle as before."""
        return self._reference is not None and abs(distance + self._setback - self._last_distance) <= MOST_JUMP

    def see(self, image: NDArray[np.uint8] | NDArray[np.uint16], told_distance: float) -> None:
        """Look for the vehicle in the next frame.

        Parameters
        ----------
        image : (rows, cols) or (rows, cols, 3) uint8 or uint16
            An image of the camera.
        told_distance : float
            Range by the radar [m].

        Raises
        ------
        CannotTellError
            If it is not there to be seen.
        """
        distance = told_distance + self._setback
        crop = vehicle_crop(image, self._camera, distance)
        if self._reference is None:
            self._begin(crop, distance)
        else:
            self._follow(crop, distance, self._reference)

    def _begin(self, crop: Crop, distance: float) -> None:
        window = find_lead(crop.luminance, crop.origin, self._camera, distance, crop.noise)
        if window is None:
            raise CannotTellError("no vehicle stands out where the range says that there is one")
        sighting = sighting_of(crop, distance, window, self._blur)
        comparison = _compared_with_itself(sighting)
        if comparison.regression.mean >= sighting.sky:
            # Fog only ever brings a vehicle nearer to the sky's light; lamps alone are brighter.
            raise CannotTellError("what stands where the range says is brighter than the sky: no vehicle by day")
        self._reference, self._kept, self._comparisons = sighting, [sighting], [comparison]
        self._remember(window.column, window.foot, distance)

    def _follow(self, crop: Crop, distance: float, reference: Sighting) -> None:
        expected = self._expected(distance, reference)
        sighting = sighting_of(crop, distance, expected, self._blur)
        most = self._most_contrast(distance)
        comparison = _compared(reference, sighting, _prior(reference, sighting), most)
        if comparison is None or comparison.contrast > most + UNSURE * comparison.deviation:
            raise CannotTellError("the vehicle ahead was lost")
        placement = comparison.regression.placement
        moved = placement.column - sighting.patch.column, placement.row - sighting.patch.row
        self._remember(expected.column + moved[0], expected.foot + moved[1], distance)
        if all(abs(distance - kept.distance) >= self._spacing for kept in self._kept):
            patch = replace(sighting.patch, column=placement.column, row=placement.row)
            self._keep(replace(sighting, patch=patch), comparison, reference)

    def _most_contrast(self, distance: float) -> float:
        """Contrast that fog leaves at most: not more than nearer by, but for errors."""
        nearer = [c.contrast + UNSURE * c.deviation for c in self._comparisons if c.distance <= distance]
        return GROWTH * min(nearer, default=math.inf)

    def _keep(self, sighting: Sighting, comparison: Comparison, reference: Sighting) -> None:
        self._kept.append(sighting)
        self._comparisons.append(comparison)
        if len(self._kept) > SIGHTINGS:
            oldest = next(i for i, kept in enumerate(self._kept) if kept is not reference)
            del self._kept[oldest], self._comparisons[oldest]
        if sighting.distance < NEARER * reference.distance:
            self._compare_anew(sighting)

    def _compare_anew(self, reference: Sighting) -> None:
        """Take the nearest picture for the reference of all: it shows the most."""
        pairs = [
            (kept, _compared(reference, kept, _stayed(reference, kept))) for kept in self._kept if kept is not reference
        ]
        pairs.append((reference, _compared_with_itself(reference)))
        self._reference = reference
        self._kept = [kept for kept, comparison in pairs if comparison is not None]
        self._comparisons = [comparison for _, comparison in pairs if comparison is not None]

    def _remember(self, column: float, foot: float, distance: float) -> None:
        """Keep lateral offset [m] and what pitch the foot shows [px]: they change least from frame to frame."""
        across = (column - self._camera.principal_point[0]) * distance / self._camera.focal_length
        pitch = foot - self._camera.horizon_row - self._camera.row_distance / distance
        share = FOLLOWED if math.isfinite(self._last_distance) else 1.0
        before = self._offset
        self._offset = (before[0] + share * (across - before[0]), before[1] + share * (pitch - before[1]))
        self._last_distance = distance

    def _expected(self, distance: float, reference: Sighting) -> LeadWindow:
        camera = self._camera
        return LeadWindow(
            column=camera.principal_point[0] + self._offset[0] * camera.focal_length / distance,
            foot=camera.horizon_row + camera.row_distance / distance + self._offset[1],
            width=reference.width * reference.distance / distance,
        )


def _prior(reference: Sighting, sighting: Sighting) -> PlacementPrior:
    """Where the reference is expected in the next frame: as before, but for pitch, steering and the range's noise."""
    nearness = 1.0 / sighting.distance + 1.0 / reference.distance
    placement = Placement(sighting.patch.column, sighting.patch.row, reference.distance / sighting.distance)
    return PlacementPrior(
        placement, 1.0 + STEERING * sighting.width, 0.5 + sighting.pitch_deviation, RANGE_DEVIATION * nearness
    )


def _stayed(reference: Sighting, sighting: Sighting) -> PlacementPrior:
    """Where the reference is expected in a picture that has been registered before."""
    return replace(_prior(reference, sighting), column_deviation=0.5, row_deviation=0.5)


def _compared(
    reference: Sighting, sighting: Sighting, prior: PlacementPrior, most: float = math.inf
) -> Comparison | None:
    # A saturated sky does not tell the exposure.
    seen = reference.sky < SATURATED and sighting.sky < SATURATED
    gain = sighting.sky / reference.sky if seen else 1.0
    found = register(reference.patch, sighting.patch, prior, sighting.noise, most * gain)
    if found is None:
        return None
    # What a small picture does not resolve alike: its detail and its place.
    by_size = SMALL / sighting.width * abs(found.slope)
    return Comparison(
        distance=sighting.distance,
        contrast=found.slope / gain,
        deviation=math.hypot(found.slope_deviation, by_size) / gain,
        mean_deviation=max(found.residual, sighting.noise) / math.sqrt(found.pixels) / sighting.sky
        if seen
        else math.inf,
        sky=sighting.sky,
        reference_sky=reference.sky,
        regression=found,
    )


def _compared_with_itself(reference: Sighting) -> Comparison:
    """The reference as the first of its comparisons: contrast 1, but its variance is measured.

    Raises
    ------
    CannotTellError
        If it shows nothing that could be followed.
    """
    found = register(reference.patch, reference.patch, _stayed(reference, reference), reference.noise)
    if found is None:
        raise CannotTellError("the vehicle ahead shows nothing that could be followed")
    itself = math.inf if reference.sky >= SATURATED else 0.0
    return Comparison(reference.distance, 1.0, 0.0, itself, reference.sky, reference.sky, found)
