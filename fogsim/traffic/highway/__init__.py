"""highway-env as a second traffic simulation; nothing else of FogSim knows that library."""

from fogsim.traffic.highway.behaviour import Conduct, take_over
from fogsim.traffic.highway.fleet import EGO, LEAD, Fleet
from fogsim.traffic.highway.network import road_network, same_roads
from fogsim.traffic.highway.snapshot import read_snapshot
from fogsim.traffic.highway.traffic import HighwayTraffic, is_highway_environment

__all__ = [
    "EGO",
    "LEAD",
    "Conduct",
    "Fleet",
    "HighwayTraffic",
    "is_highway_environment",
    "read_snapshot",
    "road_network",
    "same_roads",
    "take_over",
]
