"""Moving SUMO's vehicles to the top speeds that their drivers desire, as gently as people slow down for a speed sign.

A car-following model obeys a lower top speed as hard as it can brake. So a top speed is lowered step by step, from the
speed at which the vehicle drives; only vehicles whose top speed is moving are touched. Braking for a leader stays the
model's own, and so does speeding up.
"""

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.core.kinematics import decelerated_speed
from fogsim.traffic.sumo.claims import Claims
from fogsim.traffic.sumo.link import UNKNOWN, Api, vehicle_getter
from fogsim.traffic.sumo_behaviour.driver_table import Column, DriverTable

_UNNOTICED_SPEED = 0.3
"""Change of a desired speed [m/s] that is not noticed; setting it costs calls."""

_MAX_INTERVAL = 1.0
"""However long ago the last update was, a top speed falls by no more than it does in this time [s]."""


class TopSpeedControl:
    """Sets top speeds, and lowers them gradually (`deceleration` [m/s²], `now` [s])."""

    def __init__(self, api: Api, table: DriverTable, claims: Claims, deceleration: float, now: float) -> None:
        self._vehicles = api.vehicle
        self._speed = vehicle_getter(api, "getSpeed")
        self._table = table
        self._claims = claims
        self._deceleration = deceleration
        self._updated_at = now
        self._falling: dict[str, int] = {}

    def set_desired(self, vehicles: Sequence[str], rows: NDArray[np.intp], desired: NDArray[np.float64]) -> None:
        """Set the desired speeds of drivers (`rows` (n,) int, `desired` (n,) [m/s])."""
        table = self._table
        noticed = np.abs(desired - table.values[rows, Column.SPEED_DESIRED]) > _UNNOTICED_SPEED
        for i in noticed.nonzero()[0].tolist():
            vehicle, row, speed = vehicles[i], int(rows[i]), float(desired[i])
            table.values[row, Column.SPEED_DESIRED] = speed
            top_speed = float(table.values[row, Column.SPEED_SET])
            if speed < top_speed:
                # What is left between the speed and the top speed need not be braked away.
                top_speed = min(top_speed, float(self._speed(vehicle)))
            if speed < top_speed:
                table.values[row, Column.SPEED_SET] = top_speed
                self._falling[vehicle] = row
            else:
                self._falling.pop(vehicle, None)
                self._set(vehicle, row, speed)

    def set_at_entry(self, vehicles: Sequence[str], rows: NDArray[np.intp], desired: NDArray[np.float64]) -> None:
        """Let vehicles that have just departed drive no faster than their drivers desire."""
        table = self._table
        slower = desired < table.values[rows, Column.TOP_SPEED] - _UNNOTICED_SPEED
        for i in slower.nonzero()[0].tolist():
            vehicle, speed = vehicles[i], float(desired[i])
            if speed < self._speed(vehicle):
                # It has not braked for that: its acceleration is 0.
                self._vehicles.setPreviousSpeed(vehicle, speed, 0.0)
            table.values[int(rows[i]), Column.SPEED_DESIRED] = speed
            self._set(vehicle, int(rows[i]), speed)

    def update(self, time: float, present: Collection[str]) -> None:
        """Lower further the top speeds that are being lowered (`time` [s])."""
        before, self._updated_at = self._updated_at, time
        if not self._falling:
            return
        passed = min(max(time - before, 0.0), _MAX_INTERVAL)
        for vehicle, row in list(self._falling.items()):
            if vehicle not in present:
                del self._falling[vehicle]
                continue
            desired = float(self._table.values[row, Column.SPEED_DESIRED])
            speed = decelerated_speed(
                float(self._table.values[row, Column.SPEED_SET]), desired, self._deceleration, passed
            )
            self._set(vehicle, row, speed)
            if speed <= desired:
                del self._falling[vehicle]

    def _set(self, vehicle: str, row: int, speed: float) -> None:
        if speed < float(self._table.values[row, Column.TOP_SPEED]):
            self._claims.claim(vehicle, speed)
        else:
            self._claims.withdraw(vehicle)
        self._table.values[row, Column.SPEED_SET] = speed

    def release(self, vehicles: Sequence[str], rows: NDArray[np.intp]) -> None:
        """Withdraw all claims to the top speeds of vehicles (`rows` (n,) int)."""
        self._falling.clear()
        own = self._table.values[rows, Column.TOP_SPEED]
        for i in np.flatnonzero(self._table.values[rows, Column.SPEED_SET] != own).tolist():
            self._set(vehicles[i], int(rows[i]), float(own[i]))
        self._table.values[rows, Column.SPEED_DESIRED] = own


