"""How many vehicles pass the cross sections of a road."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.metrics.metric import Definition, JsonValue, definitions_of, share
from fogsim.metrics.road_speeds import ROAD_HALF_WIDTH
from fogsim.metrics.traffic_span import HOUR, TrafficMetric, TrafficSpan

Floats = NDArray[np.float64]
Numbers = NDArray[np.intp]

_NOT_YET = -2.0
"""Step at which a vehicle was last seen that has not been seen."""

_LEAST_COSINE = math.cos(math.radians(45.0))
"""Ways at a larger angle to the road are on another one [-]."""


@kernel
def _count_passages(
    position: Floats,
    step: Numbers,
    vehicle: Numbers,
    last: Floats,
    sections: Floats,
    read: NDArray[np.bool_],
    first: int,
    half_width: float,
) -> int:
    """Count in `read` (k, s) how often vehicles pass sections (s, 4) [m] of a road in its direction."""
    count = 0
    for i in range(len(position)):
        v = vehicle[i]
        came_x, came_y, clear = last[v, 0], last[v, 1], 0.0
        if last[v, 2] == step[i] - 1:
            way, clear = math.hypot(position[i, 0] - came_x, position[i, 1] - came_y), last[v, 3]
            if way < clear:
                clear -= way
            else:
                nearest = math.inf
                for j in range(len(sections)):
                    x, y, along_x, along_y = sections[j]
                    nearest = min(nearest, (position[i, 0] - x) ** 2 + (position[i, 1] - y) ** 2)
                    after = (position[i, 0] - x) * along_x + (position[i, 1] - y) * along_y
                    before = (came_x - x) * along_x + (came_y - y) * along_y
                    if before >= 0.0 or after < max(_LEAST_COSINE * way + before, 0.0) or not read[step[i] - first, j]:
                        continue
                    aside_after = (position[i, 1] - y) * along_x - (position[i, 0] - x) * along_y
                    aside_before = (came_y - y) * along_x - (came_x - x) * along_y
                    if abs(aside_before * after - aside_after * before) <= half_width * (after - before):
                        count += 1
                clear = math.sqrt(nearest) - half_width
        last[v, 0], last[v, 1], last[v, 2], last[v, 3] = position[i, 0], position[i, 1], step[i], clear
    return count


SPACING = 250.0
"""Way from one cross section to the next [m]; the first lies half of it from where the road begins."""

_FASTEST = 80.0
"""Speed at which no one departs from the ego [m/s]."""

_AHEAD = 5.0
"""How far to either side along the road its direction is taken [m]."""


@dataclass(slots=True)
class TrafficThroughput(TrafficMetric):
    """Flow: vehicles that pass cross sections of the ego's route, or of ``traffic.along``, over the time of counting.

    A section is counted at while it is read: always without an ego, else while it is within the reading radius. Who
    passes is found from two steps that follow one another, in the direction of the road and within 20 m of its line.
    The ego, whose coming decides when is counted, is not counted itself.
    """

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_throughput")
    _sections: NDArray[np.float64] | None = None
    _last: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 4)))
    _passed: int = 0
    _time: float = 0.0

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        if span.route is None:
            return
        if self._sections is None:
            self._sections = _sections_along(span.route)
        read, time = _when_read(span, self._sections)
        self._time += time
        missing = int(span.vehicle.max(initial=-1)) + 1 - len(self._last)
        self._last = np.concatenate((self._last, np.full((max(missing, 0), 4), _NOT_YET)))
        others = np.ones(len(span.vehicle), np.bool_)
        if span.ego is not None:
            others[span.ego] = False
        rows = span.position[others, :2], span.moment[others], span.vehicle[others]
        first = int(span.moment[0]) if len(span.moment) else 0
        self._passed += _count_passages(*rows, self._last, self._sections, read, first, ROAD_HALF_WIDTH)

    def result(self) -> dict[str, JsonValue]:
        """Say how many passed."""
        return {"traffic_flow_vehicles_per_h": share(HOUR * self._passed, self._time)}


def _sections_along(road: NDArray[np.float64]) -> NDArray[np.float64]:
    """Middles [m] and unit vectors along the road (s, 4) of cross sections of a polyline (m, 3) [m]."""
    x, y = road[:, 0], road[:, 1]
    place = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    middle = np.arange(0.5 * SPACING, place[-1], SPACING)
    begin, end = (
        np.stack((np.interp(middle + ahead, place, x), np.interp(middle + ahead, place, y)), axis=1)
        for ahead in (-_AHEAD, _AHEAD)
    )
    way = end - begin
    return np.concatenate((0.5 * (begin + end), way / np.hypot(way[:, :1], way[:, 1:])), axis=1)


def _when_read(span: TrafficSpan, sections: NDArray[np.float64]) -> tuple[NDArray[np.bool_], float]:
    """Which sections are read at each step that has rows, from the first one on, and for how long all of them [s]."""
    if span.ego is None:
        steps = int(np.ptp(span.moment)) + 1 if len(span.moment) else 0
        return np.ones((steps, len(sections)), np.bool_), span.duration * len(sections)
    ego, elapsed = span.position[span.ego, None, :2], span.elapsed[span.ego, None]
    away = np.hypot(*np.moveaxis(ego - sections[:, :2], -1, 0))
    # None is read while the ego is off the lanes.
    read = np.zeros((int(np.ptp(span.moment)) + 1 if len(span.moment) else 0, len(sections)), np.bool_)
    # Who passes was read at the step before, too.
    near = read[span.moment[span.ego] - span.moment[:1]] = away <= span.reading_radius - _FASTEST * elapsed
    return read, float((near * elapsed).sum())
