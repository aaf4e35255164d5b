"""Where every vehicle is, how it moves and how it obeys advice."""

import warnings
from pathlib import Path

from fogsim.traffic.drivers.events import BrakeEvent, Event, LampFailureEvent, LaneChangeEvent, Trigger
from fogsim.traffic.drivers.following import FOLLOWING_MODELS
from fogsim.traffic.drivers.sight import DriverSight, FogAccess
from fogsim.traffic.drivers.speed_choice import COMPLIANCES, SPEED_CHOICES, Compliance, DriverSetup
from fogsim.traffic.road.configuration import configured_files, ignored_options
from fogsim.traffic.road.demand import Demand, VehicleRoute, read_configured_demand, read_demand
from fogsim.traffic.road.network import NetEdges, read_net_edges
from fogsim.traffic.setup import ANY_EGO, AfterCollision, AnyTraffic, NetworkTraffic, Traffic, TrafficSetup
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.options import has_error_log, output_prefix
from fogsim.traffic.sumo.output_folder import OutputFolder
from fogsim.traffic.sumo.traci_link import TraciLink
from fogsim.traffic.sumo_traffic import SumoTraffic
from fogsim.traffic.user_simulation import AttachedTraffic, step_length


def libsumo_traffic(setup: TrafficSetup, outputs: Path | None = None) -> Traffic:
    """SUMO inside this process; one at a time."""
    return _libsumo(setup, outputs)


def libsumo_network_traffic(setup: TrafficSetup, outputs: Path | None = None) -> NetworkTraffic:
    """SUMO inside this process, without an ego; one at a time."""
    return _libsumo(setup, outputs)


def _libsumo(setup: TrafficSetup, outputs: Path | None) -> SumoTraffic:
    for option in ignored_options(setup.config, setup.step_length) if setup.config else ():
        warnings.warn(f"{setup.config}: {option}", stacklevel=3)
    return SumoTraffic(setup, LibsumoLink(OutputFolder(outputs, output_prefix(setup), not has_error_log(setup))))


def traci_traffic(setup: TrafficSetup, link: TraciLink) -> Traffic:
    """SUMO in another process, which the user has started."""
    return SumoTraffic(setup, link)


__all__ = [
    "ANY_EGO",
    "COMPLIANCES",
    "FOLLOWING_MODELS",
    "SPEED_CHOICES",
    "AfterCollision",
    "AnyTraffic",
    "AttachedTraffic",
    "BrakeEvent",
    "Compliance",
    "Demand",
    "DriverSetup",
    "DriverSight",
    "Event",
    "FogAccess",
    "LampFailureEvent",
    "LaneChangeEvent",
    "NetEdges",
    "NetworkTraffic",
    "TraciLink",
    "Traffic",
    "TrafficSetup",
    "Trigger",
    "VehicleRoute",
    "configured_files",
    "libsumo_network_traffic",
    "libsumo_traffic",
    "read_configured_demand",
    "read_demand",
    "read_net_edges",
    "step_length",
    "traci_traffic",
]
