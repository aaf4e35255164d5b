"""What of a timeline does not fit the rest of its scenario, and the names that stand in it."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from fogsim.conditions import EGO, Condition, Limits, condition_mistakes, pointless_parts, vehicles_in
from fogsim.errors import suggest
from fogsim.scenario.document import Document
from fogsim.scenario.expect.checks import run_content
from fogsim.scenario.expect.conditions import refuse
from fogsim.scenario.plain_yaml import KeyPath
from fogsim.scenario.timeline.actions import departing_vehicles, entry_name, operations, vehicles_of
from fogsim.scenario.timeline.lamps import lamp_mistake
from fogsim.scenario.timeline.schema import Doing, FogActions, LightActions, SignalActions, TimelineEntry
from fogsim.scenario.timeline.vehicle_actions import VehicleActions
from fogsim.units import DAY_ILLUMINANCE

if TYPE_CHECKING:
    from fogsim.scenario.schema import ScenarioFile

PHOTONS_BY_DAY = f"fog.airlight: photons is of the sky's light by day, from {DAY_ILLUMINANCE:g} lx on"
"""Why there is none by lamplight."""

_DAYLIGHT_RENDERER = "reference"
"""Name of the renderer that draws by daylight only."""


def check_timeline(scenario: "ScenarioFile") -> None:
    """Refuse a timeline that a run of its scenario could not play."""
    refuse((("timeline", *place), mistake) for place, mistake in _mistakes(scenario))
    if scenario.end_when is not None:
        mistakes = condition_mistakes(scenario.end_when, run_content(scenario))
        refuse((("end_when",), one) for one in mistakes)


def pointless_triggers(document: Document, scenario: "ScenarioFile", limits: Limits) -> Iterator[tuple[KeyPath, str]]:
    """Say which triggers, and which ``end_when``, can never come as they are written, within some limits.

    Triggers of OpenSCENARIO files may: what was not played is reported at the end of the run. So may those that come
    after a run's end that was moved by ``--set``.
    """
    if document.is_overridden(("duration_s",)):
        limits = {key: ends for key, ends in limits.items() if key != "time"}
    triggers: list[tuple[KeyPath, Condition | None]] = [(("end_when",), scenario.end_when)]
    triggers += [(("timeline", number, "when"), entry.when) for number, entry in enumerate(scenario.timeline)]
    for at, condition in triggers:
        if condition is not None and document.is_written(at):
            for reason in pointless_parts(condition, limits, scenario.traffic.ego):
                yield at, f"this can never come: {reason}"


def _mistakes(scenario: "ScenarioFile") -> Iterator[tuple[KeyPath, str]]:
    names = [entry_name(entry, number) for number, entry in enumerate(scenario.timeline)]
    content = run_content(scenario) if scenario.timeline else None
    for number, entry in enumerate(scenario.timeline):
        if names[number] in names[:number]:
            yield (number, "name"), f"names of entries must differ, but {names[number]!r} occurs twice"
        if content is not None:
            yield from (((number, "when"), mistake) for mistake in condition_mistakes(entry.when, content))
        if not scenario.traffic.has_ego and EGO in vehicles_of(entry):
            yield (number, "do"), "it refers to the ego, but traffic.ego is none"
        for subject, doing in operations(entry):
            mistake = (
                _mistake(doing, scenario)
                or _person_mistake(subject, doing, scenario)
                or _lamp_mistake(subject, doing, scenario)
                or _speed_mistake(subject, doing, scenario)
            )
            if mistake:
                yield (number, "do", subject), mistake


def _person_mistake(subject: str, doing: Doing, scenario: "ScenarioFile") -> str | None:
    """What persons and vehicles cannot do that the others can."""
    if not isinstance(doing, VehicleActions):
        return None
    actor = scenario.actors.get(subject)
    if actor is not None and actor.is_person and not doing.walk:
        return f"{subject} is a person, who can walk and nothing else"
    if doing.take_route and subject == EGO:
        return "take_route: positions count along the ego's route, which is known from the beginning"
    if doing.walk and (subject == EGO or (actor is not None and not actor.is_person)):
        persons = [name for name, one in scenario.actors.items() if one.is_person]
        there = suggest(subject, persons) if persons else "the scenario has no persons"
        return f"{subject} is a vehicle, and only persons walk; {there}"
    return None


def _lamp_mistake(subject: str, doing: Doing, scenario: "ScenarioFile") -> str | None:
    """Lamps that a vehicle does not have, where its type is known."""
    if not isinstance(doing, VehicleActions) or doing.lamps is None:
        return None
    kind = _kind(subject, scenario)
    return None if kind is None else lamp_mistake(kind, doing.lamps)


def _speed_mistake(subject: str, doing: Doing, scenario: "ScenarioFile") -> str | None:
    """A speed above the one with which a vehicle begins, which is its type's maximum then."""
    if not isinstance(doing, VehicleActions):
        return None
    wanted = [] if doing.speed is None else [doing.speed.to_kmh or 0.0, *(speed for _, speed in doing.speed.profile)]
    wanted += [] if doing.arrive is None or doing.arrive.factor else [doing.arrive.to_kmh or 0.0]
    if not any(wanted):
        return None
    named = scenario.traffic.ego if subject == EGO else subject
    actor = scenario.actors.get(named)
    begins = [actor.speed_kmh] if actor is not None else []
    for entry in scenario.timeline:
        for name, other in operations(entry):
            if name == subject and isinstance(other, VehicleActions) and other.depart and other.depart.like is None:
                begins.append(other.depart.speed_kmh)
    most = max((speed or math.inf for speed in begins), default=math.inf)
    if max(wanted) <= most:
        return None
    return (
        f"{subject} begins with speed_kmh: {most:g} and never drives faster, so it does not come to {max(wanted):g}; "
        "begin with the highest speed, or leave speed_kmh out"
    )


