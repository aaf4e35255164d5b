"""highway-env as a second traffic simulation; nothing else of FogSim knows that library."""

from fogsim.traffic.highway.behaviour import control_drivers, limit_sight
from fogsim.traffic.highway.fleet import EGO, LEAD, Fleet, read_snapshot
from fogsim.traffic.highway.network import RouteProgress, road_network, same_roads
from fogsim.traffic.highway.traffic import HighwayTraffic, OtherRoadsError, is_highway_environment

__all__ = [
    "EGO",
    "LEAD",
    "Fleet",
    "HighwayTraffic",
    "OtherRoadsError",
    "RouteProgress",
    "control_drivers",
    "is_highway_environment",
    "limit_sight",
    "read_snapshot",
    "road_network",
    "same_roads",
]
