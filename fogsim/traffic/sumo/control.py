"""Making vehicles drive at the speeds that they are told."""

import math
from collections.abc import Collection, Iterable, Mapping

from fogsim.traffic.drivers.deceleration import governed_speed
from fogsim.traffic.drivers.events import Order
from fogsim.traffic.sumo.claims import LANE_CHANGE_MODE, SOLE_SESSION, Claims
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.roster import Roster

_SUMO_DRIVES = -1.0
_NO_LANE_CHANGES = 0


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

    def release(self, present: Collection[str]) -> None:
        """Free all vehicles that are held and still on the road."""
        for vehicle in self._held.intersection(present):
            self._vehicles.setSpeed(vehicle, _SUMO_DRIVES)
        self._held.clear()

    def _hold(self, vehicle: str, target: float, deceleration: float) -> None:
        # An order is no licence to speed: what the driver would not drive by itself is not asked of it.
        allowed = min(target, self._vehicles.getAllowedSpeed(vehicle))
        speed = self._vehicles.getSpeed(vehicle)
        self._vehicles.setSpeed(vehicle, governed_speed(speed, allowed, deceleration, self._step_length))
        self._held.add(vehicle)


class LaneKeeping:
    """Keeps some vehicles in their lanes.

    Parameters
    ----------
    api : Api
        The simulation.
    vehicles : iterable of str
        Which, as soon as they are on the road.
    roster : Roster
        Who is on the road.
    session : str
        Name of the session.
    """

    def __init__(self, api: Api, vehicles: Iterable[str], roster: Roster, session: str = SOLE_SESSION) -> None:
        self._wanted = frozenset(vehicles)
        self._modes = Claims(api, LANE_CHANGE_MODE, session)
        self._kept: set[str] = set()
        self._roster = roster
        # Who is there already keeps the owner's lane changing.
        _, self._mark = roster.newcomers(0)

    def keep(self) -> None:
        """Take charge of those who are new on the road."""
        new, self._mark = self._roster.newcomers(self._mark)
        for vehicle in self._wanted.intersection(new) if new else ():
            self._modes.make(vehicle, _NO_LANE_CHANGES)
            self._kept.add(vehicle)

    def release(self, present: Collection[str]) -> None:
        """Let those on the road change lanes again as they did before."""
        for vehicle in self._kept.intersection(present):
            self._modes.withdraw(vehicle)
        self._kept.clear()
