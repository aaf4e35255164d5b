"""The vehicle ahead as `lead_contrast` follows it: found once, then known by its likeness to the nearest picture."""

import math
from collections import deque
from dataclasses import dataclass, replace

from fogsim.estimators.tracked_vehicle import SmoothedRanges, TrackedVehicle
from fogsim.vision.light.daylight import CannotTellError
from fogsim.vision.vehicle.contrast_ratio import ContrastRatio, RearPicture, contrast_ratio
from fogsim.vision.vehicle.rear_localisation import RearBox
from fogsim.vision.vehicle.registration import RoadBehind, register_rear
from fogsim.vision.vehicle.vehicle_crop import LevelledRows, VehicleCrop

SPACING = 1.0
"""Change of range that makes a new picture worth keeping [m]; between, a picture only shows where the vehicle is."""

_CHANGED, _REFRESHED = 0.1, 10.0
"""Relative change of the contrast at a range from which the fog is another one and the track begins again [-], and age
from which a detection gives way to another from its range [s]."""

_NEARER = 0.85
"""A vehicle that has come this much nearer than its reference picture, relative to that, becomes the reference [-]."""

_STEERING = 0.25
"""Deviation of the vehicle's place sideways from where it was in the last picture [m]."""

_FOLLOWED = 0.1
"""Least share of a new place's height in what is expected next: pitch of the moment is no trend [-]."""

_ALIKE = 0.6
"""Least correlation with the reference where the vehicle must be visible [-]."""

_SCALED, _RESCALED, _BETTER = 0.06, 0.2, 0.03
"""Changes of the range's logarithm from which a vehicle is distinguished by its correlation from a thing that keeps its
size in the image: if that of such a thing is better by so much, and if it is better at all [-]."""

_FEW = 5
"""Last images over which that is averaged: in one, coarse pixels may show a vehicle otherwise."""

_VISIBLE = 3.0
"""Contrast of the reference, faded, in deviations of a cell from which the vehicle must look alike [-]."""

_GROWTH = 1.25
"""Factor by which contrast may seem to grow with range [-]."""

_SUSPICION = 2.5
"""The same that mean another vehicle if it also looks otherwise [m]."""

_SURE = 12.0
"""Contrast in its deviations from which a vehicle's place in a picture is believed [-]."""

_UNPLACED = 0.15
"""Relative deviation of its contrast where it is not: what is off its place shows less [-]."""

_GAP = 3.0
"""Time without the vehicle after which it is another one, where frames have a time [s]."""

_RELEVELLED = 0.15
"""Change of ln k from which the airlight before known pictures is reckoned again [-]."""

DENSEST = 0.1
"""Densest fog that is thought of before a track says more [1/m]."""


@dataclass(frozen=True, slots=True)
class RearDetection:
    """One picture of the vehicle ahead."""

    number: int  # Number of the measured range
    # distance, depth: its range as measured, and from the camera to its rear [m]
    distance: float
    depth: float
    time: float  # [s]
    picture: RearPicture  # The picture
    box: RearBox  # Its place in the image
    contrast: ContrastRatio  # Contrast over that of the reference
    clipped: bool  # Whether the sky may be brighter than it looks
    airlight_deviation: float  # Relative deviation of the airlight before it, where that is not even [-]
    alike: bool  # Whether it looks like the reference, and is not only where that is expected
    levelled: LevelledRows | None  # How its rows were taken relative to their own airlight; None where that is even


