"""The ego driven by hand: an acceleration and changes of lane in place of SUMO's own driver."""

from collections.abc import Callable

from fogsim.errors import SimulationError
from fogsim.traffic.appearance import TRAINS, body_kind
from fogsim.traffic.setup import ANY_EGO
from fogsim.traffic.sumo.claims import LANE_CHANGE_MODE, SPEED_MODE, Claims
from fogsim.traffic.sumo.link import Api, edge_length, getter, has_lane, is_off_lanes
from fogsim.values import EgoControl

_LONG_WAY = 1000.0
"""The first vehicle with so much of its route ahead is chosen [m]."""

_PATIENCE = 600.0
"""So long after the first vehicle that would do, the one with the longest way is chosen, if possible without stops [s].
"""

_LOOK_PERIOD = 1.0
"""Time between two looks at those who have departed [s]."""

_BODIES = frozenset({"car", "van", "truck", "bus"})
_DRIVES = 1.0  # [m/s]


class _EgoChoice:
    """Watches a simulation until a vehicle suits: a car, van, truck or bus that drives on a lane.

    It is the first with `_LONG_WAY` and no stop ahead, or any vehicle for the id ``any``.
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
        self._next = now + _LOOK_PERIOD
        present = set(self._api.vehicle.getIDList())
        waiting, self._waiting = self._waiting, []
        for vehicle in waiting:
            if vehicle not in present or not self._is_fit(vehicle):
                continue
            if not self._drives(vehicle):
                self._waiting.append(vehicle)
                continue
            way = not self._api.vehicle.getStops(vehicle, 1), self._way_ahead(vehicle)
            if way >= (True, _LONG_WAY):
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
        get = self._api.vehicle
        route = get.getRoute(vehicle)[get.getRouteIndex(vehicle) :]
        return float(sum(edge_length(self._api, edge) for edge in route) - get.getLanePosition(vehicle))


def choose_ego(api: Api, step: Callable[[], object], last: float) -> str:
    """Run a simulation until a vehicle suits as the ego, at the longest until a time [s], and give back its id."""
    choice, simulation = _EgoChoice(api), api.simulation
    while (found := choice.look()) is None:
        if simulation.getTime() >= last or simulation.getMinExpectedNumber() == 0:
            found = choice.best
            break
        step()
    if found is None:
        until = f"until {simulation.getTime():g} s"
        raise SimulationError(f"ego: {ANY_EGO}: no car, van, truck or bus drives on a lane {until}")
    return found


_NO_CHECKS = 0
"""Speed mode and lane-change mode of a vehicle that follows commands, whoever is in the way."""
_SUMO_DRIVES = -1.0
_STAY = 1.0  # [s]


class EgoDriving:
    """Drives the ego by commands; without any, SUMO's driver takes over again (`step_length` [s])."""

    def __init__(self, api: Api, ego: str | None, step_length: float, session: str) -> None:
        self._api = api
        self._ego = ego
        self._step_length = step_length
        # Apart from the session's other claims.
        self._modes = tuple(Claims(api, mode, f"{session} control") for mode in (SPEED_MODE, LANE_CHANGE_MODE))
        self._is_driven = False
        self._last: EgoControl | None = None
        self._planned_from: float | None = None

    def apply(self, control: EgoControl | None, present: set[str]) -> bool:
        """Drive for the next step; return whether the ego is driven by hand."""
        ego, vehicles = self._ego, self._api.vehicle
        if ego is None or ego not in present:
            self._planned_from = None
            return False
        if control is None:
            self._release(ego)
            return False
        for modes in self._modes:
            # Another vehicle may have come under the ego's name.
            modes.hold(ego, _NO_CHECKS)
        self._is_driven = True
        now, acceleration = float(vehicles.getSpeed(ego)), float(control.acceleration)
        if control.brakes_with_driver and acceleration < 0.0:
            acceleration = min(acceleration, self._planned_by_driver(ego))
        self._planned_from = now
        speed = now + self._step_length * acceleration
        vehicles.setSpeed(ego, min(max(speed, 0.0), float(vehicles.getMaxSpeed(ego))))
        if control.lanes and control is not self._last and has_lane(self._api, ego, control.lanes):
            vehicles.changeLaneRelative(ego, control.lanes, _STAY)
        self._last = control
        return True

    def _planned_by_driver(self, ego: str) -> float:
        """Acceleration that SUMO's driver would have had in the last step [m/s²], which it had if it drove."""
        if self._planned_from is None:
            return float(self._api.vehicle.getAcceleration(ego))
        planned = float(self._api.vehicle.getSpeedWithoutTraCI(ego))
        return (planned - self._planned_from) / self._step_length

    def _release(self, ego: str) -> None:
        if self._is_driven:
            for modes in self._modes:
                modes.withdraw(ego)
            self._api.vehicle.setSpeed(ego, _SUMO_DRIVES)
        self._is_driven, self._last, self._planned_from = False, None, None
