"""Search frame after frame for the signs of the map, and follow how far away each is detected."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.estimators.signs.regions import (
    PoseDeviation,
    ProjectedSign,
    Registration,
    project_sightings,
    register_signs,
)
from fogsim.values.camera import Camera
from fogsim.values.estimate import SignLook
from fogsim.values.image import for_kernels
from fogsim.values.observation import LeadMeasurement, Observation
from fogsim.vision.light.daylight import TOO_DARK, lit_by_lamps
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.horizon import calibrated_horizon, levelled
from fogsim.vision.strips.sky import Sky, sky_above
from fogsim.vision.symmetry.detection import detect_signs

_CONFIRMED = 2
"""Detections, without two misses between them, from which the first one counts."""

_FORGOTTEN = 2
"""Misses one after another by which a detection that was not confirmed was a false alarm."""


@dataclass(frozen=True, slots=True)
class SignTrack:
    """What is known of one sign."""

    sign: ProjectedSign  # The sign when it was last looked for
    time: float  # When that was [s]
    first_seen: float | None = None  # Distance of the camera when it was first detected, d_sign, if it was [m]
    confidence: float = 0.0  # p(c) of that detection [-]
    # Nearest distance before that at which it should have been seen and was not [m]; None if it was seen at the first
    # look, so that it may have been visible from farther away
    unseen_before: float | None = None
    # detections, misses: looks at which it was detected, and at which it should have been and was not
    detections: int = 0
    misses: int = 0
    misses_since: int = 0  # Of these, how many came one after another in the end

    @property
    def confirmed(self) -> bool:
        """Whether it was detected often enough for its first detection to count."""
        return self.detections >= _CONFIRMED


class SignTracks:
    """Signs of the map, looked for in picture after picture."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all signs."""
        self._tracks: dict[str, SignTrack] = {}

    @property
    def tracks(self) -> tuple[SignTrack, ...]:
        """Signs ahead, in the order in which they came."""
        return tuple(self._tracks.values())

    def update(
        self, time: float, signs: Sequence[ProjectedSign], found: Iterable[Registration]
    ) -> tuple[SignTrack, ...]:
        """Add one look.

        Returns signs that were not looked for any more, as they were left: they have been passed. Takes `time` [s].
        """
        seen = {one.sign.sighting.sign_id: one for one in found}
        ahead = {sign.sighting.sign_id: sign for sign in reversed(signs)}
        passed = tuple(track for sign_id, track in self._tracks.items() if sign_id not in ahead)
        before = self._tracks
        self._tracks = {}
        for sign_id in sorted(ahead, key=lambda each: (each not in before, ahead[each].distance)):
            track = replace(before.get(sign_id) or SignTrack(ahead[sign_id], time), sign=ahead[sign_id], time=time)
            hit = seen.get(sign_id)
            self._tracks[sign_id] = _missed(track) if hit is None else _seen(track, hit)
        return passed


def _seen(track: SignTrack, hit: Registration) -> SignTrack:
    if track.first_seen is None:
        track = replace(track, first_seen=track.sign.distance, confidence=hit.confidence)
    return replace(track, detections=track.detections + 1, misses_since=0)


def _missed(track: SignTrack) -> SignTrack:
    if not track.sign.expected:
        return track
    track = replace(track, misses=track.misses + 1, misses_since=track.misses_since + 1)
    if track.first_seen is not None and not track.confirmed and track.misses_since >= _FORGOTTEN:
        track = replace(track, first_seen=None, confidence=0.0, detections=0)
    return track if track.first_seen is not None else replace(track, unseen_before=track.sign.distance)


_STRANGE = 3
"""Successive signs not found at their position in the map after which the map is doubted."""

_MIN_AIRLIGHT = 6.0
"""Sky darker than this is no day [linear grey levels]."""

_WELL_SEEN = 30.0
"""Range within which a sign must have been searched to know that it is not simply too far to see [m]."""


