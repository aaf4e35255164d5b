"""The storyboard as a timeline: acts, groups, maneuvers and events, each with a trigger in FogSim's language."""

import re
from dataclasses import dataclass, field
from typing import Any

from fogsim.openscenario.actions import Actions
from fogsim.openscenario.catalogs import Catalogs
from fogsim.openscenario.effects import Effect
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.parameters import fits
from fogsim.openscenario.triggers import AT_ONCE, NEVER, Trigger, Triggers, both
from fogsim.openscenario.xml_tree import Node

_BEGUN, _OVER = ("startTransition", "runningState"), ("endTransition", "completeState")
_MOST_TIMES = 100
_MOTION = {"speed", "follow", "arrive"}
_PARTS = ("Story", "Act", "ManeuverGroup", "Maneuver", "Event", "Action")


@dataclass
class Entry:
    """An event as entries of the timeline, one for each execution; its trigger is `NEVER` until it is known."""

    names: list[str]
    node: Node
    actors: list[str]
    effect: Effect = field(default_factory=Effect)
    trigger: Trigger = NEVER


@dataclass
class Storyboard:
    """Reads stories; `entries` has the events by the identity of their elements."""

    catalogs: Catalogs
    actions: Actions
    root: Node
    triggers: Triggers = field(init=False)
    entries: dict[int, Entry] = field(default_factory=dict)
    _acts: dict[int, Trigger] = field(default_factory=dict)
    _stories: list[Node] = field(default_factory=list)
    _open: list[Node] = field(default_factory=list)

    @property
    def findings(self) -> Findings:
        """Receives what cannot be played."""
        return self.catalogs.findings

    def find_events(self, storyboard: Node) -> None:
        """Find all events and their effects; triggers follow later, since events refer to one another."""
        self._stories = storyboard.all("Story")
        for group in (one for act in self._all_acts() for one in act.all("ManeuverGroup")):
            actors = group.one("Actors")
            names = [one.get("entityRef") for one in actors.all("EntityRef")] if actors else []
            if actors and self.findings.flag(actors, "selectTriggeringEntities", "false"):
                self.findings.refuse(actors, "selectTriggeringEntities: name the actors")
            for one in names:
                if one not in self.actions.vehicles:
                    self.findings.refuse(actors or group, f"there is no vehicle {one!r}")
            times = self._executions(group)
            for reference in group.all("CatalogReference"):
                entry = self.catalogs.entry(reference)
                group.children += [entry] if entry else []
            for maneuver in group.all("Maneuver"):
                for event in maneuver.all("Event"):
                    self._find(event, names, times)
            if times > 1 and len(events := [e for m in group.all("Maneuver") for e in m.all("Event")]) > 1:
                self.findings.refuse(group, f"maximumExecutionCount: {len(events)} events are played once; write 1")

    def _executions(self, node: Node) -> int:
        times = self.findings.number(node, "maximumExecutionCount", 1.0)
        if not (times.is_integer() and 1.0 <= times <= _MOST_TIMES):
            self.findings.refuse(node, f"maximumExecutionCount: expected 1 … {_MOST_TIMES}, got {times:g}")
        return min(max(int(times), 1), _MOST_TIMES)

    def _find(self, event: Node, actors: list[str], times: int) -> None:
        priority = event.get("priority")
        if priority not in ("overwrite", "override", "parallel"):
            self.findings.refuse(event, f"priority: expected override, overwrite or parallel, got {priority!r}")
        entry = Entry([], event, actors)
        for _ in range(min(times * self._executions(event), _MOST_TIMES)):
            taken = {name for one in self.entries.values() for name in one.names}
            entry.names.append(_free_name(event.get("name"), {*taken, *entry.names}))
        self.entries[id(event)] = entry
        for action in event.all("Action"):
            self.actions.take(action, actors, entry.effect)

    def timeline(self) -> list[tuple[Node, dict[str, Any]]]:
        """Entries of the timeline, each with its element."""
        self._acts = {id(act): self._act_begins(act, self.triggers) for act in self._all_acts()}
        written = []
        for act in self._all_acts():
            stop = self.triggers.trigger(act.one("StopTrigger"))
            for event in _events(act):
                entry = self.entries[id(event)]
                entry.trigger = self._begins(entry, act)
                until, trigger = _until(stop, self.triggers, event), entry.trigger
                for number, name in enumerate(entry.names):
                    if number and entry.effect.is_endless:
                        self.findings.refuse(
                            event, "maximumExecutionCount: what is never over by itself is played once"
                        )
                    if number:
                        # It is played again once it is over and its own trigger holds.
                        trigger = both(self._played(entry, entry.names[number - 1]), entry.trigger)
                    written.append((event, _written(entry, name, trigger, until)))
                    if entry.effect.once_there:
                        then = Entry([f"{name}_once_there"], event, [], Effect(entry.effect.once_there))
                        written.append((event, _written(then, then.names[0], Trigger(f"happened({name})"), until)))
                    ends = self._end_others(entry, name, trigger)
                    written += [(event, _written(one, one.names[0], one.trigger, until)) for one in ends]
        return written

    def _end_others(self, entry: Entry, name: str, trigger: Trigger) -> list[Entry]:
        """What an overriding event does to others of its maneuver that have begun: speeds stay as they are."""
        if entry.node.get("priority") == "parallel" or not trigger.condition:
            return []
        actors = [one for one in entry.actors if not entry.effect.do.get(one, {}).keys() & _MOTION]
        others = [one for one in self.entries.values() if one is not entry and one.node.above is entry.node.above]
        begun = [f"happened({one.names[0]})" for one in others if any(map(one.effect.changes_speed, actors))]
        condition = f"({trigger.condition}) and not happened({name}) and ({' or '.join(begun)})"
        held = Effect({one: {"speed": self.actions.held(one)} for one in actors})
        ends = Entry([f"{name}_ends_others"], entry.node, actors, held, Trigger(condition, trigger.delay))
        return [ends] if begun else []

    def _act_begins(self, act: Node, triggers: Triggers) -> Trigger:
        """When an act begins; a trigger that is more than a time becomes a mark."""
        begins = triggers.trigger(act.one("StartTrigger")) or AT_ONCE
        if begins.at is not None or not begins.condition:
            return begins
        name = _free_name(f"act_{act.get('name')}", {mark.name for mark in triggers.marks})
        triggers.mark(name, begins, act)
        return Trigger(f"happened({name})", stays=True)

    def _begins(self, entry: Entry, act: Node) -> Trigger:
        own = self.triggers.trigger(entry.node.one("StartTrigger")) or AT_ONCE
        return both(self._acts[id(act)], own)

    def state(self, node: Node) -> Trigger:
        """Trigger for a ``StoryboardElementStateCondition``."""
        kind = node.get("storyboardElementType")
        kind = "ManeuverGroup" if kind == "maneuverGroup" else kind[:1].upper() + kind[1:]
        name, state = node.get("storyboardElementRef"), node.get("state")
        if kind not in _PARTS or state not in _BEGUN + _OVER:
            self.findings.refuse(node, f"states are {', '.join(_BEGUN + _OVER)} of {', '.join(_PARTS)}")
            return NEVER
        found = [one for story in self._stories for one in story.walk() if _is_called(one, kind, name)]
        if len(found) != 1:
            self.findings.refuse(node, f"there {'are several' if found else 'is no'} {kind} {name!r}")
            return NEVER
        if any(one is found[0] for one in self._open):
            self.findings.refuse(node, f"{name} waits for itself")
            return NEVER
        self._open.append(found[0])
        try:
            return self._begun(found[0]) if state in _BEGUN else self._over(found[0])
        finally:
            self._open.pop()

    def value(self, node: Node) -> Trigger:
        """Trigger for a condition on a parameter or variable, which events may set."""
        kind = node.tag.removesuffix("Condition")
        name = node.get(f"{kind.lower()}Ref")
        declared = [
            one for block in self.root.all(f"{kind}Declarations") for one in block.all() if one.get("name") == name
        ]
        setters = [entry for entry in self.entries.values() if name in entry.effect.sets]
        if not declared:
            self.findings.refuse(node, f"there is no {kind.lower()} {name!r}")
            return NEVER
        holds = fits(declared[0].get("value"), node, self.findings)
        later = {fits(entry.effect.sets[name], node, self.findings) for entry in setters}
        if later <= {holds}:
            return AT_ONCE if holds else Trigger("time < 0 s", stays=True)
        if len(setters) > 1:
            self.findings.refuse(node, f"{len(setters)} events set {name!r}; a condition may wait for one")
        happened = f"happened({setters[0].names[0]})"
        return Trigger(f"not {happened}" if holds else happened, stays=not holds)

    def _begun(self, part: Node) -> Trigger:
        if part.tag in ("Event", "Action"):
            return Trigger(f"happened({self._entry(part).names[0]})", stays=True)
        act = next((one for one in self._all_acts() if any(inner is part for inner in one.walk())), None)
        if act is None:
            # A story begins with the run.
            return AT_ONCE
        if id(act) not in self._acts:
            self._acts[id(act)] = self._act_begins(act, self.triggers)
        return self._acts[id(act)]

    def _over(self, part: Node) -> Trigger:
        """When all events in an element are over."""
        inner = {id(event): event for act in self._all_acts() for event in _events(act)}
        if part.tag == "Action":
            events = [self._entry(part).node]
        else:
            events = [event for key, event in inner.items() if any(one is event for one in part.walk())]
        played = [self._played(entry, entry.names[-1]) for entry in (self.entries[id(event)] for event in events)]
        if not played:
            return AT_ONCE
        return Trigger(" and ".join(one.condition for one in played), stays=all(one.stays for one in played))

    def _played(self, entry: Entry, name: str) -> Trigger:
        """When an execution of an event is over."""
        effect, phrase = entry.effect, f"happened({name})"
        if effect.has_unknown_end:
            self.findings.refuse(entry.node, "when a trajectory without times or places is over is not known")
        if effect.is_endless:
            return Trigger("time < 0 s", stays=True)
        if effect.ends_itself:
            if any(_MOTION & done.keys() for done in effect.do.values()):
                self.findings.refuse(
                    entry.node, "together with a speed, the end of a change of lane by distance is not known"
                )
            phrase = f"over({name})"
        elif effect.lasts > 0.0:
            phrase = f"{phrase} for {effect.lasts:g} s"
        return Trigger(" and ".join([phrase, *(f"({end})" for end in effect.ends)]), stays=not effect.ends)

    def _entry(self, part: Node) -> Entry:
        return next(one for one in self.entries.values() if any(inner is part for inner in one.node.walk()))

    def _all_acts(self) -> list[Node]:
        return [act for story in self._stories for act in story.all("Act")]


