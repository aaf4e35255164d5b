"""Triggers as conditions of FogSim's language."""

import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from fogsim.openscenario.entities import Vehicle
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.parameters import RULES
from fogsim.openscenario.positions import Positions
from fogsim.openscenario.xml_tree import Node

_DISTANCES = ("longitudinal", "cartesianDistance", "euclidianDistance")
_EDGES = ("none", "rising", "falling", "risingOrFalling")
_WORD = re.compile(r"[A-Za-z_][\w:#@\-]*")
NEAR = 0.05
"""Difference up to which speeds are equal [m/s]."""

_STILL = 0.1  # Speed below which a vehicle counts as stopped [m/s]


@dataclass(frozen=True, slots=True)
class Trigger:
    """When something begins: a condition in FogSim's language ("" for never), and a delay after it [s].

    `at` is the time if the condition is only a time [s], below zero for the start. `stays` if it stays true.
    """

    condition: str
    delay: float = 0.0
    at: float | None = None
    stays: bool = False


@dataclass(frozen=True, slots=True)
class Mark:
    """A timeline entry without action that records that something has happened, for an element."""

    name: str
    trigger: Trigger
    node: Node


AT_ONCE = Trigger("time >= 0 s", at=-1.0)
NEVER = Trigger("")


@dataclass(frozen=True, slots=True)
class _Test:
    """A condition: its text, and the comparison if it is one."""

    text: str
    signal: str = ""
    rule: str = ""
    value: str = ""
    at: float | None = None


