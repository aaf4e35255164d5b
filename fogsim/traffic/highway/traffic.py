"""highway-env as the traffic of a closed loop."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

from highway_env.envs.common.abstract import AbstractEnv
from highway_env.utils import are_polygons_intersecting
from highway_env.vehicle.behavior import IDMVehicle

from fogsim.core.linear_algebra import matrix_product
from fogsim.errors import InputError, SimulationError, suggest
from fogsim.traffic.drivers.events import Event
from fogsim.traffic.drivers.sight import DriverSight, FogAccess
from fogsim.traffic.drivers.speed_choice import DriverSetup
from fogsim.traffic.highway.behaviour import DriverControl, control_drivers, hold_at_standstill
from fogsim.traffic.highway.fleet import LEAD, Fleet, read_snapshot
from fogsim.traffic.highway.network import (
    RouteProgress,
    lanes_ahead,
    planned_route,
    road_network,
    same_roads,
    speed_limit,
)
from fogsim.traffic.setup import UNTOUCHED, AfterCollision, CollisionLog
from fogsim.values import Collision, Command, RoadNetwork, SignMap, TrafficSnapshot, Unplayed
from fogsim.values.script import TrafficAction


def _find_collisions(fleet: Fleet, period: float) -> Iterator[Collision]:
    """Collisions of the last step by the library's own rule; they are found in later steps again (`period` [s])."""
    for one, other in _hits(fleet.environment.road, period):
        collider, victim = fleet.name(one), fleet.name(other)
        if _approach(one, other) < _approach(other, one):
            collider, victim = victim, collider
        yield Collision(fleet.time, collider, victim, math.dist(one.velocity, other.velocity))


def _hits(road: Any, period: float) -> Iterator[tuple[Any, Any]]:
    solid = [v for v in road.vehicles if v.collidable and v.solid]
    obstacles = [o for o in road.objects if o.collidable and o.solid]
    for one, other in itertools.chain(itertools.combinations(solid, 2), itertools.product(solid, obstacles)):
        reach = 0.5 * (one.diagonal + other.diagonal) + abs(one.speed) * period
        if math.dist(one.position, other.position) > reach or not (one.check_collisions or other.check_collisions):
            continue
        now, soon, _ = are_polygons_intersecting(
            one.polygon(), other.polygon(), one.velocity * period, other.velocity * period
        )
        if now or soon:
            yield one, other


def _approach(one: Any, other: Any) -> float:
    """Component of one's velocity towards the other, times their distance."""
    return float(matrix_product(one.velocity, other.position - one.position))


_IDM = {"DISTANCE_WANTED": (10.0, 7), "COMFORT_ACC_MAX": (3.0, 6), "COMFORT_ACC_MIN": (-5.0, -3)}
"""Constants of highway-env's IDM, and those that its intersections set for every environment of the process."""


class OtherRoadsError(SimulationError):
    """The environment has built other roads than before, or sends the ego another way: all has to be drawn again."""


def is_highway_environment(environment: object) -> bool:
    """Whether something is one of highway-env's environments."""
    return isinstance(environment, AbstractEnv)


