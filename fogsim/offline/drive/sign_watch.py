"""Signs of your own map along your own drive: where each image should show them, and whether it does."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.estimators.signs.regions import PoseDeviation
from fogsim.estimators.signs.watch import SignTrack, sign_looks
from fogsim.estimators.signs.watch import SignWatch as Watch
from fogsim.offline.drive.sign_file import SignFile, load_sign_file
from fogsim.offline.drive.track_file import GeographicPose, Track, load_track, metres_per_radian
from fogsim.offline.image_files import Pixels
from fogsim.offline.source import Source
from fogsim.sensors import signs_ahead
from fogsim.values import Camera, Frame, Observation, Sign, SignLook, SignMap, SignSighting

REACH = 250.0
"""Distance ahead up to which signs are searched [m]."""

_OWN_DRIVE = PoseDeviation(position=2.0, height=0.4, heading=math.radians(1.0), pitch=math.radians(0.3))
"""Accuracy of positions from a receiver in a car and a map that was drawn from images."""

_FAR_AWAY = 10_000.0
"""Distance between track and map above which they are in different frames, or of different drives [m]."""


@dataclass(frozen=True, slots=True)
class SignSummary:
    """Result for a sign of a drive.

    Attributes
    ----------
    sign_id, kind : str
        The sign's id and type in the map.
    first_seen : float or None
        Distance at which it was first detected [m]; None if it never was, or once only.
    detections, misses : int
        Images that showed it, and that should have but did not.
    """

    sign_id: str
    kind: str
    first_seen: float | None
    detections: int
    misses: int


class SignWatch:
    """Signs of a map along a track, searched in image after image.

    The track is assumed to be the camera's, and the road ahead to be a plane.

    Parameters
    ----------
    signs : SignFile
        The map.
    track : Track
        The drive.
    camera : Camera
        The calibration of its camera.
    offset : float
        Time of the track at the first image [s].

    Raises
    ------
    InputError
        If no sign is near the track.
    """

    def __init__(self, signs: SignFile, track: Track, camera: Camera, offset: float = 0.0) -> None:
        self._track, self._offset = track, offset
        self._signs = signs.signs
        self._longitude = np.array([sign.longitude for sign in signs.signs])
        self._latitude = np.array([sign.latitude for sign in signs.signs])
        self._nearest = self._nearest_positions(signs.path)
        self._camera, self._watch = camera, Watch(camera, None, _OWN_DRIVE)
        self._passed: list[SignTrack] = []
        self._images = self._outside = 0

    def sightings(self, time: float) -> tuple[SignSighting, ...] | None:
        """Signs ahead by the map; None if the track has no position.

        Parameters
        ----------
        time : float
            Time from the first image [s].
        """
        pose = self._track.pose_at(time + self._offset)
        self._images += 1
        if pose is None:
            self._outside += 1
            return None
        return signs_ahead(self._around(pose), np.zeros(3), pose.heading, REACH)

    def look(self, image: Pixels, time: float, sightings: tuple[SignSighting, ...]) -> tuple[SignLook, ...]:
        """Search for signs in an image.

        Parameters
        ----------
        image : (rows, cols[, 3]) uint8 or uint16
            The image.
        time : float
            Its time [s].
        sightings : tuple of SignSighting
            Signs ahead by the map.

        Returns
        -------
        tuple of SignLook
            One for each sign that the image may show.
        """
        if image.dtype == np.uint16 and self._camera.bits == 8:
            # Of the whole range, the upper half of the bits shows signs well enough.
            image = (image >> 8).astype(np.uint8)
        watched = self._watch.look(Observation(Frame(time, image, self._camera), signs=sightings))
        self._passed += watched.passed
        return sign_looks(watched, self._watch.tracks)

    def summary(self) -> Iterator[SignSummary]:
        """Result for each sign, in order of appearance."""
        known: dict[str, SignSummary] = {}
        for track in (*self._passed, *self._watch.tracks):
            sign, first = track.sign.sighting, track.first_seen if track.confirmed else None
            # A sign at the border of the visible area may appear more than once.
            was = known.get(sign.sign_id) or SignSummary(sign.sign_id, sign.kind, None, 0, 0)
            first = first if was.first_seen is None else was.first_seen
            counts = (was.detections + track.detections, was.misses + track.misses)
            known[sign.sign_id] = SignSummary(sign.sign_id, sign.kind, first, *counts)
        yield from known.values()

    def remarks(self) -> Iterator[str]:
        """Faults of map, track and camera, judged by the results."""
        signs = list(self.summary())
        if self._outside:
            times = self._track.time[[0, -1]] - self._offset
            yield (
                f"{self._outside} of {self._images} images are not covered by the track, which has "
                f"{times[0]:.1f} … {times[1]:.1f} s from the first image, gaps left out: no signs there"
            )
        if self._outside < self._images and not signs:
            yield (
                "no image should show any sign of the map: do they face the other way (heading_deg), does the track "
                "begin at another time (--track-offset), or are they too small in the images?"
            )
        if signs and not any(sign.detections for sign in signs):
            yield (
                f"none of the {len(signs)} signs that images should show was found: the map may be in another "
                "coordinate frame or the track at another time (--track-offset), or fog hides them all"
            )

    def _around(self, pose: GeographicPose) -> SignMap:
        """Signs within reach in the tangent plane of the ellipsoid at a pose, which is the origin."""
        east, north = metres_per_radian(pose.latitude)
        x = east * np.remainder(self._longitude - pose.longitude + math.pi, 2.0 * math.pi) - east * math.pi
        y = north * (self._latitude - pose.latitude)
        return SignMap(
            tuple(self._placed(j, x[j], y[j]) for j in np.flatnonzero(np.hypot(x, y) <= 1.1 * REACH).tolist())
        )

    def _placed(self, number: int, x: float, y: float) -> Sign:
        sign, heading = self._signs[number], self._signs[number].heading
        if heading is None:
            heading = float(self._track.heading[self._nearest[number]])
        return Sign(sign.sign_id, sign.kind, sign.value, (float(x), float(y), sign.height), heading, sign.diameter)

    def _nearest_positions(self, path: Path) -> NDArray[np.intp]:
        """Index of the track position nearest to each sign; InputError if no sign is near the track."""
        distance, nearest = _apart(self._track, self._longitude, self._latitude)
        if distance.min() > REACH:
            swapped, _ = _apart(self._track, self._latitude, self._longitude)
            hint = ""
            if swapped.min() <= REACH:
                hint = ": longitude and latitude are swapped in the map; GeoJSON has longitude first"
            elif distance.min() > _FAR_AWAY:
                hint = ": map and track are in different coordinate frames, or of different drives"
            raise InputError(
                f"{path}: no sign lies near the track {self._track.path}; the nearest is {_far(distance.min())} "
                f"away{hint}"
            )
        return nearest


def _apart(
    track: Track, longitude: NDArray[np.float64], latitude: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Least distance of each sign to the track's positions [m], and the index of that position."""
    distance, nearest = np.empty(len(longitude)), np.empty(len(longitude), np.intp)
    east, north = metres_per_radian(float(track.latitude.mean()))
    for number, (one, other) in enumerate(zip(longitude, latitude, strict=True)):
        turned = np.remainder(one - track.longitude + math.pi, 2.0 * math.pi) - math.pi
        square = (east * turned) ** 2 + (north * (other - track.latitude)) ** 2
        nearest[number] = square.argmin()
        distance[number] = math.sqrt(square[nearest[number]])
    return distance, nearest


