"""Names and looks of highway-env's vehicles, which have neither ids nor lamps."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from highway_env.vehicle.objects import Landmark
from numpy.typing import NDArray

from fogsim.traffic.appearance import OTHERS_LAMPS, SUMO_DEFAULT_COLOUR, paint
from fogsim.traffic.highway.network import RouteProgress, lane_id, speed_limit, upright
from fogsim.values import Collision, Command, Lamp, Leader, TrafficSnapshot, TrafficState
from fogsim.values.traffic import advised_speeds

EGO = "ego"
"""Id of the ego."""

LEAD = "lead"
"""Id of the vehicle that is ahead of the ego in its lane when the run begins, if there is one."""

_BRAKING = 0.5
"""Stop lamps are lit from this deceleration [m/s²]."""


class Fleet:
    """Vehicles of one run of an environment, after its reset."""

    def __init__(self, environment: Any, ego: Any) -> None:
        self.environment = environment
        self.ego = ego
        self.ego_lamps = Command().lamps
        self.lamps_of: Mapping[str, Lamp] = {}
        self.dark: frozenset[str] = frozenset()
        # Vehicles are equal only to themselves, so they serve as keys.
        self._names: dict[Any, str] = {ego: EGO}
        lead = ahead(environment.road, ego)
        for vehicle in environment.road.vehicles:
            if vehicle is lead:
                self._names[vehicle] = LEAD
            self.name(vehicle)

    @property
    def time(self) -> float:
        """Simulated time since the reset [s]."""
        return float(self.environment.steps / self.environment.config["simulation_frequency"])

    @property
    def step_length(self) -> float:
        """Length of a simulation step [s]."""
        return float(1.0 / self.environment.config["simulation_frequency"])

    def name(self, vehicle: Any) -> str:
        """Id of a vehicle or obstacle for the whole run: its kind, and its place in the environment's order."""
        return self._names.setdefault(vehicle, f"{type(vehicle).__name__} {len(self._names)}")

    def known(self) -> frozenset[str]:
        """Ids of all vehicles that have been on the road."""
        return frozenset(self._names.values())

    def present(self) -> dict[str, Any]:
        """Vehicles on the road by their ids."""
        return {self.name(vehicle): vehicle for vehicle in self.environment.road.vehicles}

    def paint(self, vehicle: Any) -> tuple[float, float, float]:
        """Linear reflectance of a vehicle's paint, 0 … 1; highway-env's colours mark roles, not paints."""
        return paint(self.name(vehicle), SUMO_DEFAULT_COLOUR)

    def lamps(self, vehicle: Any) -> Lamp:
        """Lit lamps; an obstacle has none, and neither has a vehicle whose lamps have failed."""
        if not hasattr(vehicle, "action") or self.name(vehicle) in self.dark:
            return Lamp.NONE
        steady = self.ego_lamps if vehicle is self.ego else self.lamps_of.get(self.name(vehicle), OTHERS_LAMPS)
        return steady | Lamp.STOP if acceleration(vehicle) < -_BRAKING else steady


def acceleration(vehicle: Any) -> float:
    """Acceleration along the heading [m/s²]."""
    return float(vehicle.action["acceleration"])


def ahead(road: Any, vehicle: Any) -> Any:
    """What is ahead of a vehicle in its lane, seen or not; None if there is nothing."""
    # The class's own way, as the instance's may be that of drivers in fog.
    return type(road).neighbour_vehicles(road, vehicle, vehicle.lane_index)[0]


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
    """Snapshot of the traffic up to a `reach` from the ego [m]; None if the ego is not on the road."""
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
