"""Where every vehicle is, how it moves and how it obeys advice."""

from fogsim.traffic.drivers import SPEED_CHOICES, Compliance, DriverSetup
from fogsim.traffic.protocol import Traffic
from fogsim.traffic.setup import AfterCollision, BrakeEvent, TrafficSetup
from fogsim.traffic.sight import DriverSight, FogAccess
from fogsim.traffic.sumo_library import LibsumoLink
from fogsim.traffic.sumo_traffic import SumoTraffic


def libsumo_traffic(setup: TrafficSetup) -> Traffic:
    """SUMO inside this process; one at a time.

    Parameters
    ----------
    setup : TrafficSetup
        The simulation and its ego.
    """
    return SumoTraffic(setup, LibsumoLink())


__all__ = [
    "SPEED_CHOICES",
    "AfterCollision",
    "BrakeEvent",
    "Compliance",
    "DriverSetup",
    "DriverSight",
    "FogAccess",
    "Traffic",
    "TrafficSetup",
    "libsumo_traffic",
]
