"""The initial state: positions, speeds and lamps of vehicles, fog and light."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from fogsim.openscenario.actions import DISPLACEMENTS, Actions
from fogsim.openscenario.entities import Vehicle
from fogsim.openscenario.environment import Environment, environment_of
from fogsim.openscenario.lateral import Effect
from fogsim.openscenario.positions import ALONG, Positions
from fogsim.openscenario.xml_tree import Node
from fogsim.traffic.road.opendrive_lanes import Spot
from fogsim.units import KMH_PER_MPS

_STRAIGHT = 1000.0  # Way of those off the lanes in the direction in which they stand [m]


@dataclass
class Beginning:
    """Initial state: positions, ordered speeds of vehicles, fog and light, and further effects.

    `fronts` are the places of front bumpers, and `distances` the actions that place one at a distance to another.
    """

    positions: Positions
    fronts: dict[str, Spot] = field(default_factory=dict)
    orders: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    environment: Environment = field(default_factory=Environment)
    effect: Effect = field(default_factory=Effect)
    distances: list[tuple[str, Node]] = field(default_factory=list)

    @property
    def routed(self) -> set[str]:
        """Vehicles that have a route, from the beginning or later, for which they change lane."""
        return {*self.effect.routes, *self.positions.rerouted}

    def speed(self, vehicle: str, *asked: str) -> float:
        """Initial speed of a vehicle [m/s]; one that is relative follows from another's."""
        order = self.orders.get(vehicle)
        if order is None or vehicle in asked:
            return 0.0
        if "to_kmh" in order:
            return float(order["to_kmh"]) / KMH_PER_MPS
        other = self.speed(self.of_name(order["like"]), *asked, vehicle)
        return max(other * float(order.get("factor", 1.0)) + float(order.get("plus_kmh", 0.0)) / KMH_PER_MPS, 0.0)

    def of_name(self, named: str) -> str:
        """The vehicle that the timeline names so."""
        return self.positions.vehicles.ego if named == "ego" else named


def read_beginning(init: Node | None, actions: Actions) -> Beginning:
    """Initial state from the element ``Init``."""
    begin, vehicles = Beginning(actions.positions), actions.vehicles
    blocks = init.all("Actions") if init else []
    for block in blocks:
        for action in block.all("GlobalAction"):
            _take_global(action, begin, actions)
    private = vehicles.known(one for block in blocks for one in block.all("Private"))
    added = {one.get("entityRef"): one for block in blocks for one in _entity_actions(block, "AddEntityAction")}
    _place(_positions(private, added, actions), actions)
    for one in private:
        for action in one.all("PrivateAction"):
            _take_private(action, one.get("entityRef"), begin, actions)
    for name, action in begin.distances:
        with action.refusing():
            actions.spots[name] = _at_distance(action, name, begin, actions)
    absent = {one.get("entityRef") for block in blocks for one in _entity_actions(block, "DeleteEntityAction")}
    for name in absent:
        actions.spots.pop(name, None)
    if init and init.above:
        absent |= {one.get("entityRef") for one in _entity_actions(init.above, "AddEntityAction")} - {*added}
    for name, vehicle in vehicles.items():
        if name not in absent or name == vehicles.ego:
            _begin(vehicle, begin, actions)
    return begin


def _entity_actions(node: Node, kind: str) -> list[Node]:
    """All elements within that add an entity, or delete one."""
    return [one for one in node.walk() if one.tag == "EntityAction" and any(c.tag == kind for c in one.children)]


def _begin(vehicle: Vehicle, begin: Beginning, actions: Actions) -> None:
    """Find where a vehicle's front bumper begins, and its way, or its path off the lanes."""
    name, positions = vehicle.name, actions.positions
    if name in positions.off_lanes or (name not in actions.spots and "path" in begin.effect.do.get(name, {})):
        _place_off_lanes(vehicle, begin)
    elif name in actions.spots:
        try:
            begin.fronts[name] = _front(vehicle, begin)
            wanted = begin.effect.routes.get(name, ())
            positions.ways[name] = positions.lanes.route(begin.fronts[name].lane.edge, wanted)
        except ValueError as error:
            vehicle.node.refuse(f"{name} cannot begin where it is to: {error}")
            del actions.spots[name]
    elif not vehicle.node.findings.refused:
        vehicle.node.refuse(f"{name} has no place: Init needs a TeleportAction of it")


def _place_off_lanes(vehicle: Vehicle, begin: Beginning) -> None:
    """Let one begin off the lanes, or turned on one; without a path it moves straight on, a vehicle along its lane."""
    name, lanes = vehicle.name, begin.positions.lanes
    (x, y, heading), speed = begin.positions.off_lanes.setdefault(name, (math.inf, 0.0, 0.0)), begin.speed(name)
    far, degrees = _STRAIGHT if speed or vehicle.body else 0.0, math.degrees(heading)
    ends = [[x + way * math.cos(heading), y + way * math.sin(heading), degrees] for way in (0.0, far)]
    lane = None if vehicle.body else lanes.nearest(x, y)
    path = {"points": lanes.backwards(lane) if lane else ends, "ahead_m": vehicle.front, "stays": True}
    done = begin.effect.do.setdefault(name, {})
    done["path"] = {**done.get("path", path), "speed_kmh": speed * KMH_PER_MPS}