@dataclass(frozen=True, slots=True)
class Watched:
    """What one frame showed of the signs ahead."""

    signs: tuple[ProjectedSign, ...]  # Where the map has them
    found: tuple[Registration, ...]  # Those that were detected
    passed: tuple[SignTrack, ...]  # Signs that are no longer ahead
    sky: Sky | None = None  # The sky, if there are signs to look for and it is seen
    night: str = ""  # Why the picture is none by day, or nothing


class SignWatch:
    """Projects the map's signs into the picture, detects and registers them, and follows each (`setback` [m])."""

    def __init__(self, camera: Camera, setback: float | None, deviation: PoseDeviation) -> None:
        self._camera, self._setback, self._deviation = camera, setback, deviation
        self._margin = 3.0 * calibrated_horizon(camera, deviation.pitch).standard_deviation + 2.0
        self._tracks = SignTracks()
        self.reset()

    def reset(self) -> None:
        """Forget all signs."""
        self._tracks.reset()
        self._lost = 0
        self._has_signs = False

    @property
    def tracks(self) -> tuple[SignTrack, ...]:
        """Signs ahead."""
        return self._tracks.tracks

    def look(self, observation: Observation) -> Watched:
        """Look for the signs of one frame."""
        image, sightings = for_kernels(observation.image), observation.signs
        ids = [one.sign_id for one in sightings]
        if len(set(ids)) < len(ids):
            twice = next(one for one in ids if ids.count(one) > 1)
            raise InputError(f"the ids of a map's signs must differ, got {twice!r} twice; its value names one sign")
        self._has_signs = self._has_signs or bool(sightings)
        setback = observation.camera_setback if self._setback is None else self._setback
        signs = project_sightings(sightings, self._camera, setback, self._deviation)
        sky, night = self._daylight(image, observation.lead) if signs else (None, "")
        if night:
            # What lamps light is seen farther than by day, and what they do not less far.
            self._tracks.reset()
            return Watched((), (), (), sky, night)
        found = register_signs(signs, detect_signs(image, [sign.region for sign in signs])) if signs else ()
        passed = self._tracks.update(observation.time, signs, found)
        for track in passed:
            if track.confirmed:
                self._lost = 0
            elif track.unseen_before is not None and track.unseen_before < _WELL_SEEN:
                self._lost += 1
        return Watched(signs, found, passed, sky)

    def _daylight(
        self, image: NDArray[np.uint8] | NDArray[np.uint16], lead: LeadMeasurement | None
    ) -> tuple[Sky | None, str]:
        level = levelled(image, self._camera)
        sky = sky_above(linear_pixels(level, self._camera), self._camera, self._margin)
        if sky is not None and sky.luminance < _MIN_AIRLIGHT:
            return sky, TOO_DARK
        return sky, lit_by_lamps(level, self._camera, lead)

    @property
    def trouble(self) -> str:
        """Why no sign can be seen; empty if one might be."""
        if self._lost >= _STRANGE:
            return (
                f"the last {self._lost} signs were not found at their positions in the map: the map may be in another "
                "coordinate frame, or the camera's calibration be wrong"
            )
        return "" if self._has_signs else "no sign ahead in the map within sensors.sign_reach_m"


def sign_looks(watched: Watched, tracks: Iterable[SignTrack]) -> tuple[SignLook, ...]:
    """What came of looking for each sign that the picture may show, for ``Estimate.diagnostics["sign_looks"]``."""
    pairs = {one.sign.sighting.sign_id: one for one in watched.found}
    known = {one.sign.sighting.sign_id: one for one in tracks}
    ids = [sign.sighting.sign_id for sign in watched.signs]
    return tuple(_look(sign, pairs.get(one), known[one]) for one, sign in zip(ids, watched.signs, strict=True))


def _look(sign: ProjectedSign, pair: Registration | None, track: SignTrack) -> SignLook:
    first = track.first_seen if track.confirmed else None
    look = SignLook(sign.sighting.sign_id, sign.u, sign.v, sign.radius, sign.distance, pair is not None, first)
    if pair is None:
        return look
    return replace(look, u=pair.detection.u, v=pair.detection.v, radius=pair.detection.radius)
