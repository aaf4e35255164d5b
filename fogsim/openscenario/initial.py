"""The initial state: positions, speeds and lamps of vehicles, fog and light."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from fogsim.openscenario.actions import DISPLACEMENTS, Actions
from fogsim.openscenario.environment import Environment, Vehicle, environment_of
from fogsim.openscenario.lateral import Effect
from fogsim.openscenario.positions import ALONG, POSITIONS
from fogsim.openscenario.shapes import positions_of, shape_of
from fogsim.openscenario.xml_tree import Node
from fogsim.traffic.road.opendrive_lanes import Spot
from fogsim.units import KMH_PER_MPS

_TO_OTHER_LANES = ("LaneChangeAction", "CatalogReference")
_STRAIGHT = 1000.0  # Way of those off the lanes in the direction in which they stand [m]


@dataclass
class Beginning:
    """Initial state: places of front bumpers, ordered speeds of vehicles, fog and light, and further effects."""

    actions: Actions
    fronts: dict[str, Spot] = field(default_factory=dict)
    orders: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    environment: Environment = field(default_factory=Environment)
    effect: Effect = field(default_factory=Effect)
    aims: dict[str, float] = field(default_factory=dict)  # Speeds that vehicles come to in the beginning [m/s]
    late: set[str] = field(default_factory=set)  # Who comes in a story
    _distances: list[tuple[str, Node]] = field(default_factory=list)
    _changing: set[str] = field(default_factory=set)  # Who changes lane, or may: its first one decides no way

    def __post_init__(self) -> None:
        self.positions, self.vehicles = self.actions.positions, self.actions.vehicles
        self.lanes, self.spots = self.positions.lanes, self.positions.spots

    def speed(self, vehicle: str, *asked: str) -> float:
        """Initial speed of a vehicle [m/s]; one that is relative follows from another's."""
        order = self.orders.get(vehicle)
        if order is None or vehicle in asked:
            return 0.0
        if "to_kmh" in order:
            return float(order["to_kmh"]) / KMH_PER_MPS
        other = self.speed(self._of_name(order["like"]), *asked, vehicle)
        return max(other * float(order.get("factor", 1.0)) + float(order.get("plus_kmh", 0.0)) / KMH_PER_MPS, 0.0)

    def moves(self, vehicle: str) -> bool:
        """Whether a vehicle drives in the beginning, or comes to a speed."""
        comes = "speed" in self.effect.do.get(vehicle, {})
        return bool(self.speed(vehicle) or (comes and self.aims.get(vehicle, 1.0)))

    def _of_name(self, named: str) -> str:
        return self.vehicles.ego if named == "ego" else named

    def read(self, init: Node | None, at_once: Sequence[tuple[str, Node]] = ()) -> None:
        """Read the element ``Init``, and distances that a story orders at once."""
        blocks = init.all("Actions") if init else []
        groups = [one for one in init.above.walk() if one.tag == "ManeuverGroup"] if init and init.above else []
        groups = [one for one in groups if any(part.tag in _TO_OTHER_LANES for part in one.walk())]
        actors = (one for group in groups for block in group.all("Actors") for one in block.all("EntityRef"))
        self._changing = {*self.vehicles.selected(actors)}
        for action in (one for block in blocks for one in block.all("GlobalAction")):
            self._take_global(action)
        private = self.vehicles.known(one for block in blocks for one in block.all("Private"))
        added = {one.get("entityRef"): one for block in blocks for one in _entity_actions(block, "AddEntityAction")}
        self._place(private, added)
        for one in private:
            for action in one.all("PrivateAction"):
                self._take_private(action, one.get("entityRef"))
        for name, action in (*self._distances, *at_once):
            with action.refusing():
                self.spots[name] = self._at_distance(action, name)
        gone = {one.get("entityRef") for block in blocks for one in _entity_actions(block, "DeleteEntityAction")}
        for name in gone:
            self.spots.pop(name, None)
            self.positions.off_lanes.pop(name, None)
        if init and init.above:
            self._find_late(_entity_actions(init.above, "AddEntityAction"), private, added)
        for name, vehicle in self.vehicles.items():
            if name not in gone | self.late or name == self.vehicles.ego:
                self._begin(vehicle)

    def _find_late(self, adding: Sequence[Node], private: Sequence[Node], added: Mapping[str, Node]) -> None:
        """Find who comes in a story; it is not there in the beginning, and does nothing then."""
        for one in adding:
            if (name := one.get("entityRef")) in {*self.spots, *self.positions.off_lanes} - {*added}:
                one.refuse(f"{name} is there from Init on, and who leaves does not come back; delete it in Init")
            self.late |= {name} - {*added}
        for one in private:
            if (name := one.get("entityRef")) in self.late and (name in self.orders or self.effect.do.get(name)):
                one.refuse(f"{name} comes in a story, and stands then; order what it does next to its AddEntityAction")

    def _begin(self, vehicle: Vehicle) -> None:
        """Find where a vehicle's front bumper begins, and its way, or its path off the lanes."""
        name = vehicle.name
        if name in self.positions.off_lanes or (name not in self.spots and "path" in self.effect.do.get(name, {})):
            self._place_off_lanes(vehicle)
        elif name in self.spots:
            try:
                front = self.fronts[name] = self._front(vehicle)
                wanted = self.effect.routes.get(name, ())
                stays = name not in self._changing and "change_lane" not in self.effect.do.get(name, {})
                self.positions.ways[name] = self.lanes.route(
                    front.lane.edge, wanted, front.lane.index if stays else None
                )
            except ValueError as error:
                vehicle.node.refuse(f"{name} cannot begin where it is to: {error}")
                del self.spots[name]
        elif not vehicle.node.findings.refused:
            vehicle.node.refuse(f"{name} has no place: Init needs a TeleportAction of it")

    def _place_off_lanes(self, vehicle: Vehicle) -> None:
        """Let one begin off the lanes, or turned on one; without a path it moves on, a vehicle along its lane."""
        x, y, heading = self.positions.off_lanes.setdefault(vehicle.name, (math.inf, 0.0, 0.0))
        speed, degrees = self.speed(vehicle.name), math.degrees(heading)
        far = _STRAIGHT if self.moves(vehicle.name) or vehicle.body else 0.0
        ends = [[x + way * math.cos(heading), y + way * math.sin(heading), degrees] for way in (0.0, far)]
        lane = None if vehicle.body else self.lanes.nearest(x, y)
        back = self.lanes.backwards(lane) if lane else []
        # At the beginning of its road none of it is left.
        path = {"points": back if len(back) > 1 else ends, "ahead_m": vehicle.front, "stays": True}
        done = self.effect.do.setdefault(vehicle.name, {})
        done["path"] = {**done.get("path", path), "speed_kmh": speed * KMH_PER_MPS}

    def _front(self, vehicle: Vehicle) -> Spot:
        """Place of a front bumper; ValueError if it is on no road or, where all is as written, in another vehicle."""
        wanted = self.effect.routes.get(vehicle.name, ())
        front = self.lanes.along(self.spots[vehicle.name], vehicle.front, wanted)
        for other, there in self.fronts.items() if not vehicle.node.findings.refused else ():
            is_same = (there.lane.edge, there.lane.index) == (front.lane.edge, front.lane.index)
            if is_same and -self.vehicles[other].length < front.position - there.position < vehicle.length:
                raise ValueError(f"{other} is there")
        return front

    def _take_global(self, action: Node) -> None:
        for one in action.all():
            if one.tag == "EntityAction":
                # `read` sees to it.
                one.all("AddEntityAction", "DeleteEntityAction")
                self.vehicles.known([one])
            elif one.tag == "EnvironmentAction":
                with one.refusing():
                    later = environment_of(one, self.positions.catalogs, self.lanes)
                    self.environment = self.environment.then(later)
            else:
                self.actions.take(action, [], self.effect)

    def _place(self, private: list[Node], added: Mapping[str, Node]) -> None:
        """Place vehicles where they are added, or put, at the beginning; those relative to another one last."""
        holders = [(name, one.all("AddEntityAction")) for name, one in added.items() if name in self.vehicles]
        wanted = {name: position for name, inside in holders for one in inside for position in one.all("Position")}
        for one in private:
            places = [t for action in one.all("PrivateAction") for t in action.all("TeleportAction")]
            wanted.update((one.get("entityRef"), position) for place in places for position in place.all("Position"))
            # Who only follows a trajectory begins where it does.
            follows = [action for action in one.walk() if action.tag == "FollowTrajectoryAction"]
            for action in () if one.get("entityRef") in wanted else follows[:1]:
                with action.refusing():
                    wanted[one.get("entityRef")] = self._first_of(action)
        refers_to = self.positions.refers_to
        while wanted:
            ready = [name for name, position in wanted.items() if refers_to(position) not in wanted] or list(wanted)
            for name, position in ((name, wanted.pop(name)) for name in ready):
                if (point := self._off_lanes(position, self.vehicles[name])) is not None:
                    self.positions.off_lanes[name] = point
                    continue
                with next(iter(position.children), position).refusing():
                    self.spots[name] = self.positions.on_lanes(position)

    def _first_of(self, action: Node) -> Node:
        """Position at which a trajectory begins; ValueError if it has none."""
        holder = action.one("TrajectoryRef") or action
        trajectory = self.positions.catalogs.need(holder, "Trajectory")
        if holder.one("CatalogReference"):
            # The action reads a copy of its own.
            trajectory.see()
        return positions_of(shape_of(trajectory))[0]

    def _off_lanes(self, position: Node, vehicle: Vehicle) -> tuple[float, float, float] | None:
        """x, y [m] and heading [rad] of one on no lane, of a body turned on one, or of a vehicle against one."""
        try:
            x, y, heading, along = self.positions.point(position)
            lane = self.lanes.nearest(x, y)
        except ValueError:
            return None
        facing = along if heading is None else heading
        along_lane = 1.0 if lane is None or facing is None else math.cos(facing - lane.world[2])
        is_turned = along_lane < (ALONG if vehicle.body else -ALONG)
        if vehicle.name == self.vehicles.ego or not (lane is None or is_turned):
            return None
        if lane is not None and not vehicle.body:
            # Where the file names a lane, whatever the offset.
            one = position.need(*POSITIONS)
            named = (one.get("roadId"), one.get("laneId"), one.number("s")) if one.tag == "LanePosition" else None
            self.positions.against[vehicle.name] = self.lanes.on_lane(*named) if named else lane
        return x, y, facing or 0.0

    def _take_private(self, action: Node, name: str) -> None:
        if action.one("TeleportAction"):
            return
        distance = action.within("LongitudinalAction", "LongitudinalDistanceAction")
        if distance and distance.one("DynamicConstraints") is None:
            # Without limits to its motion it is there at once.
            self._distances.append((name, distance))
            if not distance.flag("continuous"):
                return
        self.actions.take(action, [name], effect := Effect(is_at_start=True))
        self.effect.routes.update(effect.routes)
        done = effect.do.get(name, {})
        speed, leader = done.pop("speed", None), self._of_name(done.get("follow", {}).get("vehicle", ""))
        if speed is not None and speed.keys() & {"over_s", "rate_mps2", "profile"}:
            self._come_to(name, speed, effect.lasts, action)
        elif speed is not None:
            self.orders[name] = speed
            if speed.get("continuous"):
                self.effect.add(name, speed={**speed, "shape": "step"})
        if leader in self.vehicles and not _is_ahead(self.spots.get(leader), self.spots.get(name)):
            action.refuse(f"FogSim keeps a distance to a vehicle ahead; {leader} is not ahead of {name}")
        if done:
            self.effect.add(name, **done)

    def _come_to(self, name: str, speed: dict[str, Any], lasts: float, action: Node) -> None:
        """Let a vehicle come to a speed from standstill, or an earlier order; unless it stops, the ego drives on."""
        first = speed.get("profile", [(1.0, 0.0)])[0]
        if first[0] == 0.0:
            self.orders[name] = {"to_kmh": first[1]}
        final = speed["profile"][-1][1] if "profile" in speed else speed.get("to_kmh")
        if final is not None:
            self.aims[name] = final / KMH_PER_MPS
        if "over_s" in speed and final is not None:
            self.actions.check_able(action, name, self.aims[name] - self.speed(name), lasts, speed["shape"])
        if final and name == self.vehicles.ego:
            if self.speed(name) > self.aims[name]:
                action.refuse("its driver aims for the speed that it comes to, and begins no faster; take a story")
            if "rate_mps2" in speed:
                lasts = abs(self.aims[name] - self.speed(name)) / speed["rate_mps2"]
            speed = {**speed, "for_s": max(lasts, 0.1)}
        self.effect.add(name, speed=speed)

    def _at_distance(self, action: Node, name: str) -> Spot:
        """Place at a distance to another vehicle, on the lane on which the vehicle is; ValueError if there is none."""
        (headway, distance, is_between_bumpers), reference = self.actions.gap(action), action.get("entityRef")
        own, other = self.spots.get(name), self.spots.get(reference)
        if own is None or other is None:
            raise ValueError(f"{name} or {reference} has no place")
        where = action.word("displacement", DISPLACEMENTS, "any")
        is_ahead = _is_ahead(own, other) if where == "any" else where == DISPLACEMENTS[1]
        ahead, behind = (name, reference) if is_ahead else (reference, name)
        away = headway * self.speed(behind) + distance
        if is_between_bumpers:
            away += self.vehicles[behind].front + self.vehicles[ahead].rear
        spot = self.lanes.along(other, away if is_ahead else -away)
        return self.lanes.beside(spot, own.lane.index - other.lane.index).shifted(own.offset)


def _entity_actions(node: Node, kind: str) -> list[Node]:
    return [one for one in node.walk() if one.tag == "EntityAction" and any(c.tag == kind for c in one.children)]


def _is_ahead(one: Spot | None, other: Spot | None) -> bool:
    """Whether a place lies ahead of another one, seen from there."""
    if one is None or other is None:
        return True
    (x, y, _), (from_x, from_y, heading) = one.world, other.world
    return (x - from_x) * math.cos(heading) + (y - from_y) * math.sin(heading) > 0.0
