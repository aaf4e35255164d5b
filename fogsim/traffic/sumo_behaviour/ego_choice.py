"""Which vehicle becomes the ego of a simulation whose user leaves the choice to FogSim (``ego: any``)."""

from fogsim.traffic.appearance import TRAINS, body_kind
from fogsim.traffic.setup import ANY_EGO
from fogsim.traffic.sumo.link import Api, getter, is_off_lanes

LONG_WAY = 1000.0
"""The first vehicle with so much of its route ahead is chosen [m]."""

_PATIENCE = 600.0
"""So long after the first vehicle that would do, the one with the longest way is chosen, if possible without stops [s].
"""

LOOK_PERIOD = 1.0
"""Time between two looks at those who have departed [s]."""

_BODIES = frozenset({"car", "van", "truck", "bus"})
_DRIVES = 1.0  # [m/s]


class EgoChoice:
    """Watches a simulation until a vehicle suits: a car, van, truck or bus that drives on a lane.

    It is the first one with `LONG_WAY` and no stop ahead of it, or a vehicle whose id is ``any``.
    """

    def __init__(self, api: Api) -> None:
        self._api = api
        self._departed = getter(api, "simulation", "getDepartedIDList")
        self._time = getter(api, "simulation", "getTime")
        self._waiting: list[str] = list(api.vehicle.getIDList())
        self._next = 0.0
        self._until = 0.0
        self._longest = (False, 0.0)
        self.best: str | None = None
        """Who would be chosen if no one came any more."""

    def look(self) -> str | None:
        """The ego; None while no one suits. To be called after each step."""
        self._waiting += self._departed()
        now = float(self._time())
        if ANY_EGO in self._waiting:
            return ANY_EGO
        if now < self._next:
            return None
        self._next = now + LOOK_PERIOD
        present = set(self._api.vehicle.getIDList())
        waiting, self._waiting = self._waiting, []
        for vehicle in waiting:
            if vehicle not in present or not self._is_fit(vehicle):
                continue
            if not self._drives(vehicle):
                self._waiting.append(vehicle)
                continue
            way = not self._api.vehicle.getStops(vehicle, 1), self._way_ahead(vehicle)
            if way >= (True, LONG_WAY):
                return vehicle
            if way > self._longest:
                self._until = self._until or now + _PATIENCE
                self._longest, self.best = way, vehicle
        return self.best if self.best is not None and now >= self._until else None

    def _is_fit(self, vehicle: str) -> bool:
        get = self._api.vehicle
        kind = str(get.getVehicleClass(vehicle))
        body = body_kind(kind, get.getShapeClass(vehicle), get.getLength(vehicle))
        return kind not in TRAINS and body in _BODIES

    def _drives(self, vehicle: str) -> bool:
        return not is_off_lanes(self._api, vehicle) and self._api.vehicle.getSpeed(vehicle) > _DRIVES

    def _way_ahead(self, vehicle: str) -> float:
        """What a vehicle has yet to drive of its route, without the ways across junctions [m]."""
        get, length = self._api.vehicle, self._api.lane.getLength
        route = get.getRoute(vehicle)[get.getRouteIndex(vehicle) :]
        return float(sum(length(f"{edge}_0") for edge in route) - get.getLanePosition(vehicle))