def _events(act: Node) -> list[Node]:
    return [e for group in act.all("ManeuverGroup") for m in group.all("Maneuver") for e in m.all("Event")]


def _is_called(node: Node, kind: str, name: str) -> bool:
    parts = re.split(r"::|/", name)
    return node.tag == kind and node.attributes.get("name") == parts[-1] and all(f"[{p}]" in node.path for p in parts)


def _free_name(wanted: str, taken: set[str]) -> str:
    """A name for an entry of the timeline: letters, digits and _, and unique."""
    name = re.sub(r"\W", "_", wanted, flags=re.ASCII)[:80] or "event"
    name = name if name[0].isalpha() or name[0] == "_" else f"_{name}"
    number = 1
    free = name
    while free in taken:
        number += 1
        free = f"{name}_{number}"
    return free


def _until(stop: Trigger | None, triggers: Triggers, node: Node) -> str:
    """Condition for an event in addition to its trigger: its act has not been stopped."""
    if stop is None or not stop.condition:
        return ""
    if stop.at is not None:
        return f"time < {max(stop.at, 0.0):g} s"
    name = f"stop_{len(triggers.marks)}"
    triggers.mark(name, stop, node)
    return f"not happened({name})"


def _written(entry: Entry, name: str, trigger: Trigger, until: str) -> dict[str, Any]:
    condition = trigger.condition
    if until:
        condition = f"({condition}) and {until}"
    return {
        "name": name,
        "when": condition,
        **({"delay_s": trigger.delay} if trigger.delay else {}),
        "do": entry.effect.do,
    }
