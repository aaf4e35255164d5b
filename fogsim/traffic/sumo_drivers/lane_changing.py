"""Drivers change lanes by what they see.

SUMO's lane-change models look through any fog. Here, for the drivers for whom that makes a difference:

- Who wants to change lanes and is held back by no one in sight changes: SUMO makes the change by its ``changeLane``,
  for one step without respect for others' gaps, but never into an overlap. What follows, braking or a collision, is
  SUMO's.
- A leader that stands out of sight is no obstacle to leave the lane for (``lcStrategic``), as long as the route goes
  on in this lane.
- A slow vehicle in the lane to the left that is out of sight is no reason to fall back behind it, as where overtaking
  on the right is forbidden (``lcOvertakeRight``).
- No one makes room for somebody who is out of sight (``lcCooperative``, ``lcCooperativeSpeed``).

Drivers look each `_LOOK_PERIOD`; who has no one unseen about is not touched.
"""

import contextlib
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

from fogsim.traffic.sumo.claims import (
    COOPERATIVE,
    COOPERATIVE_SPEED,
    LANE_CHANGE_MODE,
    OVERTAKE_RIGHT,
    SPEED_GAIN,
    STRATEGIC,
    Claims,
)
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.roster import DueVehicles
from fogsim.traffic.sumo_drivers.neighbour_sight import NEAR, Neighbours, NeighbourSight, WantedChange
from fogsim.traffic.sumo_drivers.perception import REACH, Perception
from fogsim.traffic.sumo_drivers.unseen import LaneChangeSwitch, refusal_of
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps, VehicleSight

_LOOK_PERIOD = 0.5
"""Time between two looks of a driver [s]."""

_THRESHOLD = 0.2
"""Sum of relative gains at which the wish begins, over the driver's eagerness [s]."""

_LEAST_SPEED = 10.0
"""Gains are relative to the speed in the other lane, and at least to this [m/s]."""

_FORGOTTEN = 0.8
"""Share of the sum that is left after a second without anything to gain [-]."""

_SHORTEST_STAY = 20.0
"""The route must go on in the other lane for so long [s]."""

_SPEED_GAIN_BITS = 0x30


def _safe_speed(gap: float, leader_speed: float, deceleration: float, headway: float) -> float:
    """Speed behind a leader from which one stops behind it if both brake equally hard [m/s].

    Source: Krauss, S. (1998), Microscopic modeling of traffic flow: investigation of collision free vehicle dynamics.
    """
    delay = deceleration * headway
    return math.sqrt(delay**2 + leader_speed**2 + 2.0 * deceleration * max(gap, 0.0)) - delay


class _OvertakingWishes:
    """Adds up what drivers gain in a lane to the left that looks free to them."""

    def __init__(self, api: Api, leaders: Perception) -> None:
        self._vehicles = api.vehicle
        self._leader, self._speed = leaders.leader, leaders.speed
        self._refusal = refusal_of(api)
        self._gains: dict[str, float] = {}

    def update(self, drivers: Iterable[str]) -> list[str]:
        """Those of some drivers who want to overtake; all others begin again."""
        before, self._gains = self._gains, {}
        for driver in drivers:
            gain = self._relative_gain(driver)
            if driver not in before:
                # There is nothing to add up before the first look; who has just entered knows of no neighbours yet.
                kept = 0.0
            elif gain > 0.0:
                kept = before[driver] + gain * _LOOK_PERIOD
            else:
                kept = before[driver] * _FORGOTTEN**_LOOK_PERIOD
            self._gains[driver] = kept
        return [driver for driver, gain in self._gains.items() if self._is_wish(driver, gain)]

    def _relative_gain(self, driver: str) -> float:
        """What a free lane would gain over staying behind the leader [-]."""
        leader, gap = self._leader(driver, REACH) or ("", 0.0)
        if not leader:
            return 0.0
        get = self._vehicles
        free = float(get.getAllowedSpeed(driver))
        behind = _safe_speed(gap, float(self._speed(leader)), float(get.getDecel(driver)), float(get.getTau(driver)))
        return (free - min(behind, free)) / max(free, _LEAST_SPEED)

    def _is_wish(self, driver: str, gain: float) -> bool:
        """Whether a sum of gains is enough for the driver's own eagerness, mode and route."""
        get = self._vehicles
        eagerness = 0.0
        # A lane-change model without it (DK2008) has other rules.
        with contextlib.suppress(self._refusal):
            eagerness = SPEED_GAIN.read(get, driver)
        if gain * eagerness <= _THRESHOLD or not get.getLaneChangeMode(driver) & _SPEED_GAIN_BITS:
            return False
        lanes, beside = get.getBestLanes(driver), int(get.getLaneIndex(driver)) + 1
        if beside >= len(lanes):
            return False
        _, length, _, offset, *_ = lanes[beside]
        return bool(offset == 0 and length > _SHORTEST_STAY * float(self._speed(driver)))


