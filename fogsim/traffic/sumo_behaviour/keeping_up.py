"""Drivers who keep up with the leader whom they see, though by themselves they would drive slower in fog."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.following import CATCHING_UP
from fogsim.traffic.drivers.sight import DriverSight
from fogsim.traffic.drivers.speed_choice import UNAFFECTED_ABOVE
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.vehicle_getters import vehicle_getters
from fogsim.traffic.sumo_behaviour.driver_table import Column, DriverTable
from fogsim.traffic.sumo_drivers.perception import REACH
from fogsim.traffic.sumo_lanes.leaders import Leaders

_NO_LEADER = "", 0.0


class KeepingUp:
    """Speeds of the leaders that drivers keep up with."""

    def __init__(self, api: Api, table: DriverTable, sight: DriverSight | None, remote: bool) -> None:
        self._leader = Leaders(api, remote).within(REACH)
        (self._speed,) = vehicle_getters(api, remote, ("getSpeed",))
        self._table = table
        self._sight = sight
        self._keeps_up = np.array([kind.keeps_up for kind in table.kinds])

    def keepers(self, rows: NDArray[np.intp]) -> NDArray[np.intp]:
        """Which of some drivers keep up with a leader in the fog where they are (`rows` (n,) int)."""
        if self._sight is None or not self._keeps_up.any():
            return np.empty(0, dtype=np.intp)
        values = self._table.values[rows]
        in_fog = values[:, Column.VISIBILITY] < UNAFFECTED_ABOVE
        return np.flatnonzero(in_fog & self._keeps_up[values[:, Column.KIND].astype(np.intp)])

    def kept_speeds(self, vehicles: Sequence[str], rows: NDArray[np.intp]) -> NDArray[np.float64]:
        """Speeds at which drivers keep up with their leaders (n,) [m/s]; 0 where none is seen (`rows` (n,) int)."""
        reaches, speed = self._table.values[rows, Column.REACH].tolist(), self._speed
        ahead = [found or _NO_LEADER for found in map(self._leader, vehicles, itertools.repeat(REACH))]
        return np.array(
            [
                float(speed(leader)) + CATCHING_UP if leader and gap <= reach else 0.0
                for (leader, gap), reach in zip(ahead, reaches, strict=True)
            ]
        )
