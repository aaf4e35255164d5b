"""The ego driven by hand: an acceleration and changes of lane in place of SUMO's own driver."""

from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo_behaviour.scripted_actions import has_lane
from fogsim.values import EgoControl

_NO_CHECKS = 0
"""Speed mode and lane-change mode of a vehicle that follows commands, whoever is in the way."""
_SUMO_DRIVES = -1.0
_STAY = 1.0  # [s]


class EgoDriving:
    """Drives the ego by commands; without any, SUMO's driver takes over again (`step_length` [s])."""

    def __init__(self, api: Api, ego: str | None, step_length: float) -> None:
        self._api = api
        self._ego = ego
        self._step_length = step_length
        self._modes: tuple[int, int] | None = None
        self._last: EgoControl | None = None

    def apply(self, control: EgoControl | None, present: set[str]) -> bool:
        """Drive for the next step.

        Returns whether the ego is driven by hand.
        """
        ego, vehicles = self._ego, self._api.vehicle
        if ego is None or ego not in present:
            return False
        if control is None:
            self._release(ego)
            return False
        if self._modes is None:
            self._modes = int(vehicles.getSpeedMode(ego)), int(vehicles.getLaneChangeMode(ego))
            vehicles.setSpeedMode(ego, _NO_CHECKS)
            vehicles.setLaneChangeMode(ego, _NO_CHECKS)
        speed = float(vehicles.getSpeed(ego)) + self._step_length * control.acceleration
        vehicles.setSpeed(ego, min(max(speed, 0.0), float(vehicles.getMaxSpeed(ego))))
        if control.lanes and control is not self._last and has_lane(self._api, ego, control.lanes):
            vehicles.changeLaneRelative(ego, control.lanes, _STAY)
        self._last = control
        return True

    def _release(self, ego: str) -> None:
        if self._modes is not None:
            speed_mode, change_mode = self._modes
            self._api.vehicle.setSpeedMode(ego, speed_mode)
            self._api.vehicle.setLaneChangeMode(ego, change_mode)
            self._api.vehicle.setSpeed(ego, _SUMO_DRIVES)
        self._modes = self._last = None
