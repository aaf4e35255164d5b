"""How fast highway-env's drivers desire to drive: by their own choice in fog, and when they are advised."""

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from highway_env.vehicle.behavior import IDMVehicle

from fogsim.traffic.drivers.advice_hearing import AdviceHearing, Heard, check_edges, check_start, heard_since
from fogsim.traffic.drivers.following import CATCHING_UP, FOLLOWING_MODELS, Surroundings, misjudged_headway
from fogsim.traffic.drivers.sight import DriverSight, FogAccess, drivers_visibility, leader_reach
from fogsim.traffic.drivers.speed_choice import (
    CHOICE_PERIOD,
    UNAFFECTED_ABOVE,
    DriverSetup,
    DriverTraits,
    HeardAdvice,
    desired_speed,
    driver_traits,
)
from fogsim.traffic.highway.fleet import Fleet, front_bumper
from fogsim.traffic.highway.network import edge_id, lanes_ahead, speed_limit
from fogsim.units import visibility_from_extinction
from fogsim.values import Command, Stretch


class _HighwayVehiclePlaces:
    """Finds vehicles by their lanes; edges are named as in the road network. See `VehiclePlaces`."""

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        network = fleet.environment.road.network
        self._route = tuple(edge_id(*lane[:2]) for lane in lanes_ahead(network, fleet.ego))
        self._length = {
            edge_id(start, end): float(lanes[0].length)
            for start, ends in network.graph.items()
            for end, lanes in ends.items()
        }

    def on_stretch(self, stretch: Stretch, among: Collection[str] | None = None) -> dict[str, float]:
        """Vehicles on a stretch, and how far past its beginning they are [m]; see `VehiclePlaces.on_stretch`."""
        starts = self._edge_starts(stretch)
        past: dict[str, float] = {}
        for name, vehicle in self._fleet.present().items():
            start = starts.get(edge_id(*vehicle.lane_index[:2]))
            if start is not None and (among is None or name in among):
                front = vehicle.position + 0.5 * vehicle.LENGTH * vehicle.direction
                position = start + float(vehicle.lane.local_coordinates(front)[0])
                if stretch.start <= position < stretch.end:
                    past[name] = position - stretch.start
        return past

    def _edge_starts(self, stretch: Stretch) -> dict[str, float]:
        """Where the edges of a stretch's road begin along it [m]."""
        edges: Sequence[str] = stretch.edges or self._route
        check_edges(stretch, self._length)
        starts, length = {}, 0.0
        for edge in edges:
            starts[edge] = length
            length += self._length[edge]
        check_start(stretch, length)
        return starts

    def near_ego(self, distance: float, among: Collection[str] | None = None) -> list[str]:
        """Vehicles near the ego; see `VehiclePlaces.near_ego` (`distance` [m])."""
        vehicles = self._fleet.present()
        if self._fleet.ego not in vehicles.values():
            return []
        here = front_bumper(self._fleet.ego)
        asked = vehicles.keys() if among is None else among
        return [name for name in asked if math.dist(front_bumper(vehicles[name]), here) <= distance]

    def speed(self, vehicle: str) -> float:
        """Speed of a vehicle [m/s]; see `VehiclePlaces.speed`."""
        return float(self._fleet.present()[vehicle].speed)


