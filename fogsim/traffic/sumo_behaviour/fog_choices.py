"""What drivers choose by the fog where they are: a speed, a share of the speed in clear air, and room to the leader."""

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.following import FollowingModel
from fogsim.traffic.drivers.leader_reach import drivers_visibility, leader_reach
from fogsim.traffic.drivers.sight import DriverSight
from fogsim.traffic.drivers.speed_choice import SPEED_CHOICES, DriverSetup, speed_share, unaffected
from fogsim.traffic.sumo_behaviour.driver_table import Column, DriverTable
from fogsim.units import visibility_from_extinction


class FogChoices:
    """Writes into the table what drivers choose.

    Parameters
    ----------
    table : DriverTable
        The drivers.
    setup : DriverSetup
        What they are like.
    sight : DriverSight or None
        Their eyes; None if they see through the fog.
    """

    def __init__(self, table: DriverTable, setup: DriverSetup, sight: DriverSight | None) -> None:
        self._table = table
        self._choice = SPEED_CHOICES[setup.speed_choice]
        plain = self._choice is unaffected and set(table.kinds) == {FollowingModel()}
        self._sight = None if plain and setup.misjudgement == 0.0 else sight

    def update(self, rows: NDArray[np.intp], extinction: NDArray[np.float64]) -> None:
        """Choose where the fog is another than at the last choice.

        Parameters
        ----------
        rows : (n,) intp
            Rows of the drivers.
        extinction : (n,) float64
            Extinction coefficients where they are [1/m].
        """
        table = self._table
        changed = np.flatnonzero(extinction != table.values[rows, Column.EXTINCTION])
        if not len(changed):
            return
        of, here = rows[changed], extinction[changed]
        # Mostly there are some twenty, which np.unique would take longer to sort.
        place: dict[float, int] = {}
        which = [place.setdefault(k, len(place)) for k in here.tolist()]
        visibilities = [visibility_from_extinction(k) for k in place]
        seen = [drivers_visibility(self._sight, visibility) for visibility in visibilities]
        reaches = [leader_reach(self._sight, visibility) for visibility in visibilities]
        limits = np.array([[kind.top_speed(reach) for reach in reaches] for kind in table.kinds])
        kinds = table.values[of, Column.KIND].astype(np.intp)
        table.values[of, Column.EXTINCTION] = here
        table.values[of, Column.VISIBILITY] = np.array(seen)[which]
        table.values[of, Column.BODY_REACH] = np.array([reach.by_body for reach in reaches])[which]
        table.values[of, Column.REACH] = np.array([reach.farthest for reach in reaches])[which]
        table.values[of, Column.CHOICE] = np.array([self._choice(visibility) for visibility in seen])[which]
        table.values[of, Column.SHARE] = np.array([speed_share(self._choice, v) for v in seen])[which]
        table.values[of, Column.LIMIT] = limits[kinds, which]
