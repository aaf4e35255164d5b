"""SUMO's files of a scenario: those that it names, and those that FogSim writes of its road, demand and actors.

What is written lies in the user's cache directory, in a folder named after its content, so that the same scenario has
the same files, and one that is changed has others.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from fogsim.core.files.user_cache import write_generated
from fogsim.errors import InputError, nearest_of, suggest
from fogsim.scenario.roads.schema import NO_MEASURES, ActorSection, DemandSection, ObstructionSection, Road, measure_of
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.timeline import Entries, operations
from fogsim.scenario.timeline.vehicle_actions import DepartAction, VehicleActions
from fogsim.traffic.road.configuration import configured_files
from fogsim.traffic.road.network import read_net_edges
from fogsim.traffic.templates import (
    ROAD_TEMPLATES,
    WALKING_SPEED,
    Actor,
    Demand,
    Footfall,
    Layout,
    Obstruction,
    Placed,
    PlacementError,
    Relation,
    RoadTemplate,
    Walker,
    actors_text,
    additional_text,
    check_placement,
    cuts_around,
    net_text,
    place_actors,
    read_ways,
    routes_text,
    usual_mix,
)
from fogsim.traffic.templates.placement import Ways, edge_at
from fogsim.units import KMH_PER_MPS
from fogsim.values.script import Enter

_NET, _ROUTES, _BESIDE = "road.net.xml", "road.rou.xml", "road.add.xml"
_SECONDS_PER_HOUR = 3600.0
_MOST_NAMED = 10
"""Edges that a message names."""
AnyScenario = TypeVar("AnyScenario", bound=ScenarioFile)


@dataclass(frozen=True, slots=True)
class TrafficFiles:
    """SUMO's files of a scenario."""

    net: Path | None  # Its network; None where a configuration names it
    # routes, additional: its route and additional files, but those that a configuration names
    routes: tuple[Path, ...]
    additional: tuple[Path, ...]


def traffic_files(scenario: ScenarioFile) -> TrafficFiles:
    """Files of a scenario; those of a road by template are written where they are not there yet."""
    traffic, folder = scenario.traffic, scenario.directory
    net = None if traffic.net is None else folder / traffic.net
    routes = tuple(folder / path for path in traffic.routes)
    additional = tuple(folder / path for path in traffic.additional)
    if scenario.road is None:
        own = (
            ()
            if net is None or not scenario.actors
            else (write_generated("roads", {_ROUTES: _actors_on(net, scenario)}) / _ROUTES,)
        )
        return TrafficFiles(net, (*own, *routes), additional)
    layout, placed = road_layout(scenario)
    _check_ways(layout, scenario.demand or DemandSection())
    demand = _demand(scenario.demand or DemandSection(), usual_mix(scenario.road.template))
    walkers = [_walker(name, section) for name, section in scenario.actors.items() if section.is_person]
    footfall = _footfall(scenario, layout)
    texts = {_NET: net_text(layout.net), _ROUTES: routes_text(layout, demand, placed, walkers, footfall)}
    obstructions = [_obstruction(one) for one in scenario.road.obstructions]
    beside = additional_text(layout, obstructions, scenario.road.sign_spacing_m)
    made = write_generated("roads", {**texts, **({_BESIDE: beside} if beside else {})})
    return TrafficFiles(made / _NET, (made / _ROUTES, *routes), (*([made / _BESIDE] if beside else []), *additional))


def road_layout(scenario: ScenarioFile) -> tuple[Layout, tuple[Placed, ...]]:
    """Road of a scenario and where its actors are."""
    if scenario.road is None:
        raise ValueError("expected a scenario with a road by template, got one without")
    template = _template(scenario.road)
    sections = {name: actor for name, actor in actors_of(scenario).items() if not actor.is_person}
    placed = place_actors([_actor(name, sections) for name in sections])
    on_the_way = [one for one in placed if one.actor.way == "same_way"]
    layout = template.layout(cuts_around(on_the_way, template.free_length))
    check_placement(placed, layout)
    return layout, placed


def with_way(scenario: AnyScenario) -> AnyScenario:
    """A scenario of traffic alone on a road by template, with the whole way as that along which places count."""
    traffic = scenario.traffic
    if scenario.road is None or traffic.has_ego or traffic.along:
        return scenario
    layout, _ = road_layout(scenario)
    return scenario.model_copy(update={"traffic": traffic.model_copy(update={"along": tuple(layout.way("same_way"))})})


