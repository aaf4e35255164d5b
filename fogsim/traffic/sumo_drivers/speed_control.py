"""Where advice enters SUMO: the ego's as the speed that it drives, other drivers' as the top speed that they desire."""

import itertools
import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.kinematics import decelerated_speed
from fogsim.traffic.drivers.advice_hearing import AdviceHearing
from fogsim.traffic.drivers.events import Order
from fogsim.traffic.drivers.sight import FogAccess
from fogsim.traffic.drivers.speed_choice import (
    CHOICE_PERIOD,
    SPEED_CHOICES,
    DriverSetup,
    complied_speed,
    perceived_distance_factor,
)
from fogsim.traffic.sumo.claims import TIME_HEADWAY, TOP_SPEED, Claims
from fogsim.traffic.sumo.link import Api, vehicle_getter
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo.vehicle_places import SumoVehiclePlaces
from fogsim.traffic.sumo_drivers.driver_table import Column, DriverTable
from fogsim.traffic.sumo_drivers.top_speeds import TopSpeedControl
from fogsim.units import visibility_from_extinction
from fogsim.values import Command

UNNOTICED_FACTOR = 0.02
"""Change of a headway's factor [-] that is not noticed; setting it costs a call."""

_SUMO_DRIVES = -1.0


class SpeedControl:
    """Brings the ego to its advised speed and vehicles to scripted ones; remembers which, to free them again.

    Parameters
    ----------
    api : Api
        The simulation.
    step_length : float
        Time between two calls [s].
    """

    def __init__(self, api: Api, step_length: float) -> None:
        self._vehicles = api.vehicle
        self._step_length = step_length
        self._held: set[str] = set()

    def apply(self, orders: Mapping[str, Order]) -> None:
        """Apply the orders of this step.

        Parameters
        ----------
        orders : mapping from vehicle id to Order
            Orders for vehicles on the road.
        """
        for vehicle, (target, deceleration) in orders.items():
            if math.isfinite(target):
                self._hold(vehicle, target, deceleration)
            elif vehicle in self._held:
                self._vehicles.setSpeed(vehicle, _SUMO_DRIVES)
                self._held.discard(vehicle)

    def release(self, present: Collection[str]) -> None:
        """Free all vehicles that are held.

        Parameters
        ----------
        present : collection of str
            Vehicles on the road.
        """
        for vehicle in self._held.intersection(present):
            self._vehicles.setSpeed(vehicle, _SUMO_DRIVES)
        self._held.clear()

    def _hold(self, vehicle: str, target: float, deceleration: float) -> None:
        # Advice does not make a driver faster than the road and the vehicle allow.
        allowed = min(target, self._vehicles.getAllowedSpeed(vehicle))
        speed = self._vehicles.getSpeed(vehicle)
        self._vehicles.setSpeed(vehicle, decelerated_speed(speed, allowed, deceleration, self._step_length))
        self._held.add(vehicle)


