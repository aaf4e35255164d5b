"""Signs of your own map along your own drive: where each image should show them, and whether it does."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.readers import number_within, read_json
from fogsim.errors import InputError, shown
from fogsim.estimators.signs.regions import PoseDeviation
from fogsim.estimators.signs.watch import SignTrack, sign_looks
from fogsim.estimators.signs.watch import SignWatch as Watch
from fogsim.offline.drive.track_file import GeographicPose, Track, load_track, metres_per_radian
from fogsim.offline.image_files import Pixels
from fogsim.offline.source import Source
from fogsim.recorders.sign_marks import NET
from fogsim.scene import SIGN_KINDS
from fogsim.sensors import signs_ahead
from fogsim.units import KMH_PER_MPS
from fogsim.values import Camera, Frame, Observation, Sign, SignLook, SignMap, SignSighting

USUAL_HEIGHT, USUAL_DIAMETER = 2.2, 0.6
"""Default height of a face's middle above the road, and its default size [m]."""

_WGS84 = ("CRS84", "4326")
"""Suffixes of the names of coordinate frames that GeoJSON may use."""


@dataclass(frozen=True, slots=True)
class GeographicSign:
    """A sign of the map at a WGS 84 position [rad]; `height` of its middle above the road and `diameter` are in m.

    `value` is the speed of a speed limit [m/s]; `heading` is the direction of travel that it applies to,
    counterclockwise from east [rad], None if the map does not give it.
    """

    sign_id: str
    kind: str
    value: float
    longitude: float
    latitude: float
    height: float
    diameter: float
    heading: float | None


@dataclass(frozen=True, slots=True)
class SignFile:
    """A map with at least one sign, each with a unique id, and remarks on what was assumed or skipped."""

    path: Path
    signs: tuple[GeographicSign, ...]
    remarks: tuple[str, ...]


def load_sign_file(path: Path) -> SignFile:
    """Read a map of signs: a GeoJSON FeatureCollection of points, as ``fogsim signs`` writes it with WGS 84.

    Properties: ``kind`` (required), ``height_m``, ``diameter_m``, ``heading_deg`` (clockwise from north, the direction
    of travel that the sign applies to), ``speed_limit_kmh``. Features other than points are skipped.
    """
    content = _read(path)
    _refuse_other_frames(path, content)
    features = content.get("features")
    if not isinstance(features, list):
        raise InputError(f'{path}: expected a GeoJSON FeatureCollection with "features", got {_kind_of(content)}')
    points = [(number, one) for number, one in enumerate(features) if _is_point(one)]
    if not points:
        raise InputError(f"{path}: the map has no signs: expected features that are points, got {len(features)} others")
    signs = tuple(_sign(f"{path}: feature {number}", number, one) for number, one in points)
    twice = [sign_id for sign_id, count in Counter(sign.sign_id for sign in signs).items() if count > 1]
    if twice:
        raise InputError(f"{path}: two signs have the id {twice[0]!r}; ids must be unique, or left out")
    return SignFile(path, signs, tuple(_remarks(path, signs, points, len(features) - len(points))))


def _read(path: Path) -> dict[str, Any]:
    content = read_json(path)
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected a GeoJSON FeatureCollection, got {type(content).__name__}")
    return content


def _kind_of(content: Mapping[str, Any]) -> str:
    return f"type {shown(content['type'])}" if "type" in content else "no type"


def _refuse_other_frames(path: Path, content: Mapping[str, Any]) -> None:
    """Refuse a map that declares other coordinates than longitude and latitude."""
    if content.get("coordinates") == NET:
        raise InputError(
            f"{path}: its points are x and y of a SUMO network, which has no projection; expected longitude and "
            "latitude, WGS 84"
        )
    frame = content.get("crs") or "CRS84"
    name = _block(_block(frame).get("properties")).get("name", frame)
    if not isinstance(name, str) or not name.endswith(_WGS84):
        raise InputError(f"{path}: the map is in {shown(name)}; expected longitude and latitude, WGS 84 (EPSG:4326)")


def _block(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _is_point(feature: Any) -> bool:
    return _block(_block(feature).get("geometry")).get("type") == "Point"


def _sign(where: str, number: int, feature: Mapping[str, Any]) -> GeographicSign:
    content = _block(feature.get("properties"))
    kind, sign_id = content.get("kind"), feature.get("id", content.get("id", number))
    if not isinstance(kind, str) or not kind:
        raise InputError(f'{where}: a sign needs a property "kind", as "speed_limit" or "stop", got {shown(kind)}')
    if not isinstance(sign_id, str | int | float):
        raise InputError(f"{where}: expected text or a number for its id, got {shown(sign_id)}")
    longitude, latitude = _place(where, feature["geometry"].get("coordinates"))
    heading = _number(where, content, "heading_deg", math.nan, -360.0, 360.0)
    limit = _number(where, content, "speed_limit_kmh", math.nan, 0.0, 300.0) / KMH_PER_MPS
    return GeographicSign(
        str(sign_id),
        kind,
        limit,
        math.radians(longitude),
        math.radians(latitude),
        _number(where, content, "height_m", USUAL_HEIGHT, 0.0, 20.0),
        _number(where, content, "diameter_m", USUAL_DIAMETER, 0.1, 10.0),
        None if math.isnan(heading) else math.radians(90.0 - heading),
    )


def _place(where: str, content: Any) -> tuple[float, float]:
    """Longitude and latitude [deg]."""
    if not isinstance(content, list) or len(content) < 2:
        raise InputError(f"{where}: expected coordinates [longitude, latitude], got {shown(content)}")
    longitude, latitude = (
        number_within(where, key, one) for key, one in zip(("longitude", "latitude"), content[:2], strict=True)
    )
    if abs(longitude) > 180.0 or abs(latitude) > 90.0:
        raise InputError(
            f"{where}: expected longitude within ±180° and latitude within ±90° (WGS 84), got {content[:2]}: "
            "the map is in another coordinate frame"
        )
    return longitude, latitude


def _number(where: str, content: Mapping[str, Any], key: str, usual: float, least: float, most: float) -> float:
    """Number of a property; the default if it is missing."""
    value = content.get(key)
    return usual if value is None else number_within(where, key, value, least, most)


def _remarks(path: Path, signs: tuple[GeographicSign, ...], points: list[tuple[int, Any]], others: int) -> list[str]:
    def without(key: str) -> int:
        return sum(_block(one.get("properties")).get(key) is None for _, one in points)

    assumed = [
        (without("height_m"), f"no height_m: {USUAL_HEIGHT} m above the road are assumed"),
        (without("diameter_m"), f"no diameter_m: {USUAL_DIAMETER} m are assumed"),
        (without("heading_deg"), "no heading_deg: they are taken to face the vehicle that comes nearest"),
    ]
    remarks = [f"{path}: {_count(count)} with {what}" for count, what in assumed if count]
    unknown = sorted({sign.kind for sign in signs if sign.kind.removeprefix("xodr.") not in SIGN_KINDS})
    if unknown:
        remarks.append(f"{path}: unknown kinds, searched as signs of any kind: {', '.join(unknown[:5])}")
    if others:
        remarks.append(f"{path}: {others} features that are not points are skipped")
    return remarks


def _count(count: int) -> str:
    return "1 sign" if count == 1 else f"{count} signs"


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