def _actors_on(net: Path, scenario: ScenarioFile) -> str:
    """Text of a route file with the actors of a scenario that has a network of its own."""
    sections = scenario.actors
    for name, section in sections.items():
        if section.is_person:
            raise PlacementError(name, "a person walks on a road by template; write those of a network into its routes")
    edges = {name: _declared(name, sections).edges for name in sections}
    for name, way in edges.items():
        if not way:
            raise PlacementError(
                name, "needs edges, its way on the network, or an actor that it is placed by and follows"
            )
    placed = place_actors([replace(_actor(name, sections), way=" ".join(way)) for name, way in edges.items()])
    ways = read_ways(net, {" ".join(way): way for way in edges.values()})
    for name, way in edges.items():
        for edge in way:
            if edge not in ways.edges:
                raise PlacementError(name, _no_edge(edge, net))
    check_placement(placed, ways)
    return actors_text(ways, placed)


def _no_edge(edge: str, net: Path) -> str:
    """Say that a network has no such edge, and which it has."""
    known = read_net_edges(net, ())
    if known is None:
        return f"the net has no edge {edge!r}"
    more = f", … ({len(known.lanes)} in all)" if len(known.lanes) > _MOST_NAMED else ""
    return f"the net has no edge {edge!r}; {suggest(edge, nearest_of(edge, known.lanes, _MOST_NAMED))}{more}"


def _declared(name: str, sections: Mapping[str, ActorSection]) -> ActorSection:
    """The actor that says which way an actor takes."""
    return _first(name, sections, lambda section: bool(section.edges or section.on))


def _first(name: str, sections: Mapping[str, ActorSection], says_so: Callable[[ActorSection], bool]) -> ActorSection:
    """The first that says something: an actor itself, the one that it is placed by, and so on; else the last."""
    asked, section = {name}, sections[name]
    while not says_so(section):
        other = section.placed_by
        if other is None or other not in sections or other in asked:
            break
        asked.add(other)
        section = sections[other]
    return section