@dataclass
class Triggers:
    """Reads triggers.

    `along` is the position of an entity or position along the ego's route [m], None off the route; `states` gives the
    trigger of a storyboard state condition, `values` of one on a parameter or variable; `end` is where the ego's road
    ends [m]; `marks` become timeline entries without action.
    """

    vehicles: Mapping[str, Vehicle]
    ego: str
    positions: Positions
    along: Callable[[str | Node], float | None]
    states: Callable[[Node], Trigger]
    values: Callable[[Node], Trigger]
    end: float = math.inf
    marks: list[Mark] = field(default_factory=list)

    @property
    def findings(self) -> Findings:
        """Receives what conditions cannot express."""
        return self.positions.findings

    def trigger(self, node: Node | None) -> Trigger | None:
        """Trigger of a ``StartTrigger`` or ``StopTrigger``; None without one, or for one without groups."""
        groups = [self._group(group) for group in node.all("ConditionGroup")] if node else []
        times = [group.at for group in groups if group.at is not None]
        if node is None or len(times) == len(groups):
            return at_time(min(times)) if times else None
        if len({group.delay for group in groups}) > 1:
            groups = [_delayed(group) for group in groups]
        phrase = groups[0].condition if len(groups) == 1 else " or ".join(f"({group.condition})" for group in groups)
        return Trigger(phrase, groups[0].delay)

    def _group(self, group: Node) -> Trigger:
        read = [self._condition(one) for one in group.all("Condition")]
        latest = max((trigger.at for trigger in read if trigger.at is not None), default=-1.0)
        others = [trigger for trigger in read if trigger.at is None]
        if not others:
            return at_time(latest)
        if len({trigger.delay for trigger in others}) > 1:
            others = [_delayed(one) for one in others]
        delay = others[0].delay
        phrase = [f"time >= {latest - delay:g} s"] if latest > delay else []
        parts = list(dict.fromkeys(one.condition for one in others))
        return Trigger(" and ".join([*phrase, *(_bracketed(one, len(parts) + len(phrase)) for one in parts)]), delay)

    def _condition(self, node: Node) -> Trigger:
        delay = self.findings.number(node, "delay", 0.0)
        edge = self.findings.word(node, "conditionEdge", _EDGES, "none")
        for kind in node.all("ByValueCondition"):
            for one in kind.all():
                return self._by_value(one, edge, delay)
        for kind in node.all("ByEntityCondition"):
            # Who is at the end of the road stays there.
            ends = [one for each in kind.all("EntityCondition") for one in each.all("EndOfRoadCondition")]
            stays = sum(self.findings.number(one, "duration") for one in ends)
            return Trigger(self._by_entities(kind, edge), delay + stays)
        self.findings.refuse(node, "expected a ByValueCondition or a ByEntityCondition")
        return NEVER

    def _by_value(self, node: Node, edge: str, delay: float) -> Trigger:
        if edge == "falling" and node.get("rule") not in ("lessThan", "lessOrEqual"):
            self.findings.refuse(node, "conditionEdge: what has begun does not end again; write rising")
        if node.tag == "SimulationTimeCondition":
            value = self.findings.number(node, "value")
            rule = self.findings.word(node, "rule", tuple(rule for rule in RULES if rule != "notEqualTo"))
            if rule in ("lessThan", "lessOrEqual"):
                test = _Test(f"time {RULES[rule]} {value:g} s", "time", RULES[rule], f"{value:g} s")
                return Trigger(self._edged(test, edge, node), delay)
            return Trigger(f"time >= {value + delay:g} s", at=value + delay)
        if node.tag == "StoryboardElementStateCondition":
            found = self.states(node)
            if found.at is not None:
                return at_time(max(found.at, 0.0) + delay) if delay else found
            return replace(found, delay=found.delay + delay)
        if node.tag in ("ParameterCondition", "VariableCondition"):
            return replace(self.values(node), delay=delay)
        self.findings.refuse(node, "FogSim has no such condition")
        return NEVER

    def _by_entities(self, node: Node, edge: str) -> str:
        triggering = node.one("TriggeringEntities")
        test = next((one for kind in node.all("EntityCondition") for one in kind.all()), None)
        if triggering is None or test is None:
            self.findings.refuse(node, "expected TriggeringEntities and an EntityCondition")
            return ""
        rule = self.findings.word(triggering, "triggeringEntitiesRule", ("any", "all"))
        names = [one.get("entityRef") for one in triggering.all("EntityRef")]
        if not names:
            self.findings.refuse(triggering, "expected an EntityRef at least")
        if test.tag not in _TESTS:
            self.findings.refuse(test, "FogSim has no such condition")
            return ""
        tests = [_TESTS[test.tag](self, test, name) for name in names if self._is_known(triggering, name)]
        phrase = [self._edged(one, edge, node) for one in tests if one is not None]
        return (" and " if rule == "all" else " or ").join(_bracketed(one, len(phrase)) for one in phrase)

    def _edged(self, test: _Test, edge: str, node: Node) -> str:
        if edge == "none" or not test.text:
            return test.text
        if edge == "risingOrFalling":
            return f"({self._edged(test, 'rising', node)}) or ({self._edged(test, 'falling', node)})"
        is_rising = edge == "rising"
        if test.signal and test.rule in ("<", "<=", ">", ">="):
            how = "rises above" if (test.rule[0] == ">") == is_rising else "falls below"
            return f"{test.signal} {how} {test.value}"
        # An edge: the condition was different before.
        name = f"before_{len(self.marks)}"
        now, before = (test.text, f"not ({test.text})") if is_rising else (f"not ({test.text})", test.text)
        self.mark(name, Trigger(before), node)
        return f"happened({name}) and ({now})"

    def mark(self, name: str, trigger: Trigger, node: Node) -> None:
        """Add a mark."""
        self.marks.append(Mark(name, trigger, node))

    def _is_known(self, node: Node, name: str) -> bool:
        if name not in self.vehicles:
            self.findings.refuse(node, f"there is no vehicle {name!r}")
        return name in self.vehicles

    def called(self, vehicle: str) -> str:
        """A vehicle as conditions name it."""
        return "ego" if vehicle == self.ego else vehicle if _WORD.fullmatch(vehicle) else f'"{vehicle}"'

    def _compared(self, node: Node, signal: str, unit: str, shift: float = 0.0) -> _Test:
        value = self.findings.number(node, "value") + shift
        rule = RULES[self.findings.word(node, "rule", tuple(RULES))]
        if rule in ("==", "!=") and unit == "m/s":
            about = f"{signal} > {value - NEAR:.9g} {unit} and {signal} < {value + NEAR:.9g} {unit}"
            return _Test(about if rule == "==" else f"not ({about})")
        if rule in ("==", "!="):
            self.findings.refuse(node, "rule: places and times are never exactly equal; take less or greater")
        return _Test(f"{signal} {rule} {value:.9g} {unit}", signal, rule, f"{value:.9g} {unit}")

    def _along(self, node: Node, signal: str, unit: str) -> _Test:
        self.findings.word(node, "direction", ("longitudinal",), "longitudinal")
        return self._compared(node, signal, unit)

    def _is_less(self, node: Node) -> bool:
        """Whether a distance shall be less than its value."""
        return self.findings.word(node, "rule", ("lessThan", "lessOrEqual", "greaterThan", "greaterOrEqual"))[0] == "l"

    def _speed(self, node: Node, name: str) -> _Test:
        """`X.speed`."""
        return self._along(node, f"{self.called(name)}.speed", "m/s")

    def _acceleration(self, node: Node, name: str) -> _Test:
        """`X.acceleration`."""
        return self._along(node, f"{self.called(name)}.acceleration", "m/s²")

    def _relative_speed(self, node: Node, name: str) -> _Test | None:
        """`speed_difference(X, Y)`."""
        other = node.get("entityRef")
        if not self._is_known(node, other):
            return None
        return self._along(node, f"speed_difference({self.called(name)}, {self.called(other)})", "m/s")

    def _stands(self, node: Node, name: str) -> _Test:
        """`X.speed < 0.1 m/s for` its duration."""
        duration = self.findings.number(node, "duration")
        still = f"{self.called(name)}.speed < {_STILL} m/s"
        return _Test(f"{still} for {duration:g} s" if duration > 0.0 else still)

    def _traveled(self, node: Node, name: str) -> _Test | None:
        """`X.position`, from where the vehicle begins; it must begin on the ego's route."""
        return self._at_or_beyond(node, name, self.along(name))

    def _ends(self, node: Node, name: str) -> _Test | None:
        """`X.position` at the end of the ego's road, or of its route."""
        if not math.isfinite(self.end):
            self.findings.refuse(node, "the ego's road has no end")
        return _Test(f"{self.called(name)}.position >= {self.end:.3f} m")

    def _at_or_beyond(self, node: Node, name: str, begin: float | None) -> _Test | None:
        if begin is None:
            self.findings.refuse(node, f"{name} does not begin on the ego's route, along which FogSim measures")
            return None
        value = f"{begin + self.findings.number(node, 'value'):.3f} m"
        signal = f"{self.called(name)}.position"
        return _Test(f"{signal} >= {value}", signal, ">=", value)

    def _relative_distance(self, node: Node, name: str) -> _Test | None:
        """`gap(X, Y)`, ahead or behind; straight `clearance(X, Y)`; without `freespace` between rear axles."""
        other = node.get("entityRef")
        if not self._is_known(node, other):
            return None
        if self._is_along(node):
            return self._along_the_road(node, name, other)
        pair = f"{self.called(name)}, {self.called(other)}"
        if self.findings.flag(node, "freespace"):
            return self._compared(node, f"clearance({pair})", "m")
        rear = f"{self.vehicles[name].front:g} m, {self.vehicles[other].front:g} m"
        return self._compared(node, f"distance({pair}, {rear})", "m")

    def _is_along(self, node: Node, default: str = "euclidianDistance") -> bool:
        """Whether a distance is along the road, not straight; entities' own axes are taken as along the road."""
        self.findings.word(node, "coordinateSystem", ("entity", "lane", "road"), "entity")
        return self.findings.word(node, "relativeDistanceType", _DISTANCES, default) == "longitudinal"

    def _along_the_road(self, node: Node, name: str, other: str) -> _Test:
        one, far = self.vehicles[name], self.vehicles[other]
        free = self.findings.flag(node, "freespace")
        ahead = 0.0 if free else one.front + far.rear
        behind = 0.0 if free else one.rear + far.front
        value = self.findings.number(node, "value")
        gap, near = f"gap({self.called(name)}, {self.called(other)})", (value - ahead, behind - value)
        if self._is_less(node):
            return _Test(f"{gap} < {near[0]:.9g} m and {gap} > {near[1]:.9g} m")
        return _Test(f"{gap} > {near[0]:.9g} m or {gap} < {near[1]:.9g} m")

    def _distance(self, node: Node, name: str) -> _Test | None:
        """`distance_to` a position; along the road `X.position` about it; without `freespace` of the rear axle."""
        is_along, is_free = self._is_along(node), self.findings.flag(node, "freespace")
        if not (is_along or self.findings.flag(node, "alongRoute", "false")):
            if is_free:
                self.findings.refuse(
                    node, "freespace: straight distances to a position are of the rear axle; write false"
                )
            signal = self._distance_to(node, name)
            return None if signal is None else self._compared(node, signal, "m")
        place, free, vehicle = self._place_along(node), is_free, self.vehicles[name]
        if place is None:
            return None
        value, signal = self.findings.number(node, "value"), f"{self.called(name)}.position"
        near = place - value + (0.0 if free else vehicle.front)
        far = place + value + (vehicle.length if free else vehicle.front)
        if self._is_less(node):
            return _Test(f"{signal} > {near:.3f} m and {signal} < {far:.3f} m")
        return _Test(f"{signal} < {near:.3f} m or {signal} > {far:.3f} m")

    def _reaches(self, node: Node, name: str) -> _Test | None:
        """`distance_to` a position; on the ego's route, ahead of the vehicle, `X.position` from its tolerance on."""
        position, around = node.one("Position"), self.findings.number(node, "tolerance")
        place, begins = None if position is None else self.along(position), self.along(name)
        if place is not None and begins is not None:
            near = place + self.vehicles[name].front - around
            if begins < near:
                # However far it drives between two looks, it has been there.
                signal = f"{self.called(name)}.position"
                return _Test(f"{signal} >= {near:.3f} m", signal, ">=", f"{near:.3f} m")
        reached = self._distance_to(node, name)
        return None if reached is None else _Test(f"{reached} <= {around:.9g} m", reached, "<=", f"{around:.9g} m")

    def _distance_to(self, node: Node, name: str) -> str | None:
        """Straight distance of a vehicle's rear axle to a position."""
        position = node.one("Position")
        relative = position.one("RelativeObjectPosition") if position else None
        if relative and not relative.children and not self.findings.number(relative, "dy", 0.0):
            other = relative.get("entityRef")
            if not self._is_known(relative, other):
                return None
            behind = self.vehicles[other].front - self.findings.number(relative, "dx", 0.0)
            return f"distance({self.called(name)}, {self.called(other)}, {self.vehicles[name].front:g} m, {behind:g} m)"
        try:
            x, y, *_ = self.positions.point(position if position else node)
        except ValueError as error:
            self.findings.refuse(node, str(error))
            return None
        return f"distance_to({self.called(name)}, {self.vehicles[name].front:g} m, {x:.3f} m, {y:.3f} m)"

    def _place_along(self, node: Node) -> float | None:
        position = node.one("Position")
        place = None if position is None else self.along(position)
        if place is None:
            self.findings.refuse(node, "its position is not on the ego's route, along which FogSim measures")
        return place

    def _headway(self, node: Node, name: str) -> _Test | None:
        """`headway(X, Y, LENGTH)`, without `freespace` from rear axle to rear axle; nothing unless Y is ahead."""
        return self._between(node, name, node.get("entityRef"), "headway")

    def _time_to_collision(self, node: Node, name: str) -> _Test | None:
        """`ttc(X, Y, LENGTH)`, likewise; nothing unless they approach."""
        target = node.within("TimeToCollisionConditionTarget", "EntityRef")
        if target is None:
            self.findings.refuse(node, "times to collision are with an entity")
            return None
        return self._between(node, name, target.get("entityRef"), "ttc")

    def _between(self, node: Node, name: str, other: str, signal: str) -> _Test | None:
        if not self._is_along(node, "longitudinal"):
            self.findings.refuse(node, "relativeDistanceType: times are of distances along the road (longitudinal)")
        if not self._is_known(node, other):
            return None
        further = (
            0.0 if self.findings.flag(node, "freespace") else self.vehicles[name].front + self.vehicles[other].rear
        )
        return self._compared(node, f"{signal}({self.called(name)}, {self.called(other)}, {further:g} m)", "s")

    def _collides(self, node: Node, name: str) -> _Test:
        """`X.collision`, with anybody or a vehicle: `X.collision and Y.collision`."""
        for kind in node.all("ByType"):
            self.findings.word(kind, "type", ("vehicle",))
        phrase = [self.called(name)]
        for other in node.all("EntityRef"):
            phrase += [self.called(other.get("entityRef"))] if self._is_known(other, other.get("entityRef")) else []
        return _Test(" and ".join(f"{one}.collision" for one in phrase))


