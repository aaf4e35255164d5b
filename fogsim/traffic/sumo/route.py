"""How far along its route a vehicle is."""

import itertools
import math
from collections.abc import Sequence

from fogsim.traffic.sumo.getters import getter
from fogsim.traffic.sumo.link import Api

UNNOTICED_MOVE = 5.0
"""Driven and straight way between two looks may differ by this much more than a bend explains [m]."""


class RouteProgress:
    """Place of a vehicle along its route, junctions included.

    Follows a route that changes on the way, and a vehicle that is moved by hand, whose odometer SUMO sets anew.

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
        self._distance = getter(api, "vehicle", "getDistance")
        self._seen_at: tuple[float, float, float] | None = None
        self._begin()

    def _begin(self) -> None:
        get, vehicle = self._api.vehicle, self._vehicle
        self._route_id = get.getRouteID(vehicle)
        starts, self._length = self._edge_starts(get.getRoute(vehicle))
        edge = get.getRouteIndex(vehicle)
        lane = get.getLaneID(vehicle)
        # On a junction, the edge is the one before it and the place on the lane counts from the junction's border.
        crossed = self._edge_length(get.getRoute(vehicle)[edge]) if lane.startswith(":") else 0.0
        here = starts[edge] + crossed + get.getLanePosition(vehicle)
        self._offset = here - get.getDistance(vehicle)

    def _edge_starts(self, route: Sequence[str]) -> tuple[list[float], float]:
        """Where each edge of a route starts, and where the last one ends [m]."""
        steps = [self._edge_length(a) + self._crossing(a, b) for a, b in itertools.pairwise(route)]
        starts = [0.0, *itertools.accumulate(steps)]
        return starts, starts[-1] + self._edge_length(route[-1])

    def _edge_length(self, edge: str) -> float:
        return float(self._api.lane.getLength(f"{edge}_0"))

    def _crossing(self, edge: str, following: str) -> float:
        """Length of the way across the junction between two edges [m]; 0 in a net without inner lanes."""
        get = self._api.lane
        for index in range(self._api.edge.getLaneNumber(edge)):
            for link in get.getLinks(f"{edge}_{index}"):
                if link[0].rpartition("_")[0] == following:
                    return self._length_through(link[4])
        return 0.0

    def _length_through(self, inner: str) -> float:
        get, length = self._api.lane, 0.0
        while inner:
            length += get.getLength(inner)
            inner = next((link[4] for link in get.getLinks(inner)), "")
        return length

    def now(self, here: Sequence[float]) -> tuple[float, float]:
        """How far along the route the front bumper is, and the route's length [m].

        Parameters
        ----------
        here : sequence of float
            Position of the front bumper [m].
        """
        driven = self._distance(self._vehicle)
        if self._current_route(self._vehicle) != self._route_id or self._has_jumped(driven, here):
            self._begin()
        return self._offset + driven, self._length

    def _has_jumped(self, driven: float, here: Sequence[float]) -> bool:
        """True if the way since the last look is none that is driven."""
        x, y = float(here[0]), float(here[1])
        last, self._seen_at = self._seen_at, (driven, x, y)
        if last is None:
            return False
        way, straight = driven - last[0], math.hypot(x - last[1], y - last[2])
        return not straight - UNNOTICED_MOVE <= way <= 2.0 * straight + UNNOTICED_MOVE
