"""Drivers react to a leader only once they can see it.

SUMO's own car-following models are told which leader to ignore (``carFollowModel.ignoreIDs``), and only when that
changes; so Krauss, IDM, EIDM and the rest stay as they are, and an unseen vehicle stays on the road. Lane changing is
told in the same moment; see `Ignoring`.

Drivers are looked at only in steps in which what they see could have changed. Between two looks a gap changes at most
by the fastest approach there is, and near the edge of sight by what speeds and accelerations allow; so for a leader
that stays the same the decision is in every step the one that looking in every step would give. A leader that is new
(one of the two has changed lane, or somebody came within `REACH`) is taken up in the next look, at most
`LONGEST_PAUSE` later; until then SUMO's driver sees it.
"""

import itertools
from collections.abc import Iterable, Sequence

from fogsim.traffic.drivers.sight import EYE_HEIGHT, DriverSight, FogAccess
from fogsim.traffic.sumo.claims import SOLE_SESSION
from fogsim.traffic.sumo.getters import Getter, vehicle_getter
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.motion_bounds import MotionBounds
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo.schedule import Schedule
from fogsim.traffic.sumo_drivers.ignored_leaders import Ignoring
from fogsim.traffic.sumo_drivers.pair_sight import OwnLamps, Pair, PairSight
from fogsim.traffic.sumo_drivers.subscribed_pairs import SubscribedPairs
from fogsim.values import Lamp

__all__ = ["EYE_HEIGHT", "LONGEST_PAUSE", "REACH", "Perception"]

REACH = 250.0
"""Leaders farther ahead than this matter to nobody [m]: from 150 km/h one stops in less."""

LARGEST_MINIMUM_GAP = 5.0
"""No driver's minimum gap is larger than this [m]."""

FASTEST_APPROACH = 70.0
"""Faster than this no gap changes [m/s]: 250 km/h towards a standing vehicle."""

LONGEST_PAUSE = 0.5
"""Every driver looks at least this often [s], for leaders change."""

_NOBODY = ("", 0.0)


