"""highway-env as a second traffic simulation; nothing else of FogSim knows that library."""

from fogsim.traffic.highway.behaviour import DriverControl, control_drivers, limit_sight
from fogsim.traffic.highway.fleet import EGO, LEAD, Fleet, read_snapshot
from fogsim.traffic.highway.network import RouteProgress, road_network, same_roads
from fogsim.traffic.highway.traffic import HighwayTraffic, OtherRoadsError, is_highway_environment

# Their names in version 0.1.
Conduct, take_over, let_drivers_meet = DriverControl, control_drivers, limit_sight

__all__ = [
    "EGO",
    "LEAD",
    "Conduct",
    "DriverControl",
    "Fleet",
    "HighwayTraffic",
    "OtherRoadsError",
    "RouteProgress",
    "control_drivers",
    "is_highway_environment",
    "let_drivers_meet",
    "limit_sight",
    "read_snapshot",
    "road_network",
    "same_roads",
    "take_over",
]
