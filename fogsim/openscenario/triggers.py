"""Triggers as conditions of FogSim's language."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from fogsim.openscenario.environment import Vehicle
from fogsim.openscenario.parameters import RULES
from fogsim.openscenario.positions import Positions
from fogsim.openscenario.xml_tree import Node, NodeError, handlers
from fogsim.traffic.road.opendrive_lanes import Spot

_DISTANCES = ("longitudinal", "cartesianDistance", "euclidianDistance")
_EDGES = ("none", "rising", "falling", "risingOrFalling")
_INEQUALITIES = ("lessThan", "lessOrEqual", "greaterThan", "greaterOrEqual")
_TURNED = {"<": ">", ">": "<", "<=": ">=", ">=": "<="}
NEAR = 0.05  # Difference up to which speeds are equal [m/s]
NEAR_THE_END = 10.0  # Distance to the end of its route at which a vehicle has arrived [m]
STEP = "0.001 s"  # Less than a camera period: what is delayed by it was so one step before
_BESIDE = 1.5  # Least distance at which a vehicle in the same lane has been at a place [m]
_STILL = 0.1  # Speed below which a vehicle counts as stopped [m/s]


@dataclass(frozen=True, slots=True)
class Trigger:
    """When something begins: a condition in FogSim's language ("" for never), and a delay after it [s]."""

    condition: str
    delay: float = 0.0
    at: float | None = None  # Time, if the condition is only a time [s], below zero for the start


AT_ONCE = Trigger("time >= 0 s", at=-1.0)
NEVER = Trigger("")


TimelineEntry = tuple[Node, dict[str, Any]]  # With the element that it is for
_Test = tuple[str, ...]  # The whole text of a condition, or signal, operator and value of a comparison