class HighwayTraffic:
    """A `Traffic` of one highway-env environment, whose vehicles move by its own models.

    The ego keeps its lane and follows its leader by IDM, as the others do. Of the environment, roads and vehicles are
    used, not its rewards, its endings or what it does once a policy step (intersections let new vehicles in there).
    """

    def __init__(
        self,
        environment: Any,
        sight: DriverSight | None,
        reading_radius: float = 1000.0,
        advice_deceleration: float = 2.0,
        drivers: DriverSetup = UNTOUCHED,
        events: Sequence[Event] = (),
        keep_lane: Sequence[str] = (),
        after_collision: AfterCollision = AfterCollision.STOP,
    ) -> None:
        if not is_highway_environment(environment):
            raise InputError(f"expected an environment of highway-env without wrappers, got {environment!r}")
        self._environment = environment
        self._sight = sight
        self._reading_radius = reading_radius
        self._advice_deceleration = advice_deceleration
        self._drivers = drivers
        self._events = tuple(events)
        self._keep_lane = tuple(keep_lane)
        self._after_collision = after_collision
        self._fog: FogAccess | None = None
        self._fleet: Fleet | None = None
        self._collisions = CollisionLog()
        self._control: DriverControl | None = None
        self._network: RoadNetwork | None = None
        self._way: tuple[tuple[str, str], ...] = ()
        self._progress: RouteProgress | None = None

    @property
    def step_length(self) -> float:
        """Length of a simulation step [s]."""
        return float(1.0 / self._environment.config["simulation_frequency"])

    def start(self, seed: int) -> None:
        """Reset the environment."""
        if all(getattr(IDMVehicle, name) == changed for name, (_, changed) in _IDM.items()):
            for name, (value, _) in _IDM.items():
                setattr(IDMVehicle, name, value)
        self._environment.reset(seed=seed)
        if self._environment.vehicle is None:
            raise SimulationError(f"{type(self._environment).__name__} has no controlled vehicle to become the ego")
        self._fleet = Fleet(self._environment, _driver_for(self._environment))
        for vehicle in self._environment.road.vehicles:
            if isinstance(vehicle, IDMVehicle):
                vars(vehicle).update({name: getattr(vehicle, name) for name in _IDM})
        self._collisions = CollisionLog()
        self._control = control_drivers(
            self._fleet, self._drivers, self._events, seed, self._advice_deceleration, self._sight
        )
        self._hold_in_lane(self._fleet)
        road, ego = self._environment.road, self._fleet.ego
        network, way = road_network(road, ego), tuple(lane[:2] for lane in lanes_ahead(road.network, ego))
        if self._network is not None and not (way == self._way and same_roads(self._network, network)):
            raise OtherRoadsError(
                f"{type(self._environment).__name__} has built other roads than before, or leads on others"
            )
        self._network, self._way, self._progress = network, way, RouteProgress(network.route)
        if self._fog is not None:
            self._control.enter_fog(self._fog)

    def enter_fog(self, fog: FogAccess) -> None:
        """Let drivers see only what this fog lets them see, from now on and in every later run."""
        self._fog = fog
        if self._control is not None:
            self._control.enter_fog(fog)

    def _hold_in_lane(self, fleet: Fleet) -> None:
        vehicles = fleet.present()
        for name in self._keep_lane:
            if name not in vehicles and name != LEAD:
                raise InputError(f"traffic.keep_lane: there is no vehicle {name!r}; {suggest(name, vehicles)}")
            if isinstance(vehicles.get(name), IDMVehicle):
                vehicles[name].enable_lane_change = False

    def planned_network(self) -> None:
        """Nothing: the road is made at the start; see `Traffic.planned_network`."""

    def network(self) -> tuple[RoadNetwork, SignMap]:
        """Roads, and no signs: highway-env has none; after `start`."""
        if self._network is None:
            raise SimulationError("the traffic has not been started, or is closed")
        return self._network, SignMap()

    def begin(self, actions: Sequence[TrafficAction]) -> tuple[TrafficAction, ...]:
        """Begin what a script asks for; see `Traffic.begin`."""
        _, control = self._running()
        return control.begin(actions)

    def advance(self, command: Command) -> None:
        """Move by one simulation step with a command in force."""
        fleet, control = self._running()
        fleet.ego_lamps, fleet.lamps_of = command.lamps, command.lamps_of
        control.command = command
        fleet.environment.road.act()
        hold_at_standstill(fleet)
        fleet.environment.road.step(self.step_length)
        fleet.environment.steps += 1
        fleet.environment.time += self.step_length
        self._collisions.add(_find_collisions(fleet, self.step_length))
        if self._after_collision is AfterCollision.REMOVE:
            road = fleet.environment.road
            road.vehicles = [v for v in road.vehicles if v is fleet.ego or not v.crashed]

    def observe(self) -> TrafficSnapshot | None:
        """Report where everyone is and what has happened since the last call; None once the ego has left.

        The impact speed of a collision is the length of the difference of both velocities.
        """
        fleet, control = self._running()
        if self._progress is None:
            raise SimulationError("the traffic has not been started, or is closed")
        return read_snapshot(fleet, self._progress, self._collisions.take(), self._reading_radius, control.heard())

    def unplayed(self) -> Unplayed:
        """What of the script has not been played; see `Traffic.unplayed`."""
        _, control = self._running()
        return control.unplayed(self._keep_lane)

    def _running(self) -> tuple[Fleet, DriverControl]:
        if self._fleet is None or self._control is None:
            raise SimulationError("the traffic has not been started, or is closed")
        return self._fleet, self._control

    def close(self) -> None:
        """End the simulation; closing twice is allowed."""
        self._environment.close()
        self._fleet, self._control, self._network = None, None, None


def _driver_for(environment: Any) -> Any:
    """Put a driver who keeps the lane and follows by IDM into the controlled vehicle."""
    passive, road = environment.vehicle, environment.road
    driver = IDMVehicle(
        road,
        passive.position,
        passive.heading,
        passive.speed,
        # Vehicles that agents steer by themselves have neither a target nor a plan.
        target_lane_index=getattr(passive, "target_lane_index", None),
        target_speed=getattr(passive, "target_speed", speed_limit(passive.lane)),
        route=planned_route(passive),
        enable_lane_change=False,
    )
    destination = environment.config.get("destination")
    if driver.route is None and destination:
        driver.plan_route_to(destination)
    road.vehicles[road.vehicles.index(passive)] = driver
    environment.controlled_vehicles[0] = driver
    return driver
