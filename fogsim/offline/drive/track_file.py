"""Positions of a vehicle: GPX or CSV, WGS 84."""

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.readers import column_names, number_in_text, read_text, refuse_other_length
from fogsim.core.files.xml_reader import read_tree
from fogsim.errors import InputError, shown

_SEMI_MAJOR, _FLATTENING = 6_378_137.0, 1.0 / 298.257223563
"""Ellipsoid of WGS 84: semi-major axis [m], flattening [-] (NIMA TR8350.2, 2000, table 3.1)."""

_LONGEST_GAP = 5.0
"""Time without a position after which the track counts as interrupted [s]."""

_LONGEST_TIME = 1e12
"""Largest number in a track: time in seconds since 1970 is about 2e9."""

MOVING, _MOST_LOOKED_AT = 10.0, 100
"""Distance over which a direction is derived from positions [m], and number of positions before and after."""

_HEADING, _OTHER_HEADINGS = "heading_deg", ("heading", "course", "bearing", "azimuth", "yaw")
"""Column of the direction of travel, and words in the names of columns that could mean it in other units."""

COLUMNS: Mapping[str, tuple[str, ...]] = {
    "time": ("time_s", "time"),
    "latitude": ("latitude", "lat"),
    "longitude": ("longitude", "lon"),
}
"""Columns of a CSV file, and their possible names."""


class GeographicPose(NamedTuple):
    """WGS 84 position [rad] and direction of travel, counterclockwise from east [rad], of the camera."""

    longitude: float
    latitude: float
    heading: float


@dataclass(frozen=True, slots=True)
class Track:
    """Positions of a drive, each (n,): increasing time [s], WGS 84 [rad], and direction of travel [rad].

    The direction is counterclockwise from east and has no jumps.
    """

    path: Path
    time: NDArray[np.float64]
    longitude: NDArray[np.float64]
    latitude: NDArray[np.float64]
    heading: NDArray[np.float64]

    def pose_at(self, time: float) -> GeographicPose | None:
        """Pose at an instant of the track's time [s], interpolated; None outside the track."""
        after = int(np.searchsorted(self.time, time))
        if time < self.time[0] or after == len(self.time):
            return None
        before = max(after - 1, 0)
        if self.time[after] - self.time[before] > _LONGEST_GAP:
            return None
        columns = (self.longitude, self.latitude, self.heading)
        return GeographicPose(*(float(np.interp(time, self.time, column)) for column in columns))

    def way_at(self, time: float) -> float | None:
        """Length of the track up to an instant of its time [m]; None outside the track."""
        if self.pose_at(time) is None:
            return None
        east, north = metres_per_radian(float(self.latitude.mean()))
        steps = np.hypot(east * np.diff(self.longitude), north * np.diff(self.latitude))
        return float(np.interp(time, self.time, np.concatenate(([0.0], np.cumsum(steps)))))


def metres_per_radian(latitude: float) -> tuple[float, float]:
    """Distance east and north per angle of longitude and latitude on the ellipsoid of WGS 84 [m/rad].

    The radii of curvature at latitude φ [rad] are M = a (1 − e²) / (1 − e² sin²φ)^1.5 along the meridian and N = a /
    √(1 − e² sin²φ) across it, so that the distance east is N cos φ.
    """
    square = _FLATTENING * (2.0 - _FLATTENING)
    share = 1.0 - square * math.sin(latitude) ** 2
    return _SEMI_MAJOR * math.cos(latitude) / math.sqrt(share), _SEMI_MAJOR * (1.0 - square) / share**1.5


def load_track(path: Path) -> Track:
    """Read the positions of a drive from ``.gpx`` or ``.csv``.

    GPX: the points of all tracks, whose time counts from the first. CSV with a heading line: ``time_s`` (or ``time`` as
    ISO 8601, which counts from the first), ``latitude`` and ``longitude`` in degrees, and optionally ``heading_deg``,
    clockwise from north. Missing headings follow from positions at least `MOVING` apart.
    """
    readers = {".gpx": _gpx_points, ".csv": _csv_points}
    if path.suffix.lower() not in readers:
        raise InputError(f"--track {path}: expected a name that ends in .gpx or .csv")
    # Receivers write 0, 0 as long as they have no position.
    points = [one for one in readers[path.suffix.lower()](path) if one[1:3] != (0.0, 0.0)]
    points = [one for number, one in enumerate(points) if number == 0 or one[0] != points[number - 1][0]]
    if len(points) < 2:
        raise InputError(f"--track {path}: expected two positions with different times or more, got {len(points)}")
    time, latitude, longitude, headings = np.array(points).T
    back = np.flatnonzero(np.diff(time) < 0)
    if back.size:
        raise InputError(f"--track {path}: time goes back after position {back[0] + 1} of {len(points)}")
    longitude, latitude = np.unwrap(np.radians(longitude)), np.radians(latitude)
    return Track(path, time, longitude, latitude, _headings(path, longitude, latitude, headings))


