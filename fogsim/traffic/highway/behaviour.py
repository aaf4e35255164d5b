"""What highway-env's drivers do next to following their leader.

Its environments let their road decide for everyone (``act``) in each simulation step; here the road decides after the
drivers have chosen their speeds, and before the script has its way. IDM and MOBIL stay as they are.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

import numpy as np
from highway_env.road.regulation import RegulatedRoad
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.controller import ControlledVehicle
from numpy.typing import NDArray

from fogsim.core.kinematics import decelerated_speed
from fogsim.core.linear_algebra import matrix_product
from fogsim.errors import InputError, suggest
from fogsim.traffic.appearance import EYE_HEIGHTS
from fogsim.traffic.drivers.events import Event, Order, Script, Situation, signed_gap
from fogsim.traffic.drivers.lamp_intensity import head_lamp_light, high_beam_veil, intensity_toward
from fogsim.traffic.drivers.sight import DriverSight, FogAccess, inherent_contrast
from fogsim.traffic.drivers.speed_choice import DriverSetup
from fogsim.traffic.highway.desired_speeds import HighwayDesiredSpeeds
from fogsim.traffic.highway.fleet import LEAD, Fleet, acceleration, front_bumper, rear_bumper
from fogsim.values import Command, Unplayed
from fogsim.values.light import ALL_LAMPS
from fogsim.values.script import ChangeLane, SetLamps, TrafficAction


def limit_sight(fog: FogAccess, fleet: Fleet, sight: DriverSight) -> None:
    """Let the drivers of an environment see only what a fog lets them see, until its next reset."""
    # On this one road, not in the library: other environments of the process go on in clear air.
    road = fleet.environment.road
    road.neighbour_vehicles = neighbours = _VisibleNeighbours(fog, fleet, sight)
    if isinstance(road, RegulatedRoad):
        road.respect_priorities = neighbours.who_gives_way


class _VisibleNeighbours:
    """Stands in for the methods ``neighbour_vehicles`` and ``respect_priorities`` of one road."""

    def __init__(self, fog: FogAccess, fleet: Fleet, sight: DriverSight) -> None:
        self._fog = fog
        self._fleet = fleet
        self._sight = sight
        self._certainly_seen = sight.sure_distance(fog.maximum_extinction)
        self._last_hidden: dict[tuple[Any, Any], float] = {}

    def __call__(self, vehicle: Any, lane_index: Any = None) -> tuple[Any, Any]:
        """Vehicles ahead and behind in a lane; None where the driver has perceived none."""
        road = self._fleet.environment.road
        front, rear = type(road).neighbour_vehicles(road, vehicle, lane_index)
        return (
            front if front is not None and self._perceives(vehicle, front, rear_bumper(front)) else None,
            rear if rear is not None and self._perceives(vehicle, rear, front_bumper(rear)) else None,
        )

    def who_gives_way(self, one: Any, other: Any) -> Any:
        """Which of two vehicles whose ways cross gives way; None if its driver has not perceived the other."""
        giving = type(self._fleet.environment.road).respect_priorities(one, other)
        foe, eye = (other if giving is one else one), front_bumper(giving)
        near_end = min(front_bumper(foe), rear_bumper(foe), key=lambda end: math.dist(eye, end))
        return giving if self._perceives(giving, foe, near_end) else None

    def _perceives(self, vehicle: Any, other: Any, end: NDArray[np.float64]) -> bool:
        """Whether a driver sees another's near end, and has for the reaction time if it was hidden before."""
        pair, now = (vehicle, other), self._fleet.time
        if not self._sees(vehicle, other, end):
            self._last_hidden[pair] = now
            return False
        return now - self._last_hidden.get(pair, -np.inf) >= self._sight.reaction_time

    def _sees(self, vehicle: Any, other: Any, end: NDArray[np.float64]) -> bool:
        lift = np.array([0.0, 0.0, EYE_HEIGHTS["car"]])
        eye = front_bumper(vehicle)
        distance = max(math.dist(eye, end), 0.1)
        if distance <= self._certainly_seen:
            return True
        depth, fleet = float(self._fog.optical_depth(eye + lift, end + lift)), self._fleet
        east, north, _ = eye - front_bumper(other)
        forward_east, forward_north = other.direction
        ahead = float(east * forward_east + north * forward_north)
        aside = float(north * forward_east - east * forward_north)
        lit = intensity_toward(int(fleet.lamps(other)), other.LENGTH, ahead, aside)
        # What is behind stands in no one's own head lamps.
        own = head_lamp_light(int(fleet.lamps(vehicle))) if ahead < 0.0 else 0.0
        glare = high_beam_veil(float(self._fog.extinction(eye + lift))) if own > 1.0 else 0.0
        contrast = inherent_contrast(fleet.paint(other), self._sight.airlight_share)
        return depth <= self._sight.depth_limit(distance, contrast, lit, own, glare)


