"""Drivers obey traffic lights only once they can see them.

To a driver who does not see the light it is not there: SUMO's speed mode lets the vehicle pass a red or yellow light,
and only that is set, when sight changes. A light that has come into view is obeyed after the reaction time. Who cannot
stop any more brakes as hard as the vehicle can, passes the stop line with the speed that is left, and leaves the
junction; SUMO itself would stop the vehicle at the line in one step.

Vehicles on rails are left alone, for their drivers are signalled in the cab or know the line.
"""

import math

import numpy as np

from fogsim.traffic.appearance import RAILWAYS
from fogsim.traffic.sumo.claims import SPEED_MODE, Claims
from fogsim.traffic.sumo.link import vehicle_getter
from fogsim.traffic.sumo.roster import Due, DueVehicles
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, OwnLamps
from fogsim.traffic.sumo_lanes.street import Light, LightsAhead
from fogsim.values.light import SIGNAL_INTENSITY

_SIGNAL_HEIGHT = 2.0
"""Height above the road of the line of sight: between eyes and signal heads [m]."""

_EYE_HEIGHT, _HEAD_HEIGHT = 1.2, 3.0
"""Heights above the road from which and at which a light is looked for past what stands next to the road [m]."""

_REACH = 250.0
"""No one brakes for a light farther ahead than this [m]."""

_MAX_PAUSE = 0.5
"""A driver within reach of a light looks at least this often [s]."""

_PAUSE_IN_DOUBT = 0.2
"""And one to whom uneven fog may show it at any time, at least this often [s]."""

_FAR_PAUSE = 2.0
"""And one who is not, at least this often [s]."""

_FASTEST_GAIN = 10.0
"""No one is faster by more than this after `_FAR_PAUSE` [m/s]."""

_OBEY_LIGHTS = 16
_STOPPING = frozenset("ryu")
_NOT_SEEN = math.inf