class DemandError(InputError):
    """Traffic on a way that a road does not have."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(f"demand.{key}: {message}")
        self.key = key
        self.message = message


def _check_ways(layout: Layout, section: DemandSection) -> None:
    for key in section.model_fields_set:
        way = key.removesuffix("_vph")
        if key != way and getattr(section, key) and not layout.way(way):
            raise DemandError(key, f"the road has no way {way!r}; {suggest(way, dict(layout.ways))}")


def actors_of(scenario: ScenarioFile) -> dict[str, ActorSection]:
    """Actors of a scenario by their ids; on a road by template the ego is one of them, also where it is not written."""
    if scenario.road is None or not scenario.traffic.has_ego:
        return dict(scenario.actors)
    return {scenario.traffic.ego: ActorSection(), **scenario.actors}


def _walker(name: str, section: ActorSection) -> Walker:
    return Walker(
        name,
        section.on or "same_way",
        section.side == "left",
        200.0 if section.position_m is None else section.position_m,
        WALKING_SPEED if section.speed_kmh is None else section.speed_kmh / 3.6,
        section.depart_s or 0.0,
        section.crosses_at_m,
        section.waits,
    )


def _footfall(scenario: ScenarioFile, layout: Layout) -> Footfall:
    persons, traffic = (scenario.demand or DemandSection()).persons, scenario.traffic
    for key, lacks in (("along_pph", not layout.net.edges[0].footway), ("across_pph", not layout.net.zebras)):
        if lacks and getattr(persons, key):
            needed = "road.footways: true" if key == "along_pph" else "road.footways: true and road.zebra_crossings"
            raise DemandError(f"persons.{key}", f"the road has nothing for persons there; give {needed}")
    until = scenario.duration_s + (traffic.warm_up_limit_s if traffic.has_ego else traffic.warm_up_s)
    return Footfall(persons.along_pph / _SECONDS_PER_HOUR, persons.across_pph / _SECONDS_PER_HOUR, until)


def _template(road: Road) -> RoadTemplate:
    given = {key: getattr(road, key) for key in road.model_fields_set - NO_MEASURES}
    named = {measure_of(key): value for key, value in given.items() if value is not None}
    return ROAD_TEMPLATES[road.template](
        **{name: value * worth if worth != 1.0 else value for (name, worth), value in named.items()}
    )


def _actor(name: str, sections: Mapping[str, ActorSection]) -> Actor:
    section = sections[name]
    lanes = {"right": 0, "left": -1}
    return Actor(
        name,
        section.type,
        _declared(name, sections).on or "same_way",
        lanes[section.lane] if isinstance(section.lane, str) else section.lane,
        _place(section),
        None if section.speed_kmh is None else section.speed_kmh / 3.6,
        _first(name, sections, lambda one: one.depart_s is not None).depart_s or 0.0,
        section.stands,
    )


def _obstruction(section: ObstructionSection) -> Obstruction:
    width, height, length = section.sizes()
    at = (section.along, section.at_m, length, section.side == "left", section.distance_m)
    return Obstruction(section.kind, *at, width, height)


def _place(section: ActorSection) -> float | Relation:
    gap = section.gap_m or 0.0
    if section.ahead_of is not None:
        return Relation(section.ahead_of, gap)
    if section.behind is not None:
        return Relation(section.behind, -gap)
    if section.beside is not None:
        return Relation(section.beside, 0.0, is_beside=True)
    return 200.0 if section.position_m is None else section.position_m


def _demand(section: DemandSection, mix: tuple[tuple[str, float], ...]) -> Demand:
    flows = {
        key.removesuffix("_vph"): getattr(section, key) / _SECONDS_PER_HOUR
        for key in type(section).model_fields
        if key.endswith("_vph")
    }
    return Demand(tuple(flows.items()), mix if section.mix is None else tuple(section.mix.items()), section.turning)


_NUMBERS = {"right": 0, "left": -1}


def entering_vehicles(scenario: ScenarioFile) -> Entries:
    """Vehicles that a timeline brings onto the road with a way of their own."""
    doings = [pair for entry in scenario.timeline for pair in operations(entry)]
    wanted = {
        (vehicle, doing.depart): None
        for vehicle, doing in doings
        if isinstance(doing, VehicleActions) and doing.depart and doing.depart.like is None
    }
    if not wanted:
        return {}
    if scenario.road is not None:
        layout, _ = road_layout(scenario)
        return {key: _on_template(*key, layout) for key in wanted}
    return {key: _on_net(*key, scenario) for key in wanted}


def _on_template(vehicle: str, action: DepartAction, layout: Ways) -> Enter:
    if action.edges:
        raise PlacementError(vehicle, f"edges go with a network; on a road by template write on: {_names(layout)}")
    return _entry(vehicle, action, layout, action.on or "same_way")


def _on_net(vehicle: str, action: DepartAction, scenario: ScenarioFile) -> Enter:
    if action.on is not None or not action.edges:
        raise PlacementError(vehicle, "on goes with a road by template; on a network write edges, its way")
    traffic, folder = scenario.traffic, scenario.directory
    net = configured_files(folder / traffic.config)[0] if traffic.config else traffic_files(scenario).net
    if net is None:
        raise PlacementError(vehicle, "the network is not known")
    first = action.edges[0]
    ways = read_ways(net, {first: action.edges})
    for edge in action.edges:
        if edge not in ways.edges:
            raise PlacementError(vehicle, _no_edge(edge, net))
    length = ways.edges[first].length
    if (action.position_m or 0.0) > length:
        raise PlacementError(vehicle, f"position_m counts along {first!r}, which is {length:.0f} m long")
    return _entry(vehicle, action, ways, first)


def _entry(vehicle: str, action: DepartAction, ways: Ways, way: str) -> Enter:
    speed = None if action.speed_kmh is None else action.speed_kmh / KMH_PER_MPS
    lane = _NUMBERS.get(str(action.lane), 0 if action.lane is None else action.lane)
    actor = Actor(vehicle, action.type or "car", way, int(lane), 0.0, speed)
    position = actor.length if action.position_m is None else action.position_m
    placed = Placed(actor, position)
    if way not in dict(ways.ways):
        raise PlacementError(vehicle, f"the road has no way {way!r}; {suggest(way, dict(ways.ways))}")
    check_placement([placed], ways)
    names = ways.way(way)
    name, place = edge_at(ways, way, position)
    edge = ways.edge(name)
    index = edge.index(actor.lane % edge.lanes)
    return Enter(vehicle, actor.kind, tuple(names[names.index(name) :]), place, index, speed)


def _names(ways: Ways) -> str:
    return ", ".join(name for name, _ in ways.ways)
