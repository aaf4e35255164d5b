"""Positions and gaps along the routes of SUMO's vehicles, junctions included."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from fogsim.traffic.drivers.events import signed_gap
from fogsim.traffic.sumo.link import UNKNOWN, Api, getter, is_off_lanes

MOVE_TOLERANCE = 5.0
"""Driven and straight distance between two updates may differ by this much more than a bend explains [m]."""


class RoutePosition:
    """Position of a vehicle along its route.

    Follows a route that changes on the way, and a vehicle that is moved by hand, whose odometer SUMO sets anew. Off the
    lanes, a vehicle stays where it left them.

    Parameters
    ----------
    api : Api
        The simulation.
    vehicle : str
        Id of a vehicle that is on the road.
    """

    def __init__(self, api: Api, vehicle: str) -> None:
        self._api = api
        self._vehicle = vehicle
        self._current_route = getter(api, "vehicle", "getRouteID")
        self._odometer = getter(api, "vehicle", "getDistance")
        self._last: tuple[float, float, float] | None = None
        self._begin()

    def _begin(self) -> None:
        get, vehicle = self._api.vehicle, self._vehicle
        self._route_id = get.getRouteID(vehicle)
        starts, self._length = self._edge_starts(get.getRoute(vehicle))
        edge = get.getRouteIndex(vehicle)
        lane = get.getLaneID(vehicle)
        # On a junction, the edge is the one before it and the place on the lane counts from the junction's border.
        crossed = self._edge_length(get.getRoute(vehicle)[edge]) if lane.startswith(":") else 0.0
        station = get.getLanePosition(vehicle)
        here = starts[edge] + crossed + (0.0 if station == UNKNOWN else station)
        self._offset = here - get.getDistance(vehicle)
        self._held = False
        self._place = here, self._length

    def _edge_starts(self, route: Sequence[str]) -> tuple[list[float], float]:
        """Where each edge of a route starts, and where the last one ends [m]."""
        steps = [self._edge_length(a) + self._crossing(a, b) for a, b in itertools.pairwise(route)]
        starts = [0.0, *itertools.accumulate(steps)]
        return starts, starts[-1] + self._edge_length(route[-1])

    def _edge_length(self, edge: str) -> float:
        return float(self._api.lane.getLength(f"{edge}_0"))

    def _crossing(self, edge: str, following: str) -> float:
        """Length of the way across the junction between two edges [m]; 0 in a net without inner lanes."""
        for target, inner in connections(self._api, edge):
            if target == following:
                length = 0.0
                for lane in inner:
                    length += float(self._api.lane.getLength(lane))
                return length
        return 0.0

    def update(self, here: Sequence[float], off_lanes: bool = False) -> tuple[float, float]:
        """Position of the front bumper along the route, and the route's length [m].

        Parameters
        ----------
        here : sequence of float
            Position of the front bumper [m].
        off_lanes : bool
            Whether the vehicle is off the lanes now.
        """
        if off_lanes:
            self._held, self._last = True, None
            return self._place
        driven = self._odometer(self._vehicle)
        if self._held or self._current_route(self._vehicle) != self._route_id or self._has_jumped(driven, here):
            self._begin()
        self._place = self._offset + driven, self._length
        return self._place

    def _has_jumped(self, driven: float, here: Sequence[float]) -> bool:
        """True if the vehicle cannot have driven to where it is since the last update."""
        x, y = float(here[0]), float(here[1])
        last, self._last = self._last, (driven, x, y)
        if last is None:
            return False
        way, straight = driven - last[0], math.hypot(x - last[1], y - last[2])
        return not straight - MOVE_TOLERANCE <= way <= 2.0 * straight + MOVE_TOLERANCE


class _Place(NamedTuple):
    """Where a front bumper is: on an edge of the vehicle's route, or past its end on the way across a junction."""

    edge: str
    station: float
    past_end: float


class GapToEgo:
    """Measures gaps to an ego in SUMO along the routes of both, junctions included, whichever lanes they are on.

    A vehicle is ahead if the ego's route leads to where it is, and behind if its own route leads to the ego.

    Parameters
    ----------
    api : Api
        The simulation.
    ego : str
        Id of the ego.
    """

    def __init__(self, api: Api, ego: str) -> None:
        self._api = api
        self._ego = ego

    def measure(self, vehicle: str) -> float | None:
        """Gap of a vehicle [m], with the sign and the None of `signed_gap`; None if one of them is off the lanes.

        Both must be on the road.

        Parameters
        ----------
        vehicle : str
            Its id.
        """
        if is_off_lanes(self._api, self._ego) or is_off_lanes(self._api, vehicle):
            return None
        own, other = self._place(self._ego), self._place(vehicle)
        length = self._api.vehicle.getLength
        ahead, behind = self._distance(self._ego, own, other), self._distance(vehicle, other, own)
        return signed_gap(ahead, behind, length(vehicle), length(self._ego))

    def _distance(self, vehicle: str, here: _Place, there: _Place) -> float | None:
        """Distance along a vehicle's route to another place [m]; None if its route does not lead there."""
        if here.edge == there.edge:
            apart = there.station + there.past_end - here.station - here.past_end
            if apart >= 0.0:
                return apart
        # SUMO measures from inside a junction, but only to places outside of it.
        way = float(self._api.vehicle.getDrivingDistance(vehicle, there.edge, there.station, 0))
        return way + there.past_end if way >= 0.0 else None

    def _place(self, vehicle: str) -> _Place:
        get = self._api.vehicle
        lane, position = get.getLaneID(vehicle), get.getLanePosition(vehicle)
        if not lane.startswith(":"):
            return _Place(get.getRoadID(vehicle), position, 0.0)
        edge = get.getRoute(vehicle)[get.getRouteIndex(vehicle)]
        return _Place(edge, self._api.lane.getLength(f"{edge}_0"), self._passed(edge, lane) + position)

    def _passed(self, edge: str, current: str) -> float:
        """Length of the lanes inside a junction that lie between an edge and the current lane [m]."""
        for _, inner in connections(self._api, edge):
            passed = 0.0
            for lane in inner:
                if lane == current:
                    return passed
                passed += float(self._api.lane.getLength(lane))
        return 0.0


def connections(api: Api, edge: str) -> Iterator[tuple[str, Iterator[str]]]:
    """Edges that the lanes of an edge lead to, each with the lanes inside the junction on the way there.

    Parameters
    ----------
    api : Api
        The simulation.
    edge : str
        The edge.
    """
    links = api.lane.getLinks

    def inner(lane: str) -> Iterator[str]:
        while lane:
            yield lane
            lane = next((link[4] for link in links(lane)), "")

    for index in range(api.edge.getLaneNumber(edge)):
        for link in links(f"{edge}_{index}"):
            yield link[0].rpartition("_")[0], inner(link[4])
