"""Drivers react to a leader only once they can see it.

SUMO's own car-following models get the leader to ignore (``carFollowModel.ignoreIDs``), and only when that changes; so
Krauss, IDM, EIDM and the rest stay as they are, and an unseen vehicle stays on the road. Lane changing is changed with
it; see `_IgnoredLeaders`.

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
from numpy.typing import NDArray

from fogsim.traffic.appearance import OTHERS_LAMPS, TRAINS, lamps_from_signals
from fogsim.traffic.drivers.lamp_intensity import BRIGHTEST as BRIGHTEST_LAMP
from fogsim.traffic.drivers.lamp_intensity import high_beam_veil, rear_intensity, uses_high_beam
from fogsim.traffic.drivers.sight_kernels import (
    BRIGHTEST,
    CONTRAST,
    DAZZLED,
    DEPTH,
    DISTANCE,
    INTENSITY,
    OWN,
    OWN_STEADY,
    SEEN,
    STEADY,
    Closing,
    face_leaders,
)
from fogsim.traffic.sumo.claims import SPEED_GAIN, SessionValues
from fogsim.traffic.sumo.link import Api, Getter, vehicle_getter
from fogsim.traffic.sumo.roster import DueVehicles, closing_speed_bound
from fogsim.traffic.sumo_drivers.oncoming_glare import OncomingGlare, most_glare
from fogsim.traffic.sumo_drivers.unseen import LaneChangeSwitch
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps
from fogsim.traffic.sumo_lanes.leaders import Leaders
from fogsim.values import Lamp

_LEAST_EXTINCTION = 1e-6
"""Below this, fog hides nothing that matters [1/m]."""

_FASTEST_DRIFT = 30.0
"""Fog drifts and changes no faster than if a wind of this speed carried it [m/s]."""

_LIT = [int(OTHERS_LAMPS) | lamps_from_signals(signals) for signals in range(128)]
_REAR_LIGHTS = np.array([[rear_intensity(lit | soon) for lit in _LIT] for soon in (0, int(Lamp.STOP))])
"""Luminous intensity of the brightest rear lamp that signals light, and that may soon be lit (2, n) [cd]."""

_NOWHERE = np.empty((2, 0, 3))

_Pair = tuple[str, str, float]
"""Follower, leader, and SUMO's gap between them [m], which leaves out the follower's minimum gap."""


class LeaderSight:
    """Computes sight along the fog between drivers and the vehicles ahead of them (`speed` [m/s], `horizon` [s])."""

    def __init__(self, view: DriversView, speed: Getter, horizon: float) -> None:
        self._speed, self._horizon = speed, horizon
        self._fog, self._sight, self._vehicles, self._extinction = view.fog, view.sight, view.vehicles, view.extinction
        self._position = vehicle_getter(view.api, "getPosition3D")
        (self._signals,) = view.getters("getSignals")
        self._glare = OncomingGlare(view)
        self._most_glare = most_glare(view.sight.illuminance)
        densest, change = view.fog.maximum_extinction, closing_speed_bound(0.0, 0.0, horizon)
        densest = densest if view.extinction is None else max(densest, _LEAST_EXTINCTION)
        self._closing = Closing(change, _FASTEST_DRIFT, densest, -1.0 if view.extinction is None else view.extinction)

    def assess(self, pairs: Sequence[_Pair], own_lamps: OwnLamps) -> tuple[list[bool], list[float]]:
        """Whether each leader is seen, and for how long that is sure to stay so [s]."""
        facing = self._facing(pairs)
        if own_lamps:
            self._add_own_lamps(facing, pairs, own_lamps)
        judged, pauses = self._sight.judge_leaders(facing, self._most_glare, self._horizon)
        if own_lamps and self._most_glare > 0.0:
            self._doubt_own_beams(judged, pauses, pairs, own_lamps)
        seen: list[bool] = (judged == SEEN).tolist()
        for i in (judged == DAZZLED).nonzero()[0].tolist() if self._most_glare > 0.0 else ():
            seen[i] = self._is_seen(pairs[i], facing[:, i], own_lamps)
        return seen, pauses.tolist()

    def _facing(self, pairs: Sequence[_Pair]) -> NDArray[np.float64]:
        """What is known of followers and their leaders (10, n), all with the lamps that SUMO's drivers light."""
        followers, leaders, gaps = zip(*pairs, strict=True)
        both, count, facing, lines = followers + leaders, len(pairs), np.empty((OWN + 1, len(pairs))), _NOWHERE
        if self._extinction is None:
            flat = itertools.chain.from_iterable(map(self._position, both))
            lines = np.fromiter(flat, np.float64, 6 * count).reshape(2, -1, 3)
        read = np.fromiter(
            itertools.chain(gaps, map(self._speed, both), map(self._signals, leaders)), np.float64, 4 * count
        ).reshape(4, -1)
        rows = self._vehicles.rows(both).reshape(2, -1)
        face_leaders(self._vehicles.traits, rows, read, _REAR_LIGHTS, self._closing, facing, lines)
        if self._extinction is None:
            facing[DEPTH] = self._fog.optical_depth(*lines)
        return facing

    @staticmethod
    def _doubt_own_beams(
        judged: NDArray[np.float64], pauses: NDArray[np.float64], pairs: Sequence[_Pair], own_lamps: OwnLamps
    ) -> None:
        """Look again, one by one, for drivers with high beams, which veil the fog; and soon, for those who may have."""
        for i, (follower, _, _) in enumerate(pairs):
            if follower in own_lamps:
                pauses[i] = 0.0
                if uses_high_beam(own_lamps[follower]):
                    judged[i] = DAZZLED

    def _add_own_lamps(self, facing: NDArray[np.float64], pairs: Sequence[_Pair], own_lamps: OwnLamps) -> None:
        for i, (follower, leader, _) in enumerate(pairs):
            if leader in own_lamps:
                facing[INTENSITY, i] = rear_intensity(self._vehicles.lamps(leader, own_lamps))
                # Lamps that are commanded may be commanded otherwise in any step.
                facing[STEADY, i], facing[BRIGHTEST, i] = 0.0, BRIGHTEST_LAMP
            if follower in own_lamps:
                facing[OWN_STEADY, i] = 0.0
                facing[OWN, i] = self._vehicles.head_lamps(follower, own_lamps)

    def _is_seen(self, pair: _Pair, facing: NDArray[np.float64], own_lamps: OwnLamps) -> bool:
        """Whether a leader is seen who is unless glare hides it, which costs more than all the rest to know."""
        follower, leader, _ = pair
        glare = self._glare.veil(follower, leader, own_lamps)
        if uses_high_beam(own_lamps.get(follower, 0)):
            glare += high_beam_veil(self._extinction_at(follower))
        elif glare == 0.0:
            # Without glare the kernel has looked already.
            return True
        distance, contrast, intensity, own = facing[[DISTANCE, CONTRAST, INTENSITY, OWN]].tolist()
        return bool(facing[DEPTH] <= self._sight.depth_limit(distance, contrast, intensity, own, glare))

    def _extinction_at(self, vehicle: str) -> float:
        """Extinction coefficient where a vehicle is [1/m]."""
        if self._extinction is not None:
            return self._extinction
        x, y, z = self._position(vehicle)
        return float(self._fog.extinction((x, y, z + self._vehicles.body(vehicle).eye_height)))