def _kind(subject: str, scenario: "ScenarioFile") -> str | None:
    """Type of an actor, or with which a vehicle comes onto the road; None if the file does not say it."""
    if subject in scenario.actors:
        return scenario.actors[subject].type
    for entry in scenario.timeline:
        for name, doing in operations(entry):
            if name == subject and isinstance(doing, VehicleActions) and doing.depart:
                like = scenario.actors.get(doing.depart.like or "")
                return doing.depart.type or (None if like is None else like.type)
    return None


def _mistake(doing: Doing, scenario: "ScenarioFile") -> str | None:
    if isinstance(doing, VehicleActions | SignalActions):
        return None
    if isinstance(doing, FogActions):
        return _fog_mistake(doing, scenario)
    if not scenario.traffic.has_ego:
        return "daylight and sensors concern an ego's camera, and traffic.ego is none"
    return _light_mistake(doing, scenario) if isinstance(doing, LightActions) else None


def _light_mistake(doing: LightActions, scenario: "ScenarioFile") -> str | None:
    if scenario.renderer == _DAYLIGHT_RENDERER and doing.illuminance_lx < DAY_ILLUMINANCE:
        return (
            f"illuminance_lx is {doing.illuminance_lx:g}, and the renderer {_DAYLIGHT_RENDERER} knows no lamplight, "
            f"which there is below {DAY_ILLUMINANCE:g}; take opengl or cpu"
        )
    if scenario.fog.airlight == "photons" and doing.illuminance_lx < DAY_ILLUMINANCE:
        return f"illuminance_lx is {doing.illuminance_lx:g}, and {PHOTONS_BY_DAY}"
    if doing.course == "factors" and scenario.light.illuminance_lx == 0.0:
        return "course: factors goes on from the light that there is, and light.illuminance_lx is 0"
    return None


def _fog_mistake(doing: FogActions, scenario: "ScenarioFile") -> str | None:
    visibility = scenario.fog.visibility_m or scenario.fog.outside_visibility_m or math.inf
    is_clear, has_banks = math.isinf(visibility), bool(scenario.fog.banks)
    if doing.density is not None and is_clear and not has_banks:
        return "this multiplies the scenario's fog, and the scenario has none; write visibility_m, or add fog"
    if doing.visibility_m is not None and is_clear and has_banks:
        return "outside the banks the air is clear; write density, which is that of the banks"
    return None


def named_vehicles(timeline: Sequence[TimelineEntry]) -> Iterator[tuple[KeyPath, str]]:
    """Vehicles that a timeline names, and where; the ego aside, and those that it brings itself."""
    others = departing_vehicles(timeline) | {EGO}
    for number, entry in enumerate(timeline):
        for vehicle in vehicles_of(entry):
            if vehicle not in others:
                yield ("timeline", number, "do", vehicle), vehicle
        for vehicle in vehicles_in(entry.when):
            if vehicle not in others:
                yield ("timeline", number, "when"), vehicle