_UNNOTICED_SHARE = 0.01
"""Change of a share [-] that is not noticed; setting it costs calls."""

_SLOWEST = 1.0


class SpeedShareControl:
    """Sets shares, and lowers them gradually (`deceleration` [m/s²], `now` [s])."""

    def __init__(self, api: Api, table: DriverTable, deceleration: float, now: float) -> None:
        self._vehicles = api.vehicle
        self._speed = vehicle_getter(api, "getSpeed")
        self._allowed = vehicle_getter(api, "getAllowedSpeed")
        self._table = table
        self._deceleration = deceleration
        self._updated_at = now
        self._falling: dict[str, tuple[int, float]] = {}

    def set_desired(self, vehicles: Sequence[str], rows: NDArray[np.intp], desired: NDArray[np.float64]) -> None:
        """Set the shares that drivers want (`rows` (n,) int, `desired` (n,))."""
        table = self._table
        for i in _is_noticed(desired, table.values[rows, Column.SHARE_DESIRED]).nonzero()[0].tolist():
            vehicle, row, share = vehicles[i], int(rows[i]), float(desired[i])
            table.values[row, Column.SHARE_DESIRED] = share
            if share >= table.values[row, Column.SHARE_SET]:
                self._falling.pop(vehicle, None)
                self._set(vehicle, row, share)
            else:
                in_clear_air = max(float(self._allowed(vehicle)) / table.values[row, Column.SHARE_SET], _SLOWEST)
                # What is left between the speed and the wanted one need not be braked away.
                start = min(float(table.values[row, Column.SHARE_SET]), float(self._speed(vehicle)) / in_clear_air)
                table.values[row, Column.SHARE_SET] = max(start, share)
                self._falling[vehicle] = (row, self._deceleration / in_clear_air)

    def set_at_entry(self, vehicles: Sequence[str], rows: NDArray[np.intp], desired: NDArray[np.float64]) -> None:
        """Let vehicles that have just departed drive no faster than the share that their drivers want."""
        for i in _is_noticed(desired, np.ones(len(desired))).nonzero()[0].tolist():
            vehicle, row = vehicles[i], int(rows[i])
            self._table.values[row, Column.SHARE_DESIRED] = desired[i]
            self._set(vehicle, row, float(desired[i]))
            allowed = float(self._allowed(vehicle))
            if UNKNOWN < allowed < self._speed(vehicle):
                # It has not braked for that: its acceleration is 0.
                self._vehicles.setPreviousSpeed(vehicle, allowed, 0.0)

    def update(self, time: float, present: Collection[str]) -> None:
        """Lower further the shares that are being lowered (`time` [s])."""
        before, self._updated_at = self._updated_at, time
        if not self._falling:
            return
        passed = min(max(time - before, 0.0), _MAX_INTERVAL)
        for vehicle, (row, rate) in list(self._falling.items()):
            if vehicle not in present:
                del self._falling[vehicle]
                continue
            desired = float(self._table.values[row, Column.SHARE_DESIRED])
            share = max(float(self._table.values[row, Column.SHARE_SET]) - rate * passed, desired)
            self._set(vehicle, row, share)
            if share <= desired:
                del self._falling[vehicle]

    def _set(self, vehicle: str, row: int, share: float) -> None:
        table = self._table
        if share < 1.0:
            table.speed_factors.claim(vehicle, share * float(table.values[row, Column.SPEED_FACTOR]))
        else:
            table.speed_factors.withdraw(vehicle)
        table.values[row, Column.SHARE_SET] = share

    def release(self, vehicles: Sequence[str], rows: NDArray[np.intp]) -> None:
        """Give vehicles their own speed factors back (`rows` (n,) int)."""
        self._falling.clear()
        for i in np.flatnonzero(self._table.values[rows, Column.SHARE_DESIRED] != 1.0).tolist():
            self._set(vehicles[i], int(rows[i]), 1.0)
        self._table.values[rows, Column.SHARE_DESIRED] = 1.0


def _is_noticed(desired: NDArray[np.float64], known: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether shares differ; whoever is to be as in clear air is, to the last digit."""
    noticed: NDArray[np.bool_] = (np.abs(desired - known) > _UNNOTICED_SHARE) | ((desired == 1.0) & (known != 1.0))
    return noticed
