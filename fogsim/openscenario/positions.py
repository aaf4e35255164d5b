"""Positions of a file on the lanes of the network."""

import inspect
import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from fogsim.openscenario.catalogs import Catalogs
from fogsim.openscenario.elements import REFUSED
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.xml_tree import Node
from fogsim.traffic.road.opendrive_lanes import OpenDriveLanes, Spot

Point = tuple[float, float, float | None]
"""x, y [m] and heading [rad] of a place, None for any."""

ALONG = math.cos(0.3)
"""Cosine of the angle to a lane at which a vehicle still stands along it."""


@dataclass
class Positions:
    """Finds positions; relative ones refer to the known initial positions `entities`, whose ways are `ways`.

    `off_lanes` are x, y [m] and heading [rad] of those that begin on no lane, or turned on one; of these, vehicles that
    drive `against` a lane have the place that the file names. Those `moving` are elsewhere later, those `rerouted` on
    another way. `with_oncoming` if
    vehicles drive on the oncoming lane.
    """

    lanes: OpenDriveLanes
    catalogs: Catalogs
    with_oncoming: bool = False
    entities: dict[str, Spot] = field(default_factory=dict)
    ways: dict[str, tuple[str, ...]] = field(default_factory=dict)
    off_lanes: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    against: dict[str, Spot] = field(default_factory=dict)
    moving: set[str] = field(default_factory=set)
    rerouted: set[str] = field(default_factory=set)

    @property
    def findings(self) -> Findings:
        """Receives what has no place."""
        return self.catalogs.findings

    def refers_to(self, position: Node) -> str | None:
        """Entity to which a ``Position`` is relative; None for an absolute one."""
        return next((one.get("entityRef") or None for one in position.children), None)

    def spot(self, position: Node) -> Spot | None:
        """Place of a ``Position``; None, and a finding, if it cannot be placed, or a vehicle cannot stand so there."""
        try:
            return self.on_lanes(position)
        except ValueError as error:
            self.findings.refuse(next(iter(position.children), position), str(error))
            return None

    def on_lanes(self, position: Node, *, is_of_vehicle: bool = True) -> Spot:
        """Place of a ``Position`` on the lanes; ValueError if it has none, or a vehicle cannot stand so there."""
        one, found = self._found(position)
        spot = found if isinstance(found, Spot) else self.lanes.at(*found)
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
        starts, one = self.lanes.starts(way), position.one("RoutePosition")
        inner = one.within("InRoutePosition", "FromLaneCoordinates") if one else None
        reference = one.one("RouteRef") if one and inner else None
        edges: tuple[str, ...] = ()
        if inner and reference:
            (spot, edges), further = self.route(reference), self.findings.number(inner, "pathS")
            inner.read.update(inner.attributes)
        else:
            spot, further = self.on_lanes(position, is_of_vehicle=False), 0.0
        if not {spot.lane.edge, *edges} <= {*way}:
            raise ValueError(f"{position.tag}: it is not on the way of its vehicle")
        return starts[way.index(spot.lane.edge)] + spot.position + further

    def named(self, position: Node) -> Spot | None:
        """Place in the middle of the lane that a ``LanePosition`` names, whatever its offset."""
        one = next(iter(position.children), position)
        if one.tag != "LanePosition":
            return None
        return self.lanes.on_lane(one.get("roadId"), one.get("laneId"), self.findings.number(one, "s"))

    def _found(self, position: Node) -> tuple[Node, Spot | Point]:
        one = next(iter(position.all()), None)
        if one is None or one.tag not in _KINDS:
            message = REFUSED.get(one.tag, "") if one else "expected a position"
            raise ValueError(f"{message}; positions are {', '.join(_KINDS)}")
        reference = one.get("entityRef") if one.tag.startswith("Relative") else None
        if reference is not None and reference not in self.entities:
            raise ValueError(f"there is no entity {reference!r} that has a place already")
        self._check_standing(reference)
        return one, _KINDS[one.tag](self, one)

    def _check_standing(self, entity: str | None) -> None:
        if entity in self.moving:
            raise ValueError(f"outside Init, where {entity} is by then is not known; give a place on the map")

    def _heading(self, node: Node, lane: float) -> float | None:
        """Heading by an ``Orientation``, whose pitch and roll are the road's, or by `h` of the position [rad]."""
        orientation = node.one("Orientation")
        if orientation is None:
            return self.findings.number(node, "h") if "h" in node.attributes else None
        kind = self.findings.word(orientation, "type", ("relative", "absolute"), "absolute")
        if not orientation.get("h"):
            return None
        turn = self.findings.number(orientation, "h")
        if kind == "absolute":
            return turn
        if node.tag == "RoadPosition":
            return (
                turn + self.lanes.across(node.get("roadId"), self.findings.number(node, "s"), 0.0)[2] if turn else lane
            )
        return turn + (self.entities[node.get("entityRef")].world[2] if node.get("entityRef") else lane)

    def world(self, node: Node) -> Point:
        """The nearest lane that leads there (by `h`, where it stands), and where in it."""
        x, y = self._numbers(node, "x", "y")
        return x, y, self.findings.number(node, "h") if "h" in node.attributes else None

    def lane(self, node: Node) -> Spot | Point:
        """That lane at s, and `offset` from its middle."""
        road, lane, s = node.get("roadId"), node.get("laneId"), self.findings.number(node, "s")
        if any(f"{road}_{lane}" in one.origins for one in self.lanes.lanes) or road not in self.lanes.roads:
            return self._shifted(self.lanes.on_lane(road, lane, s), node)
        t = self.lanes.middle(road, lane, s) + self.findings.number(node, "offset", 0.0)
        return self.lanes.across(road, s, t)

    def road(self, node: Node) -> Point:
        """The lane at s and t."""
        s, t = self._numbers(node, "s", "t")
        return self.lanes.across(node.get("roadId"), s, t)

    def relative_lane(self, node: Node) -> Spot | Point:
        """The lane by an entity's number and `dLane`, along the road's line (`ds`), or ahead of it (`dsLane`)."""
        spot = self.entities[node.get("entityRef")]
        beside = self.lanes.beside(spot, int(sense(spot) * self.findings.number(node, "dLane")))
        if "dsLane" in node.attributes:
            return self._shifted(self.lanes.along(beside, self.findings.number(node, "dsLane")), node)
        return self._shifted(self.lanes.farther(beside, self.findings.number(node, "ds")), node)

    def relative_world(self, node: Node) -> Point:
        """The lane that is so far from an entity, along x and y."""
        x, y, heading = self.entities[node.get("entityRef")].world
        dx, dy = self._numbers(node, "dx", "dy")
        return x + dx, y + dy, heading

    def relative_object(self, node: Node) -> Point:
        """The lane that is so far from an entity, along its own axes."""
        x, y, heading = self.entities[node.get("entityRef")].world
        dx, dy = self._numbers(node, "dx", "dy")
        cosine, sine = math.cos(heading), math.sin(heading)
        return x + dx * cosine - dy * sine, y + dx * sine + dy * cosine, heading

    def relative_road(self, node: Node) -> Point:
        """The lane that is `ds` and `dt` from an entity, along and across its road's reference line."""
        spot = self.entities[node.get("entityRef")]
        road, (x, y, _), (ds, dt) = (
            (spot.lane.origins or ("_",))[0].rpartition("_")[0],
            spot.world,
            self._numbers(node, "ds", "dt"),
        )
        if road not in self.lanes.roads:
            raise ValueError(f"{node.get('entityRef')} is on no road of an OpenDRIVE file")
        s = self.lanes.roads[road].nearest(x, y)
        middle_x, middle_y, along = self.lanes.roads[road].at(s)
        t = (y - middle_y) * math.cos(along) - (x - middle_x) * math.sin(along)
        return self.lanes.across(road, s + ds, t + dt)

    def on_route(self, node: Node) -> Spot | Point:
        """So far along a route from its first waypoint, on the lane of `laneId`; or where an entity is."""
        reference, place = node.one("RouteRef"), node.one("InRoutePosition")
        inner = place.one("FromLaneCoordinates", "FromCurrentEntity") if place else None
        if reference is None or inner is None:
            raise ValueError("expected a RouteRef, and an InRoutePosition from lane coordinates or an entity")
        first, edges = self.route(reference)
        if inner.tag == "FromCurrentEntity":
            if (entity := inner.get("entityRef")) not in self.entities:
                raise ValueError(f"there is no entity {entity!r} that has a place already")
            self._check_standing(entity)
            return self.entities[entity]
        spot, lane = self.lanes.along(first, self.findings.number(inner, "pathS"), edges), inner.get("laneId")
        for one in self.lanes.lanes:
            if one.edge == spot.lane.edge and any(origin.endswith(f"_{lane}") for origin in one.origins):
                return self._shifted(Spot(one, spot.position * one.length / spot.lane.length), inner, "laneOffset")
        raise ValueError(f"there is no lane {lane!r} to drive on there")

    def route(self, holder: Node) -> tuple[Spot, tuple[str, ...]]:
        """First waypoint, and edges through all waypoints, of a ``Route`` or a reference to one; ValueError if none."""
        reference = holder.one("CatalogReference")
        node = self.catalogs.entry(reference) if reference else holder.one("Route")
        points = node.all("Waypoint") if node else []
        spots = [self.spot(position) for point in points for position in point.all("Position")]
        known = [spot for spot in spots if spot is not None]
        if node is None or not known or len(known) != len(points):
            raise ValueError("expected a Route of Waypoints that have a Position")
        if self.findings.flag(node, "closed", "false"):
            self.findings.refuse(node, "closed: write the waypoints of each lap")
        edges: tuple[str, ...] = (known[0].lane.edge,)
        for point, (before, after) in zip(points, itertools.pairwise(known), strict=False):
            if before.lane.edge == after.lane.edge and after.position < before.position:
                raise ValueError("a waypoint lies behind the one before")
            by = self.findings.word(point, "routeStrategy", ("shortest", "fastest"))
            edges += self.lanes.way(edges[-1], after.lane.edge, is_fastest=by == "fastest")[1:]
        points[-1].get("routeStrategy")
        if reference:
            self.findings.look_for_unread(node)
        return known[0], edges

    def _numbers(self, node: Node, *keys: str) -> tuple[float, float]:
        first, second = (self.findings.number(node, key) for key in keys)
        return first, second

    def _shifted(self, spot: Spot, node: Node, key: str = "offset") -> Spot | Point:
        """The place so far from its lane's middle, in the direction of t; beyond the lane a point."""
        offset = sense(spot) * self.findings.number(node, key, 0.0)
        try:
            return spot.shifted(offset)
        except ValueError:
            return replace(spot, offset=offset).world


def sense(spot: Spot) -> float:
    """1 on a lane along its road, -1 against it: numbers of lanes, and t, grow to the left of the road."""
    return 1.0 if all("_-" in one for one in spot.lane.origins) else -1.0


_KINDS: Mapping[str, Callable[[Positions, Node], Spot | Point]] = {
    "WorldPosition": Positions.world,
    "LanePosition": Positions.lane,
    "RoadPosition": Positions.road,
    "RelativeLanePosition": Positions.relative_lane,
    "RelativeWorldPosition": Positions.relative_world,
    "RelativeObjectPosition": Positions.relative_object,
    "RelativeRoadPosition": Positions.relative_road,
    "RoutePosition": Positions.on_route,
}

POSITIONS: Mapping[str, str] = {tag: inspect.getdoc(kind) or "" for tag, kind in _KINDS.items()}
"""Types of positions that are read, with the place of each."""