_CERTAIN_PERIOD = 1.0
"""Who has somebody in sight for certain ahead in the lane to the left, or no one, looks there again after this [s]."""

_MANY = 1000
"""From so many vehicles on the road on, asking for one on a lane costs less than letting SUMO find it there; not where
a call is a message, and neighbours are subscribed to."""

_STANDING_REACH = 150.0
"""SUMO's drivers leave the lane for who stands within 100 m; between two looks they drive less than the rest [m]."""

_SOON_STANDING = 5.0
"""Who drives slower than this may stand before the next look [m/s]: braking hard, or after a collision."""

_SUBLANE_CHANGE = 4.0
"""Time for which SUMO's sublane model is asked to change lanes, at up to 1 m/s to the side [s]."""

_MUCH_FASTER = 2.0
"""Who drives so much faster in the lane to the left holds no one back, seen or not [m/s]."""

_NEVER, _ALWAYS = -1.0, 1.0
_RESPECT = 0x300
_NO_OVERLAP = 0x100


class _StandingLeaders:
    """Keeps drivers in their lanes behind leaders that stand out of sight."""

    def __init__(self, api: Api, leaders: Perception, session: str) -> None:
        self._vehicles = api.vehicle
        self._leaders = leaders
        self._strategic = LaneChangeSwitch(api, STRATEGIC, _NEVER, session)

    def update(self, drivers: Sequence[str], present: set[str]) -> None:
        """Decide again for some drivers."""
        hidden, speed = self._leaders.hidden, self._leaders.speed
        # A hidden leader may have left since the driver's last look ahead.
        behind = [(v, hidden[v]) for v in drivers if v in hidden and hidden[v] in present]
        speeds = map(speed, [leader for _, leader in behind])
        soon_standing = [pair for pair, now in zip(behind, speeds, strict=True) if now < _SOON_STANDING]
        self._strategic.decide(drivers, [pair[0] for pair in soon_standing if self._would_be_left_for(*pair)])

    def expect_unseen(self, driver: str, leader: str) -> None:
        """Keep a driver in the lane to which he changes until the next look, if he does not see who stands there."""
        if self._leaders.speed(leader) < _SOON_STANDING:
            self._strategic.turn_on(driver)

    def _would_be_left_for(self, driver: str, hidden: str) -> bool:
        """Whether a hidden leader is so near that SUMO's driver would leave a lane that leads on."""
        leader, gap = self._leaders.leader(driver, REACH) or ("", 0.0)
        if leader != hidden or gap > _STANDING_REACH:
            return False
        lane = self._vehicles.getLaneID(driver)
        # SUMO reports for each lane of the edge how many lanes away the best one for the route is.
        return any(best[0] == lane and best[3] == 0 for best in self._vehicles.getBestLanes(driver))

    def restart(self, drivers: Sequence[str], present: set[str]) -> None:
        """Give some drivers their own behaviour back; see `LaneChangeSwitch.restart`."""
        self._strategic.restart(drivers, present)

    def release(self, present: set[str]) -> None:
        """Give everyone their own behaviour back; see `LaneChangeSwitch.release`."""
        self._strategic.release(present)


