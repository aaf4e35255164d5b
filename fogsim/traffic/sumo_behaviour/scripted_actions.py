"""Actions of a script in SUMO: imposed speeds, changes of lane, lamps, traffic lights and persons who walk."""

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

from fogsim.errors import InputError, suggest
from fogsim.traffic.drivers.playing import Lamps, Motion, Playing
from fogsim.traffic.sumo.claims import LANE_CHANGE_MODE, Claims
from fogsim.traffic.sumo.lane_changes import LaneChangeSmoothing
from fogsim.traffic.sumo.link import Api, has_lane, is_off_lanes, shared_type
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_behaviour.departures import depart, enter
from fogsim.traffic.sumo_behaviour.paths import LaneOffsets, Paths
from fogsim.traffic.sumo_behaviour.speed_control import SpeedControl
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.traffic.sumo_lanes.route_position import GapToEgo
from fogsim.values import Lamp
from fogsim.values.light import lamp_names
from fogsim.values.script import (
    ChangeLane,
    Depart,
    Enter,
    Follow,
    FollowPath,
    Leave,
    SetSignal,
    TakeRoute,
    TrafficAction,
    Walk,
)

_NO_LANE_CHANGES = 0


class LaneKeeping:
    """Keeps some vehicles in their lanes."""

    def __init__(self, api: Api, vehicles: Iterable[str], roster: Roster, session: str) -> None:
        self._wanted = frozenset(vehicles)
        self._modes = Claims(api, LANE_CHANGE_MODE, session)
        self._kept: set[str] = set()
        self._roster = roster
        # Vehicles that are there already keep the owner's lane changing.
        _, self._mark = roster.entered_since(0)

    def update(self) -> None:
        """Forbid lane changes to vehicles that have entered the road."""
        new, self._mark = self._roster.entered_since(self._mark)
        for vehicle in self._wanted.intersection(new) if new else ():
            self._modes.claim(vehicle, _NO_LANE_CHANGES)
            self._kept.add(vehicle)

    def release(self, present: Collection[str]) -> None:
        """Let vehicles change lanes again as they did before."""
        for vehicle in self._kept.intersection(present):
            self._modes.withdraw(vehicle)
        self._kept.clear()


_LAMPS_PARAMETER = "fogsim-lamps"
"""Parameter of a vehicle that names its lit lamps, joined by "+"."""


class LampPublisher:
    """Publishes changes of vehicles' lamps to SUMO, for sumo-gui's parameter window, outputs and other clients.

    A parameter says it and not SUMO's own signals of the vehicle: who sets those takes braking and turning out of
    SUMO's hands, so that its stop lamps would stay dark.
    """

    def __init__(self, api: Api) -> None:
        self._api = api
        self._published: dict[str, Lamp] = {}

    def publish(self, lamps: Mapping[str, Lamp], present: set[str]) -> None:
        """Publish the lamps that have changed."""
        for vehicle, lit in lamps.items():
            if vehicle not in present:
                self._published.pop(vehicle, None)
            elif lit != self._published.get(vehicle):
                self._api.vehicle.setParameter(vehicle, _LAMPS_PARAMETER, lamp_names(lit))
                self._published[vehicle] = lit


