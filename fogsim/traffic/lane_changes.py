"""Smooth lane changes for the camera.

SUMO's vehicles change lane in one step. Its own ways to make them take time cost many times the whole simulation
(``lanechange.duration`` 3 … 20 times, the sublane model 13 … 40 times), so here only where vehicles are *shown* glides
from the old lane to the new one; all that SUMO computes with (gaps, speeds, collisions) is as it was.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.values import TrafficState

DURATION = 3.0
"""Time that a change by one lane takes [s]."""

LANE_WIDTH = 3.75
"""Whoever moves farther to the side than this takes longer, at the same sideways speed [m]."""

LEAST_JUMP, LARGEST_JUMP = 0.5, 8.0
"""Sideways jumps from a lane to another that count as a change of lane [m]. Smaller ones are bends, or changes that the
simulation makes smooth by itself; larger ones are vehicles moved by hand."""

TOP_SPEED = 100.0
"""Speed that no road vehicle exceeds [m/s]."""

LEAST_SPEED = 10.0
"""Slower vehicles turn to the side no farther than if they were this fast [m/s]."""

_BEGUN, _OFFSET, _RATE, _DURATION = range(4)


class LaneChangeSmoothing:
    """Lets vehicles that change lane glide to it: a cubic from their place and sideways speed to rest in the new lane.

    The new lane is SUMO's from the first step on, in `TrafficState.lane` too; the heading follows the sideways speed.
    States in which nobody has changed lane within the last 3 s are given back as they are.
    """

    def __init__(self) -> None:
        self._last: TrafficState | None = None
        self._ids: list[str] = []
        self._glides = np.empty((0, 4))

    def smoothed(self, state: TrafficState) -> TrafficState:
        """The state as it is to be seen; the states of one run are to be given in their order."""
        last, self._last = self._last, state
        if last is not None:
            changed = _lane_changed(last, state)
            if changed:
                self._begin(last, state, changed)
        return self._glided(state) if self._ids else state

    def _begin(self, last: TrafficState, state: TrafficState, changed: Sequence[str]) -> None:
        """Let those who have jumped begin to glide, from where an earlier glide has brought them."""
        jumps = _sideways_jumps(last, state, changed)
        under_way = dict(zip(self._ids, self._glides, strict=True))
        for vehicle, jump in zip(changed, jumps.tolist(), strict=True):
            if LEAST_JUMP <= abs(jump) <= LARGEST_JUMP:
                offset, rate = jump, 0.0
                if vehicle in under_way:
                    (left,), (rate,) = _course(under_way[vehicle][None], state.time)
                    offset += left
                duration = DURATION * max(1.0, abs(offset) / LANE_WIDTH)
                under_way[vehicle] = np.array([state.time, offset, rate, duration])
        self._keep(under_way)

    def _keep(self, glides: dict[str, NDArray[np.float64]]) -> None:
        self._ids = list(glides)
        self._glides = np.array(list(glides.values())).reshape(-1, 4)

    def _glided(self, state: TrafficState) -> TrafficState:
        row = {vehicle: i for i, vehicle in enumerate(state.ids)}
        over = state.time >= self._glides[:, _BEGUN] + self._glides[:, _DURATION]
        if over.any() or not row.keys() >= set(self._ids):
            glides = zip(self._ids, self._glides, over.tolist(), strict=True)
            self._keep({v: glide for v, glide, is_over in glides if not is_over and v in row})
            if not self._ids:
                return state
        rows = [row[vehicle] for vehicle in self._ids]
        offset, rate = _course(self._glides, state.time)
        position, heading = state.position.copy(), state.heading.copy()
        position[rows, 0] += offset * np.sin(heading[rows])
        position[rows, 1] -= offset * np.cos(heading[rows])
        heading[rows] -= np.arctan2(rate, np.maximum(state.speed[rows], LEAST_SPEED))
        return replace(state, position=position, heading=heading)


def _lane_changed(last: TrafficState, state: TrafficState) -> list[str]:
    """Vehicles of both states whose lane is another, be it only the next along the road."""
    if state.lane == last.lane and state.ids == last.ids:
        return []
    before = dict(zip(last.ids, last.lane, strict=True))
    return [v for v, lane in zip(state.ids, state.lane, strict=True) if before.get(v, lane) != lane]


def _sideways_jumps(last: TrafficState, state: TrafficState, vehicles: Sequence[str]) -> NDArray[np.float64]:
    """How far vehicles have moved to their left (n,) [m]; ``inf`` for those who were not driven there."""
    before, now = ({v: i for i, v in enumerate(s.ids)} for s in (last, state))
    old, new = [before[v] for v in vehicles], [now[v] for v in vehicles]
    moved = state.position[new, :2] - last.position[old, :2]
    # Along an arc one moves in the direction of the mean heading, so that a bend is no move to the side.
    turn = np.remainder(state.heading[new] - last.heading[old] + np.pi, 2.0 * np.pi) - np.pi
    middle = last.heading[old] + 0.5 * turn
    jump = moved[:, 1] * np.cos(middle) - moved[:, 0] * np.sin(middle)
    reach = TOP_SPEED * (state.time - last.time) + LARGEST_JUMP
    return np.where(np.hypot(moved[:, 0], moved[:, 1]) <= reach, jump, np.inf)


def _course(glides: NDArray[np.float64], time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What is left of the way to the new lane, to the left (n,) [m], and its rate of change (n,) [m/s].

    The cubic Hermite polynomial from (offset, rate) to (0, 0); a smoothstep for who starts without sideways speed.
    """
    offset, rate, duration = glides[:, _OFFSET], glides[:, _RATE], glides[:, _DURATION]
    s = np.minimum((time - glides[:, _BEGUN]) / duration, 1.0)
    left = offset * (1.0 + s * s * (2.0 * s - 3.0)) + rate * duration * s * (1.0 - s) ** 2
    change = 6.0 * offset / duration * s * (s - 1.0) + rate * (1.0 - s) * (1.0 - 3.0 * s)
    return left, change
