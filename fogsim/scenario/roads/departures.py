"""Vehicles of free types and ways that a timeline brings onto the road: where each begins."""

from fogsim.errors import suggest
from fogsim.scenario.roads.files import no_edge, road_layout, traffic_files
from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.timeline import Entries, operations
from fogsim.scenario.timeline.vehicle_actions import DepartAction, VehicleActions
from fogsim.traffic.road.configuration import configured_files
from fogsim.traffic.templates import Actor, Placed, PlacementError, check_placement, read_ways
from fogsim.traffic.templates.placement import Ways, edge_at
from fogsim.units import KMH_PER_MPS
from fogsim.values.script import Enter

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
            raise PlacementError(vehicle, no_edge(edge, net))
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
