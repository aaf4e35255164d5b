"""What SUMO cannot play of a scenario: its traffic step, and vehicles, roads and banks missing from its files."""

import itertools
import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path

from fogsim.conditions import EGO, Limits, lights_of
from fogsim.errors import nearest, shown, suggest
from fogsim.scenario.document import Document
from fogsim.scenario.expect.checks import last_time, named_vehicles
from fogsim.scenario.plain_yaml import KeyPath, dotted
from fogsim.scenario.roads.files import TrafficFiles
from fogsim.scenario.schema import Clocks, ScenarioFile
from fogsim.scenario.timeline import SIGNAL_STATES, SignalActions, departing_vehicles, operations, pointless_triggers
from fogsim.scenario.timeline import named_vehicles as scripted_vehicles
from fogsim.scenario.timeline.vehicle_actions import VehicleActions
from fogsim.scenario.traffic_schema import ChangeLane
from fogsim.traffic import (
    ANY_EGO,
    Demand,
    NetEdges,
    VehicleRoute,
    configured_files,
    read_configured_demand,
    read_demand,
    read_net_edges,
)
from fogsim.traffic.sumo.loaded_files import CLOCK_TICK
from fogsim.traffic.sumo.options import option_mistakes

_ROUNDING = 1e-6  # of a tick: possible rounding of a number in decimals
_LONGER, _ASIDE = 1.05, 50.0  # by which SUMO may measure a route longer than its middle lanes are [-], [m]


