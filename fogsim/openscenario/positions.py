"""Positions of a file on the lanes of the network."""

import contextlib
import itertools
import math
from dataclasses import dataclass, field, replace

from fogsim.openscenario.environment import Vehicle, Vehicles
from fogsim.openscenario.parameters import Catalogs, is_of_carla
from fogsim.openscenario.shapes import positions_of, sampled, shape_of
from fogsim.openscenario.xml_tree import REFUSED, Node, NodeError, handlers
from fogsim.traffic.road.opendrive_lanes import OpenDriveLanes, Spot

Point = tuple[float, float, float | None]  # x, y [m] and heading [rad] of a place, None for any
_ON_PATH = 0.5  # Distance up to which a position is on a path [m]
_ASIDE = 0.3  # Distance across up to which a lane is where its file has it [m]
ALONG = math.cos(0.3)  # Of the angle to a lane at which a vehicle still stands along it


@dataclass
class Positions:
    """Finds positions, by the places and ways that vehicles have at first."""

    lanes: OpenDriveLanes
    catalogs: Catalogs
    vehicles: Vehicles
    with_oncoming: bool = False  # Vehicles drive on the oncoming lane.
    spots: dict[str, Spot] = field(default_factory=dict)
    ways: dict[str, tuple[str, ...]] = field(default_factory=dict)
    off_lanes: dict[str, tuple[float, float, float]] = field(default_factory=dict)  # x, y [m] and heading [rad]
    against: dict[str, Spot] = field(default_factory=dict)  # Of those off the lanes that drive against one
    moving: set[str] = field(default_factory=set)  # Vehicles that are elsewhere later
    rerouted: set[str] = field(default_factory=set)  # Vehicles that get another way
    paths: dict[str, list[tuple[float, float]]] = field(default_factory=dict)  # That vehicles follow from the start [m]
    at_once: set[int] = field(default_factory=set)  # Identities of actions of a story that are done at the beginning

    def refers_to(self, position: Node) -> str | None:
        """Entity to which a ``Position`` is relative; None for an absolute one."""
        return next((one.get("entityRef") for one in position.children if one.tag.startswith("Relative")), None)

    def on_lanes(self, position: Node, *, is_of_vehicle: bool = True) -> Spot:
        """Place of a ``Position`` on the lanes; ValueError if it has none, or a vehicle cannot stand so there."""
        one, found = self._found(position)
        spot = found if isinstance(found, Spot) else self.lanes.at(*found, one.get("roadId"), self._height(one))
        lane = spot.world[2]
        heading = self._heading(one, lane)
        if is_of_vehicle and heading is not None and math.cos(heading - lane) < ALONG:
            left = math.degrees(heading - lane) % 360.0
            message = f"it stands {left:.0f} degrees to the left of the direction of its lane"
            raise ValueError(f"h: vehicles stand, and drive, along their lanes; {message}")
        return spot

    def point(self, position: Node) -> tuple[float, float, float | None, float | None]:
        """x, y [m], heading and the road's direction [rad, None if not given] anywhere; ValueError if none."""
        one, found = self._found(position)
        x, y, along = found.world if isinstance(found, Spot) else found
        return x, y, self._heading(one, along or 0.0), along

    def along_way(self, position: Node, way: tuple[str, ...]) -> float:
        """How far along a way a ``Position`` is, also inside a junction if it is on a route [m]; ValueError if not."""
        inside = position.within("RoutePosition", "InRoutePosition")
        inner = inside.one("FromLaneCoordinates", "FromRoadCoordinates") if inside else None
        reference, edges = position.within("RoutePosition", "RouteRef"), tuple[str, ...]()
        if inner and reference:
            (spot, edges), further = self.route(reference), inner.number("pathS")
            inner.read.update(inner.attributes)
        else:
            spot, further = self.on_lanes(position, is_of_vehicle=False), 0.0
        if not {spot.lane.edge, *edges} <= {*way}:
            raise ValueError(f"{position.tag}: it is not on the way of its vehicle")
        return self.lanes.starts(way)[way.index(spot.lane.edge)] + spot.position + further

    def along_path(self, position: Node, vehicle: str) -> float:
        """How far along a vehicle's path a ``Position`` is [m]; ValueError if it is off the path."""
        x, y, *_ = self.point(position)
        feet, so_far = [], 0.0
        for (from_x, from_y), (to_x, to_y) in itertools.pairwise(self.paths[vehicle]):
            dx, dy = to_x - from_x, to_y - from_y
            length = math.hypot(dx, dy) or 1.0
            along = min(max(((x - from_x) * dx + (y - from_y) * dy) / length, 0.0), length)
            foot = from_x + along * dx / length, from_y + along * dy / length
            feet.append((math.dist((x, y), foot), so_far + along))
            so_far += math.hypot(dx, dy)
        away, place = min(feet, default=(math.inf, 0.0))
        if away > _ON_PATH:
            raise ValueError(f"{position.tag}: it is {away:.1f} m from the trajectory of {vehicle}")
        return place

    def along_ego(self, what: Vehicle | Node) -> float | None:
        """Position along the ego's route of a vehicle's front bumper at first, or a ``Position``; None off it [m]."""
        route = self.ways[self.vehicles.ego]
        spot, further = None, 0.0
        if isinstance(what, Vehicle):
            spot, further = self.spots.get(what.name), what.front
        else:
            with contextlib.suppress(ValueError):
                spot = self.on_lanes(what, is_of_vehicle=False)
        if spot is None or spot.lane.edge not in route:
            return None
        # On a closed road, the first time counts.
        return self.lanes.starts(route)[route.index(spot.lane.edge)] + spot.position + further

    def _found(self, position: Node) -> tuple[Node, Spot | Point]:
        one = position.one()
        if one is None or one.tag not in POSITIONS:
            message = REFUSED.get(one.tag, "") if one else "expected a position"
            raise ValueError(f"{message}; positions are {', '.join(POSITIONS)}")
        place: Spot | Point = POSITIONS[one.tag](self, one)
        return one, place

    def _height(self, node: Node) -> float | None:
        """Height by a world position, or that of the entity to which a position is relative [m]; None if unknown."""
        if "z" in node.attributes:
            return node.number("z")
        spot = self.spots.get(node.get("entityRef"))
        return spot.height if spot else None

    def _place_of(self, node: Node) -> Spot:
        """Place of the entity to which an element refers; ValueError if it has none, or is elsewhere by then."""
        entity = node.get("entityRef")
        if entity not in self.spots:
            raise ValueError(f"there is no entity {entity!r} that has a place already")
        if entity in self.moving:
            raise ValueError(f"outside Init, where {entity} is by then is not known; give a place on the map")
        return self.spots[entity]

    def _world_of(self, node: Node) -> tuple[float, float, float]:
        """x, y [m] and heading [rad] of the entity to which an element refers, on the lanes or off them."""
        entity = node.get("entityRef")
        if entity in self.off_lanes and entity not in self.moving:
            return self.off_lanes[entity]
        return self._place_of(node).world

    def _heading(self, node: Node, lane: float) -> float | None:
        """Heading by an ``Orientation``, whose pitch and roll are the road's, or by `h` of the position [rad]."""
        orientation = node.one("Orientation")
        if orientation is None:
            return node.number("h") if "h" in node.attributes else None
        kind = orientation.word("type", ("relative", "absolute"), "absolute")
        if not orientation.get("h"):
            return None
        turn = orientation.number("h")
        if kind == "absolute":
            return turn
        if node.tag == "RoadPosition":
            return turn + self.lanes.across(node.get("roadId"), node.number("s"), 0.0)[2] if turn else lane
        return turn + (self._world_of(node)[2] if node.tag.startswith("Relative") else lane)

    def world_position(self, node: Node) -> Point:
        """The nearest lane that leads there (by `h`, where it stands), and where in it."""
        x, y = (node.number(key) + moved for key, moved in zip("xy", self.lanes.moved, strict=True))
        return x, y, node.number("h") if "h" in node.attributes else None

    def lane_position(self, node: Node) -> Spot | Point:
        """That lane at s, and `offset` from its middle."""
        road, lane, s = node.get("roadId"), node.get("laneId"), node.number("s")
        if any(f"{road}_{lane}" in one.origins for one in self.lanes.lanes) or road not in self.lanes.roads:
            spot = self.lanes.on_lane(road, lane, s)
            x, y, heading = spot.world
            there_x, there_y, _ = self.lanes.across(road, s, self.lanes.middle(road, lane, s))
            aside = (there_y - y) * math.cos(heading) - (there_x - x) * math.sin(heading)
            if abs(aside) > _ASIDE:
                where = f"{abs(aside):.1f} m to the {'left' if aside > 0.0 else 'right'} of where FogSim has it"
                node.remark(f"lane {lane} is {where}: netconvert gives lanes that widen, or shift, one width and place")
            return self._shifted(spot, node)
        along = 1.0 if lane.startswith("-") else -1.0
        t = self.lanes.middle(road, lane, s) + along * self.leftward(along) * node.number("offset", 0.0)
        return self.lanes.across(road, s, t)

    def road_position(self, node: Node) -> Point:
        """The lane at s and t."""
        s, t = (node.number(key) for key in "st")
        return self.lanes.across(node.get("roadId"), s, t)

    def relative_lane_position(self, node: Node) -> Spot | Point:
        """The lane by an entity's number and `dLane`, along the road's line (`ds`), or ahead of it (`dsLane`)."""
        spot = self._place_of(node)
        other = self.lanes.beside(spot, int(sense(spot)) * node.whole("dLane"))
        if "dsLane" in node.attributes:
            return self._shifted(self.lanes.along(other, node.number("dsLane")), node)
        return self._shifted(self.lanes.farther(other, node.number("ds")), node)

    def relative_world_position(self, node: Node) -> Point:
        """The lane that is so far from an entity, along x and y."""
        x, y, heading = self._world_of(node)
        return x + node.number("dx"), y + node.number("dy"), heading

    def relative_object_position(self, node: Node) -> Point:
        """The lane that is so far from an entity, along its own axes."""
        x, y, heading = self._world_of(node)
        dx, dy, cosine, sine = node.number("dx"), node.number("dy"), math.cos(heading), math.sin(heading)
        return x + dx * cosine - dy * sine, y + dx * sine + dy * cosine, heading

    def relative_road_position(self, node: Node) -> Point:
        """The lane that is `ds` and `dt` from an entity, along and across its road's reference line."""
        spot = self._place_of(node)
        road, (x, y, _), ds, dt = road_of(spot), spot.world, node.number("ds"), node.number("dt")
        if road not in self.lanes.roads:
            raise ValueError(f"{node.get('entityRef')} is on no road of an OpenDRIVE file")
        middle_x, middle_y, along = self.lanes.roads[road].at(self.lanes.roads[road].nearest(x, y))
        t = (y - middle_y) * math.cos(along) - (x - middle_x) * math.sin(along)
        return self._across(spot, ds, t + dt)

    def trajectory_position(self, node: Node) -> Point:
        """So far (`s`) along a trajectory, and `t` to its left."""
        shape = shape_of(self.catalogs.need(node.need("TrajectoryRef"), "Trajectory"))
        points, _ = sampled(shape, [self.point(one) for one in positions_of(shape)], is_timed=False)
        left, t, last = node.number("s"), node.number("t", 0.0), len(points) - 2
        for n, ((x, y, *here), (to_x, to_y, *there)) in enumerate(itertools.pairwise(points)):
            length, heading = math.dist((x, y), (to_x, to_y)), math.atan2(to_y - y, to_x - x)
            # Chords are shorter than the curve.
            if left <= length + (_ON_PATH if n == last else 0.0):
                if shape.tag != "Polyline" and here and there:
                    turn = math.remainder(there[0] - here[0], 360.0)
                    heading = math.radians(here[0] + turn * left / (length or 1.0))
                cosine, sine = math.cos(heading), math.sin(heading)
                return x + left * cosine - t * sine, y + left * sine + t * cosine, heading
            left -= length
        raise ValueError(f"s: it lies {left:.1f} m beyond the end of the trajectory")

    def _across(self, spot: Spot, ds: float, t: float) -> Point:
        """The point `ds` farther along a place's road, and `t` across it [m]; ValueError without such a road."""
        road, (x, y, _) = road_of(spot), spot.world
        if road not in self.lanes.roads:
            raise ValueError("there is no road of an OpenDRIVE file there")
        return self.lanes.across(road, self.lanes.roads[road].nearest(x, y) + ds, t)

    def route_position(self, node: Node) -> Spot | Point:
        """So far along a route from its first waypoint, on the lane of `laneId`, or at `t`; or where an entity is."""
        inner = node.need("InRoutePosition").need("FromLaneCoordinates", "FromRoadCoordinates", "FromCurrentEntity")
        first, edges = self.route(node.need("RouteRef"))
        if inner.tag == "FromCurrentEntity":
            return self._place_of(inner)
        spot, lane = self.lanes.along(first, inner.number("pathS"), edges), inner.get("laneId")
        if inner.tag == "FromRoadCoordinates":
            return self._across(spot, 0.0, inner.number("t"))
        here = [one for one in self.lanes.lanes if one.edge == spot.lane.edge]
        lanes = {origin.rpartition("_")[2]: one for one in here for origin in one.origins}
        turned = lane.removeprefix("-") if lane.startswith("-") else f"-{lane}"
        found = lanes.get(lane) or lanes.get(turned)
        if found is None:
            raise ValueError(f"there is no lane {lane!r} to drive on there; the route has {', '.join(lanes)}")
        there = Spot(found, spot.position * found.length / spot.lane.length)
        if lane in lanes:
            return self._shifted(there, inner, "laneOffset")
        inner.remark(f"lane {lane} leads against the route; read as counted along it, which is lane {turned}")
        return there.shifted(inner.number("laneOffset", 0.0))

    def route(self, holder: Node) -> tuple[Spot, tuple[str, ...]]:
        """First waypoint, and edges through all waypoints, of a ``Route`` or a reference to one; ValueError if none."""
        node = self.catalogs.need(holder, "Route")
        points = node.some("Waypoint")
        if any(point.within("Position", "RoutePosition") for point in points):
            raise NodeError(node, "a waypoint needs an absolute position, not one on a route")
        known = [self.on_lanes(point.need("Position")) for point in points]
        if node.flag("closed", "false"):
            node.refuse("closed: write the waypoints of each lap")
        edges: tuple[str, ...] = (known[0].lane.edge,)
        for point, (before, after) in zip(points, itertools.pairwise(known), strict=False):
            if before.lane.edge == after.lane.edge and after.position < before.position:
                raise ValueError("a waypoint lies behind the one before")
            by = point.word("routeStrategy", ("shortest", "fastest"))
            edges += self.lanes.way(edges[-1], after.lane.edge, is_fastest=by == "fastest")[1:]
        points[-1].get("routeStrategy")
        return known[0], edges

    def leftward(self, along: float) -> float:
        """1 if offsets grow to the left of a lane, by its `sense`; for ScenarioRunner they grow to the right."""
        return -1.0 if is_of_carla(self.catalogs.root) else along

    def _shifted(self, spot: Spot, node: Node, key: str = "offset") -> Spot | Point:
        """The place so far from its lane's middle, in the direction of t; beyond the lane a point."""
        offset = self.leftward(sense(spot)) * node.number(key, 0.0)
        try:
            return spot.shifted(offset)
        except ValueError:
            return replace(spot, offset=offset).world