class _SignalControl:
    """Sets traffic lights; remembers which, to give them back."""

    def __init__(self, api: Api) -> None:
        self._lights = api.trafficlight
        self._programs: dict[str, str] = {}
        self._until: dict[str, float] = {}

    def begin(self, action: SetSignal, time: float) -> None:
        """Let traffic lights show something else (`time` [s])."""
        known, signal = list(self._lights.getIDList()), action.signal
        if signal not in known:
            raise InputError(f"there are no traffic lights {signal!r} in the net; {suggest(signal, known)}")
        self._give_back(signal)
        program = str(self._lights.getProgram(signal))
        if action.phase is None:
            self._programs[signal] = program
            self._lights.setRedYellowGreenState(signal, self._state(action))
        else:
            self._lights.setPhase(signal, self._phase(action, program))
        if math.isfinite(action.hold):
            self._until[signal] = time + action.hold
            if action.phase is not None:
                self._lights.setPhaseDuration(signal, action.hold)

    def _state(self, action: SetSignal) -> str:
        links = len(self._lights.getRedYellowGreenState(action.signal))
        if len(action.state) not in (1, links):
            raise InputError(
                f"the traffic lights {action.signal!r} have {links} links: expected {links} letters, or one for all, "
                f"got {action.state!r}"
            )
        return action.state if len(action.state) == links else action.state * links

    def _phase(self, action: SetSignal, program: str) -> int:
        logics = {logic.programID: logic for logic in self._lights.getAllProgramLogics(action.signal)}
        phases = len(logics[program].phases)
        if action.phase is None or not 0 <= action.phase < phases:
            raise InputError(
                f"the program of the traffic lights {action.signal!r} has phases 0 to {phases - 1}, got {action.phase}"
            )
        return action.phase

    def update(self, time: float) -> None:
        """Give back the lights whose time is over (`time` [s])."""
        for signal in [one for one, end in self._until.items() if time >= end - 1e-9] if self._until else ():
            self._give_back(signal)

    def release(self) -> None:
        """Give all lights back to their programs."""
        for signal in list(self._programs):
            self._give_back(signal)

    def _give_back(self, signal: str) -> None:
        self._until.pop(signal, None)
        if signal in self._programs:
            self._lights.setProgram(signal, self._programs.pop(signal))


_REGARD_OF_OTHERS, _NO_COLLISION = 3 << 8, 1 << 8
"""Bits of SUMO's lane-change mode on what of others a change that is asked for regards, and those for as much as does
not hit anybody."""

_LONGEST_CHANGE = 10.0
"""Time after which a change of lane that no one could make is given up [s]."""

_ONCOMING_STAY = 1.0
"""Time for which SUMO is asked for the oncoming lane [s]: it wants as much free road, and leads no one back."""


