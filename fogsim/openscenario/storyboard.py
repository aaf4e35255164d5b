"""The storyboard as a timeline: acts, groups, maneuvers and events, each with a trigger in FogSim's language."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from fogsim.openscenario.actions import Actions
from fogsim.openscenario.environment import Vehicle
from fogsim.openscenario.lateral import MOTION, Effect
from fogsim.openscenario.parameters import fits
from fogsim.openscenario.triggers import (
    AT_ONCE,
    NEVER,
    STEP,
    TimelineEntry,
    Trigger,
    Triggers,
    both,
    fires,
    is_single,
    timeline_entry,
)
from fogsim.openscenario.xml_tree import Node, NodeError

_BEGUN, _OVER = ("startTransition", "runningState"), ("endTransition", "completeState")
_MOST_TIMES = 100
_STRAIGHT, _SHORT = 1000.0, 0.01  # Lengths of paths [m]
_ROOM = 600  # Most characters of conditions that are joined into one
_REFERENCE = "CatalogReference"
_GENTLE = ("parallel", "skip")  # Priorities that end nothing
_REPEATED = ("Event", "Action")
_PARTS = ("Story", "Act", "ManeuverGroup", "Maneuver", "Event", "Action")


@dataclass
class Entry:
    """An event as entries of the timeline, one for each execution; its trigger is `NEVER` until it is known."""

    group: Node
    node: Node
    actors: list[str]
    names: list[str] = field(default_factory=list)
    effect: Effect = field(default_factory=Effect)
    parts: dict[int, Effect] = field(default_factory=dict)  # Of several actions, by the identity of their elements
    trigger: Trigger = NEVER


@dataclass
class Storyboard:
    """Reads stories; `entries` has the events by the identity of their elements."""

    actions: Actions
    root: Node
    triggers: Triggers = field(init=False)
    entries: dict[int, Entry] = field(default_factory=dict)
    initial: dict[str, str] = field(default_factory=dict)  # Values of parameters and variables that Init sets
    _begins: dict[int, Trigger] = field(default_factory=dict)
    _stops: dict[int, str] = field(default_factory=dict)  # Names of entries that stop acts
    _over_marks: dict[tuple[str, int], list[str]] = field(default_factory=dict)  # Conditions that these have been over
    _stories: list[Node] = field(default_factory=list)
    _acts: list[Node] = field(default_factory=list)
    _never: list[Node] = field(default_factory=list)  # Acts and events that never begin
    _open: list[Node] = field(default_factory=list)

    def find_events(self, storyboard: Node) -> None:
        """Find all events and their effects; triggers follow later, since events refer to one another."""
        for one in (one for block in self.root.all("VariableDeclarations") for one in block.all()):
            one.get("value")
        self._stories = storyboard.all("Story")
        acts = [act for story in self._stories for act in story.all("Act")]
        for reference in (one for act in acts for group in act.all("ManeuverGroup") for one in group.all(_REFERENCE)):
            with reference.refusing():
                self.actions.positions.catalogs.entry(reference)
        self._acts = [act for act in acts if not self._is_idle(act)]
        for group in (one for act in self._acts for one in act.all("ManeuverGroup")):
            actors, times = group.one("Actors"), _executions(group)
            names = self.actions.vehicles.selected(actors.all("EntityRef")) if actors else []
            if actors and actors.flag("selectTriggeringEntities", "false"):
                actors.refuse("selectTriggeringEntities: name the actors")
            maneuvers = [one for holder in (group, *group.all(_REFERENCE)) for one in holder.all("Maneuver")]
            events = [one for maneuver in maneuvers for one in maneuver.all("Event") if not self._is_idle(one)]
            for event in events:
                self._find(Entry(group, event, names), times)
            if times > 1 and len(events) > 1:
                group.refuse(f"maximumExecutionCount: {len(events)} events are played once; write 1")

    def places_at_once(self, storyboard: Node) -> list[tuple[str, Node]]:
        """Actors and actions of distances that are there at the very beginning, as places in Init are."""
        found = []
        for group in (one for one in storyboard.walk() if one.tag == "ManeuverGroup"):
            actors = group.all("Actors")
            names = self.actions.vehicles.selected(one for block in actors for one in block.all("EntityRef"))
            for event in (one for one in group.walk() if one.tag == "Event"):
                if not all(map(self._begins_at_once, (group.above, event))):
                    continue
                # Times of trajectories that begin with the run are those of the run.
                self.actions.positions.at_once |= {
                    id(one) for one in event.walk() if one.tag == "FollowTrajectoryAction"
                }
                for action in (one for one in event.walk() if one.tag == "LongitudinalDistanceAction"):
                    if action.one("DynamicConstraints") is None and not action.flag("continuous"):
                        found += [(name, action) for name in names]
                        self.actions.positions.at_once.add(id(action))
        return found

    def _begins_at_once(self, part: Node | None) -> bool:
        """Whether an act or event begins with the run: it has no condition, or parameters have the values for it."""
        start = part.one("StartTrigger") if part else None
        groups = start.all("ConditionGroup") if start else []
        return not groups or any(all(map(self._holds_at_once, group.all("Condition"))) for group in groups)

    def _holds_at_once(self, condition: Node) -> bool:
        by_value = condition.one("ByValueCondition")
        one = by_value.one() if by_value else None
        if one is None or condition.number("delay", 0.0) or condition.attributes.get("conditionEdge", "none") != "none":
            return False
        if one.tag == "SimulationTimeCondition":
            return one.number("value") <= 0.0 and one.get("rule").startswith("greater")
        return one.tag == "ParameterCondition" and bool(self._declared(one)) and self._is_fixed(one, holds=True)

    def _is_idle(self, part: Node) -> bool:
        """Whether an act or event waits for a parameter with another value that nothing sets; it is left out then."""
        start = part.one("StartTrigger")
        groups = start.all("ConditionGroup") if start else []
        if not groups or not all(any(map(self._fails, group.walk())) for group in groups):
            return False
        part.remark("it never begins: its parameters have other values", is_whole=True)
        self._never.append(part)
        return True

    def _fails(self, node: Node) -> bool:
        """Whether it is a condition that a parameter does not fit, which nothing sets."""
        return node.tag == "ParameterCondition" and self._is_fixed(node, holds=False)

    def _is_fixed(self, node: Node, holds: bool) -> bool:
        """Whether a condition holds, or does not, by the declared value of a parameter that nothing sets."""
        name = node.attributes.get("parameterRef")
        sets = (one.tag == "ParameterAction" and one.attributes.get("parameterRef") == name for one in self.root.walk())
        return not any(sets) and all(fits(value, node) for value in self._declared(node)) == holds

    def _find(self, entry: Entry, times: int) -> None:
        entry.node.word("priority", ("override", "overwrite", *_GENTLE))
        for _ in range(min(times * _executions(entry.node), _MOST_TIMES)):
            taken = {name for one in self.entries.values() for name in one.names}
            entry.names.append(free_name(entry.node.get("name"), {*taken, *entry.names}))
        self.entries[id(entry.node)] = entry
        actions = entry.node.all("Action")
        for action in actions:
            self.actions.take(action, entry.actors, part := entry.effect.part())
            entry.effect.join(part)
            if len(actions) > 1:
                entry.parts[id(action)] = part
        entry.effect.wait_for_those_who_come()

    def timeline(self) -> list[TimelineEntry]:
        """Entries of the timeline, each with its element."""
        taken = {name for one in self.entries.values() for name in one.names}
        stopped = [act for act in self._acts if any(one.children for one in act.all("StopTrigger"))]
        self._stops = {id(act): free_name(f"stop_{number}", taken) for number, act in enumerate(stopped, start=1)}
        self._begins = {id(act): self._act_begins(act) for act in self._acts}
        written: list[TimelineEntry] = []
        comes: list[TimelineEntry] = []
        for act in self._acts:
            until = self._until(act)
            for entry in (one for one in self.entries.values() if one.group.above is act):
                own = self.triggers.trigger(entry.node.one("StartTrigger")) or AT_ONCE
                entry.trigger = both(self._begins[id(act)], own)
                if entry.node.get("priority") == "skip":
                    entry.trigger = self._unless_another_runs(entry)
                written += self._executed(entry, until)
                for name in entry.names if entry.effect.once_there else ():
                    happened = Trigger(f"happened({name})")
                    done = entry.effect.once_there
                    comes.append(timeline_entry(entry.node, f"{name}_once_there", happened, done, until))
        # What other events order of who comes in the same step counts more.
        return comes + written

    def _executed(self, entry: Entry, until: str) -> list[TimelineEntry]:
        written, node, effect = [], entry.node, entry.effect
        for number, name in enumerate(entry.names):
            trigger = entry.trigger
            if number:
                if effect.is_endless:
                    node.refuse("maximumExecutionCount: an action that never ends is played once")
                # It is played again once it is over and its own trigger holds.
                trigger = both(Trigger(self._played(entry, entry.names[number - 1])), trigger)
            written.append(timeline_entry(node, name, trigger, effect.do, until))
            for order, (actor, reached) in enumerate(effect.reached.items()):
                held = {actor: {"speed": {"like": self.actions.vehicles[actor].named, "shape": "step"}}}
                when = Trigger(" and ".join([f"happened({name})", reached, *self._still_ordered(entry, name, actor)]))
                called = f"{name}_reached" + (f"_{order + 1}" if order else "")
                written.append(timeline_entry(node, called, when, held, until))
            written += self._end_others(entry, name, trigger, until)
        return written

    def _still_ordered(self, entry: Entry, name: str, actor: str) -> list[str]:
        """Conditions that no other event has ordered the speed of an actor since an entry began."""
        others = [
            one for one in self.entries.values() if one is not entry and MOTION & one.effect.do.get(actor, {}).keys()
        ]
        later = []
        for other in (other for one in others for other in one.names):
            is_first = Trigger(f"happened({name}) and not happened({other})")
            before = self._mark(entry.node, f"{name}_before_{other}", is_first)
            later.append(f"not ({before} and happened({other}))")
        return later

    def _unless_another_runs(self, entry: Entry) -> Trigger:
        """Trigger of an event that is skipped while another of its maneuver runs, or begins in the same step."""
        others, earlier = self._others(entry), True
        if not entry.trigger.condition or not others:
            return entry.trigger
        running = []
        for one in self.entries.values():
            earlier &= one is not entry
            if any(one is other for other in others):
                running += [f"(happened({name}) and not ({self._played(one, name)}))" for name in one.names]
                if earlier and one.trigger.condition:
                    running.append(f"({fires(one.trigger)} and not happened({one.names[0]}))")
        return Trigger(f"{fires(entry.trigger)} and not ({' or '.join(running)})")

    def _end_others(self, entry: Entry, name: str, trigger: Trigger, until: str) -> list[TimelineEntry]:
        """What an overriding event does to others of its maneuver that run: speeds stay as they are, and paths end."""
        if entry.node.get("priority") in _GENTLE or not trigger.condition:
            return []
        known, orders = self.actions.vehicles, entry.effect.do
        slow = [one for one in entry.actors if one in known and not orders.get(one, {}).keys() & MOTION]
        held = {one: {"speed": {"like": known[one].named, "shape": "step"}} for one in slow}
        left = [one for one in entry.actors if one in known and "path" not in orders.get(one, {})]
        ends = {one: {"path": _left(known[one])} for one in left}
        # Whose trajectory has times has no other speed.
        stays = {one: {**held.get(one, {}), **end} for one, end in ends.items()}
        others = self._others(entry)
        fast = [one for one in others if any(map(one.effect.changes_speed, slow))]
        timed, untimed = (
            [one for one in others if any(one.effect.has_path(name, has) for name in left)] for has in (True, False)
        )
        written: list[TimelineEntry] = []
        for done, ended in ((held, fast), (stays, timed), (ends, untimed)):
            for running in _joined((part for one in ended for part in self._running(one)), " or "):
                when = Trigger(f"{fires(trigger)} and not happened({name}) and ({running})")
                called = f"{name}_ends_others" + (f"_{len(written) + 1}" if written else "")
                written.append(timeline_entry(entry.node, called, when, done, until))
        return written

    def _others(self, entry: Entry) -> list[Entry]:
        """Other events of its maneuver."""
        above = entry.node.above
        return [one for one in self.entries.values() if one is not entry and one.node.above is above]

    def _running(self, entry: Entry) -> list[str]:
        """Conditions that an execution of an event is running; where its end is not known, that the first has begun."""
        if entry.effect.has_unknown_end or (entry.effect.ends_itself and entry.effect.moved()):
            return [f"happened({entry.names[0]})"]
        return [f"(happened({name}) and not ({self._played(entry, name)}))" for name in entry.names]

    def _overridden(self, entry: Entry, name: str) -> list[str]:
        """When an execution of an event whose changes of speed would go on is overridden or replaced, by its name."""
        effect = entry.effect
        goes_on = effect.is_endless or effect.changes_speed() or any(map(effect.has_path, effect.do))
        if not goes_on:
            return []
        others = [one for one in self._others(entry) if one.node.get("priority") not in _GENTLE]
        if effect.ends and (moved := effect.moved()):
            # A speed that another event orders instead is never reached.
            others += [one for one in self.entries.values() if one is not entry and moved <= one.effect.moved()]
        begun = f"(happened({name}) delayed {STEP} and happened({{0}}) and not (happened({{0}}) delayed {STEP}))"
        return list(dict.fromkeys(begun.format(other) for one in others for other in one.names))

    def _mark(self, node: Node, wanted: str, trigger: Trigger) -> str:
        """Condition that a trigger has fired: an entry of the timeline without action."""
        taken = {mark["name"] for _, mark in self.triggers.marks}
        name = free_name(wanted, taken.union(*(one.names for one in self.entries.values())))
        self.triggers.marks.append(timeline_entry(node, name, trigger, {}))
        return f"happened({name})"

    def _until(self, act: Node) -> str:
        """Condition for events in addition to their triggers: their act has not been stopped."""
        stop = self.triggers.trigger(act.one("StopTrigger"))
        if stop is None or not stop.condition:
            return ""
        name = self._stops[id(act)]
        self.triggers.marks.append(timeline_entry(act, name, stop, {}))
        return f"not happened({name})" if stop.at is None else f"time < {max(stop.at, 0.0):g} s"

    def _act_begins(self, act: Node) -> Trigger:
        """When an act begins; a trigger that is more than a time becomes a mark."""
        begins = self.triggers.trigger(act.one("StartTrigger")) or AT_ONCE
        if begins.at is not None or not begins.condition:
            return begins
        return Trigger(self._mark(act, f"act_{act.get('name')}", begins))

    def state(self, node: Node) -> Trigger:
        """Trigger for a ``StoryboardElementStateCondition``."""
        kind = node.get("storyboardElementType")
        kind = kind[:1].upper() + kind[1:]
        name, state = node.get("storyboardElementRef"), node.get("state")
        if kind not in _PARTS or state not in _BEGUN + _OVER:
            raise NodeError(node, f"states are {', '.join(_BEGUN + _OVER)} of {', '.join(_PARTS)}")
        found = [one for story in self._stories for one in story.walk() if _is_called(one, kind, name)]
        if len(found) != 1:
            raise NodeError(node, f"there {'are several' if found else 'is no'} {kind} {name!r}")
        if any(one is found[0] for one in self._open):
            raise NodeError(node, f"{name} waits for itself")
        idle = [one for one in self._never if any(found[0] is inner for inner in one.walk())]
        if idle or (state in _OVER and any(one is inner for one in self._never for inner in found[0].walk())):
            return Trigger("time < 0 s")
        self._open.append(found[0])
        try:
            if state in _OVER:
                # What may be repeated ends each time, and an action is complete then.
                return self._over(found[0], 0 if state == _OVER[0] or kind == "Action" else -1)
            begun = self._begun(found[0])
            if state != "runningState" or (is_single(node) and kind != "Event"):
                return begun
            # What is over at once is running for a step.
            return Trigger(f"({begun.condition}) and not (({self._over(found[0]).condition}) delayed {STEP})")
        finally:
            self._open.pop()

    def value(self, node: Node) -> Trigger:
        """Trigger for a condition on a parameter or variable, which events may set."""
        name = node.get("parameterRef") or node.get("variableRef")
        setters = [entry for entry in self.entries.values() if name in entry.effect.sets]
        if not (values := self._declared(node)):
            raise NodeError(node, f"there is no {node.tag.removesuffix('Condition').lower()} {name!r}")
        holds = fits(self.initial.get(name, values[0]), node)
        if {fits(entry.effect.sets[name], node) for entry in setters} <= {holds}:
            return AT_ONCE if holds else Trigger("time < 0 s")
        if len(setters) > 1:
            node.refuse(f"{len(setters)} events set {name!r}; a condition may wait for one")
        happened = f"happened({setters[0].names[0]})"
        return Trigger(f"not {happened}" if holds else happened)

    def _declared(self, node: Node) -> list[str]:
        """Declared values of the parameter or variable of a condition."""
        kind = node.tag.removesuffix("Condition")
        name = node.attributes.get(f"{kind.lower()}Ref", "").strip()
        declarations = (one for block in self.root.all(f"{kind}Declarations") for one in block.all())
        return [one.get("value") for one in declarations if one.get("name") == name]

    def _begun(self, part: Node) -> Trigger:
        if part.tag in ("Event", "Action"):
            return Trigger(f"happened({self._entry(part).names[0]})")
        act = next((one for one in self._acts if any(inner is part for inner in one.walk())), None)
        if act is None:
            # A story begins with the run.
            return AT_ONCE
        if id(act) not in self._begins:
            self._begins[id(act)] = self._act_begins(act)
        return self._begins[id(act)]

    def _over(self, part: Node, execution: int = -1) -> Trigger:
        """When a part is over; an event or action, after one of its executions."""
        inside = {id(one) for one in part.walk()}
        inside |= {id(self._entry(part).node)} if part.tag == "Action" else set()
        phrases = []
        for act in self._acts:
            entries = [one for key, one in self.entries.items() if key in inside and one.group.above is act]
            which = execution if part.tag in _REPEATED else -1
            ends = ((one, one.names[which], one.parts.get(id(part), one.effect)) for one in entries)
            joined = _joined((self._played(*end) for end in ends), " and ")
            if len(joined) > 1:
                joined = [self._mark(part, f"{part.name}_over", Trigger(one)) for one in joined]
            phrase = " and ".join(joined)
            stop = self._stops.get(id(act))
            phrases += [f"(({phrase}) or happened({stop}))" if stop else phrase] * bool(entries)
        return Trigger(" and ".join(phrases)) if phrases else AT_ONCE

    def _played(self, entry: Entry, name: str, effect: Effect | None = None) -> str:
        effect, phrase = effect or entry.effect, f"happened({name})"
        if effect.has_unknown_end:
            message = "when a trajectory without times or places is over is not known"
            entry.node.refuse(f"{message}; nor is the end of a relative speed by rate")
        if effect.ends_itself:
            if effect.moved():
                entry.node.refuse("together with a speed, the end of a change of lane by distance is not known")
            phrase = f"over({name})"
        elif effect.lasts > 0.0:
            phrase = f"{phrase} for {effect.lasts:g} s"
        own = [] if effect.is_endless else [" and ".join([phrase, *(f"({end})" for end in effect.ends)])]
        key = name, id(effect)
        if key not in self._over_marks:
            overridden = self._overridden(entry, name)
            # What is over stays over.
            parts = [*own, *overridden] if effect.ends or overridden else []
            marks = [self._mark(entry.node, f"{name}_over", Trigger(one)) for one in _joined(parts, " or ")]
            self._over_marks[key] = marks
        parts = [*own, *self._over_marks[key]] or ["time < 0 s"]
        return parts[0] if len(parts) == 1 else f"({' or '.join(parts)})"

    def _entry(self, part: Node) -> Entry:
        return next(one for one in self.entries.values() if any(part is inner for inner in one.node.walk()))


def _left(vehicle: Vehicle) -> dict[str, Any]:
    """Path of one whose trajectory ends where it is: a vehicle's ends at once, and a body moves straight on."""
    far = _STRAIGHT if vehicle.body else _SHORT
    path = {"points": [[0.0, 0.0, 0.0], [far, 0.0, 0.0]], "ahead_m": vehicle.front, "origin": "vehicle"}
    return path | ({"stays": True} if vehicle.body else {})


