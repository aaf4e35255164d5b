"""The vehicle ahead as `lead_contrast` follows it: found once, then known by its likeness to the nearest picture."""

import math
from collections import deque
from dataclasses import dataclass, replace

from fogsim.vision.region.road_image import CannotTellError
from fogsim.vision.vehicle.contrast_ratio import ContrastRatio, RearPicture, contrast_ratio
from fogsim.vision.vehicle.rear_localisation import RearBox
from fogsim.vision.vehicle.registration import RoadBehind, register_rear
from fogsim.vision.vehicle.vehicle_crop import VehicleCrop

SPACING = 1.0
"""Change of range that makes a new picture worth keeping [m]; between, a picture only shows where the vehicle is."""

CHANGED, REFRESHED = 0.1, 10.0
"""Relative change of the contrast at a range from which the fog is another one and the track begins anew [-], and age
from which a sight gives way to another from its range [s]."""

NEARER = 0.85
"""A vehicle that has come this much nearer than its reference picture, relative to that, becomes the reference [-]."""

STEERING = 0.25
"""Deviation of the vehicle's place sideways from where it was in the last picture [m]."""

FOLLOWED = 0.1
"""Least share of a new place's height in what is expected next: pitch of the moment is no trend [-]."""

ALIKE = 0.6
"""Least correlation with the reference where the vehicle must be visible [-]."""

SCALED, RESCALED, BETTER = 0.06, 0.2, 0.03
"""Changes of the range's logarithm from which a vehicle is told from a thing that keeps its size in the image, by its
correlation: if that of such a thing is better by so much, and if it is better at all [-]."""

VISIBLE = 3.0
"""Contrast of the reference, faded, in deviations of a cell from which the vehicle must look alike [-]."""

GROWTH = 1.25
"""Factor by which contrast may seem to grow with range [-]."""

SUSPICION = 2.5
"""The same that mean another vehicle if it also looks otherwise [m]."""

SURE = 12.0
"""Contrast in its deviations from which a vehicle's place in a picture is believed [-]."""

UNPLACED = 0.15
"""Relative deviation of its contrast where it is not: what is off its place shows less [-]."""

DENSEST = 0.1
"""Densest fog that is thought of before a track says more [1/m]."""


@dataclass(frozen=True, slots=True)
class Sight:
    """One look at the vehicle ahead.

    Attributes
    ----------
    number : int
        Number of the measured range.
    distance, depth : float
        Its range as measured, and from the camera to its rear [m].
    time : float
        [s].
    picture : RearPicture
        The picture.
    window : RearBox
        Its place in the image.
    fading : ContrastRatio
        Contrast over that of the reference.
    clipped : bool
        Whether the sky may be brighter than it looks.
    alike : bool
        Whether it looks like the reference, and is not only where that is expected.
    """

    number: int
    distance: float
    depth: float
    time: float
    picture: RearPicture
    window: RearBox
    fading: ContrastRatio
    clipped: bool
    alike: bool


