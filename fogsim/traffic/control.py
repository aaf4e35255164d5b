"""Making vehicles drive at the speeds that they are told."""

import math
from collections.abc import Mapping

from fogsim.traffic.governor import governed_speed
from fogsim.traffic.link import Api

Order = tuple[float, float]
"""Target speed [m/s], ``inf`` to free the vehicle, and the deceleration to reach it with [m/s²]."""

_SUMO_DRIVES = -1.0


class SpeedControl:
    """Carries out orders; remembers which vehicles are held, to free them again.

    Parameters
    ----------
    api : Api
        The simulation.
    step_length : float
        Time between two calls [s].
    """

    def __init__(self, api: Api, step_length: float) -> None:
        self._vehicles = api.vehicle
        self._step_length = step_length
        self._held: set[str] = set()

    def carry_out(self, orders: Mapping[str, Order]) -> None:
        """Carry out the orders of this step, each for a vehicle that is on the road."""
        for vehicle, (target, deceleration) in orders.items():
            if math.isfinite(target):
                self._hold(vehicle, target, deceleration)
            elif vehicle in self._held:
                self._vehicles.setSpeed(vehicle, _SUMO_DRIVES)
                self._held.discard(vehicle)

    def _hold(self, vehicle: str, target: float, deceleration: float) -> None:
        # An order is no licence to speed: what the driver would not drive by itself is not asked of it.
        allowed = min(target, self._vehicles.getAllowedSpeed(vehicle))
        speed = self._vehicles.getSpeed(vehicle)
        self._vehicles.setSpeed(vehicle, governed_speed(speed, allowed, deceleration, self._step_length))
        self._held.add(vehicle)