@dataclass
class Triggers:
    """Reads triggers, with the help of readers of conditions on states of the storyboard, and on values."""

    positions: Positions
    states: Callable[[Node], Trigger]
    values: Callable[[Node], Trigger]
    marks: list[TimelineEntry] = field(default_factory=list)  # Without action
    since: Trigger = AT_ONCE  # From when on conditions are checked, and delays count

    def trigger(self, node: Node | None) -> Trigger | None:
        """Trigger of a ``StartTrigger`` or ``StopTrigger``; None without one, or for one without groups."""
        groups = [self._group(group) for group in node.all("ConditionGroup")] if node else []
        times = [group.at for group in groups if group.at is not None]
        if len(times) == len(groups):
            return _at_time(min(times)) if times else None
        groups = self._of_one_delay(groups)
        phrase = groups[0].condition if len(groups) == 1 else " or ".join(f"({group.condition})" for group in groups)
        return Trigger(phrase, groups[0].delay)

    def _group(self, group: Node) -> Trigger:
        read = [self._read(one) for one in group.all("Condition")]
        latest = max((trigger.at for trigger in read if trigger.at is not None), default=-1.0)
        others = self._of_one_delay([trigger for trigger in read if trigger.at is None])
        if not others:
            return _at_time(latest)
        delay = others[0].delay
        phrase = [f"time >= {latest - delay:g} s"] if latest > delay else []
        parts = list(dict.fromkeys(one.condition for one in others))
        return Trigger(" and ".join([*phrase, *(_bracketed(one, len(parts) + len(phrase)) for one in parts)]), delay)

    def _read(self, node: Node) -> Trigger:
        delay, edge = node.number("delay", 0.0), node.word("conditionEdge", _EDGES, "none")
        test, read = next((one for kind in node.all("ByValueCondition") for one in kind.all()), None), NEVER
        with node.refusing():
            if test:
                read = self._by_value(test, edge, delay)
            else:
                by_entity = node.need("ByEntityCondition", "ByValueCondition")
                # Who is at the end of the road stays there.
                end = by_entity.within("EntityCondition", "EndOfRoadCondition")
                read = Trigger(self._by_entities(by_entity, edge), delay + (end.number("duration") if end else 0.0))
        return read

    def _by_value(self, node: Node, edge: str, delay: float) -> Trigger:
        if edge == "falling" and node.get("rule") not in ("lessThan", "lessOrEqual"):
            node.refuse("conditionEdge: what has begun does not end again; write rising")
        if node.tag == "SimulationTimeCondition":
            value, rule = node.number("value"), node.word("rule", tuple(rule for rule in RULES if rule != "notEqualTo"))
            if rule in ("lessThan", "lessOrEqual"):
                return Trigger(self._edged(("time", RULES[rule], f"{value:g} s"), edge), delay)
            # A time is reached for one step only.
            edge = "rising" if rule == "equalTo" else edge
            found = Trigger(f"time >= {value:g} s", at=value)
        elif node.tag == "StoryboardElementStateCondition":
            found = self.states(node)
        elif node.tag in ("ParameterCondition", "VariableCondition"):
            found = self.values(node)
        else:
            raise NodeError(node, "FogSim has no such condition")
        up, down = rises(found.condition), f"not ({found.condition}) and (({found.condition}) delayed {STEP})"
        if edge == "falling":
            return Trigger(down, delay)
        if edge != "none" and not is_single(node):
            return Trigger(up if edge == "rising" else f"({up}) or ({down})", delay)
        if found.at is not None:
            return self._at_time(node, found.at, delay, edge)
        return replace(found, delay=found.delay + delay)

    def _at_time(self, node: Node, time: float, delay: float, edge: str) -> Trigger:
        """Trigger at a time, or when conditions are first checked if that is later, and a delay after it [s]."""
        begins = self.since.at
        if begins is None and delay:
            return Trigger(f"{self.since.condition} and time >= {max(time, 0.0):g} s", delay)
        if edge != "none" and begins is not None and max(time, 0.0) < begins:
            message = f"it holds before its act begins at {begins:g} s, and has no edge then; read as none"
            node.remark(f"conditionEdge: {message}")
        return _at_time(max(time, begins or 0.0, 0.0) + delay)

    def _of_one_delay(self, triggers: list[Trigger]) -> list[Trigger]:
        """Triggers with their delays in their conditions if these differ."""
        if len({one.delay for one in triggers}) <= 1:
            return triggers
        return [
            Trigger(fires(both(self.since, one))) if one.delay and one.condition and one.at is None else one
            for one in triggers
        ]

    def _by_entities(self, node: Node, edge: str) -> str:
        triggering, test = node.need("TriggeringEntities"), node.need("EntityCondition").one()
        if test is None or test.tag not in CONDITIONS:
            raise NodeError(test or node, "FogSim has no such condition")
        rule, phrase = triggering.word("triggeringEntitiesRule", ("any", "all")), []
        for one in self.positions.vehicles.members(triggering.some("EntityRef")):
            with test.refusing():
                vehicle = self.positions.vehicles.of(one)
                phrase.append(CONDITIONS[test.tag](self, test, vehicle))
        if len(phrase) == 1:
            return self._edged(phrase[0], edge)
        if rule == "any" and edge == "rising":
            # One rises also where another is unknown, as the time to a vehicle that is not ahead.
            phrase, edge = [(self._edged(one, edge),) for one in phrase], "none"
        joint = " and " if rule == "all" else " or "
        return self._edged((joint.join(_bracketed(" ".join(one), 2) for one in phrase),), edge)

    def _edged(self, test: _Test, edge: str) -> str:
        text, is_rising = " ".join(test), edge == "rising"
        if edge == "none":
            return text
        if edge == "risingOrFalling":
            return f"({self._edged(test, 'rising')}) or ({self._edged(test, 'falling')})"
        if len(test) > 1 and (test[1] in ("<", ">")) == is_rising:
            signal, rule, value = test
            return f"{signal} {'rises above' if (rule[0] == '>') == is_rising else 'falls below'} {value}"
        now, before = (f"({text})", f"(not ({text}))") if is_rising else (f"not ({text})", f"({text})")
        return f"{before} delayed {STEP} and {now}"

    def _compared(self, node: Node, signal: str, unit: str) -> _Test:
        node.word("direction", ("longitudinal",), "longitudinal")
        value, rule = node.number("value"), RULES[node.word("rule", tuple(RULES))]
        if rule not in ("==", "!="):
            return signal, rule, f"{value:.9g} {unit}"
        if unit != "m/s":
            raise ValueError("rule: places and times are never exactly equal; take less or greater")
        about = f"{signal} > {value - NEAR:.9g} {unit} and {signal} < {value + NEAR:.9g} {unit}"
        return (about if rule == "==" else f"not ({about})",)

    def speed_condition(self, node: Node, one: Vehicle) -> _Test:
        """`X.speed`."""
        return self._compared(node, f"{one.called}.speed", "m/s")

    def acceleration_condition(self, node: Node, one: Vehicle) -> _Test:
        """`X.acceleration` along the heading; without `direction` either way, unless the value is below 0."""
        signal, rule, value = self._compared(node, f"{one.called}.acceleration", "m/s²")
        if node.get("direction") or value.startswith("-"):
            return signal, rule, value
        return (f"{signal} {rule} {value} {'or' if rule[0] == '>' else 'and'} {signal} {_TURNED[rule]} -{value}",)

    def relative_speed_condition(self, node: Node, one: Vehicle) -> _Test:
        """`speed_difference(X, Y)`."""
        other = self.positions.vehicles.of(node)
        return self._compared(node, f"speed_difference({one.called}, {other.called})", "m/s")

    def stand_still_condition(self, node: Node, one: Vehicle) -> _Test:
        """`X.speed < 0.1 m/s for` its duration."""
        duration = node.number("duration")
        return (f"{one.called}.speed < {_STILL} m/s" + (f" for {duration:g} s" if duration > 0.0 else ""),)

    def traveled_distance_condition(self, node: Node, one: Vehicle) -> _Test:
        """`X.driven`."""
        return f"{one.called}.driven", ">=", f"{node.number('value'):.9g} m"

    def end_of_road_condition(self, node: Node, one: Vehicle) -> _Test:
        """`X.position` at the end of the ego's road, or of its route."""
        lanes, route = self.positions.lanes, self.positions.ways[self.positions.vehicles.ego]
        last = self.positions.ways.get(one.name, route)[-1]
        if lanes.followers.get(last):
            node.refuse(f"the road of {one.name} has no end")
        if last == route[-1]:
            return (f"{one.called}.position >= {lanes.starts(route)[-1] - NEAR_THE_END:.3f} m",)
        across = [lane for lane in lanes.lanes if lane.edge == last]
        lane = across[len(across) // 2]
        x, y, _ = Spot(lane, lane.length).world
        return f"nearest_to({one.called}, 0 m, {x:.3f} m, {y:.3f} m)", "<=", f"{NEAR_THE_END:g} m"

    def relative_distance_condition(self, node: Node, one: Vehicle) -> _Test:
        """`gap(X, Y)` either way; straight `clearance(X, Y)`; without `freespace` `distance_along` or `distance`."""
        other, is_along, is_free = self.positions.vehicles.of(node), self._is_along(node), node.flag("freespace")
        pair = f"{one.called}, {other.called}"
        if not is_free:
            distance = "distance_along" if is_along else "distance"
            return self._compared(node, f"{distance}({pair}, {one.front:g} m, {other.front:g} m)", "m")
        if not is_along:
            return self._compared(node, f"clearance({pair})", "m")
        gap, value = f"gap({pair})", node.number("value")
        if node.word("rule", _INEQUALITIES)[0] == "l":
            return (f"{gap} < {value:.9g} m and {gap} > {-value:.9g} m",)
        return (f"{gap} > {value:.9g} m or {gap} < {-value:.9g} m",)

    def _is_along(self, node: Node, default: str = "euclidianDistance") -> bool:
        """Whether a distance is along the road, not straight; entities' own axes are taken as along the road."""
        node.word("coordinateSystem", ("entity", "lane", "road"), "entity")
        return node.word("relativeDistanceType", _DISTANCES, default) == "longitudinal"

    def distance_condition(self, node: Node, one: Vehicle) -> _Test:
        """`distance_to` a position; along the road `X.position` about it; without `freespace` of the rear axle."""
        is_along, is_free = self._is_along(node), node.flag("freespace")
        if not (is_along or node.flag("alongRoute", "false")):
            if is_free:
                node.refuse("freespace: straight distances to a position are of the rear axle; write false")
            return self._compared(node, self._distance_to(node, one), "m")
        place = self.positions.along_ego(node.need("Position"))
        if place is None:
            raise ValueError("its position is not on the ego's route, along which FogSim measures")
        value, signal = node.number("value"), f"{one.called}.position"
        near = f"{place - value + (0.0 if is_free else one.front):.3f} m"
        far = f"{place + value + (one.length if is_free else one.front):.3f} m"
        if node.word("rule", _INEQUALITIES)[0] == "l":
            return (f"{signal} > {near} and {signal} < {far}",)
        return (f"{signal} < {near} or {signal} > {far}",)

    def reach_position_condition(self, node: Node, one: Vehicle) -> _Test:
        """`nearest_to` a position; with a small tolerance, of one that drives along there, `X.position` in its lane."""
        around, near = node.number("tolerance"), self._distance_to(node, one).replace("distance_to", "nearest_to")
        place, ways = self.positions.along_ego(node.need("Position")), self.positions.ways
        shared = {*ways[self.positions.vehicles.ego]} & {*ways.get(one.name, ())}
        # Persons may cross.
        if place is None or one.body or not shared or around >= _BESIDE:
            return near, "<=", f"{around:.9g} m"
        # Vehicles drive in the middle of their lane, where the position need not be.
        return (f"{one.called}.position >= {place + one.front - around:.3f} m and {near} <= {_BESIDE} m",)

    def _distance_to(self, node: Node, one: Vehicle) -> str:
        position = node.need("Position")
        relative = position.one("RelativeObjectPosition")
        if relative and not relative.children and not relative.number("dy", 0.0):
            other = self.positions.vehicles.of(relative)
            behind = other.front - relative.number("dx", 0.0)
            return f"distance({one.called}, {other.called}, {one.front:g} m, {behind:g} m)"
        x, y, *_ = self.positions.point(position)
        return f"distance_to({one.called}, {one.front:g} m, {x:.3f} m, {y:.3f} m)"

    def time_headway_condition(self, node: Node, one: Vehicle) -> _Test:
        """`headway(X, Y, LENGTH)`, without `freespace` from rear axle to rear axle; nothing unless Y is ahead."""
        return self._between(node, one, node, "headway")

    def time_to_collision_condition(self, node: Node, one: Vehicle) -> _Test:
        """`ttc(X, Y, LENGTH)`, too; nothing unless they approach."""
        return self._between(node, one, node.need("TimeToCollisionConditionTarget").need("EntityRef"), "ttc")

    def _between(self, node: Node, one: Vehicle, target: Node, signal: str) -> _Test:
        if not self._is_along(node, "longitudinal"):
            node.refuse("relativeDistanceType: times are of distances along the road (longitudinal)")
        other = self.positions.vehicles.of(target)
        further = 0.0 if node.flag("freespace") else one.front + other.rear
        test = self._compared(node, f"{signal}({one.called}, {other.called}, {further:g} m)", "s")
        if not _is_denied(node, ("none", "rising") if test[1][0] == ">" else ("none",)):
            return test
        # Where there is no such time the condition is false, and not unknown.
        pair = f"{one.called}, {other.called}"
        ahead = f"{other.called}.position > {one.called}.position" if further else f"gap({pair}) > 0 m"
        nears = f"speed_difference({pair})" if signal == "ttc" else f"{one.called}.speed"
        return (" ".join([ahead, "and", nears, "> 0 m/s and", *test]),)

    def collision_condition(self, node: Node, one: Vehicle) -> _Test:
        """`X.collision`, with anybody or a vehicle; `collision(X, Y)`."""
        for kind in node.all("ByType"):
            kind.word("type", ("vehicle",))
        others = [self.positions.vehicles.of(other).called for other in node.all("EntityRef")]
        return (f"collision({one.called}, {others[0]})" if others else f"{one.called}.collision",)


CONDITIONS = handlers(Triggers, "condition")


def rises(condition: str) -> str:
    """Condition that another one holds, and did not one step before."""
    return f"({condition}) and not (({condition}) delayed {STEP})"


def _at_time(time: float) -> Trigger:
    """Trigger at a time [s]."""
    return AT_ONCE if time <= 0.0 else Trigger(f"time >= {time:g} s", at=time)


def _is_denied(node: Node, harmless: tuple[str, ...]) -> bool:
    """Whether it matters that a condition is false: to its edge, but for harmless ones, or to an event that skips."""
    while node.above:
        node = node.above
        if node.tag == "Condition" and node.attributes.get("conditionEdge", "none") not in harmless:
            return True
        if node.tag == "Maneuver":
            return any(one.attributes.get("priority") == "skip" for one in node.children)
    return False


def is_single(node: Node) -> bool:
    """Whether a condition is its group's only one, of what begins once: when it first holds is then its edge."""
    above, is_alone = node.above, True
    while above and is_alone:
        is_alone = above.attributes.get("maximumExecutionCount", "1") == "1"
        is_alone &= above.tag != "ConditionGroup" or len(above.children) == 1
        is_alone &= above.attributes.get("priority") != "skip"
        above = above.above
    return is_alone


def both(first: Trigger, then: Trigger) -> Trigger:
    """Trigger `then` once `first`, a time or an entry that has begun, has fired."""
    if not first.condition or not then.condition:
        return NEVER
    if first.at is not None and then.at is not None:
        return _at_time(max(first.at, then.at))
    if first.at is not None and first.at <= 0.0:
        return then
    return Trigger(f"{_bracketed(first.condition, 2)} and {_bracketed(then.condition, 2)}", then.delay)


def timeline_entry(node: Node, name: str, trigger: Trigger, do: Mapping[str, Any], until: str = "") -> TimelineEntry:
    """An entry of the timeline for an element."""
    if until:
        # An act may be stopped while its events wait.
        trigger = Trigger(f"{fires(trigger)} and {until}")
    delayed = {"delay_s": trigger.delay} if trigger.delay else {}
    return node, {"name": name, "when": trigger.condition, **delayed, "do": do}


def fires(trigger: Trigger) -> str:
    """Condition of a trigger with its delay."""
    return f"({trigger.condition})" + (f" delayed {trigger.delay:g} s" if trigger.delay else "")


def _bracketed(condition: str, count: int) -> str:
    return f"({condition})" if count > 1 and (" or " in condition or " and " in condition) else condition
