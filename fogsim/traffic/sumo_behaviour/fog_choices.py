"""What drivers choose by the fog where they are: a speed, a share of the speed in clear air, and room to the leader."""

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.following import FollowingModel
from fogsim.traffic.drivers.leader_reach import LeaderReach, drivers_visibility, leader_reach
from fogsim.traffic.drivers.sight import DriverSight
from fogsim.traffic.drivers.speed_choice import SPEED_CHOICES, DriverSetup, speed_share, unaffected
from fogsim.traffic.sumo_behaviour.driver_table import Column, DriverTable
from fogsim.units import visibility_from_extinction


class FogChoices:
    """Writes into the table what drivers choose."""

    def __init__(self, table: DriverTable, setup: DriverSetup, sight: DriverSight | None) -> None:
        self._table = table
        self._choice = SPEED_CHOICES[setup.speed_choice]
        plain = self._choice is unaffected and set(table.kinds) == {FollowingModel()}
        self._sight = None if plain and setup.misjudgement == 0.0 else sight

    def update(self, rows: NDArray[np.intp], extinction: NDArray[np.float64]) -> None:
        """Choose where the fog is another than at the last choice (`rows` (n,) int, `extinction` (n,) [1/m])."""
        table = self._table
        changed = np.flatnonzero(extinction != table.values[rows, Column.EXTINCTION])
        if not len(changed):
            return
        of, here = rows[changed], extinction[changed].tolist()
        # Mostly there are some twenty, which np.unique would take longer to sort.
        found = {k: self._choose_in(k) for k in dict.fromkeys(here)}
        kinds = table.values[of, Column.KIND].astype(np.intp).tolist()
        # The table's last columns.
        table.values[of, Column.EXTINCTION :] = [
            (*found[k][0], table.kinds[kind].top_speed(found[k][1])) for k, kind in zip(here, kinds, strict=True)
        ]

    def _choose_in(self, extinction: float) -> tuple[tuple[float, ...], LeaderReach]:
        """Columns `EXTINCTION` to `SHARE` in a fog, and how far away leaders are seen in it."""
        visibility = visibility_from_extinction(extinction)
        seen, reach = drivers_visibility(self._sight, visibility), leader_reach(self._sight, visibility)
        chosen = self._choice(seen), speed_share(self._choice, seen)
        return (extinction, seen, reach.by_body, reach.farthest, *chosen), reach
