"""Positions and gaps along the routes of SUMO's vehicles, junctions included."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from fogsim.traffic.drivers.events import signed_gap
from fogsim.traffic.sumo.link import UNKNOWN, Api, edge_length, getter, inner_lanes, is_off_lanes
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.values import TrafficState

_MOVE_TOLERANCE = 5.0
"""Driven and straight distance between two updates may differ by this much more than a bend explains [m]."""


_FASTER = 2.0  # times its speed is what a vehicle reaches at most before it is seen again [-]


class _RouteLengths:
    """Lengths of routes, with the ways across the junctions between their edges."""

    def __init__(self, api: Api) -> None:
        self._api = api

    def across(self, edge: str, following: str) -> float:
        """Length of the way across the junction between two edges [m]; 0 in a net without inner lanes."""
        for target, inner in connections(self._api, edge):
            if target == following:
                return sum(float(self._api.lane.getLength(lane)) for lane in inner)
        return 0.0

    def starts(self, route: Sequence[str]) -> tuple[list[float], float]:
        """Where each edge of a route starts, and where the last one ends [m]."""
        steps = [edge_length(self._api, a) + self.across(a, b) for a, b in itertools.pairwise(route)]
        starts = [0.0, *itertools.accumulate(steps)]
        return starts, starts[-1] + edge_length(self._api, route[-1])


class Place(NamedTuple):
    """Where a front bumper is: on an edge of the vehicle's route, or past its end on the way across a junction."""

    edge: str  # The edge
    number: int  # Its number in the route
    # station, past_end: way from the edge's beginning, at most to its end, and from its end on [m]
    station: float
    past_end: float


class RoutePlaces:
    """Finds vehicles on their routes, also those that overtake on the oncoming lane."""

    def __init__(self, api: Api) -> None:
        self._api = api
        self._lengths = _RouteLengths(api)
        self.directions = LaneDirections(api)

    def find(self, vehicle: str) -> Place:
        """Where a vehicle on the road is."""
        get = self._api.vehicle
        lane, station = get.getLaneID(vehicle), float(get.getLanePosition(vehicle))
        station = 0.0 if station == UNKNOWN else station
        route, index = get.getRoute(vehicle), max(int(get.getRouteIndex(vehicle)), 0)
        edge, is_inside = route[index], lane.startswith(":")
        length = edge_length(self._api, edge)
        if self.directions.is_against(vehicle, lane):
            # SUMO counts from where the oncoming lane begins.
            left = float(self._api.lane.getLength(lane)) - station
            if not is_inside:
                return Place(edge, index, min(left, length), 0.0)
            return Place(edge, index, length, left)
        if not is_inside:
            # SUMO breaks down when it is asked for the edge of a vehicle that has never been on a lane.
            return Place(lane.rpartition("_")[0] or edge, index, station, 0.0)
        return Place(edge, index, length, self._passed(edge, lane) + station)

    def _passed(self, edge: str, current: str) -> float:
        """Length of the lanes inside a junction that lie between an edge and the current lane [m]."""
        for _, inner in connections(self._api, edge):
            passed = 0.0
            for lane in inner:
                if lane == current:
                    return passed
                passed += float(self._api.lane.getLength(lane))
        return 0.0

    def distance(self, vehicle: str, here: Place, there: Place) -> float | None:
        """Distance along a vehicle's route from its own place to another [m]; None if its route does not lead there."""
        if here.edge == there.edge:
            apart = there.station + there.past_end - here.station - here.past_end
            if apart >= 0.0:
                return apart
        get = self._api.vehicle
        if self.directions.is_against(vehicle, get.getLaneID(vehicle)):
            return self._counted(get.getRoute(vehicle)[here.number :], here, there)
        # SUMO measures from inside a junction, but only to places outside of it.
        way = float(get.getDrivingDistance(vehicle, there.edge, there.station, 0))
        return way + there.past_end if way >= 0.0 else None

    def _counted(self, route: Sequence[str], here: Place, there: Place) -> float | None:
        """Distance along the rest of a route, from the edge on."""
        if there.edge not in route[1:]:
            return None
        starts, _ = self._lengths.starts(route[: route.index(there.edge, 1) + 1])
        return starts[-1] + there.station + there.past_end - here.station - here.past_end


