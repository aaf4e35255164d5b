"""Time headways of SUMO's vehicles, as their drivers want and misjudge them in fog."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.following import CATCHING_UP, FollowingModel, Surroundings, misjudged_headway
from fogsim.traffic.drivers.sight import DriverSight, LeaderReach
from fogsim.traffic.drivers.speed_choice import UNAFFECTED_ABOVE
from fogsim.traffic.sumo.link import Api, vehicle_getter, vehicle_getters
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

    def keepers(self, values: NDArray[np.float64]) -> NDArray[np.intp]:
        """Which of some drivers keep up with a leader in the fog where they are (`values`: their rows)."""
        if self._sight is None or not self._keeps_up.any():
            return np.empty(0, dtype=np.intp)
        in_fog = values[:, Column.VISIBILITY] < UNAFFECTED_ABOVE
        keeps_up: NDArray[np.bool_] = in_fog & self._keeps_up[values[:, Column.KIND].astype(np.intp)]
        return keeps_up.nonzero()[0]

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


_UNNOTICED_RATIO = 0.03
"""Change of a headway, as a share of it, that is not noticed [-]; setting it costs calls."""


class HeadwayControl:
    """Sets time headways; where the fog does not matter they are the vehicles' own."""

    def __init__(self, api: Api, table: DriverTable, misjudgement: float, sight: DriverSight | None) -> None:
        self._speed = vehicle_getter(api, "getSpeed")
        self._table = table
        self._misjudgement = misjudgement
        self._sight = sight
        self._matters = np.array([misjudgement > 0 or kind != FollowingModel() for kind in table.kinds])
        self._kept_share = np.array([kind.kept_share for kind in table.kinds])

    def update(self, vehicles: Sequence[str], rows: NDArray[np.intp]) -> None:
        """Set the headways of drivers, by the fog and the speed at which they drive (`rows` (n,) int)."""
        if self._sight is None or not self._matters.any():
            return
        values = self._table.values[rows]
        kinds = values[:, Column.KIND].astype(np.intp)
        in_fog = (values[:, Column.VISIBILITY] < UNAFFECTED_ABOVE) & self._matters[kinds]
        # Mostly the fog is as it was, and at no speed is the gap so long that it matters how far one sees.
        unchanged = values[:, Column.EXTINCTION] == values[:, Column.HEADWAY_EXTINCTION]
        due = (in_fog & ~(unchanged & self._is_near(values, kinds))) | (
            ~in_fog & (values[:, Column.HEADWAY_SET] != values[:, Column.HEADWAY])
        )
        for i in due.nonzero()[0].tolist():
            own = float(values[i, Column.HEADWAY])
            wanted = self._wanted(vehicles[i], values[i]) if in_fog[i] else own
            if abs(wanted - values[i, Column.HEADWAY_SET]) > _UNNOTICED_RATIO * own or wanted == own:
                self._set(vehicles[i], int(rows[i]), wanted)
        self._table.values[rows, Column.HEADWAY_EXTINCTION] = values[:, Column.EXTINCTION]

    def _is_near(self, values: NDArray[np.float64], kinds: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether gaps at the speeds to which drivers may come are within what their kind goes by."""
        headway = np.maximum(values[:, Column.HEADWAY], values[:, Column.HEADWAY_SET])
        gap = headway * values[:, Column.SPEED_SET] + values[:, Column.MINIMUM_GAP]
        within = self._kept_share[kinds] * values[:, Column.REACH]
        near: NDArray[np.bool_] = gap <= (
            np.minimum(within, values[:, Column.BODY_REACH]) if self._misjudgement else within
        )
        return near

    def _wanted(self, vehicle: str, values: NDArray[np.float64]) -> float:
        """Time headway that a driver wants [s]."""
        around = Surroundings(
            float(values[Column.VISIBILITY]),
            LeaderReach(float(values[Column.BODY_REACH]), float(values[Column.REACH])),
            float(self._speed(vehicle)),
            float(values[Column.MINIMUM_GAP]),
        )
        wanted = self._table.kinds[int(values[Column.KIND])].headway(float(values[Column.HEADWAY]), around)
        return misjudged_headway(wanted, around, self._misjudgement)

    def _set(self, vehicle: str, row: int, headway: float) -> None:
        table = self._table
        if headway == table.values[row, Column.HEADWAY_SET]:
            return
        if headway == table.values[row, Column.HEADWAY]:
            table.headways.withdraw(vehicle)
        else:
            table.headways.claim(vehicle, headway)
        table.values[row, Column.HEADWAY_SET] = headway

    def release(self, vehicles: Sequence[str], rows: NDArray[np.intp]) -> None:
        """Give vehicles their own headways back (`rows` (n,) int)."""
        own = self._table.values[rows, Column.HEADWAY]
        for i in np.flatnonzero(self._table.values[rows, Column.HEADWAY_SET] != own).tolist():
            self._set(vehicles[i], int(rows[i]), float(own[i]))
