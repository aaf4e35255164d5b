"""Entries of a script whose conditions are watched, and what of them begins, is over, or has never begun."""

import math
from collections.abc import Collection
from dataclasses import dataclass, field

from fogsim.conditions import History, Moment, Watch
from fogsim.simulation.run_config import Script, ScriptEntry
from fogsim.values import Ending, Reason, TrafficStep, Unplayed, UnplayedEvent
from fogsim.values.script import (
    Actions,
    Begun,
    ChangeFog,
    ChangeLane,
    ChangeLight,
    ChangeSpeed,
    Depart,
    Enter,
    Follow,
    SetSignal,
    TakeRoute,
    TrafficAction,
    Walk,
)
from fogsim.values.traffic import with_persons

_TICK = 1e-6
"""Rounding of times [s]."""


@dataclass(frozen=True, slots=True)
class Due:
    """What of a timeline begins in a camera period."""

    actions: Actions = field(default_factory=Actions)  # What is to be done
    # Entries that begin, and what each asks of the traffic
    parts: tuple[tuple[Begun, tuple[TrafficAction, ...]], ...] = ()
    over: tuple[Begun, ...] = ()  # Entries that are over


_NOTHING_DUE = Due()


class Timeline:
    """Watches the conditions of a script, and says what begins."""

    def __init__(self, script: Script) -> None:
        self._entries = tuple(_Entry(entry) for entry in script.entries)
        self._end = None if script.end_when is None else Watch(script.end_when)
        self._history = History()
        self._seen: set[str] = set()
        self._ends: list[Begun] = []

    @property
    def is_idle(self) -> bool:
        """Whether there is nothing to watch."""
        return not self._entries and self._end is None

    def due(self, step: TrafficStep) -> Due:
        """Take in a finished step, and say what begins after it.

        An entry begins when its condition holds (and its delay is over) and all its vehicles are on the road.
        """
        if not self._entries:
            return _NOTHING_DUE
        moment = self._history.moment(step)
        now = _Now(moment)
        self._seen.update(step.traffic.ids)
        self._seen.update(step.traffic.persons.ids)
        parts: list[tuple[Begun, Actions]] = []
        for entry in self._entries:
            entry.look(moment)
            actions = entry.config.actions(now) if entry.is_due(step.time) else None
            if actions is not None:
                parts.append((entry.begin(step.time, moment), actions))
        self._ends += [end for begun, actions in parts if (end := _end(begun, actions)) is not None]
        over = tuple(end for end in self._ends if end.time <= step.time + _TICK)
        self._ends = [end for end in self._ends if end not in over]
        return Due(_together([actions for _, actions in parts]), tuple((b, a.traffic) for b, a in parts), over)

    def ended(self, step: TrafficStep) -> Ending | None:
        """Whether a finished step is the last one by the script's ``end_when``; None if the run goes on."""
        return Ending.END_CONDITION if self._end is not None and self._end.update(step) else None

    def begun(self, due: Due, refused: Collection[TrafficAction]) -> tuple[Begun, ...]:
        """What has begun, or is over, of what was due."""
        failed = {
            begun.name: self._why_refused(action)
            for begun, actions in due.parts
            for action in actions
            if action in refused
        }
        tried = {begun.name for begun, _ in due.parts}
        for entry in self._entries:
            if entry.name in tried:
                entry.refusal = failed.get(entry.name)
        self._ends = [end for end in self._ends if end.name not in failed]
        return (*due.over, *(begun for begun, _ in due.parts if begun.name not in failed))

    def _why_refused(self, action: TrafficAction) -> Reason:
        match action:
            case Follow():
                return Reason.NOT_AHEAD
            case Depart() | Enter():
                return Reason.NO_PLACE
            case ChangeLane() | TakeRoute() | SetSignal():
                return Reason.NO_LANE
        who = action.person if isinstance(action, Walk) else action.vehicle
        return Reason.LEFT if who in self._seen else Reason.NEVER_SEEN

    def unplayed(self, step: TrafficStep) -> Unplayed:
        """What has not begun when a run is over."""
        reasons = [(entry, entry.why_not(self._seen, step)) for entry in self._entries]
        names = {vehicle for entry in self._entries for vehicle in entry.vehicles(step)}
        return Unplayed(
            tuple(UnplayedEvent(f"{e.name} ({e.config.text})", why) for e, why in reasons if why is not None),
            tuple(sorted(names.difference(self._seen))),
        )


