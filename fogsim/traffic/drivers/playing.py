"""Actions of a script that have begun: speeds, lanes and lamps of vehicles, whatever simulates them."""

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from fogsim.values import Lamp, TrafficState
from fogsim.values.light import Side, dark_on, settled
from fogsim.values.script import Arrive, ChangeLane, ChangeSpeed, Follow, SetLamps, Shape, Stop, TrafficAction

_GAP_GAIN, _SPEED_GAIN = 0.25, 0.8
"""Of the law by which a scripted vehicle follows: acceleration for a gap [1/s²] and for a difference of speeds [1/s].

They damp it at any headway above 0.25 s (Rajamani, Vehicle Dynamics and Control, 2nd ed., ch. 6: constant time gap).
"""

_LEAST_ACCELERATION, _MOST_ACCELERATION = -6.0, 2.5
"""Limits of that acceleration [m/s²]."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What actions look at."""

    time: float  # Time since the ego appeared [s]
    step: float  # Time to the next step [s]
    present: Collection[str]  # Vehicles on the road
    # driven, speed: distance that a vehicle has driven [m], and its speed [m/s]
    driven: Callable[[str], float]
    speed: Callable[[str], float]
    # Gap from a vehicle to another that is ahead of it, bumper to bumper [m]; None if there is none
    gap: Callable[[str, str], float | None]


class _Course(Protocol):
    """Speeds of one vehicle while an action lasts."""

    def speed(self, motion: Motion) -> float | None:
        """Speed to have after the next step [m/s]; ``inf`` for the driver's own, None when the action is over."""


@dataclass(slots=True)
class _SpeedCourse:
    action: ChangeSpeed
    begun: float
    first: float
    is_close: bool = False  # It keeps the speed at which it followed another vehicle

    def speed(self, motion: Motion) -> float | None:
        passed = motion.time + motion.step - self.begun
        action = self.action
        if motion.time - self.begun >= action.hold - 1e-9:
            return None
        if action.like and action.like in motion.present:
            speed = max(motion.speed(action.like) * action.factor + action.plus, 0.0)
            self.action = action = replace(action, speed=speed)
        return speed_on_the_way(action, self.first, passed)


def speed_on_the_way(action: ChangeSpeed, first: float, passed: float) -> float:
    """Speed at a time on the way from one speed to another [m/s] (`first` [m/s], `passed` [s])."""
    if action.profile:
        times, speeds = zip(*action.profile, strict=True)
        return float(np.interp(passed, (0.0, *times), (first, *speeds)))
    at_once = action.shape is Shape.STEP or action.duration <= 0.0
    share = 1.0 if at_once else min(max(passed / action.duration, 0.0), 1.0)
    if action.shape is Shape.SINUSOIDAL:
        share = 0.5 - 0.5 * math.cos(math.pi * share)
    return first + share * (action.speed - first)


@dataclass(slots=True)
class _FollowCourse:
    action: Follow
    begun: float

    def speed(self, motion: Motion) -> float | None:
        follow = self.action
        if motion.time - self.begun >= follow.hold - 1e-9 or follow.leader not in motion.present:
            return None
        gap, own = motion.gap(follow.vehicle, follow.leader), motion.speed(follow.vehicle)
        if gap is None:
            return math.inf
        excess = gap - follow.gap - follow.headway * own
        wanted = _GAP_GAIN * excess + _SPEED_GAIN * (motion.speed(follow.leader) - own)
        return max(own + min(max(wanted, _LEAST_ACCELERATION), _MOST_ACCELERATION) * motion.step, 0.0)