class ContrastTrack:
    """Pictures of one vehicle ahead at different ranges.

    Parameters
    ----------
    pitch_deviation : float
        Standard deviation of the true pitch about the told one [rad].
    window : float
        How long a sight counts [s].
    frames : int
        How many count at most.

    Attributes
    ----------
    sights : deque of Sight
        What is kept, oldest first.
    reference : Sight or None
        The nearest of them.
    """

    def __init__(self, pitch_deviation: float, window: float, frames: int) -> None:
        self._pitch_deviation, self._window = pitch_deviation, window
        self.sights: deque[Sight] = deque(maxlen=frames)
        self.forget()

    def forget(self) -> None:
        """Forget the vehicle."""
        self.sights.clear()
        self.reference: Sight | None = None
        self._aside = self._lift = 0.0
        self._swayed = 0

    def _follow_pitch(self, lift: float) -> None:
        """What of the pitch's error is common to all frames: their mean, later frames no less than a share of it."""
        self._lift += max(1.0 / (self._swayed + 1.0), FOLLOWED) * (lift - self._lift)
        self._swayed += 1

    def look(
        self, scene: VehicleCrop, number: int, distance: float, time: float, *, surprise: float, densest: float
    ) -> Sight:
        """Find the vehicle in a frame and keep its picture if the range is new.

        Parameters
        ----------
        scene : VehicleCrop
            The frame.
        number, distance : int, float
            Number of the measured range, and that range [m].
        time : float
            [s].
        surprise : float
            How far the range is from where the same vehicle can be [m].
        densest : float
            Extinction that is not exceeded by what is known so far [1/m].

        Raises
        ------
        CannotTellError
            If it is not there to be seen.
        """
        self._forget_old(time)
        sight = None
        if self.reference is not None:
            try:
                sight = replace(self._followed(scene, distance, time, self.reference, densest), number=number)
            except CannotTellError:
                if surprise < SUSPICION:
                    raise
                self.forget()
        if sight is None:
            sight = replace(self._begun(scene, distance, time), number=number)
        self._aside = scene.aside(sight.picture)
        self._follow_pitch(scene.lift(sight.picture))
        self._keep(sight)
        if self.reference is None or sight.depth < NEARER * self.reference.depth:
            self._compare_anew(sight)
        return sight

    def _keep(self, sight: Sight) -> None:
        """Keep a sight from a new range; one from a known range tells whether fog has changed, or replaces it."""
        known = min(self.sights, key=lambda s: abs(s.distance - sight.distance), default=None)
        if known is None or abs(known.distance - sight.distance) >= SPACING:
            self.sights.append(sight)
            return
        noise = math.hypot(known.fading.deviation, sight.fading.deviation)
        if abs(sight.fading.ratio - known.fading.ratio) > CHANGED * known.fading.ratio + 5.0 * noise:
            self.sights.clear()
            self.sights.append(sight)
            self._compare_anew(sight)
        elif sight.time - known.time > REFRESHED and known.picture is not self._reference_picture:
            rest = [s for s in self.sights if s is not known]
            self.sights.clear()
            self.sights.extend([*rest, sight])

    @property
    def _reference_picture(self) -> RearPicture | None:
        return None if self.reference is None else self.reference.picture

    def _begun(self, scene: VehicleCrop, distance: float, time: float) -> Sight:
        """Find a vehicle that has not been seen before."""
        picture = scene.found()
        fading = contrast_ratio(picture, picture)
        if fading is None:
            raise CannotTellError("the vehicle ahead hardly differs from the airlight")
        return Sight(0, distance, scene.depth, time, picture, scene.window(picture), fading, scene.sky.is_clipped, True)

    def _followed(self, scene: VehicleCrop, distance: float, time: float, reference: Sight, densest: float) -> Sight:
        """Find the vehicle that is tracked."""
        expected = scene.expected(self._aside, reference.picture.width).displaced(0.0, self._lift * scene.depth)
        pitch = scene.depth * self._pitch_deviation + 0.02
        known = min(self.sights, key=lambda s: abs(s.distance - distance)).fading.ratio
        around = RoadBehind(scene.camera.mount_height, known)
        found = register_rear(reference.picture, expected, STEERING, pitch, around)
        fading = None if found is None else contrast_ratio(reference.picture, found[0])
        if found is None or fading is None:
            raise CannotTellError("the vehicle ahead is too small in the image, or hidden")
        picture, likeness = found
        if fading.ratio < SURE * fading.deviation:
            # The best of many places would be that of the noise: it is where it was expected.
            picture, fading = expected, contrast_ratio(reference.picture, expected) or fading
            fading = replace(fading, deviation=math.hypot(fading.deviation, UNPLACED * fading.ratio))
        least, most = self._bounds(distance, densest)
        if fading.visible * least > VISIBLE and likeness < max(ALIKE, _likeness_if_fixed(scene, reference)):
            raise CannotTellError("what is seen there does not look like the vehicle that was tracked")
        if fading.ratio > most + 4.0 * fading.deviation:
            raise CannotTellError("what is seen there has more contrast than fog leaves")
        window, alike = scene.window(picture), likeness >= ALIKE
        return Sight(0, distance, scene.depth, time, picture, window, fading, scene.sky.is_clipped, alike)

    def _bounds(self, distance: float, densest: float) -> tuple[float, float]:
        """Least and greatest contrast that the vehicle can have at a range, over that of the reference."""
        nearer = [s.fading.ratio + 4.0 * s.fading.deviation for s in self.sights if s.distance <= distance + SPACING]
        nearest = min(self.sights, key=lambda s: abs(s.distance - distance))
        least = nearest.fading.ratio * math.exp(-min(densest, DENSEST) * abs(distance - nearest.distance))
        return least, GROWTH * min(nearer, default=math.inf)

    def _compare_anew(self, reference: Sight) -> None:
        """Take the nearest picture for the reference of all: it shows the most."""
        self.reference = reference
        pairs = [(s, contrast_ratio(reference.picture, s.picture)) for s in self.sights]
        self.sights.clear()
        self.sights.extend(replace(s, fading=fading) for s, fading in pairs if fading is not None)

    def _forget_old(self, time: float) -> None:
        while self.sights and time - self.sights[0].time > self._window:
            self.sights.popleft()
        if self.reference is not None and all(s.picture is not self.reference.picture for s in self.sights):
            if not self.sights:
                self.forget()
                return
            self._compare_anew(min(self.sights, key=lambda s: s.depth))


def _likeness_if_fixed(scene: VehicleCrop, reference: Sight) -> float:
    """Correlation that a vehicle must have: that of what is at the reference's place and of its size in the image."""
    change = abs(math.log(scene.depth / reference.depth))
    if change < SCALED:
        return 0.0
    around = RoadBehind(scene.camera.mount_height, 1.0)
    found = register_rear(reference.picture, scene.picture(reference.window, reference.picture.scale), 0.1, 0.1, around)
    return 0.0 if found is None else found[1] - (BETTER if change < RESCALED else 0.0)
