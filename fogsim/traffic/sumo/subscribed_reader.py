"""Reading SUMO's vehicles in one message a step, for simulations that run in another process."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fogsim.traffic.sumo.vehicle_reader import Moving, VehicleReader

# Numbers of SUMO's TraCI protocol, which libsumo and traci share (traci.constants).
_VEHICLES = 0xA4
_SPEED = 0x40
_POSITION_3D = 0x39
_ANGLE = 0x43
_ACCELERATION = 0x72
_LANE = 0x51
_SIGNALS = 0x5B
_SLOPE = 0x36
_MOVING = (_POSITION_3D, _ANGLE, _SPEED, _ACCELERATION, _LANE, _SIGNALS, _SLOPE)

_MARGIN = 50.0
"""SUMO gathers vehicles by the lanes near the ego; this much more radius leaves nobody out [m]."""


class SubscribedReader(VehicleReader):
    """Reads vehicles by subscribing to the surroundings of the ego, which SUMO tells at once.

    The subscription is for this instant alone: SUMO ends itself if one outlives its vehicle, and whoever else commands
    the simulation may take the ego away before the next step. The interface and the result are those of
    `VehicleReader`, whose getters cost a message each over a connection.
    """

    def _moving(self) -> Moving:
        rows = self._surroundings()
        # Rows of a subscription of the user's own may be among them, with other variables.
        everybody = sorted(vehicle for vehicle, row in rows.items() if all(v in row for v in _MOVING))
        position = np.array([rows[v][_POSITION_3D] for v in everybody])
        near = self._is_near(everybody, position)
        ids = tuple(v for v, is_near in zip(everybody, near, strict=True) if is_near)
        return Moving(
            ids=ids,
            position=position[near],
            angle=np.array([rows[v][_ANGLE] for v in ids]),
            speed=np.array([rows[v][_SPEED] for v in ids]),
            acceleration=np.array([rows[v][_ACCELERATION] for v in ids]),
            lane=tuple(rows[v][_LANE] for v in ids),
            signals=[rows[v][_SIGNALS] for v in ids],
            slope=np.array([rows[v][_SLOPE] for v in ids]),
        )

    def _surroundings(self) -> Mapping[str, Mapping[int, Any]]:
        vehicle = self._api.vehicle
        vehicle.subscribeContext(self._ego, _VEHICLES, self._radius + _MARGIN, _MOVING, end=self._roster.time)
        rows: Mapping[str, Mapping[int, Any]] = vehicle.getContextSubscriptionResults(self._ego)
        return rows
