"""From highway-env's vehicles to a snapshot: its positions are centres, its y axis and headings point down."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from highway_env.vehicle.objects import Landmark
from numpy.typing import NDArray

from fogsim.traffic.highway.fleet import Fleet, acceleration, ahead
from fogsim.traffic.highway.network import lane_id, speed_limit, upright
from fogsim.traffic.highway.route import RouteProgress
from fogsim.values import Collision, Leader, TrafficSnapshot, TrafficState
from fogsim.values.traffic import advised_speeds

_HEIGHT = 1.5
"""Height of every vehicle [m], taken from SUMO's passenger cars; highway-env's have none."""

_LEADER_REACH = 300.0
"""How far ahead a leader is looked for [m]."""


def front_bumper(vehicle: Any) -> NDArray[np.float64]:
    """Middle of the front bumper on the road [m], (3,): east, north, up."""
    return upright(vehicle.position + 0.5 * vehicle.LENGTH * vehicle.direction)


def rear_bumper(vehicle: Any) -> NDArray[np.float64]:
    """Middle of the rear bumper on the road [m], (3,): east, north, up."""
    return upright(vehicle.position - 0.5 * vehicle.LENGTH * vehicle.direction)


def read_snapshot(
    fleet: Fleet,
    progress: RouteProgress,
    collisions: tuple[Collision, ...],
    reach: float,
    heard: Mapping[str, float] | None = None,
) -> TrafficSnapshot | None:
    """Snapshot of the traffic.

    Parameters
    ----------
    fleet : Fleet
        The vehicles.
    progress : RouteProgress
        Follows the ego along its route from one snapshot to the next.
    collisions : tuple of Collision
        What has happened.
    reach : float
        Vehicles farther from the ego than this are left out [m].
    heard : mapping from vehicle id to float or None
        What drivers have heard advised [m/s]; None if no one has heard anything.

    Returns
    -------
    TrafficSnapshot or None
        None if the ego is not on the road.
    """
    ego, vehicles = fleet.ego, fleet.environment.road.vehicles
    if ego not in vehicles:
        return None
    near = [v for v in vehicles if math.dist(v.position, ego.position) <= reach]
    return TrafficSnapshot(
        state=_state(fleet, near, heard or {}),
        ego=near.index(ego),
        route_position=progress.update(front_bumper(ego), ego.speed < 0.0),
        route_length=progress.length,
        speed_limit=speed_limit(ego.lane),
        leader=_leader(fleet),
        collisions=collisions,
    )


def _state(fleet: Fleet, vehicles: list[Any], heard: Mapping[str, float]) -> TrafficState:
    ids = tuple(fleet.name(v) for v in vehicles)
    return TrafficState(
        time=fleet.time,
        ids=ids,
        types=("car",) * len(vehicles),
        position=np.array([front_bumper(v) for v in vehicles]),
        heading=np.array([math.remainder(-v.heading, math.tau) for v in vehicles]),
        speed=np.array([v.speed for v in vehicles], dtype=np.float64),
        acceleration=np.array([acceleration(v) for v in vehicles]),
        length=np.array([v.LENGTH for v in vehicles], dtype=np.float64),
        width=np.array([v.WIDTH for v in vehicles], dtype=np.float64),
        height=np.full(len(vehicles), _HEIGHT),
        lane=tuple(lane_id(v.lane_index) for v in vehicles),
        lamps=np.array([int(fleet.lamps(v)) for v in vehicles], dtype=np.int32),
        paint=np.array([fleet.paint(v) for v in vehicles]),
        advised_speed=advised_speeds(ids, heard),
    )


def _leader(fleet: Fleet) -> Leader | None:
    """What is ahead of the ego in its lane, seen or not."""
    ego = fleet.ego
    front = ahead(fleet.environment.road, ego)
    if front is None or isinstance(front, Landmark):
        return None
    gap = float(ego.lane_distance_to(front)) - 0.5 * (ego.LENGTH + front.LENGTH)
    return Leader(fleet.name(front), gap, float(front.speed)) if gap <= _LEADER_REACH else None
