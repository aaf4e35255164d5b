"""States of the storyboard's elements as conditions of FogSim's language."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from fogsim.openscenario.actions import Actions
from fogsim.openscenario.lateral import Effect
from fogsim.openscenario.parameters import fits
from fogsim.openscenario.triggers import AT_ONCE, NEVER, STEP, Trigger, Triggers, is_single, rises, timeline_entry
from fogsim.openscenario.xml_tree import Node, NodeError

_BEGUN, _OVER = ("startTransition", "runningState"), ("endTransition", "completeState")
_ROOM = 600  # Most characters of conditions that are joined into one
GENTLE = ("parallel", "skip")  # Priorities that end nothing
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
    skipped: str = ""  # Name of the entry that it is skipped, of one that may be


@dataclass
class States:
    """Reads conditions on states; `entries` has the events by the identity of their elements."""

    actions: Actions
    root: Node
    triggers: Triggers = field(init=False)
    entries: dict[int, Entry] = field(default_factory=dict)
    beginning: Effect = field(default_factory=Effect)  # Of Init
    _begins: dict[int, Trigger] = field(default_factory=dict)
    _stops: dict[int, str] = field(default_factory=dict)  # Names of entries that stop acts
    _known_ends: dict[tuple[str, int, bool], tuple[list[str], list[str]]] = field(default_factory=dict)
    _stories: list[Node] = field(default_factory=list)
    _acts: list[Node] = field(default_factory=list)
    _never: list[Node] = field(default_factory=list)  # Acts and events that never begin
    _open: list[Node] = field(default_factory=list)

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
            return self._in_state(found[0], state, is_single(node))
        finally:
            self._open.pop()

    def _in_state(self, part: Node, state: str, is_single: bool) -> Trigger:
        """Trigger for a state of a part; a transition lasts for a step, unless a condition on it `is_single`."""
        names = self._entry(part).names if part.tag in _REPEATED else [""]
        if state in _OVER:
            is_state = state == "completeState"
            # An action is complete each time.
            names = ["" if part.tag == "Event" else names[0]] if is_state else names
            times = [self._over(part, name, is_regular=not is_state) for name in names]
        else:
            is_state, begun = state == "runningState", self._begun(part)
            times = [f"happened({name})" for name in names] if part.tag in _REPEATED else [begun.condition]
            if is_state and not (is_single and part.tag != "Event"):
                # What is over at once is running for a step.
                return Trigger(f"({begun.condition}) and not (({self._over(part)}) delayed {STEP})")
            if is_single:
                return begun
        if AT_ONCE.condition in times:
            return AT_ONCE
        return Trigger(times[0] if is_single or is_state else " or ".join(f"({rises(one)})" for one in times))

    def value(self, node: Node) -> Trigger:
        """Trigger for a condition on a parameter or variable, which events may set."""
        name = node.get("parameterRef") or node.get("variableRef")
        setters = [entry for entry in self.entries.values() if name in entry.effect.sets]
        if not (values := self._declared(node)):
            raise NodeError(node, f"there is no {node.tag.removesuffix('Condition').lower()} {name!r}")
        holds = fits(self.beginning.sets.get(name, values[0]), node)
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

    def _act_begins(self, act: Node) -> Trigger:
        """When an act begins; a trigger that is more than a time becomes a mark."""
        begins = self.triggers.trigger(act.one("StartTrigger")) or AT_ONCE
        if begins.at is not None or not begins.condition:
            return begins
        return Trigger(self._mark(act, f"act_{act.get('name')}", begins))

    def _over(self, part: Node, name: str = "", *, is_regular: bool = False) -> str:
        """Condition that a part is over, by itself if `is_regular`; an event or action, after an execution by name."""
        inside = {id(one) for one in part.walk()}
        inside |= {id(self._entry(part).node)} if part.tag == "Action" else set()
        phrases = []
        for act in self._acts:
            entries = [one for key, one in self.entries.items() if key in inside and one.group.above is act]
            joined = joined_by((self._played(one, part, name, is_regular) for one in entries), " and ")
            if len(joined) > 1:
                joined = [self._mark(part, f"{part.name}_over", Trigger(one)) for one in joined]
            phrase = " and ".join(joined)
            if stop := self._stops.get(id(act)):
                phrase = f"(({phrase}) {'and not' if is_regular else 'or'} happened({stop}))"
            phrases += [phrase] * bool(entries)
        return " and ".join(phrases) if phrases else AT_ONCE.condition

    def _played(self, entry: Entry, part: Node | None = None, name: str = "", is_regular: bool = False) -> str:
        """Condition that an execution of an event (default: the last one) is over, or of an action that is its part."""
        is_action = part is not None and part.tag == "Action"
        effect = entry.parts.get(id(part)) if is_action else None
        ended, cut = self._ends(entry, name or entry.names[-1], effect, is_action=is_action)
        parts = ended if is_regular and name else [*ended, *cut]
        for before in () if name else entry.names[:-1]:
            # What is overridden is not played again.
            ended, cut = self._ends(entry, before)
            parts = parts + [f"({one} and not ({either(ended)}))" for one in cut]
        return either(parts + [f"happened({entry.skipped})"] * bool(entry.skipped and not name))

    def _ends(
        self, entry: Entry, name: str, effect: Effect | None = None, *, is_action: bool = False
    ) -> tuple[list[str], list[str]]:
        """Conditions that an execution of an event, or one of its actions, has ended by itself, or is overridden."""
        if effect is None and entry.parts:
            each = [self._ends(entry, name, part) for part in entry.parts.values()]
            return [" and ".join(dict.fromkeys(either(one) for one, _ in each))], list(
                dict.fromkeys(one for _, cut in each for one in cut)
            )
        effect = effect or entry.effect
        if (key := (name, id(effect), is_action)) in self._known_ends:
            return self._known_ends[key]
        own, (cut, replaced) = self._own_end(entry, name, effect), self._cuts(entry, name, effect)
        if is_action:
            cut, replaced = [*cut, *replaced], []
        if own and not effect.ends:
            cut = [f"{one} and not ({own[0]})" for one in cut]
        cut = [self._mark(entry.node, f"{name}_overridden", Trigger(one)) for one in joined_by(cut, " or ")]
        goes_on = [f"not {one}" for one in cut]
        # What is over stays over.
        stays = joined_by([*own, *replaced], " or ") if effect.ends or replaced else []
        marks = [self._mark(entry.node, f"{name}_over", Trigger(" and ".join([f"({one})", *goes_on]))) for one in stays]
        ended = [*(" and ".join([one, *goes_on]) for one in own), *marks]
        self._known_ends[key] = ended, cut
        return ended, cut

    def _own_end(self, entry: Entry, name: str, effect: Effect) -> list[str]:
        """The condition that an execution has come to its end; none for what goes on until something else ends it."""
        phrase = f"happened({name})"
        if effect.has_unknown_end:
            message = "when a trajectory without times or places is over is not known"
            entry.node.refuse(f"{message}; nor is the end of a relative speed by rate")
        if effect.ends_itself:
            if effect.moved():
                entry.node.refuse("together with a speed, the end of a change of lane by distance is not known")
            phrase = f"over({name})"
        elif effect.lasts > 0.0:
            phrase = f"{phrase} for {effect.lasts:g} s"
        return [] if effect.is_endless else [" and ".join([phrase, *(f"({end})" for end in effect.ends)])]

    def _cuts(self, entry: Entry, name: str, effect: Effect) -> tuple[list[str], list[str]]:
        """When what an execution of an event does would go on but is overridden, and when it is replaced."""
        above, lasting = entry.node.above, effect.lasting()
        # Changes of lane are completed.
        is_cut = effect.is_endless or effect.paths() or any(way == "along" for _, way in lasting)
        begun = f"(happened({name}) delayed {STEP} and happened({{0}}) and not (happened({{0}}) delayed {STEP}))"
        overridden, replaced = list[str](), list[str]()
        for one in (one for one in self.entries.values() if one is not entry):
            # An action that another one replaces for an actor ends for all.
            is_replaced = bool(lasting & one.effect.ordered())
            if one.node.above is above and one.node.get("priority") not in GENTLE:
                overridden += map(begun.format, one.names if is_cut or is_replaced else ())
            elif is_replaced:
                replaced += map(begun.format, one.names)
        return overridden, replaced

    def _others(self, entry: Entry) -> list[Entry]:
        """Other events of its maneuver."""
        above = entry.node.above
        return [one for one in self.entries.values() if one is not entry and one.node.above is above]

    def _running(self, entry: Entry) -> list[str]:
        """Conditions that an execution of an event is running; where its end is not known, that the first has begun."""
        if entry.effect.has_unknown_end or (entry.effect.ends_itself and entry.effect.moved()):
            return [f"happened({entry.names[0]})"]
        return [f"(happened({name}) and not ({self._played(entry, None, name)}))" for name in entry.names]

    def _mark(self, node: Node, wanted: str, trigger: Trigger) -> str:
        """Condition that a trigger has fired: an entry of the timeline without action."""
        taken = {mark["name"] for _, mark in self.triggers.marks}
        name = free_name(wanted, taken.union(*([*one.names, one.skipped] for one in self.entries.values())))
        self.triggers.marks.append(timeline_entry(node, name, trigger, {}))
        return f"happened({name})"

    def _entry(self, part: Node) -> Entry:
        return next(one for one in self.entries.values() if any(part is inner for inner in one.node.walk()))


def _is_called(node: Node, kind: str, name: str) -> bool:
    parts = re.split(r"::|/", name)
    return node.tag == kind and node.attributes.get("name") == parts[-1] and all(f"[{p}]" in node.path for p in parts)


def free_name(wanted: str, taken: set[str]) -> str:
    """A name for an entry of the timeline: letters, digits and _, and unique."""
    name = re.sub(r"\W", "_", wanted, flags=re.ASCII)[:80] or "event"
    name = name if name[0].isalpha() or name[0] == "_" else f"_{name}"
    numbered = (f"{name}_{number}" for number in range(2, len(taken) + 3))
    return next(one for one in (name, *numbered) if one not in taken)


def either(conditions: list[str]) -> str:
    """Condition that one of some holds."""
    return conditions[0] if len(conditions) == 1 else f"({' or '.join(conditions)})" if conditions else "time < 0 s"


def joined_by(parts: Iterable[str], by: str) -> list[str]:
    """Conditions joined by ``and`` or ``or``, into as few as their length allows."""
    joined: list[str] = []
    for part in parts:
        if joined and len(joined[-1]) + len(part) < _ROOM:
            joined[-1] += f"{by}{part}"
        else:
            joined.append(part)
    return joined