class _RequestedChanges:
    """Changes of lane that are asked of SUMO, each for one step; in the sublane model for as long as a change takes."""

    def __init__(self, api: Api, session: str) -> None:
        self._vehicles = api.vehicle
        self._edges = api.edge
        # Apart from the session's other claim, that vehicles keep their lanes.
        self._modes = Claims(api, LANE_CHANGE_MODE, f"{session} changes")
        self._duration = _SUBLANE_CHANGE if float(api.simulation.getOption("lateral-resolution")) > 0.0 else 0.0
        self._asked: dict[str, float] = {}
        self._left: set[str] = set()

    def ask(self, driver: str, lanes: int, time: float) -> bool:
        """Let a driver change lane from the next step on, without an overlap; False if there is no such lane."""
        edge, lane = str(self._vehicles.getRoadID(driver)), int(self._vehicles.getLaneIndex(driver)) + lanes
        # No one changes lanes on a junction.
        if edge.startswith(":") or not 0 <= lane < int(self._edges.getLaneNumber(edge)):
            return False
        self._modes.claim(driver, int(self._modes.own_value(driver)) & ~_RESPECT | _NO_OVERLAP)
        self._vehicles.changeLane(driver, lane, self._duration)
        self._asked[driver] = time + self._duration
        return True

    def end(self, present: set[str], time: float) -> None:
        """Give back the lane-change modes of those whose changes have had their time (`time` [s])."""
        for driver in [v for v, until in self._asked.items() if until < time] if self._asked else ():
            del self._asked[driver]
            if driver in present:
                self._modes.withdraw(driver)
            else:
                self._left.add(driver)

    def restart(self, drivers: Sequence[str], present: set[str]) -> None:
        """Give back the modes of those who come back from a teleport."""
        for driver in self._left.intersection(drivers).intersection(present) if self._left else ():
            self._left.discard(driver)
            self._modes.withdraw(driver)