_TESTS: Mapping[str, Callable[[Triggers, Node, str], _Test | None]] = {
    "SpeedCondition": Triggers._speed,
    "AccelerationCondition": Triggers._acceleration,
    "RelativeSpeedCondition": Triggers._relative_speed,
    "StandStillCondition": Triggers._stands,
    "TraveledDistanceCondition": Triggers._traveled,
    "EndOfRoadCondition": Triggers._ends,
    "RelativeDistanceCondition": Triggers._relative_distance,
    "DistanceCondition": Triggers._distance,
    "ReachPositionCondition": Triggers._reaches,
    "TimeHeadwayCondition": Triggers._headway,
    "TimeToCollisionCondition": Triggers._time_to_collision,
    "CollisionCondition": Triggers._collides,
}

CONDITIONS: Mapping[str, str] = {
    "SimulationTimeCondition": "`time`.",
    "ParameterCondition": "`happened(EVENT)` that sets it, if that makes a difference; otherwise always or never.",
    "VariableCondition": "As `ParameterCondition`.",
    "StoryboardElementStateCondition": "`happened(EVENT)`, for states of beginning, and of being over by the time that "
    "the actions take.",
    **{tag: inspect.getdoc(test) or "" for tag, test in _TESTS.items()},
}
"""Conditions that are read, and their translation."""


def at_time(time: float) -> Trigger:
    """Trigger at a time [s]."""
    return AT_ONCE if time <= 0.0 else Trigger(f"time >= {time:g} s", at=time)


def both(first: Trigger, then: Trigger) -> Trigger:
    """Trigger `then` once `first`, a time or an entry that has begun, has fired."""
    if not first.condition or not then.condition:
        return NEVER
    if first.at is not None and then.at is not None:
        return at_time(max(first.at, then.at))
    if first.at is not None and first.at <= 0.0:
        return then
    return Trigger(f"{_bracketed(first.condition, 2)} and {_bracketed(then.condition, 2)}", then.delay)


def _delayed(trigger: Trigger) -> Trigger:
    """A trigger with its delay in its condition."""
    if not trigger.delay or not trigger.condition:
        return trigger
    return Trigger(f"({trigger.condition}) delayed {trigger.delay:g} s", stays=trigger.stays)


def _bracketed(condition: str, count: int) -> str:
    return f"({condition})" if count > 1 and (" or " in condition or " and " in condition) else condition