REACH = 250.0
"""Leaders farther ahead than this do not matter [m]: from 150 km/h one stops in less."""

_LARGEST_MINIMUM_GAP = 5.0
"""No driver's minimum gap is larger than this [m]."""

MAX_PAUSE = 0.5
"""Every driver's sight is computed at least this often [s], for leaders change."""

_LONG_WAY = 70.0 * MAX_PAUSE
"""By more than this no gap changes until then [m]: at 250 km/h towards a standing vehicle."""

_CLOSING = closing_speed_bound(0.0, 0.0, MAX_PAUSE)
"""By so much the difference of two speeds changes until then, on the average [m/s]."""

_NO_LEADER = "", 0.0
_IGNORED = "carFollowModel.ignoreIDs"
_NO_SPEED_GAIN = 0.0


class _IgnoredLeaders:
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
    """Decides in each step which leaders are seen: `hidden` has those that are not reacted to, by follower."""

    def __init__(self, view: DriversView) -> None:
        api, fog, sight, self._roster = view.api, view.fog, view.sight, view.roster
        self._view, self._hidden_vehicles = view, view.hidden_vehicles
        self._ignored_leaders = _IgnoredLeaders(api, view.session)
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
        if due:
            self._look(due, own_lamps)

    def _look(self, due: Sequence[str], own_lamps: OwnLamps) -> None:
        """Decide by the gap alone where that is enough, and by sight where it is not."""
        ignored, speed, seen, hidden = self._ignored, self.speed, self._certainly_seen, self._certainly_hidden
        ahead = list(map(self.leader, due, itertools.repeat(REACH)))
        behind = self._obstructed(due, ahead)
        near: dict[str, tuple[str, float]] = {}
        doubtful: list[_Pair] = []
        for follower, found in zip(due, ahead, strict=True):
            leader, gap = found or _NO_LEADER
            if not leader:
                if follower in ignored:
                    self._reveal(follower)
                continue
            if gap > hidden or follower in behind:
                if follower not in ignored or ignored[follower] != leader or follower in self._emerging:
                    self._hide(follower, leader)
                near_edge = 0.0 if follower in behind else gap - hidden
            elif gap > seen or follower in ignored:
                doubtful.append((follower, leader, gap))
                continue
            else:
                near_edge = seen - gap
            if near_edge < _LONG_WAY:
                near[follower] = leader, near_edge
        leaders, ways = zip(*near.values(), strict=True) if near else ((), ())
        speeds = zip(near, map(speed, near), map(speed, leaders), ways, strict=True)
        # Until the gap could have changed by so much. Most are far from any doubt, and pause for the longest time.
        soon = {
            follower: pause
            for follower, own, other, way in speeds
            if (pause := way / ((other - own if other > own else own - other) + _CLOSING)) < MAX_PAUSE
        }
        if doubtful:
            pauses = self._decide_by_sight(doubtful, own_lamps)
            soon |= {pair[0]: pause for pair, pause in zip(doubtful, pauses, strict=True) if pause < MAX_PAUSE}
        self._due.schedule([follower for follower in due if follower not in soon], MAX_PAUSE)
        self._due.schedule_each(soon, soon.values())

    def _obstructed(self, followers: Sequence[str], ahead: Sequence[tuple[str, float] | None]) -> Collection[str]:
        """Those whose leaders are behind something that stands next to the road."""
        if self._hidden_vehicles is None:
            return ()
        pairs = [(v, found[0]) for v, found in zip(followers, ahead, strict=True) if found and found[0]]
        return {v for (v, _), hidden in zip(pairs, self._hidden_vehicles.are_hidden(pairs), strict=True) if hidden}

    def _decide_by_sight(self, pairs: Sequence[_Pair], own_lamps: OwnLamps) -> list[float]:
        """Decide where sight is in doubt, and give back the pauses until the next looks [s]."""
        seen, pauses = self._leader_sight.assess(pairs, own_lamps)
        ignored, emerging = self._ignored, self._emerging
        for (follower, leader, _), is_seen in zip(pairs, seen, strict=True):
            if not is_seen:
                if follower not in ignored or ignored[follower] != leader or follower in emerging:
                    self._hide(follower, leader)
            elif follower in ignored and self._reacts(follower, leader):
                self._reveal(follower)
        return [0.0 if pair[0] in emerging else pause for pair, pause in zip(pairs, pauses, strict=True)]

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