class ContrastTrack(TrackedVehicle[RearDetection]):
    """Pictures of one vehicle ahead at different ranges; the reference is the nearest.

    Takes `pitch_deviation` [rad], `window` [s].
    """

    def __init__(self, ranges: SmoothedRanges, pitch_deviation: float, window: float, frames: int) -> None:
        super().__init__(ranges, frames)
        self._pitch_deviation, self._window = pitch_deviation, window
        self._forget()

    def _forget(self) -> None:
        """Forget the vehicle, but not the ranges."""
        self.detections, self.reference = [], None
        self._aside = self._lift = 0.0
        self._swayed = 0
        self._scaled: deque[float] = deque(maxlen=_FEW)

    def is_lost(self, time: float) -> bool:
        """Count a frame without the vehicle; whether it may be another one from now on (`time` [s])."""
        seen = self.detections[-1].time if self.detections else time
        return self.miss() and abs(time - seen) >= (_GAP if time else 0.0)

    def look(
        self, crop: VehicleCrop, number: int, distance: float, time: float, *, surprise: float, densest: float
    ) -> RearDetection:
        """Find the vehicle in a frame and keep its picture if the range is new.

        Takes `number`, `distance` [m], `time` [s], `surprise` [m], `densest` [1/m].
        """
        self._forget_old(time)
        found = None
        if self.reference is not None:
            try:
                found = self._follow(crop, distance, self.reference, densest)
            except CannotTellError:
                if surprise < _SUSPICION:
                    raise
                self._forget()
        picture, ratio, alike = self._begin(crop) if found is None else found
        detection = RearDetection(
            number,
            distance,
            crop.depth,
            time,
            picture,
            crop.box_of(picture),
            ratio,
            crop.sky.is_clipped,
            crop.sky.deviation,
            alike,
            crop.levelled,
        )
        self._missed = 0
        self._aside = crop.lateral_offset(picture)
        # What of the pitch's error is common to all frames: their mean, later frames no less than a share of it.
        self._lift += max(1.0 / (self._swayed + 1.0), _FOLLOWED) * (crop.pitch_error(picture) - self._lift)
        self._swayed += 1
        self._keep_new(detection)
        if self.reference is None or detection.depth < _NEARER * self.reference.depth:
            self._compare_all(detection)
        return detection

    def relevel(self, extinction: float) -> None:
        """Take all images relative to their own airlight again, where it was computed with quite another extinction.

        Takes `extinction` [1/m].
        """
        if self.reference is None or all(_is_near(one.levelled, extinction) for one in self.detections):
            return
        # The reference itself may have given way among the detections to a later picture from its range.
        reference = _relevelled(self.reference, extinction)
        self.detections = [
            reference if self._is_reference(one) else _relevelled(one, extinction) for one in self.detections
        ]
        self._compare_all(reference)

    def _keep_new(self, detection: RearDetection) -> None:
        """Keep a detection from a new range; one from a known range shows whether fog has changed, or replaces it."""
        known = self._nearest(detection.distance) if self.detections else None
        if known is None or abs(known.distance - detection.distance) >= SPACING:
            self._keep(detection)
            return
        noise = math.hypot(known.contrast.deviation, detection.contrast.deviation)
        if abs(detection.contrast.ratio - known.contrast.ratio) > _CHANGED * known.contrast.ratio + 5.0 * noise:
            self.detections = [detection]
            self._compare_all(detection)
        elif detection.time - known.time > _REFRESHED and not self._is_reference(known):
            self.detections = [*(one for one in self.detections if one is not known), detection]

    def _begin(self, crop: VehicleCrop) -> tuple[RearPicture, ContrastRatio, bool]:
        """Find a vehicle that has not been seen before: its picture, and its contrast to itself."""
        picture = crop.localise()
        ratio = contrast_ratio(picture, picture)
        if ratio is None:
            raise CannotTellError("the vehicle ahead hardly differs from the airlight")
        return picture, ratio, True

    def _follow(
        self, crop: VehicleCrop, distance: float, reference: RearDetection, densest: float
    ) -> tuple[RearPicture, ContrastRatio, bool]:
        """Find the vehicle that is tracked: its picture, its contrast to the reference, and whether it looks alike."""
        expected = crop.expected(self._aside, reference.picture.width).displaced(0.0, self._lift * crop.depth)
        pitch = crop.depth * self._pitch_deviation + 0.02
        behind = RoadBehind(crop.camera.mount_height, self._nearest(distance).contrast.ratio)
        found = register_rear(reference.picture, expected, _STEERING, pitch, behind)
        ratio = None if found is None else contrast_ratio(reference.picture, found[0])
        if found is None or ratio is None:
            raise CannotTellError("the vehicle ahead is too small in the image, or hidden")
        picture, likeness = found
        if ratio.ratio < _SURE * ratio.deviation:
            # The best of many places would be that of the noise: it is where it was expected.
            picture, ratio = expected, contrast_ratio(reference.picture, expected) or ratio
            ratio = replace(ratio, deviation=math.hypot(ratio.deviation, _UNPLACED * ratio.ratio))
        least, most = self._bounds(distance, densest)
        if ratio.visible * least > _VISIBLE and (likeness < _ALIKE or self._keeps_its_size(crop, reference, likeness)):
            raise CannotTellError("what is seen there does not look like the vehicle that was tracked")
        if ratio.ratio > most + 4.0 * ratio.deviation:
            raise CannotTellError("what is seen there has more contrast than fog leaves")
        return picture, ratio, likeness >= _ALIKE

    def _keeps_its_size(self, crop: VehicleCrop, reference: RearDetection, likeness: float) -> bool:
        """Whether the last images show a thing of the reference's place and size in the image, and not the vehicle."""
        change = abs(math.log(crop.depth / reference.depth))
        if change < _SCALED:
            return False
        self._scaled.append(likeness - _likeness_if_fixed(crop, reference) + (_BETTER if change < _RESCALED else 0.0))
        return sum(self._scaled) < 0.0

    def _bounds(self, distance: float, densest: float) -> tuple[float, float]:
        """Least and greatest contrast that the vehicle can have at a range, over that of the reference."""
        upto = [one.contrast for one in self.detections if one.distance <= distance + SPACING]
        nearest = self._nearest(distance)
        least = nearest.contrast.ratio * math.exp(-min(densest, DENSEST) * abs(distance - nearest.distance))
        return least, _GROWTH * min((one.ratio + 4.0 * one.deviation for one in upto), default=math.inf)

    def _compare(self, reference: RearDetection, detection: RearDetection) -> RearDetection | None:
        ratio = contrast_ratio(reference.picture, detection.picture)
        return None if ratio is None else replace(detection, contrast=ratio)

    def _forget_old(self, time: float) -> None:
        while self.detections and time - self.detections[0].time > self._window:
            del self.detections[0]
        if self.reference is not None and not any(self._is_reference(one) for one in self.detections):
            if self.detections:
                self._compare_all(min(self.detections, key=lambda one: one.depth))
            else:
                self._forget()


def _is_near(levelled: LevelledRows | None, extinction: float) -> bool:
    return levelled is None or abs(math.log(extinction / levelled.extinction)) < _RELEVELLED


def _relevelled(detection: RearDetection, extinction: float) -> RearDetection:
    if detection.levelled is None:
        return detection
    change = detection.levelled.change(extinction)
    contrast = 1.0 - (1.0 - detection.picture.contrast) * change[:, None]
    levelled = replace(detection.levelled, extinction=extinction)
    return replace(detection, picture=replace(detection.picture, contrast=contrast), levelled=levelled)


def _likeness_if_fixed(crop: VehicleCrop, reference: RearDetection) -> float:
    """Correlation of what is at the reference's place and of its size in the image; 0 if nothing is."""
    behind = RoadBehind(crop.camera.mount_height, 1.0)
    found = register_rear(reference.picture, crop.picture(reference.box, reference.picture.scale), 0.1, 0.1, behind)
    return 0.0 if found is None else found[1]