@dataclass(slots=True)
class _ArriveCourse:
    """Steers to a place and time by a cubic from the present place and speed, planned again at each step."""

    action: Arrive
    last: float | None = None

    def speed(self, motion: Motion) -> float | None:
        action = self.action
        if self.last is not None or action.other not in motion.present:
            return self.last if self.last is not None else motion.speed(action.vehicle)
        own, other = motion.speed(action.vehicle), motion.speed(action.other)
        left = action.distance - motion.driven(action.vehicle)
        time = (action.other_distance - motion.driven(action.other)) / max(other, 0.01)
        final = None if action.speed is None else max(action.speed + action.factor * other, 0.0)
        if final:
            left -= action.steady + action.steady_time * final
            time -= action.steady / final + action.steady_time
        if time <= motion.step or left <= 0.0:
            self.last = own if final is None else final
            return self.last
        if final is None:
            wanted = 3.0 * (left - own * time) / time**2
        else:
            wanted = 6.0 * left / time**2 - (4.0 * own + 2.0 * final) / time
        return max(own + wanted * motion.step, 0.0)


@dataclass(slots=True)
class _StopCourse:
    action: Stop
    place: float
    stood_since: float | None = None

    def speed(self, motion: Motion) -> float | None:
        left = max(self.place - motion.driven(self.action.vehicle), 0.0)
        own, lost = motion.speed(self.action.vehicle), self.action.deceleration * motion.step
        if self.stood_since is None and own < 0.1 and left < 1.0:
            self.stood_since = motion.time
        if self.stood_since is not None:
            return None if motion.time - self.stood_since >= self.action.stand - 1e-9 else 0.0
        # From this speed after the step one comes to a standstill at the place.
        allowed = math.sqrt(lost**2 + 2.0 * self.action.deceleration * left) - lost
        return allowed if allowed < own else math.inf


@dataclass(slots=True)
class _Switches:
    """Lamps that are not the vehicle's own."""

    lit: Lamp = Lamp.NONE
    dark: Lamp = Lamp.NONE
    failed: Lamp = Lamp.NONE


@dataclass(frozen=True, slots=True)
class _Indicating:
    change: ChangeLane
    begins: float
    ends: float
    lamp: Lamp


@dataclass(slots=True)
class Lamps:
    """Lamps that are switched by hand, have failed, or indicate a change of lane."""

    _switches: dict[str, dict[Side, _Switches]] = field(default_factory=dict)
    _indicating: dict[str, _Indicating] = field(default_factory=dict)

    @property
    def dark(self) -> frozenset[str]:
        """Vehicles that show nothing but their body: no lamp that would shine by itself is lit."""
        seen = int(Lamp.POSITION | Lamp.LOW_BEAM)
        return frozenset(vehicle for vehicle in self._switches if not settled(self.switched(vehicle, seen)))

    @property
    def vehicles(self) -> frozenset[str]:
        """Vehicles with a lamp that is, or was once, switched for them."""
        return frozenset(self._switches)

    def switch(self, action: SetLamps) -> None:
        """Switch lamps."""
        sides = self._switches.setdefault(action.vehicle, {side: _Switches() for side in Side})
        for now in sides.values() if action.side is None else (sides[action.side],):
            now.failed |= action.failed
            now.lit = (now.lit & ~(action.dark | action.automatic) | action.lit) & ~now.failed
            now.dark = now.dark & ~(action.lit | action.automatic) | action.dark

    def switched(self, vehicle: str, own: int) -> int:
        """Lamps of a vehicle as they are switched, with the bits of every side that is dark."""
        lamps = own
        for side, switches in self._switches.get(vehicle, {}).items():
            # A kind that is lit by hand on one side, and not by itself, is dark on the others.
            others = [other for other in self._switches[vehicle] if other is not side]
            lit = int(switches.lit) & ~own
            lamps |= lit
            lamps |= dark_on(int(switches.dark | switches.failed), side)
            lamps |= sum(dark_on(lit & ~int(self._switches[vehicle][other].lit), other) for other in others)
        return lamps

    def indicate(self, indicating: _Indicating) -> None:
        """Let a vehicle indicate."""
        self._indicating[indicating.change.vehicle] = indicating

    def shown(self, state: TrafficState, time: float) -> TrafficState:
        """A state with the lamps as they are (`time` [s])."""
        if not (self._switches or self._indicating):
            return state
        self._indicating = {v: one for v, one in self._indicating.items() if time < one.ends}
        touched = {v for v in (*self._switches, *self._indicating) if v in state.ids}
        if not touched:
            return state
        lamps = state.lamps.copy()
        for vehicle in touched:
            row = state.ids.index(vehicle)
            lit = int(lamps[row])
            if vehicle in self._indicating:
                lit |= int(self._indicating[vehicle].lamp)
            lamps[row] = settled(self.switched(vehicle, lit))
        return replace(state, lamps=lamps.astype(np.int32))