class _Manoeuvres:
    """Makes vehicles do what is scripted."""

    def __init__(self, fleet: Fleet, events: Sequence[Event]) -> None:
        there = list(dict.fromkeys([*fleet.present(), LEAD]))
        for event in events:
            if event.vehicle not in there:
                raise InputError(
                    f"traffic.events: there is no vehicle {event.vehicle!r} in "
                    f"{type(fleet.environment).__name__}; {suggest(event.vehicle, there)}"
                )
        self._fleet = fleet
        self._script = Script(events)
        self._driven: dict[str, float] = {}
        self._keeping_lane: dict[str, tuple[float, bool]] = {}

    def begin(self, actions: Sequence[TrafficAction]) -> tuple[TrafficAction, ...]:
        """Begin changes of lane and failures of all lamps; return what could not begin, without vehicle or lane."""
        vehicles, refused = self._fleet.present(), list[TrafficAction]()
        situation = self._situation(vehicles)
        for action in actions:
            if not _is_playable(action):
                raise InputError(
                    f"timeline: highway-env's vehicles cannot play {type(action).__name__}: only changes of lane "
                    "without duration and indicator, and the failure of all lamps"
                )
            if action.vehicle not in vehicles:
                refused.append(action)
            elif isinstance(action, SetLamps):
                self._script.lamps.switch(action)
            elif situation.has_lane(action.vehicle, action.lanes):
                self._change_lane(vehicles[action.vehicle], action)
            else:
                refused.append(action)
        return tuple(refused)

    def plan(self) -> Mapping[str, Order]:
        """Begin what is due; return speeds for this step, for `apply` once the drivers have decided."""
        vehicles = self._fleet.present()
        self._end_lane_changes(vehicles)
        actions = self._script.play(self._situation(vehicles))
        for event in actions.lane_changes:
            self._change_lane(vehicles[event.vehicle], event)
        self._fleet.dark = self._script.dark
        for name, vehicle in vehicles.items():
            self._driven[name] = self._driven.get(name, 0.0) + max(vehicle.speed, 0.0) * self._fleet.step_length
        return actions.orders

    def apply(self, orders: Mapping[str, Order]) -> None:
        """Slow vehicles down to the speeds of their orders, whatever their drivers have decided."""
        vehicles = self._fleet.present() if orders else {}
        for name, (target, deceleration) in orders.items():
            vehicle = vehicles[name]
            vehicle.action["acceleration"] = _limited_acceleration(
                vehicle, target, deceleration, self._fleet.step_length
            )

    def unplayed(self, keep_lane: Sequence[str]) -> Unplayed:
        """List what has not been played so far, and which vehicles of `keep_lane` are missing."""
        present = self._fleet.present()
        return self._script.unplayed(self._fleet.known(), present, keep_lane)

    def _situation(self, vehicles: Mapping[str, Any]) -> Situation:
        ego = self._fleet.ego

        def gap_to_ego(name: str) -> float | None:
            return _gap(vehicles[name], ego) if ego in vehicles.values() else None

        def has_lane(name: str, lanes: int) -> bool:
            vehicle = vehicles[name]
            return not isinstance(vehicle, ControlledVehicle) or _lane_over(vehicle, lanes) != vehicle.lane_index

        driven = self._driven
        return Situation(self._fleet.time, set(vehicles), lambda name: driven.get(name, 0.0), gap_to_ego, has_lane)

    def _change_lane(self, vehicle: Any, event: ChangeLane) -> None:
        """Aim for another lane, as far over as there are lanes, and stay there: MOBIL would call it off."""
        if not isinstance(vehicle, ControlledVehicle):
            raise InputError(
                f"traffic.events: {event.vehicle!r} cannot change lane: a {type(vehicle).__name__} steers for no lane"
            )
        vehicle.target_lane_index = _lane_over(vehicle, event.lanes)
        if hasattr(vehicle, "enable_lane_change"):
            _, own = self._keeping_lane.get(event.vehicle, (0.0, vehicle.enable_lane_change))
            self._keeping_lane[event.vehicle] = (self._fleet.time + event.stay, own)
            vehicle.enable_lane_change = False

    def _end_lane_changes(self, vehicles: Mapping[str, Any]) -> None:
        for name, (until, own) in list(self._keeping_lane.items()):
            if self._fleet.time >= until:
                del self._keeping_lane[name]
                if name in vehicles:
                    vehicles[name].enable_lane_change = own


