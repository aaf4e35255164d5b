"""Setting how fast SUMO's vehicles may go and how closely they follow, by what their drivers choose and are told."""

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.sight import FogAccess
from fogsim.traffic.drivers.speed_choice import (
    CHOICE_PERIOD,
    SPEED_CHOICES,
    DriverSetup,
    complied_speed,
    perceived_distance_factor,
)
from fogsim.traffic.sumo.claims import SOLE_SESSION, TIME_HEADWAY, TOP_SPEED, Claims
from fogsim.traffic.sumo.getters import vehicle_getter
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_drivers.driver_table import Column, DriverTable
from fogsim.traffic.sumo_drivers.top_speeds import TopSpeeds
from fogsim.units import visibility_from_extinction

UNNOTICED_FACTOR = 0.02
"""Change of a headway's factor [-] that nobody would notice; setting it costs a call."""


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
    deceleration : float
        How hard they slow down to a lower speed that they want [m/s²].
    roster : Roster or None
        Who is on the road; None for one of its own.
    session : str
        Name of the session.
    """

    def __init__(
        self,
        api: Api,
        setup: DriverSetup,
        fog: FogAccess,
        ego: str,
        seed: int,
        deceleration: float,
        roster: Roster | None = None,
        session: str = SOLE_SESSION,
    ) -> None:
        self._api = api
        self._position = vehicle_getter(api, "getPosition3D")
        self._departure = vehicle_getter(api, "getDeparture")
        self._step = float(api.simulation.getDeltaT())
        self._setup = setup
        self._choice = SPEED_CHOICES[setup.speed_choice]
        self._fog = fog
        self._extinction = fog.minimum_extinction if fog.minimum_extinction == fog.maximum_extinction else None
        self._ego = ego
        self._roster = Roster(api) if roster is None else roster
        top_speeds = Claims(api, TOP_SPEED, session)
        self._headways = Claims(api, TIME_HEADWAY, session)
        self._table = DriverTable(setup, seed, top_speeds, self._headways)
        self._top_speeds = TopSpeeds(api, self._table, top_speeds, deceleration, self._roster.time)
        self._advised_since: dict[str, float] = {}
        self._next = 0.0
        self._mark = 0

    def update(self, advised: Mapping[str, float]) -> None:
        """Let who is new choose a speed, and every driver, if it is time to think again.

        Parameters
        ----------
        advised : mapping from vehicle id to float
            Advised speeds [m/s].
        """
        roster = self._roster
        roster.look()
        time, present = roster.time, roster.present
        new, self._mark = roster.newcomers(self._mark)
        if new:
            self._welcome([v for v in new if v != self._ego and v in present], advised)
        if time >= self._next:
            self._next = time + CHOICE_PERIOD
            # In even fog and without advice, everybody has made up the mind already.
            settled = self._extinction is not None and not advised and not self._advised_since
            self._advised_since = {v: self._advised_since.get(v, time) for v in advised}
            if not settled:
                self._think([v for v in present if v != self._ego], advised)
        self._top_speeds.move(time, present)

    def _welcome(self, new: Sequence[str], advised: Mapping[str, float]) -> None:
        """Let who is new choose; who enters has driven in that fog before, past the signs that give the advice."""
        self._table.welcome(new)
        # Departures carry the time at which their step began. Who came otherwise was on the road already.
        since = self._roster.time - 1.5 * self._step
        entering = [v for v in new if self._departure(v) >= since]
        self._advised_since.update((v, -math.inf) for v in entering if v in advised)
        if entering:
            rows, wanted = self._wanted(entering, advised)
            self._top_speeds.enter(entering, rows, wanted)
        if len(entering) < len(new):
            self._think([v for v in new if v not in set(entering)], advised)

    def _think(self, ids: Sequence[str], advised: Mapping[str, float]) -> None:
        if ids:
            rows, wanted = self._wanted(ids, advised)
            self._top_speeds.want(ids, rows, wanted)

    def _wanted(self, ids: Sequence[str], advised: Mapping[str, float]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Rows of vehicles and the top speeds that their drivers want (n,) [m/s]."""
        table = self._table
        rows = table.rows(ids)
        self._notice_fog(ids, rows)
        if self._setup.misjudgement > 0:
            self._follow_closer(ids, rows)
        top_speed = table.get(Column.TOP_SPEED, rows)
        wanted = np.minimum(table.get(Column.FACTOR, rows) * table.get(Column.CHOICE, rows), top_speed)
        if advised:
            for i in np.flatnonzero(table.get(Column.FOLLOWS, rows)).tolist():
                if ids[i] in advised:
                    wanted[i] = self._advised(ids[i], float(wanted[i]), advised[ids[i]])
        return rows, wanted

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
                self._headways.make(vehicle, float(headway) / factor)
                table.put(Column.SHORTENED, int(row), factor)

    def _advised(self, vehicle: str, own: float, advised: float) -> float:
        """Top speed [m/s] of a driver who follows advice, once the delay is over."""
        time = self._roster.time
        if time - self._advised_since.get(vehicle, time) < self._setup.compliance.delay:
            return own
        return complied_speed(min(own, self._allowed(vehicle)), advised, self._setup.compliance.strength)

    def _allowed(self, vehicle: str) -> float:
        """What the road allows a driver [m/s], whatever the top speed that the vehicle has been given."""
        get = self._api.vehicle
        allowed = float(get.getAllowedSpeed(vehicle))
        if allowed < get.getMaxSpeed(vehicle):
            return allowed
        # The top speed is the lower one, and SUMO tells only that.
        return float(self._api.lane.getMaxSpeed(get.getLaneID(vehicle)) * get.getSpeedFactor(vehicle))

    def release(self) -> None:
        """Withdraw from every vehicle on the road what was claimed of its top speed and headway."""
        ids = [v for v in self._roster.present if v != self._ego]
        rows = self._table.rows(ids)
        self._top_speeds.release(ids, rows)
        for i in np.flatnonzero(self._table.get(Column.SHORTENED, rows) != 1.0).tolist():
            self._headways.withdraw(ids[i])
        self._table.put(Column.SHORTENED, rows, 1.0)