class LaneChanging:
    """What drivers perceive of the neighbouring lanes, and of leaders that stand; a part of their perception."""

    def __init__(self, view: DriversView, leaders: Perception, vehicle_sight: VehicleSight) -> None:
        api, session, self._roster = view.api, view.session, view.roster
        self._leaders = leaders
        self._certainly_seen = max(vehicle_sight.certainly_seen, NEAR)
        self._certainly_hidden = view.sight.hidden_distance(view.fog.minimum_extinction)
        self._neighbours = Neighbours(view)
        self._sight = NeighbourSight(vehicle_sight, view.sight.reaction_time)
        self._wishes = _OvertakingWishes(api, leaders)
        self._requests = _RequestedChanges(api, session)
        self._standing = _StandingLeaders(api, leaders, session)
        self._overtake_right = LaneChangeSwitch(api, OVERTAKE_RIGHT, -_ALWAYS, session)
        self._unhelpful = tuple(
            LaneChangeSwitch(api, attribute, value, session)
            for attribute, value in ((COOPERATIVE, _NEVER), (COOPERATIVE_SPEED, 0.0))
        )
        self._due = DueVehicles(view.roster, float(api.simulation.getDeltaT()))
        self._certain_until: dict[str, float] = {}
        self._remote, self._near_left = view.remote, dict[str, str]()

    def update(self, own_lamps: OwnLamps) -> None:
        """Let those who are due look at the lanes next to them."""
        if self._certainly_seen >= REACH:
            return
        due, _, gone = self._due.take()
        self._requests.end(self._roster.present, self._roster.time)
        self._restart(gone)
        self._due.schedule(due, _LOOK_PERIOD)
        if due:
            self._standing.update(due, self._roster.present)
            free_to_their_eyes = self._free_to_the_left(due, own_lamps)
            self._overtake_right.decide(due, free_to_their_eyes)
            hidden = self._leaders.hidden
            wishes = self._wishes.update([v for v in free_to_their_eyes if v not in hidden])
            self._change_lanes(due, wishes, own_lamps)

    def _restart(self, drivers: Sequence[str]) -> None:
        """Forget drivers that have left, and whom those who have entered may be taken for."""
        if drivers:
            for driver in drivers:
                self._certain_until.pop(driver, None)
                self._near_left.pop(driver, None)
            self._standing.restart(drivers, self._roster.present)
            self._requests.restart(drivers, self._roster.present)
            for switch in (self._overtake_right, *self._unhelpful):
                switch.restart(drivers, self._roster.present)

    def _free_to_the_left(self, drivers: Sequence[str], own_lamps: OwnLamps) -> dict[str, None]:
        """Drivers to whom the lane to the left looks free ahead, though a vehicle there is hardly faster."""
        speed, certain_until = self._leaders.speed, self._certain_until
        soon, later = self._roster.time + 0.5 * _LOOK_PERIOD, self._roster.time + _CERTAIN_PERIOD
        remembers = not self._remote and len(self._roster.present) >= _MANY
        certain = map(certain_until.get, drivers, itertools.repeat(0.0))
        looking = [driver for driver, until in zip(drivers, certain, strict=True) if until <= soon]
        passing = [driver for driver in looking if driver in self._near_left and self._is_near_left(driver)]
        if passing:
            certain_until.update(dict.fromkeys(passing, later))
            looking = [driver for driver in looking if certain_until.get(driver) != later]
        unseen: dict[str, None] = {}
        doubtful: list[tuple[str, str]] = []
        for driver, (leader, gap) in zip(looking, self._neighbours.left_leaders(looking), strict=True):
            if not self._certainly_seen < gap <= REACH:
                certain_until[driver] = later
                if gap <= REACH and remembers:
                    self._near_left[driver] = leader
            elif speed(leader) <= speed(driver) + _MUCH_FASTER:
                if gap > self._certainly_hidden:
                    unseen[driver] = None
                else:
                    doubtful.append((driver, leader))
        perceived = self._sight.perceive(doubtful, own_lamps, self._roster.time)
        return unseen | {driver: None for (driver, _), is_perceived in perceived.items() if not is_perceived}

    def _is_near_left(self, driver: str) -> bool:
        """Whether who was last found near a driver in the lane to the left is still there."""
        other, ahead = self._near_left[driver], self._neighbours.is_ahead_on_the_left
        if other in self._roster.present and ahead(driver, other, self._certainly_seen):
            return True
        del self._near_left[driver]
        return False

    def _change_lanes(self, drivers: Sequence[str], wishes: Iterable[str], own_lamps: OwnLamps) -> None:
        """Let those change lanes who are blocked by no one whom they perceive, and whom no one helps whom they see."""
        doubtful = self._neighbours.wanted_changes(drivers, wishes, self._is_held_back_for_certain)
        ahead = [self._neighbours.ahead(change) for change in doubtful]
        pairs = [pair for change, leader in zip(doubtful, ahead, strict=True) for pair in _sights(change, leader)]
        perceived = self._sight.perceive(pairs, own_lamps, self._roster.time)
        unhelpful: set[str] = set()
        for change, leader in zip(doubtful, ahead, strict=True):
            if not any(perceived[change.driver, other] for other, _ in change.blockers):
                self._change(change, leader, perceived)
            elif change.is_urgent:
                # The route needs it, so SUMO's driver asks others to make room.
                unhelpful.update(other for other, _ in change.blockers if not perceived[other, change.driver])
        for switch in self._unhelpful:
            switch.decide(drivers, unhelpful)

    def _is_held_back_for_certain(self, driver: str, others: Iterable[tuple[str, float]]) -> bool:
        """Whether one of those in a driver's way is near enough to be seen in any case."""
        for other, gap in others:
            if gap < NEAR or (gap <= self._certainly_seen and not self._sight.was_hidden(driver, other)):
                return True
        return False

    def _change(self, change: WantedChange, leader: str | None, perceived: Mapping[tuple[str, str], bool]) -> None:
        if not self._requests.ask(change.driver, change.side.offset, self._roster.time):
            return
        # SUMO's drivers would see their new leaders until they look again.
        if leader is not None and not perceived[change.driver, leader]:
            self._leaders.expect_unseen(change.driver, leader)
            self._standing.expect_unseen(change.driver, leader)
        for follower, _ in change.followers:
            if not perceived[follower, change.driver]:
                self._leaders.expect_unseen(follower, change.driver)

    def release(self) -> None:
        """Give everyone on the road their own lane changing back."""
        present = self._roster.present
        self._requests.end(present, math.inf)
        self._standing.release(present)
        for switch in (self._overtake_right, *self._unhelpful):
            switch.release(present)


def _sights(change: WantedChange, leader: str | None) -> Iterator[tuple[str, str]]:
    """Who is to be seen by whom before a change: others by the driver, and the driver by them."""
    for other in (*(name for name, _ in change.blockers), *(() if leader is None else (leader,))):
        yield change.driver, other
        yield other, change.driver
