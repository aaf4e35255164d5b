"""Axes of roads: straight lines, arcs and spirals end to end, with a profile of grades."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.road.opendrive import Piece

Points = NDArray[np.float64]

_STRAIGHT_STEP, _STEP = 100.0, 12.0  # between points of straights, and most between others [m]
_SAGITTA = 0.02  # how far a chord may lie next to its arc [m]
_SAME = 1e-6  # [m]


@dataclass(frozen=True, slots=True)
class Bend:
    """A stretch of plan whose curvature is linear in its length."""

    length: float  # Length [m]
    # start, end: curvature where it begins and ends [1/m]; positive to the left, 0 for straight ahead
    start: float = 0.0
    end: float = 0.0


@dataclass(frozen=True, slots=True)
class Axis:
    """A line with a direction at each point."""

    points: Points  # (n, 3): Its points [m]
    headings: NDArray[np.float64]  # (n,): Direction at each, counterclockwise from east [rad]
    stations: NDArray[np.float64]  # (n,): How far along the axis that it was cut from each lies, in plan [m]

    @property
    def length(self) -> float:
        """Length in plan [m]."""
        return float(self.stations[-1] - self.stations[0])

    def beside(self, left: float) -> Points:
        """Points (n, 3) at a distance to its left [m] (`left` [m])."""
        aside = np.stack([-np.sin(self.headings), np.cos(self.headings), np.zeros(len(self.headings))], axis=-1)
        shifted: Points = self.points + left * aside
        return shifted

    def moved(self, left: float) -> "Axis":
        """The same axis at a distance to its left; stations stay (`left` [m])."""
        return Axis(self.beside(left), self.headings, self.stations)

    def reversed(self) -> "Axis":
        """The same line the other way; stations from its new beginning."""
        return Axis(self.points[::-1], self.headings[::-1] + math.pi, self.stations[-1] - self.stations[::-1])

    def part(self, start: float, end: float) -> "Axis":
        """What lies between two stations (`start`, `end` [m])."""
        inside = self.stations[(self.stations > start + _SAME) & (self.stations < end - _SAME)]
        return self._at(np.concatenate([[start], inside, [end]]))

    def _at(self, stations: NDArray[np.float64]) -> "Axis":
        points = np.stack([np.interp(stations, self.stations, self.points[:, k]) for k in range(3)], axis=-1)
        return Axis(points, np.interp(stations, self.stations, self.headings), stations)


def axis_of(
    bends: Sequence[Bend], grades: Sequence[tuple[float, float]] = (), start: tuple[float, float, float] = (0, 0, 0)
) -> Axis:
    """Axis from its bends (`grades` (float, float) [m], `start` [m], [rad])."""
    station, place = 0.0, start
    rows = [(station, *place)]
    for bend in bends:
        piece = Piece(0.0, bend.length, *place, bend.start, (bend.end - bend.start) / bend.length)
        count = math.ceil(bend.length / _step(bend, grades))
        rows += [(station + d, *piece.at(d)) for d in np.linspace(0.0, bend.length, count + 1)[1:].tolist()]
        station, place = station + bend.length, piece.at(bend.length)
    table = np.array(rows, np.float64)
    plan = Axis(np.column_stack([table[:, 1:3], np.zeros(len(table))]), table[:, 3], table[:, 0])
    if not grades:
        return plan
    knots = [s for s, _ in grades if 0.0 < s < station]
    plan = plan._at(np.union1d(plan.stations, knots))
    return Axis(np.column_stack([plan.points[:, :2], _heights(plan.stations, grades)]), plan.headings, plan.stations)


def _step(bend: Bend, grades: Sequence[tuple[float, float]]) -> float:
    sharpest = max(abs(bend.start), abs(bend.end))
    if sharpest:
        return min(_STEP, math.sqrt(8.0 * _SAGITTA / sharpest))
    return _STEP if grades else _STRAIGHT_STEP


def _heights(stations: NDArray[np.float64], grades: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    """Heights [m]: the integral of grades that are linear between the stations."""
    at = np.interp(stations, [s for s, _ in grades], [g for _, g in grades])
    return np.concatenate([[0.0], np.cumsum(0.5 * (at[1:] + at[:-1]) * np.diff(stations))])