def _is_playable(action: TrafficAction) -> TypeGuard[ChangeLane | SetLamps]:
    if isinstance(action, ChangeLane):
        return (action.duration, action.offset) == (None, None) and action.indicator == 0.0 and not action.oncoming
    return isinstance(action, SetLamps) and action.failed == ALL_LAMPS and action.side is None


def _lane_over(vehicle: Any, lanes: int) -> tuple[str, str, int]:
    """Lane so many to the left of a vehicle's, negative to the right, as far over as there are lanes."""
    start, end, index = vehicle.lane_index
    # highway-env counts lanes from the left.
    return start, end, min(max(index - lanes, 0), len(vehicle.road.network.graph[start][end]) - 1)


def _gap(vehicle: Any, ego: Any) -> float | None:
    """Gap to the ego along the ego's lane, whichever lane the vehicle is on [m]; None if it drives the other way."""
    if float(matrix_product(vehicle.direction, ego.direction)) <= 0.0:
        return None
    # The library measures from middle to middle.
    apart = float(ego.lane_distance_to(vehicle)) + 0.5 * (vehicle.LENGTH - ego.LENGTH)
    ahead, behind = (apart, None) if apart >= 0.0 else (None, -apart)
    return signed_gap(ahead, behind, vehicle.LENGTH, ego.LENGTH)


def _limited_acceleration(vehicle: Any, target: float, deceleration: float, step_length: float) -> float:
    """Acceleration of a vehicle that is brought to a speed and kept there [m/s²]; it does not roll backwards."""
    # What no driver steers is left to roll.
    own = acceleration(vehicle) if isinstance(vehicle, ControlledVehicle) else 0.0
    hardest = min(deceleration, getattr(vehicle, "ACC_MAX", math.inf))
    asked = (decelerated_speed(vehicle.speed, target, hardest, step_length) - vehicle.speed) / step_length
    return float(max(min(own, asked), -max(vehicle.speed, 0.0) / step_length))


class DriverControl:
    """Stands in for the method ``act`` of one road (`advice_deceleration` [m/s²])."""

    def __init__(
        self,
        fleet: Fleet,
        setup: DriverSetup,
        events: Sequence[Event],
        seed: int,
        advice_deceleration: float,
        sight: DriverSight | None = None,
    ) -> None:
        self.command = Command()
        self._fleet = fleet
        self._sight = sight
        self._desired_speeds = HighwayDesiredSpeeds(fleet, setup, seed, advice_deceleration, sight)
        self._manoeuvres = _Manoeuvres(fleet, events)

    def enter_fog(self, fog: FogAccess) -> None:
        """Let the drivers choose their speeds in a fog, and see only what it lets them see."""
        self._desired_speeds.fog = fog
        if self._sight is not None:
            limit_sight(fog, self._fleet, self._sight)

    def heard(self) -> Mapping[str, float]:
        """What everyone has heard advised, the ego its own [m/s]."""
        own, ego = self.command.advice.speed, self._fleet.name(self._fleet.ego)
        return self._desired_speeds.heard if math.isinf(own) else {**self._desired_speeds.heard, ego: own}

    def begin(self, actions: Sequence[TrafficAction]) -> tuple[TrafficAction, ...]:
        """Begin what a script asks for; see `_Manoeuvres.begin`."""
        return self._manoeuvres.begin(actions)

    def unplayed(self, keep_lane: Sequence[str]) -> Unplayed:
        """List what has not been played so far; see `_Manoeuvres.unplayed`."""
        return self._manoeuvres.unplayed(keep_lane)

    def __call__(self) -> None:
        """Decide for everyone on the road."""
        road = self._fleet.environment.road
        self._desired_speeds.update(self.command)
        orders = self._manoeuvres.plan()
        type(road).act(road)
        self._manoeuvres.apply(orders)


def hold_at_standstill(fleet: Fleet) -> None:
    """Let no one who drives by IDM back away: its acceleration has no end at standstill."""
    for vehicle in fleet.environment.road.vehicles:
        if isinstance(vehicle, IDMVehicle):
            stopping = -vehicle.speed / fleet.step_length
            vehicle.action["acceleration"] = max(acceleration(vehicle), stopping)


def control_drivers(
    fleet: Fleet,
    setup: DriverSetup,
    events: Sequence[Event],
    seed: int,
    advice_deceleration: float,
    sight: DriverSight | None = None,
) -> DriverControl:
    """Let the drivers of an environment choose speeds and play a script, until its next reset; see `DriverControl`."""
    control = DriverControl(fleet, setup, events, seed, advice_deceleration, sight)
    # On this one road, not in the library: other environments of the process go on as they are.
    fleet.environment.road.act = control
    return control
