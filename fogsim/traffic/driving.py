"""Setting how fast SUMO's vehicles may go and how closely they follow, by what their drivers choose and are told."""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.driver_table import Column, DriverTable
from fogsim.traffic.drivers import (
    CHOICE_PERIOD,
    SPEED_CHOICES,
    DriverSetup,
    complied_speed,
    perceived_distance_factor,
)
from fogsim.traffic.getters import vehicle_getter
from fogsim.traffic.link import Api
from fogsim.traffic.roster import Roster
from fogsim.traffic.sight import FogAccess
from fogsim.units import visibility_from_extinction

UNNOTICED_SPEED, UNNOTICED_FACTOR = 0.3, 0.02
"""Changes of a top speed [m/s] and of a headway's factor [-] that nobody would notice; setting each costs a call."""


class Drivers:
    """Sets the top speed of every vehicle but the ego by what its driver chooses and is told.

    Parameters
    ----------
    api : Api
        The simulation.
    setup : DriverSetup
        What they are like.
    fog : FogAccess
        The fog.
    ego : str
        The ego, which others govern.
    seed : int
        With a vehicle's id it gives its driver's nature, so that it depends on nothing else.
    roster : Roster or None
        Who is on the road; None for one of its own.
    """

    def __init__(
        self, api: Api, setup: DriverSetup, fog: FogAccess, ego: str, seed: int, roster: Roster | None = None
    ) -> None:
        self._vehicles = api.vehicle
        self._position = vehicle_getter(api, "getPosition3D")
        self._setup = setup
        self._choice = SPEED_CHOICES[setup.speed_choice]
        self._fog = fog
        self._extinction = fog.minimum_extinction if fog.minimum_extinction == fog.maximum_extinction else None
        self._ego = ego
        self._roster = Roster(api) if roster is None else roster
        self._table = DriverTable(api, setup, seed)
        self._advised_since: dict[str, float] = {}
        self._next = 0.0
        self._mark = 0

    def update(self, advised: Mapping[str, float]) -> None:
        """Let every driver choose a speed, if it is time to think again.

        Parameters
        ----------
        advised : mapping from vehicle id to float
            Advised speeds [m/s].
        """
        self._roster.look()
        time = self._roster.time
        if time < self._next:
            return
        self._next = time + CHOICE_PERIOD
        new, self._mark = self._roster.newcomers(self._mark)
        # In even fog and without advice, only who is new has not made up the mind yet.
        settled = self._extinction is not None and not advised and not self._advised_since
        self._advised_since = {v: self._advised_since.get(v, time) for v in advised}
        ids = [v for v in (new if settled else self._roster.present) if v != self._ego and v in self._roster.present]
        if ids:
            self._think(ids, advised, time)

    def _think(self, ids: Sequence[str], advised: Mapping[str, float], time: float) -> None:
        table = self._table
        rows = table.rows(ids)
        self._notice_fog(ids, rows)
        if self._setup.misjudgement > 0:
            self._follow_closer(ids, rows)
        top_speed = table.get(Column.TOP_SPEED, rows)
        target = np.minimum(table.get(Column.FACTOR, rows) * table.get(Column.CHOICE, rows), top_speed)
        if advised:
            for i in np.flatnonzero(table.get(Column.FOLLOWS, rows)).tolist():
                if ids[i] in advised:
                    target[i] = self._advised(ids[i], float(target[i]), advised[ids[i]], time)
        for i in np.flatnonzero(np.abs(target - table.get(Column.SPEED_SET, rows)) > UNNOTICED_SPEED).tolist():
            self._vehicles.setMaxSpeed(ids[i], float(target[i]))
            table.put(Column.SPEED_SET, int(rows[i]), float(target[i]))

    def _notice_fog(self, ids: Sequence[str], rows: NDArray[np.intp]) -> None:
        """Choose a speed where the fog is another than at the last choice."""
        if self._extinction is not None:
            here = np.full(len(rows), self._extinction)
        else:
            flat = itertools.chain.from_iterable(map(self._position, ids))
            here = self._fog.extinction(np.fromiter(flat, np.float64, 3 * len(ids)).reshape(-1, 3))
        changed = np.flatnonzero(here != self._table.get(Column.EXTINCTION, rows))
        self._table.put(Column.EXTINCTION, rows[changed], here[changed])
        values, which = np.unique(here[changed], return_inverse=True)
        choices = np.array([self._choice(visibility_from_extinction(k)) for k in values.tolist()])
        if len(changed):
            self._table.put(Column.CHOICE, rows[changed], choices[which])

    def _follow_closer(self, ids: Sequence[str], rows: NDArray[np.intp]) -> None:
        """Who takes a gap for longer than it is keeps a shorter one: the wanted time headway shrinks by that factor."""
        table = self._table
        columns = (table.get(column, rows) for column in (Column.EXTINCTION, Column.SHORTENED, Column.HEADWAY))
        for vehicle, row, extinction, known, headway in zip(ids, rows, *columns, strict=True):
            factor = perceived_distance_factor(visibility_from_extinction(extinction), self._setup.misjudgement)
            if abs(factor - known) > UNNOTICED_FACTOR:
                self._vehicles.setTau(vehicle, float(headway) / factor)
                table.put(Column.SHORTENED, int(row), factor)

    def _advised(self, vehicle: str, own: float, advised: float, time: float) -> float:
        """Top speed [m/s] of a driver who follows advice, once the delay is over."""
        if time - self._advised_since[vehicle] < self._setup.compliance.delay:
            return own
        own = min(own, float(self._vehicles.getAllowedSpeed(vehicle)))
        return complied_speed(own, advised, self._setup.compliance.strength)

    def release(self) -> None:
        """Give every vehicle on the road the top speed and the headway back that it came with."""
        ids = [v for v in self._roster.present if v != self._ego]
        rows = self._table.rows(ids)
        speeds, headways = (self._table.get(column, rows).tolist() for column in (Column.TOP_SPEED, Column.HEADWAY))
        changed_speed = self._table.get(Column.SPEED_SET, rows) != speeds
        changed_headway = self._table.get(Column.SHORTENED, rows) != 1.0
        for i in np.flatnonzero(changed_speed).tolist():
            self._vehicles.setMaxSpeed(ids[i], speeds[i])
        for i in np.flatnonzero(changed_headway).tolist():
            self._vehicles.setTau(ids[i], headways[i])
        self._table.put(Column.SPEED_SET, rows, np.array(speeds))
        self._table.put(Column.SHORTENED, rows, 1.0)