class _Entry:
    """An entry, and what has become of it."""

    def __init__(self, config: ScriptEntry) -> None:
        self.config, self.name = config, config.name
        self.refusal: Reason | None = None
        self._watch = Watch(config.when)
        self._held = False
        self._has_held = self._has_begun = False
        self._waiting: list[tuple[float, str]] = []

    def look(self, moment: Moment) -> None:
        """See whether the condition holds now; what has begun once for all is not looked at again."""
        if self._has_held and self.config.happens_once:
            return
        holds = bool(self._watch.look(moment))
        comes = holds and not self._held
        self._held = holds
        self._has_held |= holds
        if comes:
            self._waiting.append((moment.step.time + self.config.delay, self._watch.readings()))

    def is_due(self, time: float) -> bool:
        """Whether it is time to begin."""
        return bool(self._waiting) and self._waiting[0][0] <= time + _TICK

    def begin(self, time: float, moment: Moment) -> Begun:
        """Begin."""
        _, why = self._waiting.pop(0)
        self._has_begun = True
        who = tuple(moment.vehicle_id(vehicle) for vehicle in self.config.vehicles)
        return Begun(self.name, time, self.config.text, why, who, self.config.key)

    def vehicles(self, step: TrafficStep) -> tuple[str, ...]:
        """Ids of its vehicles."""
        moment = History().moment(step)
        return tuple(moment.vehicle_id(vehicle) for vehicle in self.config.vehicles)

    def why_not(self, seen: Collection[str], step: TrafficStep) -> Reason | None:
        """Why it has not begun; None if it has."""
        if self.refusal is not None:
            return self.refusal
        if self._has_begun:
            return None
        if not self._has_held or not self.is_due(step.time):
            return Reason.NEVER_HELD
        absent = [vehicle for vehicle in self.vehicles(step) if with_persons(step.traffic).row(vehicle) is None]
        if not absent:
            # It needs a place along the ego's route, or the run has ended at its time.
            return Reason.NOT_REACHED
        return Reason.NEVER_SEEN if any(vehicle not in seen for vehicle in absent) else Reason.LEFT


class _Now:
    """Where vehicles are at one moment; see `Situation`."""

    def __init__(self, moment: Moment) -> None:
        self._moment = moment

    def vehicle_id(self, vehicle: str) -> str:
        return self._moment.vehicle_id(vehicle)

    def speed(self, vehicle: str) -> float | None:
        row = self._moment.row(vehicle)
        return None if row is None else float(self._moment.traffic.speed[row])

    def position(self, vehicle: str) -> float | None:
        return self._moment.position(vehicle)

    def lane(self, vehicle: str) -> int | None:
        row = self._moment.row(vehicle)
        if row is None:
            return None
        lane = self._moment.traffic.lane[row]
        edge, _, number = lane.rpartition("_")
        beside = self._moment.step.truth.carriageways.get(edge, ())
        if lane in beside:
            return beside.index(lane)
        return int(number) if number.isdecimal() else None


def _together(parts: list[Actions]) -> Actions:
    return Actions(
        tuple(one for part in parts for one in part.traffic),
        tuple(one for part in parts for one in part.fog),
        tuple(one for part in parts for one in part.light),
        tuple(one for part in parts for one in part.faults),
    )


def _end(begun: Begun, actions: Actions) -> Begun | None:
    """When what an entry does is over, where that is known beforehand."""
    lasting = [_duration(action) for action in (*actions.traffic, *actions.fog, *actions.light)]
    lasting += [fault.delay + fault.duration for fault in actions.faults]
    longest = max(lasting, default=0.0)
    if not 0.0 < longest < math.inf:
        return None
    return Begun(begun.name, begun.time + longest, begun.what, begun.why, begun.who, begun.key, is_over=True)


def _duration(action: TrafficAction | ChangeFog | ChangeLight) -> float:
    """How long an action lasts [s]; 0 for what is done at once, or whose end is unknown beforehand."""
    match action:
        case ChangeSpeed() | Follow() | SetSignal():
            return action.hold
        case ChangeLane():
            return action.indicator + (action.duration or 0.0)
        case ChangeFog() | ChangeLight():
            return action.duration
        case _:
            return 0.0
