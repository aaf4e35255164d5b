"""Smooth lane changes for the camera.

SUMO's vehicles change lane in one step. Its own ways to make them take time cost many times the whole simulation
(``lanechange.duration`` 3 … 20 times, the sublane model 13 … 40 times), so here only where vehicles are *shown* glides
from the old lane to the new one; all that SUMO computes with (gaps, speeds, collisions) is as it was.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.values import TrafficState

DURATION = 3.0
"""Time that a change by one lane takes [s]."""

_LEAST_DURATION = 0.001
"""Time that a change at once takes [s]."""

_LANE_WIDTH = 3.75
"""Whoever moves farther to the side than this takes longer, at the same sideways speed [m]."""

_LEAST_JUMP, _LARGEST_JUMP = 0.5, 8.0
"""Sideways jumps from a lane to another that count as a change of lane [m]. Smaller ones are bends, or changes that the
simulation makes smooth by itself; larger ones are vehicles moved by hand."""

_LARGEST_TURN = 0.3
"""Vehicles that turn farther between two states have turned off at a junction [rad]."""

_TOP_SPEED = 100.0
"""Speed that no road vehicle exceeds [m/s]."""

_LEAST_SPEED = 10.0
"""Slower vehicles turn to the side no farther than if they were this fast [m/s]."""


@dataclass(frozen=True, slots=True)
class _Glide:
    """Way to a lane: the cubic Hermite polynomial from (offset, rate) to (0, 0), a smoothstep if the rate is 0."""

    # begun, duration: when it began, and how long it takes [s]
    begun: float
    duration: float
    # offset, rate: what was left of the way then, to the left [m], and its rate of change [m/s]
    offset: float
    rate: float

    def left(self, time: float) -> tuple[float, float]:
        """What is left of the way at a time, to the left [m], and its rate of change [m/s]."""
        s = min((time - self.begun) / self.duration, 1.0)
        rest = 1.0 - s
        left = self.offset * (1.0 + s * s * (2.0 * s - 3.0)) + self.rate * self.duration * s * rest * rest
        return left, self.rate * rest * (1.0 - 3.0 * s) - 6.0 * self.offset / self.duration * s * rest


class _Before(NamedTuple):
    """What is compared with the next state, in arrays of its own: whoever gets a state may change its arrays."""

    time: float
    ids: tuple[str, ...]
    lane: tuple[str, ...]
    position: NDArray[np.float64]
    heading: NDArray[np.float64]


class LaneChangeSmoothing:
    """Lets vehicles that change lane glide to it: a cubic from their place and sideways speed to rest in the new lane.

    The new lane is SUMO's from the first step on, in `TrafficState.lane` too; the heading follows the sideways speed.
    States in which no one has changed lane within the last 3 s stay as they are.
    """

    def __init__(self) -> None:
        self._last: _Before | None = None
        self._glides: dict[str, _Glide] = {}
        self._wanted: dict[str, float] = {}

    def take_time(self, vehicle: str, duration: float) -> None:
        """Let the next change of a vehicle take a time (`duration` [s])."""
        self._wanted[vehicle] = duration

    def smooth(self, state: TrafficState) -> None:
        """Write to a state where vehicles are to be seen; the states of one run are to be given in their order."""
        last = self._last
        self._last = _Before(state.time, state.ids, state.lane, state.position.copy(), state.heading.copy())
        if last is not None:
            changed = _lane_changed(last, state)
            if changed:
                self._begin(last, state, changed)
        if self._glides:
            self._glide(state)

    def _begin(self, last: _Before, state: TrafficState, changed: Sequence[tuple[int, int]]) -> None:
        """Let those who have jumped begin to glide, from where an earlier glide has brought them."""
        for (_, row), jump in zip(changed, _sideways_jumps(last, state, changed).tolist(), strict=True):
            if _LEAST_JUMP <= abs(jump) <= _LARGEST_JUMP:
                vehicle = state.ids[row]
                earlier = self._glides.get(vehicle)
                left, rate = (0.0, 0.0) if earlier is None else earlier.left(state.time)
                offset = left + jump
                usual = DURATION * max(1.0, abs(offset) / _LANE_WIDTH)
                duration = max(self._wanted.pop(vehicle, usual), _LEAST_DURATION)
                self._glides[vehicle] = _Glide(state.time, duration, offset, rate)

    def _glide(self, state: TrafficState) -> None:
        position, heading = state.position, state.heading
        # Plain numbers: mostly one vehicle or two are on their way, for which arrays would cost ten times as much.
        for vehicle, glide in list(self._glides.items()):
            row = state.row(vehicle)
            if row is None or state.time >= glide.begun + glide.duration:
                del self._glides[vehicle]
                continue
            left, rate = glide.left(state.time)
            angle = float(heading[row])
            position[row, 0] += left * math.sin(angle)
            position[row, 1] -= left * math.cos(angle)
            heading[row] = angle - math.atan2(rate, max(float(state.speed[row]), _LEAST_SPEED))


def _lane_changed(last: _Before, state: TrafficState) -> list[tuple[int, int]]:
    """Rows in both states of vehicles on lanes whose lane is another, be it only the next along the road."""
    before: Sequence[int] = range(len(last.ids))
    if state.ids != last.ids:
        known = {vehicle: row for row, vehicle in enumerate(last.ids)}
        before = [known.get(vehicle, -1) for vehicle in state.ids]
    elif state.lane == last.lane:
        return []
    lanes = (*last.lane, "")
    both = enumerate(zip(before, state.lane, strict=True))
    return [(old, new) for new, (old, lane) in both if lane and lanes[old] not in ("", lane)]


def _sideways_jumps(last: _Before, state: TrafficState, changed: Sequence[tuple[int, int]]) -> NDArray[np.float64]:
    """How far vehicles have moved to their left (n,) [m]; ``inf`` for those who were not driven there."""
    old, new = np.array(changed).T
    moved = state.position[new, :2] - last.position[old, :2]
    # Along an arc one moves in the direction of the mean heading, so that a bend is no move to the side.
    turn = np.remainder(state.heading[new] - last.heading[old] + np.pi, 2.0 * np.pi) - np.pi
    middle = last.heading[old] + 0.5 * turn
    jump = moved[:, 1] * np.cos(middle) - moved[:, 0] * np.sin(middle)
    reach = _TOP_SPEED * (state.time - last.time) + _LARGEST_JUMP
    driven = (np.hypot(moved[:, 0], moved[:, 1]) <= reach) & (np.abs(turn) < _LARGEST_TURN)
    return np.where(driven, jump, np.inf)
