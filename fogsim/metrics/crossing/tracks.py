"""Tracks of vehicles through junctions, from their rows in steps."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.metrics.traffic_span import TrafficSpan

Floats = NDArray[np.float64]
Numbers = NDArray[np.intp]

_ROUNDING = 1e-9


@kernel
def crossing_pieces(begin: Floats, way: Floats, junction: Numbers, vehicle: Numbers, least_sine: float) -> Floats:
    """Pairs of pieces [m] in one junction that cross: their numbers, and at which part of either, 0 … 1 (k, 4)."""
    found, count = np.empty((64, 4)), 0
    length = np.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2)
    for i in range(len(begin)):
        for j in range(i + 1, len(begin)):
            if junction[j] != junction[i]:
                break
            reach = length[i] + length[j]
            x, y = begin[j, 0] - begin[i, 0], begin[j, 1] - begin[i, 1]
            if abs(x) > reach or abs(y) > reach or vehicle[j] == vehicle[i]:
                continue
            cross = way[i, 0] * way[j, 1] - way[i, 1] * way[j, 0]
            if abs(cross) <= least_sine * length[i] * length[j]:
                continue
            at = (x * way[j, 1] - y * way[j, 0]) / cross
            other = (x * way[i, 1] - y * way[i, 0]) / cross
            # A crossing where one piece ends and the next begins is in both, rather than by rounding in neither.
            if min(at, other) >= -_ROUNDING and max(at, other) <= 1.0 + _ROUNDING:
                if count == len(found):
                    grown = np.empty((2 * count, 4))
                    grown[:count] = found
                    found = grown
                found[count, 0], found[count, 1], found[count, 2], found[count, 3] = i, j, at, other
                count += 1
    return found[:count]


_CLEARANCE = 6.0
"""Way beyond its length after which a vehicle has left the junction's last crossing with others [m]."""

UNKNOWN = -1
"""Number of a lane that was not seen, and of the junction of a lane outside of all."""

INTERVAL = 0.3
"""Time between two rows that is short enough [s]: at 3 m/s² the way between them is straight in time to 3 cm."""

_JUMP = 5.0
"""Way in one step beyond one and a half times that of the speed, from which a vehicle has been put elsewhere [m]."""