Point = tuple[float, float, float, float]
"""Time [s], latitude, longitude, and heading clockwise from north [deg], NaN if missing."""


def _gpx_points(path: Path) -> Iterator[Point]:
    start = None
    for number, point in enumerate(read_tree(path, "gpx").iter("trkpt")):
        where = f"--track {path}: point {number}"
        text = (point.findtext("time") or "").strip()
        if not text:
            raise InputError(f"{where} has no <time>, so nothing says which image it belongs to")
        time = _instant(where, text)
        start = time if start is None else start
        yield time - start, *_degrees(where, point.get("lat"), point.get("lon")), math.nan


def _csv_points(path: Path) -> Iterator[Point]:
    rows = csv.DictReader(io.StringIO(read_text(path), newline=""))
    try:
        names = column_names(path, rows.fieldnames)
        column = {meant: _column(path, names, known) for meant, known in COLUMNS.items()}
        _refuse_other_heading(path, names)
        counted, start = column["time"] == "time_s", None
        for row in rows:
            where = f"--track {path}: line {rows.line_num}"
            refuse_other_length(where, row)
            text = row[column["time"]]
            time = _float(where, "time_s", text) if counted else _instant(where, text)
            start = (0.0 if counted else time) if start is None else start
            heading = _float(where, _HEADING, row[_HEADING]) if row.get(_HEADING) else math.nan
            yield time - start, *_degrees(where, row[column["latitude"]], row[column["longitude"]]), heading
    except csv.Error as error:
        raise InputError(f"{path}:{rows.line_num + 1}: not valid CSV: {error}") from error


def _column(path: Path, names: Sequence[str], known: Sequence[str]) -> str:
    for name in known:
        if name in names:
            return name
    raise InputError(f"--track {path}: expected a column {' or '.join(known)}, got {', '.join(names) or 'none'}")


def _refuse_other_heading(path: Path, names: Sequence[str]) -> None:
    others = [name for name in names if any(word in name.lower() for word in _OTHER_HEADINGS)]
    if others and _HEADING not in names:
        raise InputError(
            f"--track {path}: expected headings in a column {_HEADING}, clockwise from north, got {shown(others[0])}; "
            "rename it, or leave it out and they follow from the positions"
        )


def _instant(where: str, text: str) -> float:
    try:
        moment = datetime.fromisoformat(text)
        # Without a zone, not that of this computer, whose clock may be put forward on the way.
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError) as error:
        raise InputError(f"{where}: expected a time as 2026-05-04T07:08:09.5Z, got {shown(text)}") from error


def _degrees(where: str, latitude: str | None, longitude: str | None) -> tuple[float, float]:
    north, east = _float(where, "latitude", latitude), _float(where, "longitude", longitude)
    if abs(north) > 90.0 or abs(east) > 180.0:
        raise InputError(f"{where}: expected latitude within ±90° and longitude within ±180°, got {north:g}, {east:g}")
    return north, east


def _float(where: str, name: str, text: str | None) -> float:
    return number_in_text(where, name, text or "", -_LONGEST_TIME, _LONGEST_TIME)


def _headings(
    path: Path, longitude: NDArray[np.float64], latitude: NDArray[np.float64], headings: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Directions of travel: as given, otherwise from the position before to the one after."""
    given = np.radians(90.0 - headings)
    if not np.isnan(given).any():
        return np.unwrap(given)
    east, north = metres_per_radian(float(latitude.mean()))
    place = np.stack((east * longitude, north * latitude), axis=1)
    found = np.full(len(place), math.nan)
    for number in range(len(place)):
        start = max(number - _MOST_LOOKED_AT, 0)
        near = place[start : number + _MOST_LOOKED_AT + 1]
        apart = np.hypot(*(near - place[number]).T) >= 0.5 * MOVING
        before, after = np.flatnonzero(apart[: number - start]), np.flatnonzero(apart[number - start :])
        first = near[before[-1]] if before.size else place[number]
        last = near[number - start + after[0]] if after.size else place[number]
        if np.hypot(*(last - first)) >= 0.5 * MOVING:
            found[number] = math.atan2(*(last - first)[::-1])
    found = np.where(np.isnan(given), found, given)
    known = np.flatnonzero(~np.isnan(found))
    if not known.size:
        raise InputError(f"--track {path}: the track never moves by {MOVING:g} m; give heading_deg in a CSV file")
    return np.interp(np.arange(len(found)), known, np.unwrap(found[known]))
