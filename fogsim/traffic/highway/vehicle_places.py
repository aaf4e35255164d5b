"""Where highway-env's vehicles are: on which stretch of road, and how near the ego."""

import math
from collections.abc import Collection, Sequence

from fogsim.traffic.drivers.advice_hearing import check_edges, check_start
from fogsim.traffic.highway.fleet import Fleet
from fogsim.traffic.highway.network import edge_id
from fogsim.traffic.highway.route import lanes_ahead
from fogsim.traffic.highway.snapshot import front_bumper
from fogsim.values import Stretch


class HighwayVehiclePlaces:
    """Finds vehicles by their lanes; edges are named as in the road network. See `VehiclePlaces`."""

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        network = fleet.environment.road.network
        self._route = tuple(edge_id(*lane[:2]) for lane in lanes_ahead(network, fleet.ego))
        self._length = {
            edge_id(start, end): float(lanes[0].length)
            for start, ends in network.graph.items()
            for end, lanes in ends.items()
        }

    def on_stretch(self, stretch: Stretch, among: Collection[str] | None = None) -> dict[str, float]:
        """Vehicles on a stretch, and how far past its beginning they are [m]; see `VehiclePlaces.on_stretch`."""
        starts = self._edge_starts(stretch)
        past: dict[str, float] = {}
        for name, vehicle in self._fleet.present().items():
            start = starts.get(edge_id(*vehicle.lane_index[:2]))
            if start is not None and (among is None or name in among):
                front = vehicle.position + 0.5 * vehicle.LENGTH * vehicle.direction
                position = start + float(vehicle.lane.local_coordinates(front)[0])
                if stretch.start <= position < stretch.end:
                    past[name] = position - stretch.start
        return past

    def _edge_starts(self, stretch: Stretch) -> dict[str, float]:
        """Where the edges of a stretch's road begin along it [m]."""
        edges: Sequence[str] = stretch.edges or self._route
        check_edges(stretch, self._length)
        starts, length = {}, 0.0
        for edge in edges:
            starts[edge] = length
            length += self._length[edge]
        check_start(stretch, length)
        return starts

    def near_ego(self, distance: float, among: Collection[str] | None = None) -> list[str]:
        """Vehicles near the ego; see `VehiclePlaces.near_ego` (`distance` [m])."""
        vehicles = self._fleet.present()
        if self._fleet.ego not in vehicles.values():
            return []
        here = front_bumper(self._fleet.ego)
        asked = vehicles.keys() if among is None else among
        return [name for name in asked if math.dist(front_bumper(vehicles[name]), here) <= distance]

    def speed(self, vehicle: str) -> float:
        """Speed of a vehicle [m/s]; see `VehiclePlaces.speed`."""
        return float(self._fleet.present()[vehicle].speed)