class ScriptedActions:
    """Plays in SUMO what the script has begun."""

    def __init__(
        self,
        api: Api,
        speeds: SpeedControl,
        lamps: Lamps,
        lane_changes: LaneChangeSmoothing,
        session: str,
        left_hand: Callable[[], bool],
    ) -> None:
        self._api = api
        self._step = float(api.simulation.getDeltaT())
        self._speeds = speeds
        self._playing = Playing(lamps, left_hand)
        self._lane_changes = lane_changes
        self._signals = _SignalControl(api)
        self._modes = Claims(api, LANE_CHANGE_MODE, f"{session}.script")
        self._offsets = LaneOffsets(api)
        self._paths = Paths(api)
        self._directions = LaneDirections(api)
        self._changing: dict[str, float] = {}
        self._oncoming: set[str] = set()

    def begin(
        self, actions: Sequence[TrafficAction], time: float, present: Collection[str]
    ) -> tuple[TrafficAction, ...]:
        """Begin actions at a time [s]; return those without their vehicle, lane, or leader ahead."""
        # Who leaves by one of these is gone for the next.
        present = {*present}
        refused, motion = list[TrafficAction](), self._motion(time, present)
        for action in actions:
            if isinstance(action, SetSignal):
                self._signals.begin(action, time)
            elif isinstance(action, Depart):
                refused += [] if depart(self._api, action, present) else [action]
            elif isinstance(action, Enter):
                refused += [] if enter(self._api, action) else [action]
            elif isinstance(action, FollowPath):
                refused += [] if self._paths.begin(action, time, present) else [action]
            elif isinstance(action, Walk):
                refused += [] if self._walk(action) else [action]
            elif action.vehicle not in present or not self._is_possible(action, motion):
                refused.append(action)
            elif isinstance(action, TakeRoute):
                refused += [] if self._take_route(action) else [action]
            elif isinstance(action, Leave):
                self._paths.leave(action.vehicle)
                self._api.vehicle.remove(action.vehicle)
                present.discard(action.vehicle)
            else:
                self._playing.begin(action, motion)
        return tuple(refused)

    def _walk(self, action: Walk) -> bool:
        person = self._api.person
        if action.person not in person.getIDList():
            return False
        person.setSpeed(action.person, action.speed)
        return True

    def _take_route(self, action: TakeRoute) -> bool:
        vehicle = self._api.vehicle
        route, index = vehicle.getRoute(action.vehicle), vehicle.getRouteIndex(action.vehicle)
        if index < 0 or action.vehicle in self._paths.vehicles:
            return False
        here, edges = route[index], list(action.edges)
        if here in edges:
            vehicle.setRoute(action.vehicle, edges[edges.index(here) :])
            return True
        found = self._api.simulation.findRoute(here, edges[0], shared_type(self._api, action.vehicle)).edges
        if found:
            vehicle.setRoute(action.vehicle, [*found, *edges[1:]])
        return bool(found)

    def _is_possible(self, action: TrafficAction, motion: Motion) -> bool:
        """Whether there is the lane to change to, or the one to follow is ahead."""
        if isinstance(action, Follow):
            return action.leader in motion.present and motion.gap(action.vehicle, action.leader) is not None
        if not isinstance(action, ChangeLane) or action.vehicle in self._oncoming:
            return True
        if action.oncoming:
            return not is_off_lanes(self._api, action.vehicle)
        if action.vehicle in self._paths.vehicles and not action.lanes:
            return True
        return has_lane(self._api, action.vehicle, action.lanes)

    def _motion(self, time: float, present: Collection[str]) -> Motion:
        vehicle = self._api.vehicle

        def gap(follower: str, leader: str) -> float | None:
            signed = GapToEgo(self._api, leader).measure(follower)
            return None if signed is None or signed > 0.0 else -signed

        def driven(one: str) -> float:
            along = self._paths.driven(one)
            return self._directions.driven(one) if along is None else along

        return Motion(time, self._step, present, driven, vehicle.getSpeed, gap)

    def play(self, time: float, present: Collection[str]) -> None:
        """Go on with what has begun, for the next step (`time` [s])."""
        self._signals.update(time)
        if self._changing:
            self._end_changes(time, present)
        if not self._playing.is_idle or self._paths.vehicles:
            self._play(time, present)
        self._offsets.play(time + self._step, present)

    def _play(self, time: float, present: Collection[str]) -> None:
        motion = self._motion(time, present)
        speeds = self._playing.speeds(motion)
        self._paths.play(time, self._step, speeds, present)
        free = {vehicle: speed for vehicle, speed in speeds.items() if vehicle not in self._paths.vehicles}
        self._speeds.impose(free, self._playing.following)
        for change in self._playing.changes(motion):
            self._change_lane(change, time)

    def _change_lane(self, change: ChangeLane, time: float) -> None:
        if change.vehicle in self._paths.vehicles:
            self._paths.shift(change.vehicle, change.offset or 0.0, change.duration or 0.0, time)
            return
        is_in_lane = change.offset is not None and not change.lanes
        if change.offset is not None:
            # What is shown glides to another lane by itself.
            self._offsets.begin(change.vehicle, change.offset, (change.duration or 0.0) * is_in_lane, time)
        if is_in_lane:
            return
        vehicle, mode = change.vehicle, int(self._modes.own_value(change.vehicle))
        self._modes.claim(vehicle, mode & ~_REGARD_OF_OTHERS | _NO_COLLISION)
        self._changing[vehicle] = time + min(change.stay, _LONGEST_CHANGE)
        if change.duration is not None:
            self._lane_changes.take_time(vehicle, change.duration)
        if change.oncoming:
            beyond = self._api.edge.getLaneNumber(self._api.vehicle.getRoadID(vehicle))
            self._oncoming.add(vehicle)
            self._api.vehicle.changeLane(vehicle, beyond, _ONCOMING_STAY)
        elif vehicle in self._oncoming:
            self._oncoming.discard(vehicle)
            self._api.vehicle.changeLaneRelative(vehicle, -1, change.stay)
        else:
            self._api.vehicle.changeLaneRelative(vehicle, change.lanes, change.stay)

    def _end_changes(self, time: float, present: Collection[str]) -> None:
        # Who is teleported meanwhile may come back.
        for vehicle in [one for one, end in self._changing.items() if time >= end and one in present]:
            del self._changing[vehicle]
            self._modes.withdraw(vehicle)

    def release(self, present: Collection[str]) -> None:
        """Give traffic lights and lane changing back; speeds are `SpeedControl`'s."""
        self._signals.release()
        self._paths.release(present)
        for vehicle in self._changing.keys() & set(present):
            self._modes.withdraw(vehicle)
        self._changing.clear()
