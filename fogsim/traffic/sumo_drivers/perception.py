"""Drivers react to a leader only once they can see it.

SUMO's own car-following models get the leader to ignore (``carFollowModel.ignoreIDs``), and only when that changes; so
Krauss, IDM, EIDM and the rest stay as they are, and an unseen vehicle stays on the road. Lane changing is changed with
it; see `IgnoredLeaders`.

Sight is computed only in steps in which what a driver sees could have changed. Between two computations a gap changes
at most by the fastest approach there is, and near the edge of sight by what speeds and accelerations allow; so for a
leader that stays the same the decision is in every step the one that computing in every step would give. A leader that
is new (one of the two has changed lane, or somebody came within `REACH`) is noticed in the next computation, at most
`MAX_PAUSE` later; until then SUMO's driver sees it. So is one that gets behind an obstruction; one that is behind it is
looked for in each step.
"""

import itertools
from collections.abc import Collection, Sequence
from types import MappingProxyType

import numpy as np

from fogsim.traffic.appearance import TRAINS
from fogsim.traffic.sumo.claims import SPEED_GAIN, SessionValues
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.update_schedule import DueVehicles, closing_speed_bound
from fogsim.traffic.sumo_drivers.lane_change_switches import LaneChangeSwitch
from fogsim.traffic.sumo_drivers.leader_sight import LeaderSight, Pair
from fogsim.traffic.sumo_drivers.oncoming_glare import most_glare
from fogsim.traffic.sumo_drivers.seen_vehicles import DriversView, OwnLamps
from fogsim.traffic.sumo_lanes.leaders import Leaders

REACH = 250.0
"""Leaders farther ahead than this do not matter [m]: from 150 km/h one stops in less."""

_LARGEST_MINIMUM_GAP = 5.0
"""No driver's minimum gap is larger than this [m]."""

_FASTEST_APPROACH = 70.0
"""Faster than this no gap changes [m/s]: 250 km/h towards a standing vehicle."""

MAX_PAUSE = 0.5
"""Every driver's sight is computed at least this often [s], for leaders change."""

_NO_LEADER = ("", 0.0)
_IGNORED = "carFollowModel.ignoreIDs"
_NO_SPEED_GAIN = 0.0


class IgnoredLeaders:
    """Makes drivers ignore the vehicle ahead, and not leave the lane because of it.

    SUMO's lane changing takes no notice of `_IGNORED`: it would avoid a slow leader that its driver cannot see. To a
    driver who sees no vehicle ahead the lane is free, and there is no speed to gain in another.
    """

    def __init__(self, api: Api, session: str) -> None:
        self._vehicles = api.vehicle
        self._session = session
        self._ignored = SessionValues[str](api, "ignored")
        # A lane-change model without such a parameter (DK2008) keeps seeing through the fog.
        self._speed_gain = LaneChangeSwitch(api, SPEED_GAIN, _NO_SPEED_GAIN, session)

    def ignore(self, follower: str, leader: str) -> None:
        """Let a follower ignore one vehicle."""
        leaders = self._ignored.read(follower)
        leaders[self._session] = leader
        self._set(follower, leaders)
        self._speed_gain.turn_on(follower)

    def stop_ignoring(self, follower: str) -> None:
        """Let a follower react again to the vehicle that this session had it ignore, and change lanes as before."""
        leaders = self._ignored.read(follower)
        if leaders.pop(self._session, None) is not None:
            self._set(follower, leaders)
        self._speed_gain.turn_off(follower)

    def _set(self, follower: str, leaders: dict[str, str]) -> None:
        self._vehicles.setParameter(follower, _IGNORED, " ".join(sorted(set(leaders.values()))))
        self._ignored.write(follower, leaders)


