"""Moving SUMO's vehicles to the top speeds that their drivers want: nobody stands on the brakes for a speed sign.

A car-following model obeys a lower top speed as hard as it can brake. So a top speed is lowered step by step, from the
speed at which the vehicle drives; only vehicles whose top speed is moving are touched. Braking for a leader stays the
model's own, and so does speeding up.
"""

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.deceleration import governed_speed
from fogsim.traffic.sumo.claims import Claims
from fogsim.traffic.sumo.getters import vehicle_getter
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo_drivers.driver_table import Column, DriverTable

UNNOTICED_SPEED = 0.3
"""Change of a wanted speed [m/s] that nobody would notice; setting it costs calls."""

LONGEST_MOVE = 1.0
"""However long nobody has called, a top speed falls by no more than what this time gives [s]."""


class TopSpeeds:
    """Sets top speeds, and lowers them gradually.

    Parameters
    ----------
    api : Api
        The simulation.
    table : DriverTable
        What was last set.
    claims : Claims
        The session's claims to top speeds.
    deceleration : float
        How fast a top speed falls [m/s²], positive.
    now : float
        Simulated time [s].
    """

    def __init__(self, api: Api, table: DriverTable, claims: Claims, deceleration: float, now: float) -> None:
        self._vehicles = api.vehicle
        self._speed = vehicle_getter(api, "getSpeed")
        self._table = table
        self._claims = claims
        self._deceleration = deceleration
        self._moved_at = now
        self._falling: dict[str, int] = {}

    def want(self, vehicles: Sequence[str], rows: NDArray[np.intp], wanted: NDArray[np.float64]) -> None:
        """Let drivers want other speeds from now on.

        Parameters
        ----------
        vehicles : sequence of str
            Their vehicles (n).
        rows : (n,) intp
            Their rows of the table.
        wanted : (n,) float64
            Top speeds to come to [m/s].
        """
        table = self._table
        for i in np.flatnonzero(np.abs(wanted - table.get(Column.SPEED_WANTED, rows)) > UNNOTICED_SPEED).tolist():
            vehicle, row, speed = vehicles[i], int(rows[i]), float(wanted[i])
            table.put(Column.SPEED_WANTED, row, speed)
            top_speed = table.number(Column.SPEED_SET, row)
            if speed < top_speed:
                # What is left between the speed and the top speed need not be braked away.
                top_speed = min(top_speed, float(self._speed(vehicle)))
            if speed < top_speed:
                table.put(Column.SPEED_SET, row, top_speed)
                self._falling[vehicle] = row
            else:
                self._falling.pop(vehicle, None)
                self._set(vehicle, row, speed)

    def enter(self, vehicles: Sequence[str], rows: NDArray[np.intp], wanted: NDArray[np.float64]) -> None:
        """Let vehicles that have just departed come along no faster than their drivers want; see `want`."""
        table = self._table
        slower = np.flatnonzero(wanted < table.get(Column.TOP_SPEED, rows) - UNNOTICED_SPEED)
        for i in slower.tolist():
            vehicle, speed = vehicles[i], float(wanted[i])
            if speed < self._speed(vehicle):
                # It has not braked for that: its acceleration is nought.
                self._vehicles.setPreviousSpeed(vehicle, speed, 0.0)
            table.put(Column.SPEED_WANTED, int(rows[i]), speed)
            self._set(vehicle, int(rows[i]), speed)

    def move(self, time: float, present: Collection[str]) -> None:
        """Lower the top speeds that are on their way down.

        Parameters
        ----------
        time : float
            Simulated time [s].
        present : collection of str
            Who is on the road.
        """
        passed, self._moved_at = min(max(time - self._moved_at, 0.0), LONGEST_MOVE), time
        for vehicle, row in list(self._falling.items()) if self._falling else ():
            if vehicle not in present:
                del self._falling[vehicle]
                continue
            wanted = self._table.number(Column.SPEED_WANTED, row)
            speed = governed_speed(self._table.number(Column.SPEED_SET, row), wanted, self._deceleration, passed)
            self._set(vehicle, row, speed)
            if speed <= wanted:
                del self._falling[vehicle]

    def _set(self, vehicle: str, row: int, speed: float) -> None:
        if speed < self._table.number(Column.TOP_SPEED, row):
            self._claims.make(vehicle, speed)
        else:
            self._claims.withdraw(vehicle)
        self._table.put(Column.SPEED_SET, row, speed)

    def release(self, vehicles: Sequence[str], rows: NDArray[np.intp]) -> None:
        """Withdraw all claims to the top speeds of vehicles."""
        self._falling.clear()
        own = self._table.get(Column.TOP_SPEED, rows)
        for i in np.flatnonzero(self._table.get(Column.SPEED_SET, rows) != own).tolist():
            self._set(vehicles[i], int(rows[i]), float(own[i]))
        self._table.put(Column.SPEED_WANTED, rows, own)