class Perception:
    """Decides in each step which leaders are seen.

    Parameters
    ----------
    api : Api
        The simulation.
    fog : FogAccess
        The fog.
    sight : DriverSight
        The drivers' eyes.
    roster : Roster or None
        Who is on the road; None for one of its own.
    distant : bool
        True where every call is a message to another process: leaders and speeds are subscribed to.
    session : str
        Name of the session.
    """

    def __init__(
        self,
        api: Api,
        fog: FogAccess,
        sight: DriverSight,
        roster: Roster | None = None,
        distant: bool = False,
        session: str = SOLE_SESSION,
    ) -> None:
        self._ignoring = Ignoring(api, session)
        sent = SubscribedPairs(api, REACH) if distant else None
        self._leader: Getter = vehicle_getter(api, "getLeader") if sent is None else sent.leader
        self._motion = MotionBounds(vehicle_getter(api, "getSpeed") if sent is None else sent.speed)
        self._roster = Roster(api) if roster is None else roster
        self._reaction_time = sight.reaction_time
        self._pairs = PairSight(api, fog, sight, self._motion)
        self._schedule = Schedule(float(api.simulation.getDeltaT()), self._roster.time)
        self._mark = 0
        self._ignored: dict[str, str] = {}
        self._emerging: dict[str, tuple[str, float]] = {}
        # Nobody nearer than this is hidden, wherever the fog is densest: for them nothing need be computed.
        self._surely_seen = sight.sure_distance(fog.maximum_extinction) - LARGEST_MINIMUM_GAP
        # And nobody farther than this is seen, wherever the fog is thinnest.
        self._surely_hidden = sight.hidden_distance(fog.minimum_extinction)
        margin = FASTEST_APPROACH * LONGEST_PAUSE
        self._seen_for_long, self._hidden_for_long = self._surely_seen - margin, self._surely_hidden + margin

    @property
    def ignored(self) -> dict[str, str]:
        """Leaders that are not reacted to, by follower."""
        return dict(self._ignored)

    def update(self, ego: str, ego_lamps: Lamp, dark: frozenset[str]) -> None:
        """Look once: tell SUMO's drivers which leader they do not see.

        Parameters
        ----------
        ego : str
            Id of the ego, whose lamps are not SUMO's.
        ego_lamps : Lamp
            Its lit lamps.
        dark : frozenset of str
            Vehicles whose lamps have failed.
        """
        due = self._due()
        doubtful = self._decide_by_gap(due) if due else ()
        if doubtful:
            own_lamps = {**dict.fromkeys(dark, None), ego: None if ego in dark else int(ego_lamps)}
            self._decide_by_sight(doubtful, own_lamps)

    def _due(self) -> list[str]:
        roster, schedule = self._roster, self._schedule
        roster.look()
        due = schedule.due(roster.time)
        if not roster.present.issuperset(due):
            self._forget(v for v in due if v not in roster.present)
            due = [v for v in due if v in roster.present]
        new, self._mark = roster.newcomers(self._mark)
        self._forget(new)
        self._pairs.forget(new)
        # Who comes back from a teleport still ignores somebody.
        for follower in roster.present.intersection(new) if new else ():
            self._ignoring.heed(follower)
        return due + [v for v in schedule.not_waiting(new) if v in roster.present and v not in due] if new else due

    def _forget(self, gone: Iterable[str]) -> None:
        for follower in gone:
            self._ignored.pop(follower, None)
            self._emerging.pop(follower, None)

    def _decide_by_gap(self, due: Sequence[str]) -> list[Pair]:
        """Decide where the gap alone tells, and give back the rest."""
        ignored, emerging = self._ignored, self._emerging
        # Far from any doubt: that most vehicles are, and they rest for as long as anybody.
        rested: list[str] = []
        doubtful: list[Pair] = []
        for follower, found in zip(due, map(self._leader, due, itertools.repeat(REACH)), strict=False):
            leader, gap = found or _NOBODY
            if not leader:
                if follower in ignored:
                    self._see(follower)
            elif gap > self._surely_hidden:
                if ignored.get(follower) != leader or follower in emerging:
                    self._lose(follower, leader)
                if gap <= self._hidden_for_long:
                    self._rest_near_edge(follower, leader, gap - self._surely_hidden)
                    continue
            elif gap > self._surely_seen or follower in ignored:
                doubtful.append((follower, leader, gap))
                continue
            elif gap > self._seen_for_long:
                self._rest_near_edge(follower, leader, self._surely_seen - gap)
                continue
            rested.append(follower)
        self._rest(rested, LONGEST_PAUSE)
        return doubtful

    def _rest_near_edge(self, follower: str, leader: str, distance: float) -> None:
        """Let a follower rest until the gap could have changed by a distance [m]."""
        closing = self._motion.closing(follower, leader, LONGEST_PAUSE)
        self._rest((follower,), min(distance / closing, LONGEST_PAUSE))

    def _decide_by_sight(self, pairs: Sequence[Pair], own_lamps: OwnLamps) -> None:
        looks = self._pairs.look(pairs, own_lamps, LONGEST_PAUSE)
        for (follower, leader, _), (is_seen, pause) in zip(pairs, looks, strict=True):
            if not is_seen:
                self._lose(follower, leader)
            elif follower in self._ignored and self._reacts(follower, leader):
                self._see(follower)
            self._rest((follower,), 0.0 if follower in self._emerging else pause)

    def _rest(self, followers: Sequence[str], pause: float) -> None:
        self._schedule.put(followers, self._roster.time + pause)

    def _lose(self, follower: str, leader: str) -> None:
        """From now on a follower reacts to a leader no more."""
        self._emerging.pop(follower, None)
        if self._ignored.get(follower) != leader:
            self._ignoring.ignore(follower, leader)
            self._ignored[follower] = leader

    def _see(self, follower: str) -> None:
        """From now on a follower reacts to everybody."""
        self._emerging.pop(follower, None)
        if self._ignored.pop(follower, None) is not None:
            self._ignoring.heed(follower)

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
        """Let everybody on the road react to everybody again."""
        for follower in self._roster.present.intersection(self._ignored):
            self._see(follower)
        self._ignored.clear()
