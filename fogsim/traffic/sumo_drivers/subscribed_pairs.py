"""Leaders and speeds that SUMO sends with each step, for simulations that run in another process."""

from collections.abc import Mapping
from typing import Any

from fogsim.traffic.sumo.link import Api

# Numbers of variables in SUMO's TraCI protocol.
_LEADER = 0x68
_SPEED = 0x40


class SubscribedPairs:
    """Stands in for ``getLeader`` and ``getSpeed``: each vehicle is subscribed to once, and then asking is free.

    Parameters
    ----------
    api : Api
        A connection of traci.
    reach : float
        How far ahead leaders are looked for [m].
    """

    def __init__(self, api: Api, reach: float) -> None:
        self._vehicles = api.vehicle
        self._results = api.vehicle.getSubscriptionResults
        self._reach = reach

    def leader(self, vehicle: str, _: float) -> tuple[str, float]:
        """Leader of a vehicle, empty if there is none, and the gap to it [m]."""
        leader: tuple[str, float] = self._of(vehicle)[_LEADER]
        return leader

    def speed(self, vehicle: str) -> float:
        """Speed of a vehicle [m/s]."""
        return float(self._of(vehicle)[_SPEED])

    def _of(self, vehicle: str) -> Mapping[int, Any]:
        results: Mapping[int, Any] = self._results(vehicle)
        if _LEADER not in results or _SPEED not in results:
            # SUMO adds them to what the user may have subscribed to.
            self._vehicles.subscribe(vehicle, (_SPEED, _LEADER), parameters={_LEADER: ("d", self._reach)})
            results = self._results(vehicle)
        return results