class HighwayDesiredSpeeds:
    """Sets the target speeds of an environment's IDM drivers, and in dense fog their time headways."""

    def __init__(
        self, fleet: Fleet, setup: DriverSetup, seed: int, advice_deceleration: float, sight: DriverSight | None = None
    ) -> None:
        self.fog: FogAccess | None = None
        self._fleet = fleet
        self._setup = setup
        self._seed = seed
        self._deceleration = advice_deceleration
        self._sight = sight
        self._traits: dict[str, DriverTraits] = {}
        self._hearing = AdviceHearing(_HighwayVehiclePlaces(fleet))
        self._advised_since: Heard = {}
        self._desired: dict[Any, float] = {}
        self._own_speed: dict[Any, float] = {}
        self._own_headway: dict[Any, float] = {}
        self._next = 0.0
        self._heard: dict[str, float] = {}

    @property
    def heard(self) -> Mapping[str, float]:
        """Lowest advice in force of those whom any has reached, followed or not, when they listened last [m/s]."""
        return self._heard

    def update(self, command: Command) -> None:
        """Set the target speeds of this step, and restore those of drivers whom nothing slows down any more."""
        drivers = [v for v in self._fleet.environment.road.vehicles if _drives_itself(v)]
        if self._fleet.time >= self._next:
            self._next = self._fleet.time + CHOICE_PERIOD
            heard = self._hearing.listen(command, CHOICE_PERIOD)
            self._choose([v for v in drivers if v is not self._fleet.ego], heard)
        for vehicle in drivers:
            ego = vehicle is self._fleet.ego
            desired = command.advice.speed if ego else self._desired.get(vehicle, math.inf)
            if math.isfinite(desired):
                own = self._own_speed.setdefault(vehicle, vehicle.target_speed)
                # Who is advised more than they would drive anyway does not drive faster for it.
                vehicle.target_speed = self._target_speed(vehicle, min(desired, own))
            elif vehicle in self._own_speed:
                vehicle.target_speed = self._own_speed.pop(vehicle)

    def _choose(self, vehicles: list[Any], advised: Heard) -> None:
        """Let every driver choose a speed."""
        time, name = self._fleet.time, self._fleet.name
        self._advised_since = heard_since(advised, self._advised_since, time)
        self._desired, self._heard = {}, {}
        for vehicle, visibility in zip(vehicles, self._visibilities(vehicles), strict=True):
            vehicle_id = name(vehicle)
            driver = self._traits_of(vehicle_id)
            room, kept = self._follow(vehicle, driver, visibility)
            reached = {
                display: speeds[vehicle_id]
                for display, speeds in advised.items()
                if vehicle_id in speeds and driver.hears(self._setup.compliance_with(display))
            }
            if reached:
                self._heard[vehicle_id] = min(reached.values())
            own = min(self._own_speed.get(vehicle, vehicle.target_speed), speed_limit(vehicle.lane))
            desired = desired_speed(
                self._setup,
                driver,
                own,
                drivers_visibility(self._sight, visibility),
                [
                    HeardAdvice(display, speed, time - self._advised_since[display][vehicle_id])
                    for display, speed in reached.items()
                ],
                room,
                kept,
            )
            if desired < own:
                self._desired[vehicle] = desired

    def _visibilities(self, vehicles: list[Any]) -> list[float]:
        if self.fog is None or not vehicles:
            return [math.inf] * len(vehicles)
        extinction = self.fog.extinction(np.array([front_bumper(v) for v in vehicles]))
        return [visibility_from_extinction(float(k)) for k in extinction]

    def _follow(self, vehicle: Any, driver: DriverTraits, visibility: float) -> tuple[float, float]:
        """Set a driver's wanted headway; the speed not exceeded for the room to a leader, and that to keep up [m/s]."""
        reach, model = leader_reach(self._sight, visibility), FOLLOWING_MODELS[driver.following]
        own = self._own_headway.setdefault(vehicle, vehicle.TIME_WANTED)
        seen = drivers_visibility(self._sight, visibility)
        around = Surroundings(seen, reach, float(vehicle.speed), float(vehicle.DISTANCE_WANTED))
        wanted = misjudged_headway(model.headway(own, around), around, self._setup.misjudgement)
        if wanted != vehicle.TIME_WANTED:
            vehicle.TIME_WANTED = wanted
        # A road in fog names only a leader whom the driver perceives.
        keeps_up = model.keeps_up and self._sight is not None and seen < UNAFFECTED_ABOVE
        leader = self._fleet.environment.road.neighbour_vehicles(vehicle)[0] if keeps_up else None
        return model.top_speed(reach), 0.0 if leader is None else float(leader.speed) + CATCHING_UP

    def _traits_of(self, vehicle: str) -> DriverTraits:
        if vehicle not in self._traits:
            self._traits[vehicle] = driver_traits(self._setup, vehicle, self._seed)
        return self._traits[vehicle]

    def _target_speed(self, vehicle: Any, speed: float) -> float:
        """Target speed on the way to a desired one at which IDM slows down no harder than the advice asks.

        On a free road IDM's acceleration is a (1 − (v / v₀)^δ), so −b follows from v₀ = v / (1 + b / a)^(1/δ).
        """
        ratio = 1.0 + self._deceleration / vehicle.COMFORT_ACC_MAX
        return float(max(speed, vehicle.speed / ratio ** (1.0 / vehicle.DELTA)))


def _drives_itself(vehicle: Any) -> bool:
    """Whether a vehicle's target speed is its driver's: the road sets it for one that gives way at a junction."""
    return isinstance(vehicle, IDMVehicle) and not getattr(vehicle, "is_yielding", False)