class SignalSight:
    """Decides which drivers see the light ahead of them."""

    def __init__(self, view: DriversView) -> None:
        api = self._api = view.api
        self._fog, self._sight, self._roster, self._obstructions = view.fog, view.sight, view.roster, view.obstructions
        self._lights = LightsAhead(api)
        self._speed, self._position = vehicle_getter(api, "getSpeed"), vehicle_getter(api, "getPosition3D")
        self._deceleration = vehicle_getter(api, "getEmergencyDecel")
        self._modes = Claims(api, SPEED_MODE, view.session)
        self._step = float(api.simulation.getDeltaT())
        self._due = DueVehicles(view.roster, self._step)
        self._certainly_seen = self._certainly_hidden = self._seen_through_fog = math.inf
        if api.trafficlight.getIDCount():
            self._seen_through_fog = self._seen_distance(view.fog.maximum_extinction)
            self._certainly_seen = 0.0 if view.obstructions else self._seen_through_fog
            self._certainly_hidden = self._seen_distance(view.fog.minimum_extinction)
        self._unseen: dict[str, float] = {}
        self._braking_late: dict[str, str] = {}
        self._left_passing: set[str] = set()
        self._stop_lines: dict[tuple[str, int], tuple[float, float]] = {}

    @property
    def unseen(self) -> frozenset[str]:
        """Vehicles whose drivers do not react to the light ahead."""
        return frozenset(self._unseen)

    def _seen_distance(self, extinction: float) -> float:
        return self._sight.seen_distance(extinction, 0.0, SIGNAL_INTENSITY, head_lamps=0.0)

    def update(self, own_lamps: OwnLamps) -> None:  # noqa: ARG002 - every part gets the lamps
        """Make SUMO's drivers ignore lights that they do not see."""
        if self._certainly_seen >= _REACH:
            return
        due = self._due.take()
        railways = self._forget(due) if due.gone else ()
        pauses: dict[float, list[str]] = {}
        for driver in due.vehicles:
            if driver not in railways:
                pauses.setdefault(self._look(driver), []).append(driver)
        for pause, drivers in pauses.items():
            self._due.schedule(drivers, pause)

    def _forget(self, due: Due) -> set[str]:
        """Forget who has left; new vehicles on rails, which are not looked at again."""
        for vehicle in due.gone:
            if self._unseen.pop(vehicle, None) is not None or self._braking_late.pop(vehicle, None) is not None:
                self._left_passing.add(vehicle)
        # A vehicle that comes back from a teleport still passes lights.
        for vehicle in self._left_passing.intersection(due.new):
            self._left_passing.discard(vehicle)
            self._modes.withdraw(vehicle)
        return {v for v in due.new if self._api.vehicle.getVehicleClass(v) in RAILWAYS}

    def _look(self, driver: str) -> float:
        """Decide for one driver, who need not look again for so long [s]."""
        light = self._lights.next_of(driver)
        if driver in self._braking_late:
            return self._brake_late(driver, light)
        if light is None or light[2] > _REACH:
            self._obey(driver)
            return _FAR_PAUSE if light is None else max(self._time_for(driver, light[2] - _REACH), _MAX_PAUSE)
        return self._notice(driver, light) if self._sees(driver, light) else self._overlook(driver, light[2])

    def _overlook(self, driver: str, way: float) -> float:
        if self._unseen.get(driver) != _NOT_SEEN:
            self._unseen[driver] = _NOT_SEEN
            self._pass_lights(driver)
        certain = way - self._certainly_hidden
        return self._time_for(driver, certain) if certain > 0.0 else _PAUSE_IN_DOUBT

    def _time_for(self, driver: str, way: float) -> float:
        """What a driver needs for a way at least, if it is less than `_FAR_PAUSE` [s]."""
        return min(way / (float(self._speed(driver)) + _FASTEST_GAIN), _FAR_PAUSE)

    def _notice(self, driver: str, light: Light) -> float:
        if driver not in self._unseen:
            # What is certainly seen is so until it is passed.
            certain = light[2] if light[2] <= self._certainly_seen else 0.0
            return max(self._time_for(driver, certain), _MAX_PAUSE)
        now = self._roster.time
        since = self._unseen[driver] = min(self._unseen[driver], now)
        if now - since < self._sight.reaction_time:
            return 0.0
        self._obey(driver)
        if light[3].lower() not in _STOPPING or self._can_stop(driver, light[2]):
            return _MAX_PAUSE
        self._braking_late[driver] = light[0]
        return self._brake_late(driver, light)

    def _sees(self, driver: str, light: Light) -> bool:
        way = light[2]
        if way <= self._certainly_seen:
            return True
        if way > self._certainly_hidden:
            return False
        x, y, z = self._position(driver)
        end_x, end_y = self._stop_line(light[0], light[1])
        if self._obstructions.hide([(x, y, z + _EYE_HEIGHT)], [[(end_x, end_y, z + _HEAD_HEIGHT)]])[0]:
            return False
        if way <= self._seen_through_fog:
            return True
        straight = max(math.hypot(end_x - x, end_y - y), 0.1)
        # The light is as far as the way to it is long, as leaders are.
        along = np.array([end_x - x, end_y - y, 0.0]) * (way / straight)
        eyes = np.array([x, y, z + _SIGNAL_HEIGHT])
        depth = float(self._fog.optical_depth(eyes, eyes + along))
        return depth <= self._sight.depth_limit(way, 0.0, SIGNAL_INTENSITY, head_lamps=0.0)

    def _stop_line(self, light: str, index: int) -> tuple[float, float]:
        known = self._stop_lines.get((light, index))
        if known is None:
            lane = self._api.trafficlight.getControlledLinks(light)[index][0][0]
            known = self._stop_lines[light, index] = tuple(self._api.lane.getShape(lane)[-1][:2])
        return known

    def _can_stop(self, driver: str, way: float) -> bool:
        speed, deceleration = float(self._speed(driver)), float(self._deceleration(driver))
        return speed * (speed / (2.0 * deceleration) - 0.5 * self._step) <= way

    def _brake_late(self, driver: str, light: Light | None) -> float:
        """Let the vehicle brake for the light that was seen too late, and pass its stop line."""
        if light is None or light[0] != self._braking_late[driver]:
            del self._braking_late[driver]
            self._modes.withdraw(driver)
        elif (self._speed(driver) - self._deceleration(driver) * self._step) * self._step >= light[2]:
            self._pass_lights(driver)
        return 0.0

    def _pass_lights(self, driver: str) -> None:
        mode = int(self._modes.own_value(driver))
        if mode & _OBEY_LIGHTS:
            self._modes.claim(driver, mode - _OBEY_LIGHTS)

    def _obey(self, driver: str) -> None:
        """From now on a driver obeys lights."""
        if self._unseen.pop(driver, None) is not None:
            self._modes.withdraw(driver)

    def release(self) -> None:
        """Let everyone on the road obey lights again."""
        for driver in self._roster.present.intersection({*self._unseen, *self._braking_late}):
            self._modes.withdraw(driver)
        self._unseen.clear()
        self._braking_late.clear()