def _is_close(course: _Course | None) -> bool:
    return isinstance(course, _FollowCourse) or (isinstance(course, _SpeedCourse) and course.is_close)


_SAME = 1e-6  # Difference of speeds that is none [m/s]
_USUAL_DURATION = 3.0
"""Time that a change of lane takes which says nothing of it [s]."""


class Playing:
    """Plays what has begun; in left-hand traffic, lanes count to the right."""

    def __init__(self, lamps: Lamps, left_hand: Callable[[], bool] = lambda: False) -> None:
        self._lamps = lamps
        self._left_hand = left_hand
        self._courses: dict[str, _Course] = {}
        self._due_changes: list[_Indicating] = []

    @property
    def is_idle(self) -> bool:
        """True if nothing is under way, so that `speeds` and `changes` would give nothing."""
        return not (self._courses or self._due_changes)

    @property
    def following(self) -> frozenset[str]:
        """Vehicles that keep a headway to another one, or the speed at which they did."""
        return frozenset(v for v, course in self._courses.items() if _is_close(course))

    def begin(self, action: TrafficAction, motion: Motion) -> None:
        """Begin an action of a vehicle on the road; of several on a speed the last one counts."""
        match action:
            case ChangeSpeed():
                first = motion.speed(action.vehicle)
                is_kept = action.duration <= 0.0 and not action.profile and abs(action.speed - first) < _SAME
                is_close = is_kept and _is_close(self._courses.get(action.vehicle))
                self._courses[action.vehicle] = _SpeedCourse(action, motion.time, first, is_close)
            case Follow():
                self._courses[action.vehicle] = _FollowCourse(action, motion.time)
            case Arrive():
                self._courses[action.vehicle] = _ArriveCourse(action)
            case Stop():
                place = motion.driven(action.vehicle) + action.distance
                self._courses[action.vehicle] = _StopCourse(action, place)
            case ChangeLane():
                begins = motion.time + action.indicator
                lasting = _USUAL_DURATION if action.duration is None else action.duration
                indicates = action.indicator > 0.0
                to_the_left = (action.lanes > 0) != (indicates and self._left_hand())
                lamp = Lamp.INDICATOR_LEFT if to_the_left else Lamp.INDICATOR_RIGHT
                indicating = _Indicating(action, begins, begins + lasting, lamp)
                self._due_changes.append(indicating)
                if indicates:
                    self._lamps.indicate(indicating)
            case SetLamps():
                self._lamps.switch(action)

    def speeds(self, motion: Motion) -> dict[str, float]:
        """Speeds that vehicles are to have after the next step [m/s]; ``inf`` for a driver who is free."""
        speeds: dict[str, float] = {}
        for vehicle, course in list(self._courses.items()):
            speed = course.speed(motion) if vehicle in motion.present else None
            if speed is None:
                del self._courses[vehicle]
            if vehicle in motion.present:
                speeds[vehicle] = math.inf if speed is None else speed
        return speeds

    def changes(self, motion: Motion) -> tuple[ChangeLane, ...]:
        """Changes of lane that are to be made now."""
        due = [one for one in self._due_changes if one.begins <= motion.time + 1e-9]
        self._due_changes = [one for one in self._due_changes if one not in due]
        return tuple(one.change for one in due if one.change.vehicle in motion.present)