class Fronts(NamedTuple):
    """Where fronts of vehicles were; row i is one vehicle at one step."""

    # vehicle, lane (n,) int: numbers of vehicle and lane
    vehicle: Numbers
    lane: Numbers
    # time, elapsed (n,): time, and that since the step before [s]
    time: Floats
    elapsed: Floats
    # x, y (n,): middle of the front bumper [m]
    x: Floats
    y: Floats
    # speed, length, width (n,): speed [m/s]; size of the body [m]
    speed: Floats
    length: Floats
    width: Floats

    @classmethod
    def of(cls, span: TrafficSpan) -> "Fronts":
        """Those of some steps, of short ones but the first and one in each `INTERVAL`."""
        time, elapsed = span.time, span.elapsed
        x, y = span.position[:, 0], span.position[:, 1]
        fronts = cls(span.vehicle, span.lane, time, elapsed, x, y, span.speed, span.length, span.width)
        ticks = time / INTERVAL + 1e-6
        return fronts.chosen((np.floor(ticks) > np.floor(ticks - elapsed / INTERVAL)) | (elapsed == 0.0))

    @classmethod
    def joined(cls, parts: Sequence["Fronts"]) -> "Fronts":
        """All rows of several, one after the other."""
        return parts[0]._replace(
            **{name: np.concatenate([getattr(part, name) for part in parts]) for name in cls._fields}
        )

    def chosen(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "Fronts":
        """Some of the rows."""
        return self._replace(**{name: getattr(self, name)[rows] for name in self._fields})


class Junctions:
    """Junctions of lanes, `UNKNOWN` for none: SUMO calls the lanes of a junction J ``:J_edge_lane``."""

    def __init__(self) -> None:
        self.of_lane: Numbers = np.zeros(0, np.intp)
        self._known: dict[str, int] = {}

    def learn(self, lane_names: Sequence[str]) -> bool:
        """Take in the lanes so far; True if any of them lies in a junction."""
        new = lane_names[len(self.of_lane) :]
        if new:
            found = [self._number(name) for name in new]
            self.of_lane = np.concatenate((self.of_lane, np.array(found, dtype=np.intp)))
        return bool(self._known)

    def _number(self, lane: str) -> int:
        if not lane.startswith(":"):
            return UNKNOWN
        return self._known.setdefault(lane.rsplit("_", 2)[0], len(self._known))


class Tracks(NamedTuple):
    """Ways through junctions, one vehicle's after another's."""

    # Rows in the order of vehicle and time; of each way from the row before the junction on, until the rear has left
    fronts: Fronts
    source: Numbers  # (n,) int: Rows that these were
    track: Numbers  # (n,) int: Number of the way that a row belongs to
    # start, end (m,) int: first and last row of each way
    start: Numbers
    end: Numbers
    travelled: Floats  # (n,): Way of the front along all of them [m]
    # (n,) int: Junction in which the way from the row before to this one lies; `UNKNOWN` where there is none, or no way
    junction: Numbers
    # origin, target (n,) int: lanes from which and to which the vehicle goes through it, `UNKNOWN` where that was not
    # seen
    origin: Numbers
    target: Numbers

    def time_at(self, row: Numbers, travelled: Floats) -> Floats:
        """Time at which a front is at a place of its way (k,) [s]; that of the way's nearer end beyond it."""
        if not row.size:
            return travelled
        track = self.track[row]
        ends = self.travelled[self.start[track]], self.travelled[self.end[track]]
        return np.interp(np.clip(travelled, *ends), self.travelled, self.fronts.time)


def tracks_through(fronts: Fronts, junctions: Junctions) -> Tracks:
    """Ways of vehicles through junctions."""
    source = _rows_at_junctions(fronts, junctions.of_lane[fronts.lane] >= 0)
    fronts = fronts.chosen(source)
    way = np.hypot(*_steps(fronts.x, fronts.y))
    elapsed = np.diff(fronts.time, prepend=fronts.time[:1])
    # A vehicle that is put elsewhere, or comes back, begins another way.
    begins = _changes(fronts.vehicle) | (elapsed > fronts.elapsed + INTERVAL)
    begins |= way > 1.5 * elapsed * np.maximum(fronts.speed, np.roll(fronts.speed, 1)) + _JUMP
    track = np.cumsum(begins) - 1
    start = np.flatnonzero(begins)
    end = np.append(start[1:], len(begins))[: len(start)] - 1
    inside = junctions.of_lane[fronts.lane]
    junction = np.where(inside >= 0, inside, np.roll(inside, 1))
    number = np.arange(len(begins))
    before = np.maximum.accumulate(np.where(inside < 0, number, -1))
    after = np.minimum.accumulate(np.where(inside < 0, number, len(begins))[::-1])[::-1]
    before[1:] = before[:-1].copy()
    known = (before >= start[track]) & ~begins, after <= end[track]
    origin, target = (
        np.where(seen, fronts.lane[np.where(seen, row, 0)], UNKNOWN)
        for seen, row in zip(known, (before, after), strict=True)
    )
    moves = ~begins & (way > 0.0)
    return Tracks(
        fronts=fronts,
        source=source,
        track=track,
        start=start,
        end=end,
        travelled=np.cumsum(np.where(begins, 1.0, way)),
        junction=np.where(moves, junction, UNKNOWN),
        origin=origin,
        target=target,
    )


def _rows_at_junctions(fronts: Fronts, inside: NDArray[np.bool_]) -> Numbers:
    """Rows in junctions, those before, and those after until the rear is clear of it; by vehicle and time."""
    # numpy sorts numbers of 16 bits and less by counting.
    short = fronts.vehicle.astype(np.min_scalar_type(int(fronts.vehicle.max(initial=0))))
    order = np.argsort(short, kind="stable")
    first, inner, number = _changes(fronts.vehicle[order]), inside[order], np.arange(len(order))
    travelled = np.cumsum(np.hypot(*_steps(fronts.x[order], fronts.y[order])))
    last_inner = np.maximum.accumulate(np.where(inner, number, -1))
    been = last_inner >= np.maximum.accumulate(np.where(first, number, 0))
    wanted = been & (travelled - travelled[last_inner] <= fronts.length[order] + _CLEARANCE)
    wanted[1:] |= wanted[:-1] & ~first[1:]
    wanted[:-1] |= inner[1:] & ~first[1:]
    rows: Numbers = order[wanted]
    return rows


def _steps(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    return np.diff(x, prepend=x[:1]), np.diff(y, prepend=y[:1])


def _changes(vehicle: Numbers) -> NDArray[np.bool_]:
    changes: NDArray[np.bool_] = np.diff(vehicle, prepend=-1) != 0
    return changes
