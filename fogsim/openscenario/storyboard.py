"""The storyboard as a timeline: acts, groups, maneuvers and events, each with a trigger in FogSim's language."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from fogsim.openscenario.environment import Vehicle
from fogsim.openscenario.lateral import MOTION, Effect
from fogsim.openscenario.parameters import fits
from fogsim.openscenario.states import GENTLE, Entry, States, either, free_name, joined_by
from fogsim.openscenario.triggers import AT_ONCE, TimelineEntry, Trigger, both, fires, timeline_entry
from fogsim.openscenario.xml_tree import Node

_MOST_TIMES = 100
_STRAIGHT, _SHORT = 1000.0, 0.01  # Lengths of paths [m]
_REFERENCE = "CatalogReference"
_Ended = tuple[dict[str, Any], list[Entry | str]]  # Blocks of a timeline, and the events that they end, or conditions


@dataclass
class Storyboard(States):
    """Reads stories."""

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
        entry.node.word("priority", ("override", "overwrite", *GENTLE))
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
        for entry in self.entries.values():
            if entry.node.get("priority") == "skip" and len(entry.names) == 1 and self._others(entry):
                entry.skipped = free_name(f"{entry.names[0]}_skipped", taken)
                taken.add(entry.skipped)
        self._begins = {id(act): self._act_begins(act) for act in self._acts}
        written: list[TimelineEntry] = []
        comes: list[TimelineEntry] = []
        for act in self._acts:
            until, ends = self._until(act)
            self.triggers.since = self._begins[id(act)]
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
            written += ends
            self.triggers.since = AT_ONCE
        # What other events order of who comes in the same step counts more.
        return comes + written

    def expected(self, stop: Trigger | None) -> list[str]:
        """Names of the events that begin unless the run's time is up first."""
        end = math.inf if stop is None or stop.at is None else stop.at
        return [one.names[0] for one in self.entries.values() if one.trigger.at is None or one.trigger.at < end]

    def _executed(self, entry: Entry, until: str) -> list[TimelineEntry]:
        written, node, effect = [], entry.node, entry.effect
        for number, name in enumerate(entry.names):
            trigger = entry.trigger
            if number:
                if effect.is_endless:
                    node.refuse("maximumExecutionCount: an action that never ends is played once")
                # It is played again once it has ended by itself and its own trigger holds.
                ended, _ = self._ends(entry, entry.names[number - 1])
                trigger = both(Trigger(either(ended)), trigger)
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
                running += [f"(happened({name}) and not ({self._played(one, None, name)}))" for name in one.names]
                if earlier and one.trigger.condition:
                    running.append(f"({fires(one.trigger)} and not happened({one.names[0]}))")
        fired, runs = fires(entry.trigger), " or ".join(running)
        if len(entry.names) > 1:
            entry.node.remark("maximumExecutionCount: it counts executions, and not how often the event is skipped")
            return Trigger(f"{fired} and not ({runs})")
        skipped = Trigger(f"{fired} and not happened({entry.names[0]}) and ({runs})")
        self.triggers.marks.append(timeline_entry(entry.node, entry.skipped, skipped, {}))
        return Trigger(f"{fired} and not ({runs}) and not happened({entry.skipped})")

    def _end_others(self, entry: Entry, name: str, trigger: Trigger, until: str) -> list[TimelineEntry]:
        """What an event does to others that run: it overrides those of its maneuver, or replaces actions of others."""
        if not trigger.condition:
            return []
        overrides = entry.node.get("priority") not in GENTLE
        ended = [*self._from_init(entry.effect), *(self._override(entry) if overrides else ())]
        overridden = self._others(entry) if overrides else []
        for one in self.entries.values():
            if not any(one is other for other in (entry, *overridden)):
                effects = [*one.parts.values()] or [one.effect]
                ended += [(self._replaced(effect, entry.effect), [one]) for effect in effects]
        written: list[TimelineEntry] = []
        for done, others in ended:
            running = (part for one in others for part in ([one] if isinstance(one, str) else self._running(one)))
            for condition in joined_by(running, " or ") if done else ():
                when = Trigger(f"{fires(trigger)} and not happened({name}) and ({condition})")
                called = f"{name}_ends_others" + (f"_{len(written) + 1}" if written else "")
                written.append(timeline_entry(entry.node, called, when, done, until))
        return written

    def _from_init(self, by: Effect) -> list[_Ended]:
        """How trajectories of Init end that an event replaces."""
        ended: list[_Ended] = []
        for one in sorted(self.beginning.paths() - by.paths()):
            ways = {way for _, way in by.ordered() if (one, way) in by.ordered() & self.beginning.ordered()}
            if ways:
                slow = {one} if self.beginning.has_path(one, has_times=True) and "along" not in ways else set[str]()
                times = self.beginning.do[one]["path"].get("at_s", [math.inf])
                done = {one: {**self._held(slow).get(one, {}), **self._left({one})[one]}}
                ended.append((done, [f"time < {times[-1]:g} s" if math.isfinite(times[-1]) else "time >= 0 s"]))
        return ended

    def _replaced(self, effect: Effect, by: Effect) -> dict[str, Any]:
        """How an action that another one replaces for an actor ends for all, unless that orders their motion."""
        lasting, ordered = effect.lasting(), by.ordered()
        if not lasting & ordered:
            return {}
        done = self._held({one for one, way in lasting if way == "along" and (one, way) not in ordered})
        for one, path in self._left(effect.paths() - by.paths()).items():
            done[one] = {**done.get(one, {}), **path}
        return done

    def _override(self, entry: Entry) -> list[_Ended]:
        """What an overriding event does to others of its maneuver: speeds stay as they are, and paths end."""
        known, orders = self.actions.vehicles, entry.effect.do
        slow = [one for one in entry.actors if one in known and not orders.get(one, {}).keys() & MOTION]
        left = [one for one in entry.actors if one in known and "path" not in orders.get(one, {})]
        held, ends = self._held(slow), self._left(left)
        # Whose trajectory has times has no other speed.
        stays = {one: {**held.get(one, {}), **end} for one, end in ends.items()}
        others = self._others(entry)
        fast = [one for one in others if any(map(one.effect.changes_speed, slow))]
        timed, untimed = (
            [one for one in others if any(one.effect.has_path(name, has) for name in left)] for has in (True, False)
        )
        return [(held, [*fast]), (stays, [*timed]), (ends, [*untimed])]

    def _until(self, act: Node) -> tuple[str, list[TimelineEntry]]:
        """Condition for events in addition to their triggers: their act is not stopped; and how those that run end."""
        stop = self.triggers.trigger(act.one("StopTrigger"))
        if stop is None or not stop.condition:
            return "", []
        name, written = self._stops[id(act)], list[TimelineEntry]()
        self.triggers.marks.append(timeline_entry(act, name, stop, {}))
        for entry in (one for one in self.entries.values() if one.group.above is act):
            done = self._held({one for one, way in entry.effect.lasting() if way == "along"})
            for one, path in self._left(entry.effect.paths()).items():
                done[one] = {**done.get(one, {}), **path}
            for running in joined_by(self._running(entry), " or ") if done else ():
                when = Trigger(f"{fires(stop)} and not happened({name}) and ({running})")
                written.append(timeline_entry(act, f"{entry.names[0]}_stopped_{len(written) + 1}", when, done))
        return f"not happened({name})" if stop.at is None else f"time < {max(stop.at, 0.0):g} s", written

    def _held(self, actors: Iterable[str]) -> dict[str, Any]:
        """Blocks of a timeline that keep speeds as they are."""
        known = self.actions.vehicles
        return {one: {"speed": {"like": known[one].named, "shape": "step"}} for one in sorted(actors)}

    def _left(self, actors: Iterable[str]) -> dict[str, Any]:
        """Blocks of a timeline that end trajectories."""
        return {one: {"path": _left(self.actions.vehicles[one])} for one in sorted(actors)}


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
