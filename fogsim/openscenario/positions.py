"""Positions of a file on the lanes of the network."""

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from fogsim.openscenario.elements import REFUSED
from fogsim.openscenario.findings import Findings
from fogsim.openscenario.xml_tree import Node
from fogsim.traffic.road.opendrive_lanes import OpenDriveLanes, Spot

_ALONG = math.cos(0.3)
"""Cosine of the angle to a lane at which a vehicle still stands along it."""


@dataclass
class Positions:
    """Finds positions; relative ones refer to the known initial positions `entities`."""

    lanes: OpenDriveLanes
    findings: Findings
    entities: dict[str, Spot] = field(default_factory=dict)

    def refers_to(self, position: Node) -> str | None:
        """Entity to which a ``Position`` is relative; None for an absolute one."""
        return next((one.attributes.get("entityRef") for one in position.children), None)

    def spot(self, position: Node) -> Spot | None:
        """Place of a ``Position``; None, and a finding, if it cannot be placed."""
        one = next(iter(position.all()), None)
        if one is None or one.tag not in _KINDS:
            told = REFUSED.get(one.tag, "") if one else "expected a position"
            self.findings.refuse(one or position, f"{told}; positions are {', '.join(_KINDS)}")
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
        """The lane by an entity's number and `dLane`, so far along the road (`ds`), or ahead of it (`dsLane`)."""
        self._no_offset(node)
        spot = self.entities[node.get("entityRef")]
        # Numbers of lanes grow to the left of the road, on whose left side vehicles drive against it.
        sense = 1.0 if all("_-" in one for one in spot.lane.origins) else -1.0
        beside = self.lanes.beside(spot, int(sense * self.findings.number(node, "dLane")))
        if "dsLane" in node.attributes:
            return self.lanes.along(beside, self.findings.number(node, "dsLane"))
        return self.lanes.along(beside, sense * self.findings.number(node, "ds"))

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

    def _numbers(self, node: Node, *keys: str) -> tuple[float, float]:
        first, second = (self.findings.number(node, key) for key in keys)
        return first, second

    def _no_offset(self, node: Node) -> None:
        if self.findings.number(node, "offset", 0.0):
            self.findings.refuse(node, "offset: vehicles are in the middle of their lanes; write 0")


def _check_heading(heading: float | None, lane: float) -> None:
    """ValueError if a heading is not that of its lane."""
    if heading is not None and math.cos(heading - lane) < _ALONG:
        told = f"{math.degrees(heading - lane) % 360.0:.0f} degrees to the left of the direction of its lane"
        raise ValueError(f"h: vehicles stand, and drive, along their lanes; it stands {told}")


_KINDS: Mapping[str, Callable[[Positions, Node], Spot]] = {
    "WorldPosition": Positions.world,
    "LanePosition": Positions.lane,
    "RoadPosition": Positions.road,
    "RelativeLanePosition": Positions.relative_lane,
    "RelativeWorldPosition": Positions.relative_world,
    "RelativeObjectPosition": Positions.relative_object,
}

POSITIONS: Mapping[str, str] = {tag: inspect.getdoc(kind) or "" for tag, kind in _KINDS.items()}
"""Types of positions that are read, with the place of each."""
