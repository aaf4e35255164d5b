"""Positions of a file on the lanes of the network."""

import inspect
import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from fogsim.openscenario.catalogs import Catalogs
from fogsim.openscenario.elements import REFUSED
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.xml_tree import Node
from fogsim.traffic.road.opendrive_lanes import OpenDriveLanes, Spot

_ALONG = math.cos(0.3)
"""Cosine of the angle to a lane at which a vehicle still stands along it."""


@dataclass
class Positions:
    """Finds positions; relative ones refer to the known initial positions `entities`.

    `with_oncoming` if vehicles drive on the oncoming lane.
    """

    lanes: OpenDriveLanes
    catalogs: Catalogs
    with_oncoming: bool = False
    entities: dict[str, Spot] = field(default_factory=dict)

    @property
    def findings(self) -> Findings:
        """Receives what has no place."""
        return self.catalogs.findings

    def refers_to(self, position: Node) -> str | None:
        """Entity to which a ``Position`` is relative; None for an absolute one."""
        return next((one.get("entityRef") or None for one in position.children), None)

    def spot(self, position: Node) -> Spot | None:
        """Place of a ``Position``; None, and a finding, if it cannot be placed."""
        one = next(iter(position.all()), None)
        if one is None or one.tag not in _KINDS:
            message = REFUSED.get(one.tag, "") if one else "expected a position"
            self.findings.refuse(one or position, f"{message}; positions are {', '.join(_KINDS)}")
            return None
        reference = one.get("entityRef") if one.tag.startswith("Relative") else None
        if reference is not None and reference not in self.entities:
            self.findings.refuse(one, f"there is no entity {reference!r} that has a place already")
            return None
        try:
            found = _KINDS[one.tag](self, one)
            return self._turned(one, found)
        except ValueError as error:
            self.findings.refuse(one, str(error))
            return None

    def _turned(self, node: Node, spot: Spot) -> Spot:
        """Check an ``Orientation``, whose pitch and roll are the road's; ValueError unless the lane leads there."""
        orientation = node.one("Orientation")
        if orientation is None:
            return spot
        kind = self.findings.word(orientation, "type", ("relative", "absolute"), "absolute")
        if not orientation.get("h"):
            return spot
        turn, lane = self.findings.number(orientation, "h"), spot.world[2]
        if kind == "relative":
            if node.tag == "RoadPosition" and turn:
                turn += self.lanes.across(node.get("roadId"), self.findings.number(node, "s"), 0.0)[2]
            else:
                turn += self.entities[node.get("entityRef")].world[2] if node.get("entityRef") else lane
        _check_heading(turn, lane)
        return spot

    def world(self, node: Node) -> Spot:
        """The nearest lane that leads there (by `h`, where it stands); the vehicle is in the lane's middle."""
        x, y = self._numbers(node, "x", "y")
        heading = self.findings.number(node, "h") if "h" in node.attributes else None
        spot = self.lanes.at(x, y, heading)
        _check_heading(heading, spot.world[2])
        return spot

    def lane(self, node: Node) -> Spot:
        """That lane at s."""
        self._no_offset(node)
        return self.lanes.on_lane(node.get("roadId"), node.get("laneId"), self.findings.number(node, "s"))

    def road(self, node: Node) -> Spot:
        """The lane at s and t."""
        s, t = self._numbers(node, "s", "t")
        return self.lanes.at(*self.lanes.across(node.get("roadId"), s, t))

    def relative_lane(self, node: Node) -> Spot:
        """The lane by an entity's number and `dLane`, along the road's line (`ds`), or ahead of it (`dsLane`)."""
        self._no_offset(node)
        spot = self.entities[node.get("entityRef")]
        # Numbers of lanes grow to the left of the road, on whose left side vehicles drive against it.
        sense = 1.0 if all("_-" in one for one in spot.lane.origins) else -1.0
        beside = self.lanes.beside(spot, int(sense * self.findings.number(node, "dLane")))
        if "dsLane" in node.attributes:
            return self.lanes.along(beside, self.findings.number(node, "dsLane"))
        return self.lanes.farther(beside, self.findings.number(node, "ds"))

    def relative_world(self, node: Node) -> Spot:
        """The lane that is so far from an entity, along x and y."""
        x, y, heading = self.entities[node.get("entityRef")].world
        dx, dy = self._numbers(node, "dx", "dy")
        return self.lanes.at(x + dx, y + dy, heading)

    def relative_object(self, node: Node) -> Spot:
        """The lane that is so far from an entity, along its own axes."""
        x, y, heading = self.entities[node.get("entityRef")].world
        dx, dy = self._numbers(node, "dx", "dy")
        cosine, sine = math.cos(heading), math.sin(heading)
        return self.lanes.at(x + dx * cosine - dy * sine, y + dx * sine + dy * cosine, heading)

    def on_route(self, node: Node) -> Spot:
        """So far along a route from its first waypoint, on the lane of `laneId`; or where an entity is."""
        reference, place = node.one("RouteRef"), node.one("InRoutePosition")
        inner = place.one("FromLaneCoordinates", "FromCurrentEntity") if place else None
        if reference is None or inner is None:
            raise ValueError("expected a RouteRef, and an InRoutePosition from lane coordinates or an entity")
        first, edges = self.route(reference)
        if inner.tag == "FromCurrentEntity":
            if (entity := inner.get("entityRef")) not in self.entities:
                raise ValueError(f"there is no entity {entity!r} that has a place already")
            return self.entities[entity]
        spot, lane = self.lanes.along(first, self.findings.number(inner, "pathS"), edges), inner.get("laneId")
        self._no_offset(inner, "laneOffset")
        for one in self.lanes.lanes:
            if one.edge == spot.lane.edge and any(origin.endswith(f"_{lane}") for origin in one.origins):
                return Spot(one, spot.position * one.length / spot.lane.length)
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

    def _no_offset(self, node: Node, key: str = "offset") -> None:
        if self.findings.number(node, key, 0.0):
            self.findings.refuse(node, f"{key}: vehicles are in the middle of their lanes; write 0")


def _check_heading(heading: float | None, lane: float) -> None:
    """ValueError if a heading is not that of its lane."""
    if heading is not None and math.cos(heading - lane) < _ALONG:
        message = f"{math.degrees(heading - lane) % 360.0:.0f} degrees to the left of the direction of its lane"
        raise ValueError(f"h: vehicles stand, and drive, along their lanes; it stands {message}")


_KINDS: Mapping[str, Callable[[Positions, Node], Spot]] = {
    "WorldPosition": Positions.world,
    "LanePosition": Positions.lane,
    "RoadPosition": Positions.road,
    "RelativeLanePosition": Positions.relative_lane,
    "RelativeWorldPosition": Positions.relative_world,
    "RelativeObjectPosition": Positions.relative_object,
    "RoutePosition": Positions.on_route,
}

POSITIONS: Mapping[str, str] = {tag: inspect.getdoc(kind) or "" for tag, kind in _KINDS.items()}
"""Types of positions that are read, with the place of each."""