class Perception:
    """Decides in each step which leaders are seen.

    Attributes
    ----------
    leader, speed : Getter
        Leaders as SUMO's ``getLeader`` reports them, to be asked with `REACH`, and SUMO's ``getSpeed``.
    hidden : mapping from str to str
        Leaders that are not reacted to, by follower, as they are at any time.
    """

    def __init__(self, view: DriversView) -> None:
        api, fog, sight, self._roster = view.api, view.fog, view.sight, view.roster
        self._view, self._hidden_vehicles = view, view.hidden_vehicles
        self._ignored_leaders = IgnoredLeaders(api, view.session)
        self.leader = Leaders(api, view.remote).within(REACH)
        (self.speed,) = view.getters("getSpeed")
        self._reaction_time = sight.reaction_time
        self._leader_sight = LeaderSight(view, self.speed, MAX_PAUSE)
        self._due = DueVehicles(self._roster, float(api.simulation.getDeltaT()))
        self._vehicle_class = api.vehicle.getVehicleClass
        self._ignored: dict[str, str] = {}
        self.hidden = MappingProxyType(self._ignored)
        self._emerging: dict[str, tuple[str, float]] = {}
        # No leader nearer than this is hidden, wherever the fog is densest: for them nothing need be computed.
        self._certainly_seen = (
            sight.sure_distance(fog.maximum_extinction, most_glare(sight.illuminance)) - _LARGEST_MINIMUM_GAP
        )
        # And none farther than this is seen, wherever the fog is thinnest.
        self._certainly_hidden = sight.hidden_distance(fog.minimum_extinction)
        margin = _FASTEST_APPROACH * MAX_PAUSE
        self._seen_for_long, self._hidden_for_long = self._certainly_seen - margin, self._certainly_hidden + margin

    def expect_unseen(self, follower: str, leader: str) -> None:
        """Hide a vehicle that is about to come before a driver who does not see it, and look again in the next step."""
        self._hide(follower, leader)
        self._due.bring_forward(follower)

    def update(self, own_lamps: OwnLamps) -> None:
        """Make SUMO's drivers ignore a leader that they do not see."""
        due, new, gone = self._due.take()
        if gone:
            self._view.vehicles.forget(gone)
            for follower in gone:
                self._ignored.pop(follower, None)
                self._emerging.pop(follower, None)
            # A vehicle that comes back from a teleport still ignores its leader.
            for follower in new:
                self._ignored_leaders.stop_ignoring(follower)
            trains = {v for v in new if self._vehicle_class(v) in TRAINS}
            due = [v for v in due if v not in trains]
        doubtful = self._decide_by_gap(due) if due else ()
        if doubtful:
            self._decide_by_sight(doubtful, own_lamps)

    def _decide_by_gap(self, due: Sequence[str]) -> list[Pair]:
        """Decide where the gap alone is enough, and give back the rest."""
        ignored, emerging = self._ignored, self._emerging
        # Most vehicles are far from any doubt, and pause for the longest time.
        certain: list[str] = []
        near_edge: list[Pair] = []
        doubtful: list[Pair] = []
        ahead = [found or _NO_LEADER for found in map(self.leader, due, itertools.repeat(REACH))]
        obstructed = self._obstructed(due, ahead)
        for follower, (leader, gap) in zip(due, ahead, strict=True):
            if follower in obstructed:
                self._hide(follower, leader)
                near_edge.append((follower, leader, 0.0))
                continue
            if not leader:
                if follower in ignored:
                    self._reveal(follower)
            elif gap > self._certainly_hidden:
                if follower not in ignored or ignored[follower] != leader or follower in emerging:
                    self._hide(follower, leader)
                if gap <= self._hidden_for_long:
                    near_edge.append((follower, leader, gap - self._certainly_hidden))
                    continue
            elif gap > self._certainly_seen or follower in ignored:
                doubtful.append((follower, leader, gap))
                continue
            elif gap > self._seen_for_long:
                near_edge.append((follower, leader, self._certainly_seen - gap))
                continue
            certain.append(follower)
        self._pause_near_edge(near_edge)
        self._due.schedule(certain, MAX_PAUSE)
        return doubtful

    def _obstructed(self, followers: Sequence[str], ahead: Sequence[tuple[str, float]]) -> Collection[str]:
        """Those whose leaders are behind something that stands next to the road."""
        if self._hidden_vehicles is None:
            return ()
        pairs = [(follower, leader) for follower, (leader, _) in zip(followers, ahead, strict=True) if leader]
        hidden = self._hidden_vehicles.are_hidden(pairs)
        return {follower for (follower, _), is_hidden in zip(pairs, hidden, strict=True) if is_hidden}

    def _pause_near_edge(self, waiting: Sequence[Pair]) -> None:
        """Leave followers alone until their gaps to leaders could have changed by a distance each [m]."""
        if waiting:
            followers, leaders, distances = zip(*waiting, strict=True)
            flat = map(self.speed, followers + leaders)
            speed = np.fromiter(flat, np.float64, 2 * len(waiting)).reshape(2, -1)
            pauses = np.minimum(distances / closing_speed_bound(speed[0], speed[1], MAX_PAUSE), MAX_PAUSE)
            self._due.schedule_each(followers, pauses.tolist())

    def _decide_by_sight(self, pairs: Sequence[Pair], own_lamps: OwnLamps) -> None:
        seen, pauses = self._leader_sight.assess(pairs, own_lamps)
        ignored, emerging = self._ignored, self._emerging
        waits: list[float] = []
        for (follower, leader, _), is_seen, pause in zip(pairs, seen, pauses, strict=True):
            if not is_seen:
                if follower in emerging or follower not in ignored or ignored[follower] != leader:
                    self._hide(follower, leader)
            elif follower in ignored and self._reacts(follower, leader):
                self._reveal(follower)
            waits.append(0.0 if follower in emerging else pause)
        self._due.schedule_each([follower for follower, _, _ in pairs], waits)

    def _hide(self, follower: str, leader: str) -> None:
        """From now on a follower does not react to a leader."""
        self._emerging.pop(follower, None)
        if self._ignored.get(follower) != leader:
            self._ignored_leaders.ignore(follower, leader)
            self._ignored[follower] = leader

    def _reveal(self, follower: str) -> None:
        """From now on a follower reacts to everyone."""
        self._emerging.pop(follower, None)
        if self._ignored.pop(follower, None) is not None:
            self._ignored_leaders.stop_ignoring(follower)

    def _reacts(self, follower: str, leader: str) -> bool:
        """Whether a follower who sees a leader reacts: not at once if that leader has just come into view."""
        if self._ignored.get(follower) != leader:
            return True
        emerged, since = self._emerging.get(follower, ("", 0.0))
        if emerged != leader:
            since = self._roster.time
            self._emerging[follower] = (leader, since)
        return self._roster.time - since >= self._reaction_time

    def release(self) -> None:
        """Let everyone on the road react to everyone again."""
        for follower in self._roster.present.intersection(self._ignored):
            self._reveal(follower)
        self._ignored.clear()