def step_mistake(clocks: Clocks) -> str | None:
    """Why SUMO cannot make a traffic step, which it rounds to whole ms, and the nearest possible; None if it can."""
    step, camera = clocks.traffic_step_s / CLOCK_TICK, clocks.camera_period_s / CLOCK_TICK
    if step > 0.5 and _is_whole(step):
        return None
    ticks = [math.floor(step), math.ceil(step)]
    if _is_whole(camera):
        fitting = [tick for tick in range(1, math.isqrt(round(camera)) + 1) if round(camera) % tick == 0]
        fitting += [round(camera) // tick for tick in fitting]
        ticks = [max((t for t in fitting if t < step), default=0), min(t for t in fitting if t > step)]
    nearest = " or ".join(f"{tick * CLOCK_TICK:g}" for tick in ticks if tick)
    return (
        f"SUMO counts time in whole milliseconds, and camera_period_s, {clocks.camera_period_s:g} s, must be a whole "
        f"multiple of this; nearest: {nearest} s; got {clocks.traffic_step_s!r}"
    )


def _is_whole(ticks: float) -> bool:
    return abs(ticks - round(ticks)) < _ROUNDING


def option_lines(document: Document, scenario: ScenarioFile, *, own_simulation: bool) -> list[str]:
    """One line for each SUMO option of a scenario that it does not accept."""
    options = scenario.traffic.sumo_options
    if own_simulation:
        mistakes = option_mistakes(options)
    else:
        mistakes = dict.fromkeys(options, "the simulation runs already; give the option to SUMO when it is started")
    at = ("traffic", "sumo_options")
    return [f"{document.where((*at, name))}: {dotted((*at, name))}: {text}" for name, text in mistakes.items()]


def trigger_mistakes(document: Document, scenario: ScenarioFile) -> list[str]:
    """One line for each trigger that can never fire, whatever the network is."""
    found = pointless_triggers(document, scenario, {"time": (0.0, last_time(scenario))})
    return [f"{document.where(at)}: {dotted(at)}: {text}" for at, text in found]


_MOST_SHOWN = 10
"""Maximum number of names in a message."""


def demand_mistakes(document: Document, scenario: ScenarioFile, made: TrafficFiles, end: float) -> list[str]:
    """One line for each vehicle, edge or lane that a scenario names and its route files or network lack.

    `made` are the scenario's files, and `end` is the time by which conditions must have been decided [s].

    Nothing is reported where vehicles may come from elsewhere, routes are not written out, or files are very large.
    """
    named = dict(_named_vehicles(scenario))
    others = departing_vehicles(scenario.timeline) | {EGO}
    watched = [(at, vehicle) for at, vehicle in named_vehicles(scenario.expect) if vehicle not in others]
    watched += scripted_vehicles(scenario.timeline)
    demand = _demand(scenario, made, frozenset((*named.values(), *(vehicle for _, vehicle in watched))))
    asked = (*named.items(), *watched)
    mistakes = {at: _unknown_vehicle(vehicle, demand) for at, vehicle in asked if demand.lacks(vehicle)}
    on_foot = "{} is a person, and only a vehicle can be named here"
    mistakes |= {at: on_foot.format(shown(vehicle)) for at, vehicle in named.items() if vehicle in demand.persons}
    edges = _edges(scenario, made, demand)
    if edges is not None:
        places = {vehicle: at for at, vehicle in reversed(named.items())}
        unfit = {places[v]: _unfit_way(v, demand.routes[v], edges) for v in named.values() if v in demand.routes}
        mistakes |= {at: text for at, text in unfit.items() if text}
        mistakes |= _wide_changes(scenario, demand, edges)
        mistakes |= _unknown_signals(scenario, edges) or _unfit_signals(scenario, edges)
        way = _way(scenario, demand)
        mistakes |= _unknown_edges(_edges_on_the_way(scenario), edges)
        mistakes |= _unknown_way(scenario, edges) or _places_aside(scenario, way, edges)
        mistakes |= _pointless(document, scenario, _limits(end, way, edges))
    return [f"{document.where(at)}: {dotted(at)}: {text}" for at, text in mistakes.items()]


def _named_vehicles(scenario: ScenarioFile) -> Iterator[tuple[KeyPath, str]]:
    traffic = scenario.traffic
    if traffic.has_ego and traffic.ego != ANY_EGO:
        yield ("traffic", "ego"), traffic.ego
    yield from ((("traffic", "equipped_vehicles", i), one) for i, one in enumerate(traffic.equipped_vehicles))
    yield from ((("traffic", "keep_lane", i), vehicle) for i, vehicle in enumerate(traffic.keep_lane))
    yield from ((("traffic", "events", i, "vehicle"), event.vehicle) for i, event in enumerate(traffic.events))


def _demand(scenario: ScenarioFile, made: TrafficFiles, wanted: frozenset[str]) -> Demand:
    traffic, folder = scenario.traffic, scenario.directory
    if traffic.config is not None:
        return read_configured_demand(folder / traffic.config, wanted)
    return read_demand((*made.additional, *made.routes), wanted)


def _edges(scenario: ScenarioFile, made: TrafficFiles, demand: Demand) -> NetEdges | None:
    """Edges of the network, if a check needs them."""
    traffic, folder = scenario.traffic, scenario.directory
    changes = any(isinstance(event, ChangeLane) for event in traffic.events)
    if not (demand.routes or changes or traffic.along or scenario.timeline or scenario.expect or scenario.end_when):
        return None
    net = configured_files(folder / traffic.config)[0] if traffic.config else made.net or Path()
    return read_net_edges(net, _way(scenario, demand), must_follow=bool(traffic.along))


def _way(scenario: ScenarioFile, demand: Demand) -> tuple[str, ...]:
    """Edges along which positions count; empty if unknown."""
    way = demand.routes.get(scenario.traffic.ego)
    return scenario.traffic.along if way is None else tuple(way.edges)


def _unknown_edges(named: Iterable[tuple[KeyPath, str]], edges: NetEdges) -> dict[KeyPath, str]:
    """Edges that the network does not have."""
    return {
        at: f"the net has no edge {shown(edge)}; {_suggested(edge, edges.lanes)}"
        for at, edge in named
        if edge not in edges.lanes
    }


def _edges_on_the_way(scenario: ScenarioFile) -> Iterator[tuple[KeyPath, str]]:
    """Edges that vehicles are to take by the timeline."""
    for number, entry in enumerate(scenario.timeline):
        for subject, doing in operations(entry):
            for edge in (isinstance(doing, VehicleActions) and doing.take_route) or ():
                yield ("timeline", number, "do", subject, "take_route"), edge


def _unknown_way(scenario: ScenarioFile, edges: NetEdges) -> dict[KeyPath, str]:
    """Edges of ``traffic.along`` that the network does not have, or that do not follow the one before."""
    along = scenario.traffic.along
    return _unknown_edges(((("traffic", "along", i), edge) for i, edge in enumerate(along)), edges) or {
        ("traffic", "along", i): f"the net has no lane that leads from edge {shown(one)} to edge {shown(other)}"
        for i, (one, other) in enumerate(itertools.pairwise(along), 1)
        if (one, other) in edges.gaps
    }


def _unknown_signals(scenario: ScenarioFile, edges: NetEdges) -> dict[KeyPath, str]:
    """Traffic lights that the timeline or conditions name, and the net does not have."""
    known = edges.signals
    return {
        at: f"the net has no traffic lights {shown(signal)}; {_suggested(signal, known) if known else 'it has none'}"
        for at, signal in _named_signals(scenario)
        if signal not in known
    }


def _unfit_signals(scenario: ScenarioFile, edges: NetEdges) -> dict[KeyPath, str]:
    """Phases that no program of the timeline's traffic lights has, and states with too few or too many letters."""
    mistakes: dict[KeyPath, str] = {}
    # Additional files may bring programs with more phases.
    is_all = not scenario.traffic.additional and scenario.traffic.config is None
    for number, entry in enumerate(scenario.timeline):
        for subject, doing in operations(entry):
            if not isinstance(doing, SignalActions):
                continue
            phases, links = edges.signals[subject.removeprefix("signal.")]
            at = "timeline", number, "do", subject
            if is_all and phases and doing.phase is not None and doing.phase >= phases:
                mistakes[*at, "phase"] = f"their program has phases 0 to {phases - 1}; got {doing.phase}"
            state = doing.state or ""
            if links and state not in SIGNAL_STATES and len(state) not in (0, 1, links):
                mistakes[*at, "state"] = f"they have {links} links: give one letter, or {links}; got {shown(state)}"
    return mistakes


def _named_signals(scenario: ScenarioFile) -> Iterator[tuple[KeyPath, str]]:
    prefix = "signal."
    for number, entry in enumerate(scenario.timeline):
        for subject in entry.do:
            if subject.startswith(prefix):
                yield ("timeline", number, "do", subject), subject.removeprefix(prefix)
        yield from ((("timeline", number, "when"), light) for light in lights_of(entry.when))
    for name, expectation in scenario.expect.items():
        for key, condition in expectation.conditions():
            yield from ((("expect", name, key), light) for light in lights_of(condition))


def _unknown_vehicle(vehicle: str, demand: Demand) -> str:
    files = ", ".join(file.name for file in demand.files[:_MOST_SHOWN])
    if not files:
        return f"there is no vehicle {shown(vehicle)}: no route file is named"
    return f"there is no vehicle {shown(vehicle)} in {files}; {_suggested(vehicle, demand.names)}"


def _unfit_way(vehicle: str, way: VehicleRoute, edges: NetEdges) -> str | None:
    who = f"the vehicle {shown(vehicle)} of {way.file.name}"
    unknown = [edge for edge in way.edges if edge not in edges.lanes and not edge.startswith(":")]
    if unknown:
        edge = unknown[0]
        return f"{who} drives on edge {shown(edge)}, which the net does not have; {_suggested(edge, edges.lanes)}"
    there = edges.lanes.get(way.edges[0])
    if there is not None and way.depart_lane is not None and way.depart_lane >= there:
        return (
            f"{who} departs on lane {way.depart_lane} of edge {shown(way.edges[0])}, which has lanes 0 to {there - 1}"
        )
    return None


def _wide_changes(scenario: ScenarioFile, demand: Demand, edges: NetEdges) -> dict[KeyPath, str]:
    """Changes over more lanes than any road on the vehicle's route has."""
    mistakes: dict[KeyPath, str] = {}
    for i, event in enumerate(scenario.traffic.events):
        way = demand.routes.get(event.vehicle)
        on = [edge for edge in (way.edges if way else edges.lanes) if edge in edges.lanes]
        widest = max((edges.lanes[edge] for edge in on), default=None)
        if isinstance(event, ChangeLane) and widest is not None and abs(event.lanes) >= widest:
            where = f"on the way of {shown(event.vehicle)}" if way else "of the net"
            mistakes["traffic", "events", i, "lanes"] = (
                f"the widest road {where} has lanes 0 to {widest - 1}; got {event.lanes}"
            )
    return mistakes


def _limits(end: float, way: tuple[str, ...], edges: NetEdges) -> Limits:
    """Ranges of time, lanes and positions in a run."""
    limits = {"time": (0.0, end), "X.lane": (0.0, max(edges.lanes.values()) - 1.0)}
    if way and all(edges.axes.get(edge) for edge in way):
        length = edges.route_length(way)
        limits["X.position"] = (-_ASIDE, _LONGER * length + _ASIDE)
    return limits


def _pointless(document: Document, scenario: ScenarioFile, limits: Limits) -> dict[KeyPath, str]:
    """Conditions that can never be true, or never matter, on this network."""
    mistakes: dict[KeyPath, str] = {}
    for name, expectation in scenario.expect.items():
        mistakes |= {("expect", name, key): text for key, text in expectation.pointless(limits, scenario.traffic.ego)}
    return mistakes | dict(pointless_triggers(document, scenario, limits))


def _places_aside(scenario: ScenarioFile, way: tuple[str, ...], edges: NetEdges) -> Mapping[KeyPath, str]:
    """Positions before the start or beyond the end of the ego's route."""
    if not way or not all(edges.axes.get(edge) for edge in way):
        return {}
    length, drivers = edges.route_length(way), scenario.drivers
    stretch, signs = drivers.advised_stretch, drivers.signs
    mistakes = {} if scenario.fog.wind is not None else _banks_aside(scenario, length)
    if stretch.start_m >= length:
        mistakes["drivers", "advised_stretch", "start_m"] = (
            f"the stretch begins beyond the ego's route, which is {length:.0f} m long; got {stretch.start_m:g}"
        )
    first = min(signs.at_m, default=signs.from_m)
    if drivers.advised == "signs" and first >= length:
        mistakes["drivers", "signs", "at_m" if signs.at_m else "from_m"] = (
            f"the first sign stands beyond the ego's route, which is {length:.0f} m long; got {first:g}"
        )
    return mistakes


def _banks_aside(scenario: ScenarioFile, length: float) -> dict[KeyPath, str]:
    """Banks entirely before the start or beyond the end of the ego's route; no wind brings them in."""
    mistakes: dict[KeyPath, str] = {}
    for i, bank in enumerate(scenario.fog.banks):
        if bank.start_m - bank.edge_m > length:
            mistakes["fog", "banks", i, "start_m"] = (
                f"the bank lies beyond the ego's route, which is {length:.0f} m long; got {bank.start_m:g}"
            )
        elif bank.end_m + bank.edge_m < 0.0:
            mistakes["fog", "banks", i, "end_m"] = (
                f"the bank lies before the ego's route, from 0 m on; got {bank.end_m:g}"
            )
    return mistakes


def _suggested(name: str, known: Collection[str]) -> str:
    """The nearest of many names, and some others."""
    near = nearest(name, known)
    some = [*([near] if near else []), *(one for one in known if one != near)][:_MOST_SHOWN]
    return suggest(name, some) + (f", … ({len(known)} in all)" if len(known) > len(some) else "")
