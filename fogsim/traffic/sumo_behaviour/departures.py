"""Vehicles that a script brings onto the road."""

import itertools
from collections.abc import Collection, Sequence

from fogsim.traffic.sumo.link import Api, edge_length, is_off_lanes, shared_type
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.traffic.sumo_lanes.route_position import RoutePlaces
from fogsim.traffic.templates.placement import VEHICLE_KINDS
from fogsim.values.script import Depart, Enter

_UNLIMITED = 10.0
"""Factor on the limit [-] of those whose top speed is the one that they keep."""


def depart(api: Api, action: Depart, present: Collection[str]) -> bool:
    """Bring a vehicle onto the road near another; False if it is there already, or there is no place."""
    get, like = api.vehicle, action.like
    if action.vehicle in get.getLoadedIDList() or like not in present or is_off_lanes(api, like):
        return False
    kind = _type(api, action.vehicle, action.kind) if action.kind else shared_type(api, like)
    length = float(get.getLength(like)) if action.gap < 0.0 else -float(api.vehicletype.getLength(kind))
    here = RoutePlaces(api).find(like)
    place = here.station + here.past_end + action.gap - length
    edges, at = list(get.getRoute(like)), here.number
    while place < 0.0 and at > 0:
        at -= 1
        place += edge_length(api, edges[at])
    while at < len(edges) - 1 and place > edge_length(api, edges[at]):
        place -= edge_length(api, edges[at])
        at += 1
    # Next to one that overtakes on the oncoming lane is the lane farthest to the left.
    leftmost = int(api.edge.getLaneNumber(edges[at])) - 1
    own = leftmost if LaneDirections(api).is_against(like, get.getLaneID(like)) else int(get.getLaneIndex(like))
    lane = own if action.lane is None else action.lane + _footways(api, edges[at])
    if not 0.0 <= place <= edge_length(api, edges[at]) or lane > leftmost:
        return False
    route = f"fogsim.{action.vehicle}.{api.simulation.getTime():g}"
    api.route.add(route, edges[at:])
    speed = float(get.getSpeed(like)) if action.speed is None else action.speed
    get.add(
        action.vehicle,
        route,
        typeID=kind,
        departLane=str(lane),
        departPos=f"{place:.3f}",
        departSpeed=f"{speed:.3f}",
    )
    return True


def _footways(api: Api, edge: str) -> int:
    """Number of footways to the right of an edge's lanes, which SUMO counts among them."""
    lanes = range(int(api.edge.getLaneNumber(edge)))
    return sum(tuple(api.lane.getAllowed(f"{edge}_{lane}")) == ("pedestrian",) for lane in lanes)


def enter(api: Api, action: Enter) -> bool:
    """Bring a vehicle onto the road on a way of its own; False if it is there already, or there is no way."""
    if action.vehicle in api.vehicle.getLoadedIDList():
        return False
    kind = _type(api, action.vehicle, action.kind, action.speed)
    way = _whole_way(api, action.edges, kind)
    if not way:
        return False
    route = f"fogsim.{action.vehicle}.{api.simulation.getTime():g}"
    api.route.add(route, way)
    api.vehicle.add(
        action.vehicle,
        route,
        typeID=kind,
        departLane=str(action.lane),
        departPos=f"{action.position:.3f}",
        departSpeed="desired" if action.speed is None else f"{action.speed:.3f}",
    )
    return True


def _whole_way(api: Api, edges: Sequence[str], kind: str) -> list[str]:
    """The edges with those between them; none where one cannot be reached."""
    way = list(edges[:1])
    for one, other in itertools.pairwise(edges):
        found = list(api.simulation.findRoute(one, other, kind).edges)
        if not found:
            return []
        way += found[1:]
    return way


def _type(api: Api, vehicle: str, name: str, steady: float | None = None) -> str:
    """SUMO's type of a vehicle of a kind, made for it; who begins with a speed keeps it, as actors do."""
    get, kind, made = api.vehicletype, VEHICLE_KINDS[name], f"fogsim.{name}.{vehicle}"
    if made not in get.getIDList():
        get.copy("DEFAULT_VEHTYPE", made)
    factor, deviation, *_ = (float(part) for part in kind.speed_factor.removeprefix("normc(")[:-1].split(","))
    get.setVehicleClass(made, kind.vehicle_class)
    for setter, value in (
        (get.setLength, kind.length),
        (get.setWidth, kind.width),
        (get.setHeight, kind.height),
        (get.setMaxSpeed, steady or kind.top_speed),
        (get.setSpeedFactor, factor if steady is None else _UNLIMITED),
        (get.setSpeedDeviation, deviation if steady is None else 0.0),
        (get.setTau, kind.headway),
        (get.setAccel, kind.acceleration),
        (get.setDecel, kind.deceleration),
        (get.setImperfection, kind.imperfection if steady is None else 0.0),
    ):
        setter(made, value)
    return made
