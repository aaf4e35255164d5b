"""Vehicles that a script brings onto the road."""

from collections.abc import Collection

from fogsim.traffic.sumo.link import Api
from fogsim.values.script import Depart


def depart(api: Api, action: Depart, present: Collection[str]) -> bool:
    """Bring a vehicle onto the road with the next step; SUMO waits with it as long as it would hit somebody.

    Parameters
    ----------
    api : Api
        The simulation.
    action : Depart
        Which, and where.
    present : collection of str
        Vehicles on the road.

    Returns
    -------
    bool
        False if there is such a vehicle already, the other one is not there, or the place is off its way.
    """
    get, like = api.vehicle, action.like
    if action.vehicle in present or like not in present:
        return False
    length = float(get.getLength(like))
    # Of the same type, it is as long.
    place = float(get.getLanePosition(like)) + action.gap + (length if action.gap >= 0.0 else -length)
    edges, at = list(get.getRoute(like)), int(get.getRouteIndex(like))
    if str(get.getRoadID(like)).startswith(":"):
        place += _length(api, edges[at])
    while place < 0.0 and at > 0:
        at -= 1
        place += _length(api, edges[at])
    while at < len(edges) - 1 and place > _length(api, edges[at]):
        place -= _length(api, edges[at])
        at += 1
    lane = int(get.getLaneIndex(like)) if action.lane is None else action.lane + _footways(api, edges[at])
    if not 0.0 <= place <= _length(api, edges[at]) or lane >= int(api.edge.getLaneNumber(edges[at])):
        return False
    route = f"fogsim.{action.vehicle}.{api.simulation.getTime():g}"
    api.route.add(route, edges[at:])
    speed = float(get.getSpeed(like)) if action.speed is None else action.speed
    get.add(
        action.vehicle,
        route,
        typeID=get.getTypeID(like),
        departLane=str(lane),
        departPos=f"{place:.3f}",
        departSpeed=f"{speed:.3f}",
    )
    return True


def _footways(api: Api, edge: str) -> int:
    """Number of footways to the right of an edge's lanes, which SUMO counts among them."""
    lanes = range(int(api.edge.getLaneNumber(edge)))
    return sum(tuple(api.lane.getAllowed(f"{edge}_{lane}")) == ("pedestrian",) for lane in lanes)


def _length(api: Api, edge: str) -> float:
    return float(api.lane.getLength(f"{edge}_0"))
