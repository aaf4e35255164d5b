"""Where every vehicle is, how it moves and how it obeys advice."""

from fogsim.traffic.drivers import SPEED_CHOICES, Compliance, DriverSetup
from fogsim.traffic.protocol import Traffic
from fogsim.traffic.setup import AfterCollision, BrakeEvent, TrafficSetup
from fogsim.traffic.sight import DriverSight, FogAccess
from fogsim.traffic.sumo_library import LibsumoLink
from fogsim.traffic.sumo_traffic import SumoTraffic
from fogsim.traffic.traci_link import TraciLink


def libsumo_traffic(setup: TrafficSetup) -> Traffic:
    """SUMO inside this process; one at a time.

    Parameters
    ----------
    setup : TrafficSetup
        The simulation and its ego.
    """
    return SumoTraffic(setup, LibsumoLink())


def traci_traffic(setup: TrafficSetup, link: TraciLink) -> Traffic:
    """SUMO in another process, which the user has started.

    Parameters
    ----------
    setup : TrafficSetup
        The simulation and its ego.
    link : TraciLink
        Where it listens.
    """
    return SumoTraffic(setup, link)


__all__ = [
    "SPEED_CHOICES",
    "AfterCollision",
    "BrakeEvent",
    "Compliance",
    "DriverSetup",
    "DriverSight",
    "FogAccess",
    "Traffic",
    "TraciLink",
    "TrafficSetup",
    "libsumo_traffic",
    "traci_traffic",
]
