"""Vehicles in the neighbouring lanes: which of them block a change that is wanted, and which the driver perceives."""

import functools
import math
import operator
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from fogsim.traffic.sumo.link import vehicle_getter, vehicle_getters
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps, VehicleSight

NEAR = 5.0
"""A vehicle next to, or with less gap than this along the road, is seen in any fog [m]."""

# Bits of signals, states and modes in SUMO's TraCI protocol.
_BLINKERS = 1 | 2
_TRACI, _URGENT = 128, 256
_LEADERS, _BLOCKING = 2, 4
_LEFT_LEADERS = _LEADERS

_NO_ONE = "", math.inf


_Others = tuple[tuple[str, float], ...]
"""Vehicles in another lane, and the gaps to them [m]."""


class _Side(NamedTuple):
    """One side of a vehicle, in SUMO's numbers."""

    offset: int  # From the vehicle's lane to the neighbouring one
    # wanted, leader, follower, blocked: bits of the lane-change state: the driver wants to go there, is blocked there
    # by a vehicle ahead, or behind, or by any
    wanted: int
    leader: int
    follower: int
    blocked: int
    neighbours: int  # What to ask for its followers by


_LEFT = _Side(1, 2, 512, 1024, 512 | 1024, 0)
_RIGHT = _Side(-1, 4, 2048, 4096, 2048 | 4096, 1)


@dataclass(frozen=True, slots=True)
class WantedChange:
    """A change of lane that a driver wants."""

    driver: str  # Id of the vehicle
    side: _Side  # Where to
    is_urgent: bool  # True if the route needs it, for which drivers ask others to make room
    # leaders, followers: who is in the way in the other lane
    leaders: _Others
    followers: _Others

    @property
    def blockers(self) -> _Others:
        """All vehicles that are in the way, and the gaps to them [m]."""
        return self.leaders + self.followers


class Neighbours:
    """Asks SUMO for neighbours and for changes that are blocked."""

    def __init__(self, view: DriversView) -> None:
        self._signals, self._lane = view.getters("getSignals", "getLaneID")
        (self._left_leaders,) = vehicle_getters(
            view.api, view.remote, ("getNeighbors",), {"getNeighbors": ("b", _LEFT_LEADERS)}
        )
        self._station = vehicle_getter(view.api, "getLanePosition")
        self._left_lane = functools.cache(_next_lane)
        self._neighbours = vehicle_getter(view.api, "getNeighbors")
        self._state = vehicle_getter(view.api, "getLaneChangeState")

    def left_leaders(self, vehicles: Sequence[str]) -> list[tuple[str, float]]:
        """Next vehicle ahead of each in the lane to the left, and the gap to it [m]; ``inf`` if there is none."""
        ask, both = self._left_leaders, zip(vehicles, map(self._lane, vehicles), strict=True)
        # SUMO breaks down when it is asked for those of a vehicle that has never been on a lane.
        found = [ask(vehicle, _LEFT_LEADERS) if lane else () for vehicle, lane in both]
        return [(_nearest(those) if those[1:] else those[0]) if those else _NO_ONE for those in found]

    def is_ahead_on_the_left(self, vehicle: str, other: str, reach: float) -> bool:
        """Whether another one is ahead in the lane to the left, front to front no farther than `reach` [m].

        So is then its next vehicle there. SUMO passes all vehicles of a lane to find that one.
        """
        if self._lane(other) != self._left_lane(self._lane(vehicle)):
            return False
        return bool(0.0 < self._station(other) - self._station(vehicle) <= reach)

    def wanted_changes(
        self, vehicles: Sequence[str], wishing: Iterable[str], is_held_back: Callable[[str, _Others], bool]
    ) -> list[WantedChange]:
        """Changes that drivers want by their own model and that others block, and some more to the left.

        Those are left out in which a driver is held back for certain by some of the others.
        """
        read = self._state
        wanted: list[tuple[str, _Side, int]] = [
            (vehicle, side, state)
            for vehicle, signals in zip(vehicles, map(self._signals, vehicles), strict=True)
            # Who wants to change lanes blinks; and another vehicle blocks what the driver's own model wants.
            if signals & _BLINKERS
            for side in (_LEFT, _RIGHT)
            if (state := read(vehicle, side.offset)[1]) & side.wanted and state & side.blocked and not state & _TRACI
        ]
        there = {vehicle for vehicle, _, _ in wanted}
        others = [(vehicle, _LEFT, read(vehicle, _LEFT.offset)[1]) for vehicle in wishing if vehicle not in there]
        wanted += [other for other in others if not other[2] & _TRACI]
        changes = (self._change(*one, is_held_back) for one in wanted)
        return [change for change in changes if change is not None]

    def _change(
        self, vehicle: str, side: _Side, state: int, is_held_back: Callable[[str, _Others], bool]
    ) -> WantedChange | None:
        blockers: list[_Others] = []
        for bit, mode in ((side.leader, _LEADERS | _BLOCKING), (side.follower, _BLOCKING)):
            others = tuple(self._neighbours(vehicle, side.neighbours | mode)) if state & bit else ()
            if others and is_held_back(vehicle, others):
                return None
            blockers.append(others)
        return WantedChange(vehicle, side, bool(state & _URGENT), *blockers)

    def ahead(self, change: WantedChange) -> str | None:
        """Next vehicle ahead in the other lane, in the way or not."""
        found = self._neighbours(change.driver, change.side.neighbours | _LEADERS)
        return str(_nearest(found)[0]) if found else None


def _next_lane(lane: str) -> str:
    """Lane to the left of one of the same edge, whether there is one or not."""
    edge, _, number = lane.rpartition("_")
    return f"{edge}_{int(number) + 1}" if edge else "no lane"


def _nearest(neighbours: Iterable[tuple[str, float]]) -> tuple[str, float]:
    return min(neighbours, key=operator.itemgetter(1))


class NeighbourSight:
    """Which neighbours drivers perceive: those in sight for at least the reaction time [s]."""

    def __init__(self, sight: VehicleSight, reaction_time: float) -> None:
        self._sight = sight
        self._reaction_time = reaction_time
        self._hidden_at: dict[tuple[str, str], float] = {}

    def was_hidden(self, observer: str, target: str) -> bool:
        """Whether a target was out of sight at a look that is no longer ago than the reaction time."""
        return (observer, target) in self._hidden_at

    def perceive(
        self, pairs: Iterable[tuple[str, str]], own_lamps: OwnLamps, time: float
    ) -> dict[tuple[str, str], bool]:
        """Whether each observer perceives a target (`pairs` (str, str), `time` [s])."""
        hidden = self._hidden_at
        if hidden:
            hidden = self._hidden_at = {pair: at for pair, at in hidden.items() if time - at < self._reaction_time}
        asked = tuple(dict.fromkeys(pairs))
        perceived = dict(zip(asked, self._sight.sees(asked, own_lamps), strict=True))
        for pair, is_seen in perceived.items():
            if not is_seen:
                hidden[pair] = time
            elif pair in hidden:
                perceived[pair] = False
        return perceived