def from_there_on(points: list[list[float]], distance: float) -> list[list[float]]:
    """What follows of points (x, y [m], perhaps heading [°]) after a distance [m]; ValueError if nothing does."""
    if distance < 0.0:
        raise ValueError(f"initialDistanceOffset: expected at least 0, got {distance:g}")
    left = distance
    for n, (here, there) in enumerate(itertools.pairwise(points)):
        if left <= 0.0:
            return points[n:]
        if left < (length := math.dist(here[:2], there[:2])):
            share = left / length
            place = [a + share * (b - a) for a, b in zip(here[:2], there[:2], strict=True)]
            turns = [a + share * math.remainder(b - a, 360.0) for a, b in zip(here[2:], there[2:], strict=True)]
            return [[*place, *turns], *points[n + 1 :]]
        left -= length
    if distance > 0.0:
        raise ValueError(f"initialDistanceOffset: the trajectory is no longer than {distance - left:.1f} m")
    return points


def sense(spot: Spot) -> float:
    """1 on a lane along its road, -1 against it: numbers of lanes, and t, grow to the left of the road."""
    return 1.0 if all("_-" in one for one in spot.lane.origins) else -1.0


def road_of(spot: Spot | None) -> str:
    """Road on which a place is, "" if none is known."""
    return (spot.lane.origins or ("",))[0].rpartition("_")[0] if spot else ""


POSITIONS = handlers(Positions, "position")