def _front(vehicle: Vehicle, begin: Beginning) -> Spot:
    """Place of a front bumper; ValueError if it is on no road or, all places being as written, in another vehicle."""
    positions, wanted = begin.positions, begin.effect.routes.get(vehicle.name, ())
    front = positions.lanes.along(positions.spots[vehicle.name], vehicle.front, wanted)
    for other, there in begin.fronts.items() if not vehicle.node.findings.refused else ():
        is_same = (there.lane.edge, there.lane.index) == (front.lane.edge, front.lane.index)
        if is_same and -positions.vehicles[other].length < front.position - there.position < vehicle.length:
            raise ValueError(f"{other} is there")
    return front


def _take_global(action: Node, begin: Beginning, actions: Actions) -> None:
    for one in action.all():
        if one.tag == "EntityAction":
            # `read_beginning` has seen to it.
            one.all("AddEntityAction", "DeleteEntityAction")
            actions.vehicles.known([one])
        elif one.tag == "EnvironmentAction":
            begin.environment = environment_of(one, actions.positions.catalogs, actions.positions.lanes)
        else:
            actions.take(action, [], begin.effect)


def _positions(private: list[Node], added: Mapping[str, Node], actions: Actions) -> dict[str, Node]:
    """Positions at which vehicles are added, or put, at the beginning."""
    holders = [(name, one.all("AddEntityAction")) for name, one in added.items() if name in actions.vehicles]
    for one in private:
        places = [t for action in one.all("PrivateAction") for t in action.all("TeleportAction")]
        # Who only follows a trajectory begins at its first vertex.
        vertices = [vertex for vertex in one.walk() if vertex.tag == "Vertex"]
        holders.append((one.get("entityRef"), places or vertices[:1]))
    return {name: position for name, inside in holders for one in inside for position in one.all("Position")}


def _place(wanted: dict[str, Node], actions: Actions) -> None:
    """Place vehicles; those relative to another one last."""
    positions = actions.positions
    while wanted:
        ready = [n for n, position in wanted.items() if positions.refers_to(position) not in wanted] or list(wanted)
        for name in ready:
            position = wanted.pop(name)
            if (point := _off_lanes(position, actions.vehicles[name], positions)) is not None:
                positions.off_lanes[name] = point
            elif (spot := positions.spot(position)) is not None:
                positions.spots[name] = spot


def _off_lanes(position: Node, vehicle: Vehicle, positions: Positions) -> tuple[float, float, float] | None:
    """x, y [m] and heading [rad] of one on no lane, of a body turned on one, or of a vehicle against one; else None."""
    try:
        x, y, heading, along = positions.point(position)
        lane = positions.lanes.nearest(x, y)
    except ValueError:
        return None
    facing = along if heading is None else heading
    along_lane = 1.0 if lane is None or facing is None else math.cos(facing - lane.world[2])
    is_turned = along_lane < (ALONG if vehicle.body else -ALONG)
    if vehicle.name == positions.vehicles.ego or not (lane is None or is_turned):
        return None
    if lane is not None and not vehicle.body:
        positions.against[vehicle.name] = positions.named(position) or lane
    return x, y, facing or 0.0


def _take_private(action: Node, name: str, begin: Beginning, actions: Actions) -> None:
    if action.one("TeleportAction"):
        return
    distance = action.within("LongitudinalAction", "LongitudinalDistanceAction")
    if distance and distance.one("DynamicConstraints") is None:
        # Without limits to its motion it is there at once.
        begin.distances.append((name, distance))
        if not distance.flag("continuous"):
            return
    effect = Effect(is_at_start=True)
    actions.take(action, [name], effect)
    begin.effect.routes.update(effect.routes)
    done = effect.do.get(name, {})
    speed, leader = done.pop("speed", None), begin.of_name(done.get("follow", {}).get("vehicle", ""))
    if speed is not None:
        # At the start there is no earlier speed to change from.
        begin.orders[name] = speed
        if speed.get("continuous"):
            begin.effect.add(name, speed={**speed, "shape": "step"})
    if leader in actions.vehicles and not _is_ahead(actions.spots.get(leader), actions.spots.get(name)):
        action.refuse(f"FogSim keeps a distance to a vehicle ahead; {leader} is not ahead of {name}")
    if done:
        begin.effect.add(name, **done)


def _at_distance(action: Node, name: str, begin: Beginning, actions: Actions) -> Spot:
    """Place at a distance to another vehicle, on the lane on which the vehicle is; ValueError if there is none."""
    headway, distance, is_between_bumpers = actions.gap(action)
    own, other, reference = actions.spots.get(name), actions.spots.get(action.get("entityRef")), action.get("entityRef")
    if own is None or other is None:
        raise ValueError(f"{name} or {reference} has no place")
    where = action.word("displacement", DISPLACEMENTS, "any")
    is_ahead = _is_ahead(own, other) if where == "any" else where == DISPLACEMENTS[1]
    ahead, behind = (name, reference) if is_ahead else (reference, name)
    away = headway * begin.speed(behind) + distance
    if is_between_bumpers:
        away += actions.vehicles[behind].front + actions.vehicles[ahead].rear
    lanes = actions.positions.lanes
    spot = lanes.along(other, away if is_ahead else -away)
    return lanes.beside(spot, own.lane.index - other.lane.index).shifted(own.offset)


def _is_ahead(one: Spot | None, other: Spot | None) -> bool:
    """Whether a place lies ahead of another one, seen from there."""
    if one is None or other is None:
        return True
    (x, y, _), (from_x, from_y, heading) = one.world, other.world
    return (x - from_x) * math.cos(heading) + (y - from_y) * math.sin(heading) > 0.0
