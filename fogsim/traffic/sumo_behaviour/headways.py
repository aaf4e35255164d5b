"""Time headways of SUMO's vehicles, as their drivers want and misjudge them in fog."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.following import FollowingModel, Surroundings, misjudged_headway
from fogsim.traffic.drivers.leader_reach import LeaderReach
from fogsim.traffic.drivers.sight import DriverSight
from fogsim.traffic.drivers.speed_choice import UNAFFECTED_ABOVE
from fogsim.traffic.sumo.link import Api, vehicle_getter
from fogsim.traffic.sumo_behaviour.driver_table import Column, DriverTable

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
        for i in np.flatnonzero(due).tolist():
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
