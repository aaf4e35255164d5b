"""Where SUMO's vehicles are: on which stretch of road, and how near the ego."""

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import NamedTuple

from fogsim.errors import InputError
from fogsim.traffic.drivers.advice_hearing import check_edges, check_start
from fogsim.traffic.sumo.link import Api, edge_length, getter, vehicle_getter
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_lanes.directions import LaneDirections, OppositeEdges
from fogsim.traffic.sumo_lanes.route_position import connections
from fogsim.values import Stretch


class _Piece(NamedTuple):
    """An edge or way inside a junction, its ends along a road [m], and the oncoming edges on which others overtake."""

    edge: str
    start: float
    end: float
    opposite: tuple[str, ...] = ()


_Spot = tuple[str, float]
"""A vehicle, and how far from the beginning of its lane it is [m]."""


class SumoVehiclePlaces:
    """Finds vehicles edge by edge; see `VehiclePlaces`."""

    def __init__(self, api: Api, ego: str | None, roster: Roster) -> None:
        self._api = api
        self._ego = ego
        self._roster = roster
        self._position = vehicle_getter(api, "getPosition3D")
        self._station = vehicle_getter(api, "getLanePosition")
        self._lane = vehicle_getter(api, "getLaneID")
        self._opposite, self._directions = OppositeEdges(api), LaneDirections(api)
        self.speed = vehicle_getter(api, "getSpeed")
        self._on_edge = getter(api, "edge", "getLastStepVehicleIDs")
        self._route: tuple[str, tuple[str, ...]] = ("", ())
        self._roads: dict[tuple[str, ...], tuple[_Piece, ...]] = {}
        self._read: tuple[float, dict[str, Sequence[_Spot]]] = math.nan, {}

    def on_stretch(self, stretch: Stretch, among: Collection[str] | None = None) -> dict[str, float]:
        """Vehicles on a stretch, and how far past its beginning they are [m]; see `VehiclePlaces.on_stretch`."""
        past = {}
        found = self._present_on if among is None else self._sorted_by_edge(among)
        for piece in self._find_pieces(stretch):
            for edge in (piece.edge, *piece.opposite):
                is_against = edge is not piece.edge
                for vehicle, station in found(edge):
                    if piece.opposite and self._directions.is_against(vehicle, self._lane(vehicle)) != is_against:
                        continue
                    # SUMO counts from where the oncoming lane begins, and far below 0 off the lanes.
                    position = piece.end - station if is_against else piece.start + station
                    if stretch.start <= position < stretch.end:
                        past[vehicle] = position - stretch.start
        return past

    def _present_on(self, edge: str) -> Sequence[_Spot]:
        time, read = self._read
        if time != self._roster.time:
            read = {}
            self._read = self._roster.time, read
        if edge not in read:
            there = [v for v in self._on_edge(edge) if v in self._roster.present]
            read[edge] = list(zip(there, map(self._station, there), strict=True))
        return read[edge]

    def _sorted_by_edge(self, vehicles: Iterable[str]) -> Callable[[str], Sequence[_Spot]]:
        there: dict[str, list[_Spot]] = {}
        for vehicle in vehicles:
            there.setdefault(self._lane(vehicle).rpartition("_")[0], []).append((vehicle, self._station(vehicle)))
        return lambda edge: there.get(edge, ())

    def _ego_route(self) -> tuple[str, ...]:
        """Edges of the ego's route; of its last one when it has left the road, none if it was not looked at before."""
        if self._ego is not None and self._ego in self._roster.present:
            route = self._api.vehicle.getRouteID(self._ego)
            if route != self._route[0]:
                self._route = (route, tuple(self._api.vehicle.getRoute(self._ego)))
        return self._route[1]

    def _find_pieces(self, stretch: Stretch) -> list[_Piece]:
        """What of a road lies on a stretch of it."""
        edges = stretch.edges or self._ego_route()
        if not edges:
            return []
        if edges not in self._roads:
            check_edges(stretch, frozenset(self._api.edge.getIDList()))
            self._roads[edges] = tuple(self._pieces_along(edges, must_follow=bool(stretch.edges)))
        road = self._roads[edges]
        check_start(stretch, road[-1].end)
        return [piece for piece in road if piece.start < stretch.end and piece.end > stretch.start]

    def _pieces_along(self, edges: Sequence[str], must_follow: bool) -> Iterator[_Piece]:
        begin = 0.0
        for edge, following in itertools.pairwise((*edges, "")):
            end = begin + edge_length(self._api, edge)
            yield _Piece(edge, begin, end, self._opposite.of(edge))
            begin = end
            ways = self._ways(edge, following)
            if following and not ways and must_follow:
                raise InputError(f"an advised stretch: no lane leads from edge {edge!r} to edge {following!r}")
            crossed: dict[str, _Piece] = {}
            back = self._ways_back(edge, following) if ways else ()
            for lanes in ways:
                at = end
                for lane in lanes:
                    inner = _Piece(lane.rpartition("_")[0], at, at + float(self._api.lane.getLength(lane)), back)
                    crossed.setdefault(inner.edge, inner)
                    at = inner.end
                # As `RoutePosition` counts: the first way is the length of the crossing.
                begin = at if begin == end else begin
            yield from crossed.values()

    def _ways(self, edge: str, following: str) -> list[list[str]]:
        """Lanes inside the junction on each way from an edge to another."""
        return [list(inner) for target, inner in connections(self._api, edge) if target == following]

    def _ways_back(self, edge: str, following: str) -> tuple[str, ...]:
        """Edges inside the junction between two edges on the ways opposite to theirs."""
        back = ((b, a) for b in self._opposite.of(following) for a in self._opposite.of(edge))
        lanes = [lane for b, a in back for inner in self._ways(b, a) for lane in inner]
        return tuple(dict.fromkeys(lane.rpartition("_")[0] for lane in lanes))

    def near_ego(self, distance: float, among: Collection[str] | None = None) -> Collection[str]:
        """Vehicles near the ego; see `VehiclePlaces.near_ego` (`distance` [m])."""
        asked = self._roster.present if among is None else among
        if self._ego is None:
            return asked
        if self._ego not in self._roster.present:
            return ()
        if distance == math.inf:
            return asked
        here = self._position(self._ego)[:2]
        return [v for v in asked if math.dist(self._position(v)[:2], here) <= distance]