def _far(distance: float) -> str:
    return f"{distance / 1000.0:.0f} km" if distance > _FAR_AWAY else f"{distance:.0f} m"


def watch_signs(
    signs: str | Path, track: str | Path, source: Source, camera: Camera, offset: float = 0.0
) -> tuple[SignWatch, tuple[str, ...]]:
    """Read a map of signs and a track for the images of a source.

    Parameters
    ----------
    signs : path
        GeoJSON; see `fogsim.offline.drive.sign_file.load_sign_file`.
    track : path
        GPX or CSV; see `fogsim.offline.drive.track_file.load_track`.
    source : Source
        The images; a sequence, a video or one image.
    camera : Camera
        Their calibration.
    offset : float
        Time of the track at the first image [s].

    Returns
    -------
    tuple of SignWatch and of str
        For `estimates_of`, and the assumptions about the map.

    Raises
    ------
    InputError
        If a file cannot be used, the images are stills, or the track ends before the first image.
    """
    if source.count > 1 and not source.temporal:
        raise InputError("--track has positions by time, but these images are stills without times: add --sequence")
    if not math.isfinite(offset):
        raise InputError(f"--track-offset must be a number of seconds, got {offset!r}")
    mapped, driven = load_sign_file(Path(signs)), load_track(Path(track))
    first, last = driven.time[[0, -1]] - offset
    # A video may not state its length.
    end = math.inf if source.temporal and source.count == 1 else source.period * max(source.count - 1, 0)
    if first > end or last < 0.0:
        raise InputError(
            f"--track {track}: covers {first:.1f} … {last:.1f} s from the first image, and the images "
            f"0 … {end:.1f} s: see --track-offset"
        )
    return SignWatch(mapped, driven, camera, offset), mapped.remarks
