"""What drivers are like, what their vehicles came with and what was last set: a row for each driver met."""

from collections.abc import Sequence
from enum import IntEnum, auto

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.individual import nature
from fogsim.traffic.drivers.speed_choice import DriverSetup
from fogsim.traffic.sumo.claims import Claims


class Column(IntEnum):
    """What a row tells.

    Attributes
    ----------
    FACTOR, FOLLOWS
        The driver's factor on the chosen speed, and whether advice moves them, 0 or 1 [-].
    TOP_SPEED, HEADWAY
        Top speed [m/s] and wanted time headway [s] of the vehicle as it came.
    SPEED_SET, SPEED_WANTED
        Top speed that was claimed, and the one that it is on the way to [m/s].
    SHORTENED
        Factor by which its headway was shortened [-].
    EXTINCTION, CHOICE
        Extinction coefficient where it was last [1/m], and the speed that goes with it [m/s].
    """

    FACTOR = 0
    FOLLOWS = auto()
    TOP_SPEED = auto()
    HEADWAY = auto()
    SPEED_SET = auto()
    SPEED_WANTED = auto()
    SHORTENED = auto()
    EXTINCTION = auto()
    CHOICE = auto()


class DriverTable:
    """The table; it grows with every driver met.

    Parameters
    ----------
    setup : DriverSetup
        What drivers are like.
    seed : int
        With a vehicle's id it gives its driver's nature, so that it depends on nothing else.
    top_speeds, headways : Claims
        The session's claims to them.
    """

    def __init__(self, setup: DriverSetup, seed: int, top_speeds: Claims, headways: Claims) -> None:
        self._top_speeds = top_speeds
        self._headways = headways
        self._setup = setup
        self._seed = seed
        self._row: dict[str, int] = {}
        self._numbers = np.empty((64, len(Column)))

    def rows(self, vehicles: Sequence[str]) -> NDArray[np.intp]:
        """Rows of vehicles (n,); who is new gets one."""
        known = self._row
        return np.array([known[v] if v in known else self._meet(v) for v in vehicles], dtype=np.intp)

    def get(self, column: Column, rows: NDArray[np.intp]) -> NDArray[np.float64]:
        """One column of some rows (n,)."""
        return np.asarray(self._numbers[rows, column])

    def number(self, column: Column, row: int) -> float:
        """What one row tells in one column."""
        return float(self._numbers[row, column])

    def put(self, column: Column, rows: NDArray[np.intp] | int, values: NDArray[np.float64] | float) -> None:
        """Write one column of some rows."""
        self._numbers[rows, column] = values

    def welcome(self, vehicles: Sequence[str]) -> None:
        """Fill rows anew for vehicles that have come, come back, or bear the id of one that was there."""
        for vehicle in vehicles:
            self._meet(vehicle)

    def _meet(self, vehicle: str) -> int:
        row = self._row.get(vehicle, len(self._row))
        if row == len(self._numbers):
            self._numbers = np.concatenate((self._numbers, np.empty_like(self._numbers)))
        for claims in (self._top_speeds, self._headways):
            claims.withdraw(vehicle)
        driver, top_speed = nature(self._setup, vehicle, self._seed), self._top_speeds.own(vehicle)
        headway = self._headways.own(vehicle)
        self._numbers[row] = (
            *(driver.factor, driver.follows, top_speed, headway),
            *(top_speed, top_speed, 1.0, -1.0, np.inf),
        )
        self._row[vehicle] = row
        return row