def _executions(node: Node) -> int:
    times = node.number("maximumExecutionCount", 1.0)
    if not (times.is_integer() and 1.0 <= times <= _MOST_TIMES):
        node.refuse(f"maximumExecutionCount: expected 1 … {_MOST_TIMES}, got {times:g}")
    return min(max(int(times), 1), _MOST_TIMES)


def _is_called(node: Node, kind: str, name: str) -> bool:
    parts = re.split(r"::|/", name)
    return node.tag == kind and node.attributes.get("name") == parts[-1] and all(f"[{p}]" in node.path for p in parts)


def free_name(wanted: str, taken: set[str]) -> str:
    """A name for an entry of the timeline: letters, digits and _, and unique."""
    name = re.sub(r"\W", "_", wanted, flags=re.ASCII)[:80] or "event"
    name = name if name[0].isalpha() or name[0] == "_" else f"_{name}"
    numbered = (f"{name}_{number}" for number in range(2, len(taken) + 3))
    return next(one for one in (name, *numbered) if one not in taken)


def _joined(parts: Iterable[str], by: str) -> list[str]:
    """Conditions joined by ``and`` or ``or``, into as few as their length allows."""
    joined: list[str] = []
    for part in parts:
        if joined and len(joined[-1]) + len(part) < _ROOM:
            joined[-1] += f"{by}{part}"
        else:
            joined.append(part)
    return joined
