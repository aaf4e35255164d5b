"""What is known of each sign of the map while it is driven past: from how far it was seen, and where it was missed."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from fogsim.estimators.signs.regions import ProjectedSign
from fogsim.estimators.signs.registration import Registration

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