class SumoDesiredSpeeds:
    """Sets the top speed of every vehicle but the ego by what its driver chooses and is advised.

    Parameters
    ----------
    api : Api
        The simulation.
    setup : DriverSetup
        What they are like.
    fog : FogAccess
        The fog.
    ego : str
        The ego, whose speed `SpeedControl` sets.
    seed : int
        With a vehicle's id it gives its driver's traits, so that they depend on nothing else.
    deceleration : float
        How hard they slow down to a lower desired speed [m/s²].
    roster : Roster
        Which vehicles are on the road.
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
        roster: Roster,
        session: str,
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
        self._roster = roster
        top_speeds = Claims(api, TOP_SPEED, session)
        self._headways = Claims(api, TIME_HEADWAY, session)
        self._table = DriverTable(setup, seed, top_speeds, self._headways)
        self._top_speeds = TopSpeedControl(api, self._table, top_speeds, deceleration, self._roster.time)
        self._hearing = AdviceHearing(SumoVehiclePlaces(api, ego, roster))
        self._advised_since: dict[str, float] = {}
        self._next, self._chosen = 0.0, self._roster.time
        self._mark = 0

    def update(self, command: Command) -> None:
        """Let new drivers choose a speed, and all drivers if it is time to choose again.

        Parameters
        ----------
        command : Command
            The advice in force.
        """
        roster = self._roster
        roster.update()
        time, present = roster.time, roster.present
        new, self._mark = roster.entered_since(self._mark)
        if new:
            self._choose_on_entry([v for v in new if v != self._ego and v in present], command)
        if time >= self._next:
            elapsed, self._chosen = time - self._chosen, time
            self._next = time + CHOICE_PERIOD
            advised = self._hearing.listen(command, elapsed)
            # In even fog and without advice, choices stay as they are.
            settled = self._extinction is not None and not advised and not self._advised_since
            self._advised_since = {v: self._advised_since.get(v, time) for v in advised}
            if not settled:
                self._update_choices([v for v in present if v != self._ego], advised)
        self._top_speeds.update(time, present)

    def _choose_on_entry(self, new: Sequence[str], command: Command) -> None:
        """Let new drivers choose; those who enter have driven in that fog before, past the signs with the advice."""
        self._table.reset(new)
        # Departures carry the time at which their step began. Other new vehicles were on the road already.
        since = self._roster.time - 1.5 * self._step
        entering = [v for v in new if self._departure(v) >= since]
        if entering:
            advised = self._hearing.enter(command, entering)
            self._advised_since.update(dict.fromkeys(advised, -math.inf))
            rows, desired = self._desired(entering, advised)
            self._top_speeds.set_at_entry(entering, rows, desired)
        if len(entering) < len(new):
            # They hear other advice than that to them by name when all listen again.
            self._update_choices([v for v in new if v not in set(entering)], command.advised_speeds)

    def _update_choices(self, ids: Sequence[str], advised: Mapping[str, float]) -> None:
        if ids:
            rows, desired = self._desired(ids, advised)
            self._top_speeds.set_desired(ids, rows, desired)

    def _desired(
        self, ids: Sequence[str], advised: Mapping[str, float]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Rows of vehicles and the top speeds that their drivers desire (n,) [m/s]."""
        table = self._table
        rows = table.rows(ids)
        self._choose_in_fog(ids, rows)
        if self._setup.misjudgement > 0:
            self._shorten_headways(ids, rows)
        top_speed = table.values[rows, Column.TOP_SPEED]
        desired = np.minimum(table.values[rows, Column.FACTOR] * table.values[rows, Column.CHOICE], top_speed)
        if advised:
            for i in np.flatnonzero(table.values[rows, Column.FOLLOWS]).tolist():
                if ids[i] in advised:
                    desired[i] = self._advised(ids[i], float(desired[i]), advised[ids[i]])
        return rows, desired

    def _choose_in_fog(self, ids: Sequence[str], rows: NDArray[np.intp]) -> None:
        """Choose a speed where the fog is another than at the last choice."""
        if self._extinction is not None:
            here = np.full(len(rows), self._extinction)
        else:
            flat = itertools.chain.from_iterable(map(self._position, ids))
            here = self._fog.extinction(np.fromiter(flat, np.float64, 3 * len(ids)).reshape(-1, 3))
        changed = np.flatnonzero(here != self._table.values[rows, Column.EXTINCTION])
        self._table.values[rows[changed], Column.EXTINCTION] = here[changed]
        values, which = np.unique(here[changed], return_inverse=True)
        choices = np.array([self._choice(visibility_from_extinction(k)) for k in values.tolist()])
        if len(changed):
            self._table.values[rows[changed], Column.CHOICE] = choices[which]

    def _shorten_headways(self, ids: Sequence[str], rows: NDArray[np.intp]) -> None:
        """Divide headways by the perceived over the true distance: who overestimates gaps keeps shorter ones."""
        table = self._table
        columns = (table.values[rows, column] for column in (Column.EXTINCTION, Column.HEADWAY_FACTOR, Column.HEADWAY))
        for vehicle, row, extinction, known, headway in zip(ids, rows, *columns, strict=True):
            factor = perceived_distance_factor(visibility_from_extinction(extinction), self._setup.misjudgement)
            if abs(factor - known) > UNNOTICED_FACTOR:
                self._headways.claim(vehicle, float(headway) / factor)
                table.values[int(row), Column.HEADWAY_FACTOR] = factor

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
        # The top speed is the lower one, and SUMO gives only that.
        return float(self._api.lane.getMaxSpeed(get.getLaneID(vehicle)) * get.getSpeedFactor(vehicle))

    def release(self) -> None:
        """Withdraw from every vehicle on the road what was claimed of its top speed and headway."""
        ids = [v for v in self._roster.present if v != self._ego]
        rows = self._table.rows(ids)
        self._top_speeds.release(ids, rows)
        for i in np.flatnonzero(self._table.values[rows, Column.HEADWAY_FACTOR] != 1.0).tolist():
            self._headways.withdraw(ids[i])
        self._table.values[rows, Column.HEADWAY_FACTOR] = 1.0
