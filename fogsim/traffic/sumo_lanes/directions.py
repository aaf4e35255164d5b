"""Which vehicles drive on the oncoming lane, where SUMO counts their position from the far end."""

import functools
import itertools
import math
from collections.abc import Sequence

from fogsim.traffic.sumo.link import Api, getter, vehicle_getter


class OppositeEdges:
    """Edges that lead from an edge's end back to its beginning: the other side of a two-way road."""

    def __init__(self, api: Api) -> None:
        self._from, self._to = getter(api, "edge", "getFromJunction"), getter(api, "edge", "getToJunction")
        self._outgoing = getter(api, "junction", "getOutgoingEdges")
        self._known: dict[str, tuple[str, ...]] = {}

    def of(self, edge: str) -> tuple[str, ...]:
        """Ids of the edges opposite to one; none for what lies inside a junction."""
        known = self._known.get(edge)
        if known is None:
            inside = not edge or edge.startswith(":")
            back = () if inside else self._outgoing(self._to(edge))
            known = tuple(e for e in back if not e.startswith(":") and self._to(e) == self._from(edge))
            self._known[edge] = known
        return known


class LaneDirections:
    """Finds vehicles that drive against the direction of their lane, such as those overtaking on the oncoming one."""

    def __init__(self, api: Api) -> None:
        self._get = api.vehicle
        self._angle = vehicle_getter(api, "getAngle")
        self._lane_angle, self._links = getter(api, "lane", "getAngle"), getter(api, "lane", "getLinks")
        self._distance, self._length = vehicle_getter(api, "getDistance"), getter(api, "lane", "getLength")
        self._lane, self._station = vehicle_getter(api, "getLaneID"), vehicle_getter(api, "getLanePosition")
        self._opposite = OppositeEdges(api)
        self._known: dict[str, tuple[str, bool]] = {}
        self.is_two_way = functools.cache(self._is_two_way)
        """Whether somebody may overtake on a lane against its direction; inside junctions it is taken to be so."""

    def is_against(self, vehicle: str, lane: str) -> bool:
        """Whether a vehicle drives against the direction of its lane; read again only where the lane is another."""
        if vehicle not in self._known or self._known[vehicle][0] != lane:
            self._known[vehicle] = lane, self.is_two_way(lane) and self._turns_back(vehicle, lane)
        return self._known[vehicle][1]

    def against(self, vehicles: Sequence[str], lanes: Sequence[str]) -> list[int]:
        """Rows of those of some vehicles that drive against the direction of their lanes."""
        both = enumerate(zip(lanes, map(self._known.get, vehicles, itertools.repeat(("", False))), strict=True))
        return [
            row
            for row, (lane, known) in both
            if (known[1] if known[0] == lane else self.is_two_way(lane) and self.is_against(vehicles[row], lane))
        ]

    def _is_two_way(self, lane: str) -> bool:
        edge = lane.rpartition("_")[0]
        return edge.startswith(":") or bool(self._opposite.of(edge))

    def _turns_back(self, vehicle: str, lane: str) -> bool:
        turn = self._angle(vehicle) - self._lane_angle(lane, self._station(vehicle))
        if math.cos(math.radians(turn)) >= 0.0:
            return False
        # The angle of a long vehicle is that of the chord between its ends, whatever its lane does; any has one such
        # where it turns round inside a junction.
        route, index = self._get.getRoute(vehicle), int(self._get.getRouteIndex(vehicle))
        edge, following = lane.rpartition("_")[0], route[index + 1 : index + 2]
        if edge.startswith(":"):
            return not any(link[0].rpartition("_")[0] in following for link in self._links(lane))
        return index < 0 or edge != route[index]

    def driven(self, vehicle: str, lane: str | None = None) -> float:
        """Distance that a vehicle has driven [m]; SUMO's own jumps where it overtakes on the oncoming lane."""
        distance = float(self._distance(vehicle))
        lane = self._lane(vehicle) if lane is None else lane
        if self.is_against(vehicle, lane):
            distance += float(self._length(lane)) - 2.0 * float(self._station(vehicle))
        return distance