class RoutePosition:
    """Position of a vehicle along its route.

    Follows a route that changes on the way, and a vehicle that is moved by hand, whose odometer SUMO resets. Off the
    lanes, a vehicle stays where it left them.
    """

    def __init__(self, api: Api, vehicle: str) -> None:
        self._api = api
        self._vehicle = vehicle
        self._current_route = getter(api, "vehicle", "getRouteID")
        self._lengths, self._places = _RouteLengths(api), RoutePlaces(api)
        self._last: tuple[float, float, float] | None = None
        self._begin()

    def _begin(self) -> None:
        get, vehicle = self._api.vehicle, self._vehicle
        self._route_id = get.getRouteID(vehicle)
        starts, self._length = self._lengths.starts(get.getRoute(vehicle))
        self._last_edge_start = starts[-1]
        place = self._places.find(vehicle)
        here = starts[place.number] + place.station + place.past_end
        self._offset = here - self._places.directions.driven(vehicle)
        self._held = False
        self._place = here, self._length

    def update(self, here: Sequence[float], lane: str) -> tuple[float, float]:
        """Position of the front bumper along the route, and the route's length [m] (`here` [m])."""
        if not lane:
            self._held, self._last = True, None
            return self._place
        driven = self._places.directions.driven(self._vehicle, lane)
        is_known = not self._held and self._current_route(self._vehicle) == self._route_id
        if not is_known or self._has_jumped(driven, here):
            self._begin()
        self._place = self._offset + driven, self._length
        return self._place

    def may_end(self, last: TrafficState, now: float) -> bool:
        """Whether the vehicle, seen last in a state, can have been on its route's last edge since (`now` [s])."""
        speed = float(last.speed[last.ids.index(self._vehicle)])
        return self._place[0] + _FASTER * speed * (now - last.time) >= self._last_edge_start

    def _has_jumped(self, driven: float, here: Sequence[float]) -> bool:
        """True if the vehicle cannot have driven to where it is since the last update."""
        x, y = float(here[0]), float(here[1])
        last, self._last = self._last, (driven, x, y)
        if last is None:
            return False
        way, straight = driven - last[0], math.hypot(x - last[1], y - last[2])
        return not straight - _MOVE_TOLERANCE <= way <= 2.0 * straight + _MOVE_TOLERANCE


class GapToEgo:
    """Measures gaps to an ego in SUMO along the routes of both, junctions included, whichever lanes they are on.

    A vehicle is ahead if the ego's route leads to where it is, and behind if its own route leads to the ego.
    """

    def __init__(self, api: Api, ego: str) -> None:
        self._api, self._places = api, RoutePlaces(api)
        self._length = api.vehicle.getLength
        self._ego = ego

    def measure(self, vehicle: str) -> float | None:
        """Gap of a vehicle on the road [m], with the sign and None of `signed_gap`; None if either is off the lanes."""
        if is_off_lanes(self._api, self._ego) or is_off_lanes(self._api, vehicle):
            return None
        find, distance, length = self._places.find, self._places.distance, self._length
        own, other = find(self._ego), find(vehicle)
        ahead, behind = distance(self._ego, own, other), distance(vehicle, other, own)
        return signed_gap(ahead, behind, length(vehicle), length(self._ego))


def connections(api: Api, edge: str) -> Iterator[tuple[str, Iterator[str]]]:
    """Edges that the lanes of an edge lead to, each with the lanes inside the junction on the way there."""
    links = api.lane.getLinks
    for index in range(api.edge.getLaneNumber(edge)):
        for link in links(f"{edge}_{index}"):
            yield link[0].rpartition("_")[0], inner_lanes(links, link[4])
