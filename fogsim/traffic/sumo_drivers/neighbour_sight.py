"""Vehicles in the neighbouring lanes: which of them block a change that is wanted, and which the driver perceives."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from fogsim.traffic.sumo.link import Api, vehicle_getter
from fogsim.traffic.sumo.vehicle_getters import vehicle_getters
from fogsim.traffic.sumo_drivers.seen_vehicles import OwnLamps
from fogsim.traffic.sumo_drivers.vehicle_sight import VehicleSight

NEAR = 5.0
"""A vehicle next to, or with less gap than this along the road, is seen in any fog [m]."""

# Bits of signals, states and modes in SUMO's TraCI protocol.
_BLINKERS = 1 | 2
_TRACI, _URGENT = 128, 256
_LEADERS, _BLOCKING = 2, 4
_LEFT_LEADERS = _LEADERS


@dataclass(frozen=True, slots=True)
class Side:
    """One side of a vehicle, in SUMO's numbers."""

    offset: int  # From the vehicle's lane to the neighbouring one
    # wanted, leader, follower: bits of the lane-change state: the driver wants to go there, is blocked there by a
    # vehicle ahead, or behind
    wanted: int
    leader: int
    follower: int
    neighbours: int  # What to ask for its followers by


LEFT = Side(1, 2, 512, 1024, 0)
RIGHT = Side(-1, 4, 2048, 4096, 1)


@dataclass(frozen=True, slots=True)
class WantedChange:
    """A change of lane that a driver wants."""

    driver: str  # Id of the vehicle
    side: Side  # Where to
    is_urgent: bool  # True if the route needs it, for which drivers ask others to make room
    # leaders, followers (str, float): vehicles that are in the way in the other lane, and the gaps to them [m]
    leaders: tuple[tuple[str, float], ...]
    followers: tuple[tuple[str, float], ...]

    @property
    def blockers(self) -> tuple[tuple[str, float], ...]:
        """All vehicles that are in the way, and the gaps to them [m]."""
        return self.leaders + self.followers


class Neighbours:
    """Asks SUMO for neighbours and for changes that are blocked (`reach` [m])."""

    def __init__(self, api: Api, reach: float, remote: bool) -> None:
        names = ("getSignals", "getNeighbors")
        self._signals, self._left_leaders = vehicle_getters(api, remote, names, {"getNeighbors": ("b", _LEFT_LEADERS)})
        self._neighbours = vehicle_getter(api, "getNeighbors")
        self._state = vehicle_getter(api, "getLaneChangeState")
        self._reach = reach

    def left_leader(self, vehicle: str) -> tuple[str, float] | None:
        """Next vehicle ahead in the lane to the left, and the gap to it [m]; None if there is none within reach."""
        found = self._left_leaders(vehicle, _LEFT_LEADERS)
        if not found:
            return None
        nearest = _nearest(found)
        return nearest if nearest[1] <= self._reach else None

    def wanted_changes(self, vehicles: Iterable[str], wishing: Iterable[str]) -> list[WantedChange]:
        """Changes that drivers want by their own model and that others block, and some more to the left."""
        # Who wants to change lanes blinks.
        blinking = [v for v in vehicles if self._signals(v) & _BLINKERS]
        states = ((v, side, int(self._state(v, side.offset)[1])) for v in blinking for side in (LEFT, RIGHT))
        wanted = [self._change(*change) for change in states if _is_blocked(*change[1:])]
        there = {change.driver for change in wanted}
        more = ((v, LEFT, int(self._state(v, LEFT.offset)[1])) for v in wishing if v not in there)
        return wanted + [self._change(*change) for change in more if not change[2] & _TRACI]

    def _change(self, vehicle: str, side: Side, state: int) -> WantedChange:
        leaders, followers = (
            tuple(self._neighbours(vehicle, side.neighbours | mode)) if state & bit else ()
            for bit, mode in ((side.leader, _LEADERS | _BLOCKING), (side.follower, _BLOCKING))
        )
        return WantedChange(vehicle, side, bool(state & _URGENT), leaders, followers)

    def ahead(self, change: WantedChange) -> str | None:
        """Next vehicle ahead in the other lane, in the way or not."""
        found = self._neighbours(change.driver, change.side.neighbours | _LEADERS)
        return str(_nearest(found)[0]) if found else None


def _nearest(neighbours: Sequence[tuple[str, float]]) -> tuple[str, float]:
    return neighbours[0] if len(neighbours) == 1 else min(neighbours, key=lambda neighbour: neighbour[1])


def _is_blocked(side: Side, state: int) -> bool:
    """Whether a state says that another vehicle blocks what the driver's own model wants."""
    return bool(state & side.wanted and state & (side.leader | side.follower)) and not state & _TRACI


class NeighbourSight:
    """Which neighbours drivers perceive: those in sight, but not within the reaction time after they were not.

    Takes `reaction_time` [s].
    """

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
        if self._hidden_at:
            self._hidden_at = {pair: at for pair, at in self._hidden_at.items() if time - at < self._reaction_time}
        asked = tuple(dict.fromkeys(pairs))
        seen = self._sight.sees(asked, own_lamps) if asked else []
        perceived = {pair: is_seen and pair not in self._hidden_at for pair, is_seen in zip(asked, seen, strict=True)}
        self._hidden_at.update((pair, time) for pair, is_seen in zip(asked, seen, strict=True) if not is_seen)
        return perceived
