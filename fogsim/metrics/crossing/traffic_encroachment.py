"""How closely in time vehicles whose ways cross drive over the same place."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from fogsim.metrics.crossing.encroachment import find_encroachments
from fogsim.metrics.crossing.tracks import Fronts, Junctions, tracks_through
from fogsim.metrics.metric import Definition, JsonValue, definitions_of
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan

MEMORY = 10.0
"""Time after which a vehicle that has left is no more compared with those who come [s]."""

CONFLICT = 5.0
"""Post-encroachment time up to which SSAM by default calls an encounter a conflict [s] (FHWA-HRT-08-051)."""

SERIOUS = 1.0
"""Time below which it is critical [s] (Várhelyi, Accident Analysis and Prevention 30 (1998), 731-742)."""


@dataclass(slots=True)
class TrafficEncroachment(TrafficMetric):
    """Post-encroachment time (PET) of vehicles whose ways cross in a junction, the least of each pair.

    A junction is where SUMO's lanes have names that begin with a colon; the formula is `find_encroachments`'.
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
        if now - self._since >= MEMORY:
            self._compare()
            self._since = now

    def _compare(self) -> None:
        """Compare all who are new, and keep those whom others may still encounter."""
        rows = Fronts.joined([*self._kept, *(Fronts.of(span) for span in self._spans)])
        self._spans = []
        if not len(rows.time):
            return
        tracks = tracks_through(rows, self._junctions)
        columns = (column.tolist() for column in find_encroachments(tracks))
        for first, second, junction, time in zip(*columns, strict=True):
            pair = min(first, second), max(first, second), junction
            self._least[pair] = min(time, self._least.get(pair, MEMORY))
        now = rows.time.max()
        kept = rows.time == now
        inside = np.flatnonzero(tracks.junction >= 0)
        left = tracks.time_at(inside, tracks.travelled[inside] + tracks.fronts.length[inside])
        late = inside[left > now - MEMORY]
        since = np.full(len(tracks.start), len(tracks.track))
        np.minimum.at(since, tracks.track[late], late - 1)
        kept[tracks.source[np.arange(len(tracks.track)) >= since[tracks.track]]] = True
        self._kept = [rows.chosen(kept)]

    def result(self) -> dict[str, JsonValue]:
        """Say how closely they followed one another."""
        if self._junctions.learn(()) and self._spans:
            self._compare()
        times = np.array([time for time in self._least.values() if time < MEMORY])
        rate = self._exposure.per_kilometre
        return {
            "traffic_minimum_post_encroachment_time_s": float(times.min()) if len(times) else None,
            "traffic_post_encroachments_below_5_s_per_vehicle_km": rate(int((times <= CONFLICT).sum())),
            "traffic_post_encroachments_below_1_s_per_vehicle_km": rate(int((times <= SERIOUS).sum())),
        }
