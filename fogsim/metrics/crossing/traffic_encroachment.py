"""How closely in time vehicles whose ways cross drive over the same place."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.crossing.tracks import (
    UNKNOWN,
    Floats,
    Fronts,
    Junctions,
    Numbers,
    Tracks,
    crossing_pieces,
    tracks_through,
)
from fogsim.metrics.metric import Definition, JsonValue, definitions_of
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan

_LEAST_ANGLE = math.radians(20.0)
"""Angle between two ways from which on they cross, instead of going side by side or ahead of one another [rad]."""

_CORNERS = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])


class _Encroachments(NamedTuple):
    """Pairs of vehicles that have driven over the same area one after the other."""

    # first, second (k,) int: vehicles, in the order of their fronts
    first: Numbers
    second: Numbers
    junction: Numbers  # (k,) int: Where
    time: Floats  # (k,): Post-encroachment time [s]; 0 where the second came before the first had left


def _find_encroachments(tracks: Tracks) -> _Encroachments:
    """Post-encroachment times of all pairs whose ways cross, at each place where they do.

    Bodies of widths w₁, w₂ on straight ways that cross at the angle θ both sweep a parallelogram, whose corners lie at
    ± w₂ / (2 sin θ) along the first way and ± w₁ / (2 sin θ) along the second one. At each of its points

        PET = (time at which the second one's front comes) − (time at which the first one's rear has left),

    and the least of these is at a corner: that is said, and 0 where it is negative [1, 2]. Times are interpolated from
    where the fronts were at the steps; a rear passes where its front has driven the vehicle's length beyond, and is
    gone with its vehicle. Ways that come from the same lane or lead to the same one do not cross.
    """
    piece = np.flatnonzero(tracks.junction >= 0)
    piece = piece[np.argsort(tracks.junction[piece], kind="stable")]
    fronts = tracks.fronts
    places = np.stack((fronts.x, fronts.y), axis=1)
    begin, way = places[piece - 1], places[piece] - places[piece - 1]
    least_sine = math.sin(_LEAST_ANGLE)
    found = crossing_pieces(begin, way, tracks.junction[piece], fronts.vehicle[piece], least_sine)
    numbers, parts = found[:, :2].astype(np.intp), found[:, 2:]
    row = piece[numbers]
    apart = ~(_alike(tracks.origin[row]) | _alike(tracks.target[row]))
    numbers, parts, row = numbers[apart], parts[apart], row[apart]
    time = fronts.time[row - 1] + parts * (fronts.time[row] - fronts.time[row - 1])
    # Who comes first stands first.
    order = np.argsort(time, axis=1, kind="stable")
    numbers, row = np.take_along_axis(numbers, order, axis=1), np.take_along_axis(row, order, axis=1)
    parts = np.take_along_axis(parts, order, axis=1)
    place = tracks.travelled[row - 1] + parts * (tracks.travelled[row] - tracks.travelled[row - 1])
    left, came = _least_apart(tracks, row, place, way[numbers])
    between = np.maximum((came - left).min(axis=0, initial=np.inf), 0.0)
    return _Encroachments(fronts.vehicle[row[:, 0]], fronts.vehicle[row[:, 1]], tracks.junction[row[:, 0]], between)


def _least_apart(tracks: Tracks, row: Numbers, place: Floats, way: Floats) -> tuple[Floats, Floats]:
    """When the first has left each corner of the area, and when the second comes there (4, k) [s]."""
    direction = way / np.hypot(way[..., 0], way[..., 1])[..., None]
    (ax, ay), (bx, by) = direction[:, 0].T, direction[:, 1].T
    cosine, sine = ax * bx + ay * by, np.abs(ax * by - ay * bx)
    along_first = _CORNERS[:, :1] * tracks.fronts.width[row[:, 1]] / (2.0 * sine)
    along_second = _CORNERS[:, 1:] * tracks.fronts.width[row[:, 0]] / (2.0 * sine)
    gone = place[:, 0] + tracks.fronts.length[row[:, 0]] + along_first + cosine * along_second
    there = place[:, 1] + along_second + cosine * along_first
    first, second = (np.broadcast_to(rows, gone.shape) for rows in row.T)
    return tracks.time_at(first, gone), tracks.time_at(second, there)


def _alike(lanes: NDArray[np.intp]) -> NDArray[np.bool_]:
    alike: NDArray[np.bool_] = (lanes[:, 0] == lanes[:, 1]) & (lanes[:, 0] != UNKNOWN)
    return alike


_MEMORY = 10.0
"""Time after which a vehicle that has left is no more compared with those who come [s]."""

_CONFLICT = 5.0
"""Post-encroachment time up to which SSAM by default calls an encounter a conflict [s] (FHWA-HRT-08-051)."""

_SERIOUS = 1.0
"""Time below which it is critical [s] (Várhelyi, Accident Analysis and Prevention 30 (1998), 731-742)."""


@dataclass(slots=True)
class TrafficEncroachment(TrafficMetric):
    """Post-encroachment time (PET) of vehicles whose ways cross in a junction, the least of each pair.

    A junction is where SUMO's lanes have names that begin with a colon; the formula is `_find_encroachments`'.
    """

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_encroachment")
    _exposure: Exposure = field(default_factory=Exposure)
    _junctions: Junctions = field(default_factory=Junctions)
    _spans: list[TrafficSpan] = field(default_factory=list)
    _kept: list[Fronts] = field(default_factory=list)
    _since: float = 0.0
    _least: dict[tuple[int, int, int], float] = field(default_factory=dict)

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self._exposure.add(span)
        if not len(span.time):
            return
        now = float(span.time[-1])
        if not self._junctions.learn(span.lane_names):
            # Its last rows may be those before the first junction.
            self._spans, self._since = [span], now
            return
        self._spans.append(span)
        if now - self._since >= _MEMORY:
            self._compare()
            self._since = now

    def _compare(self) -> None:
        """Compare all who are new, and keep those whom others may still encounter."""
        rows = Fronts.joined([*self._kept, *(Fronts.of(span) for span in self._spans)])
        self._spans = []
        if not len(rows.time):
            return
        tracks = tracks_through(rows, self._junctions)
        columns = (column.tolist() for column in _find_encroachments(tracks))
        for first, second, junction, time in zip(*columns, strict=True):
            pair = min(first, second), max(first, second), junction
            self._least[pair] = min(time, self._least.get(pair, _MEMORY))
        now = rows.time.max()
        kept = rows.time == now
        inside = np.flatnonzero(tracks.junction >= 0)
        left = tracks.time_at(inside, tracks.travelled[inside] + tracks.fronts.length[inside])
        late = inside[left > now - _MEMORY]
        since = np.full(len(tracks.start), len(tracks.track))
        np.minimum.at(since, tracks.track[late], late - 1)
        kept[tracks.source[np.arange(len(tracks.track)) >= since[tracks.track]]] = True
        self._kept = [rows.chosen(kept)]

    def result(self) -> dict[str, JsonValue]:
        """Say how closely they followed one another."""
        if self._junctions.learn(()) and self._spans:
            self._compare()
        times = np.array([time for time in self._least.values() if time < _MEMORY])
        rate = self._exposure.per_kilometre
        return {
            "traffic_minimum_post_encroachment_time_s": float(times.min()) if len(times) else None,
            "traffic_post_encroachments_below_5_s_per_vehicle_km": rate(int((times <= _CONFLICT).sum())),
            "traffic_post_encroachments_below_1_s_per_vehicle_km": rate(int((times <= _SERIOUS).sum())),
        }
