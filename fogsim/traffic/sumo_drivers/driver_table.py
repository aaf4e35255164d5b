"""Traits of drivers, what their vehicles entered with, and what was last set: a row for each driver."""

from collections.abc import Sequence
from enum import IntEnum, auto

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.speed_choice import DriverSetup, driver_traits
from fogsim.traffic.sumo.claims import Claims


class Column(IntEnum):
    """What a row holds.

    Attributes
    ----------
    FACTOR, FOLLOWS
        The driver's factor on the chosen speed, and whether advice moves them, 0 or 1 [-].
    TOP_SPEED, HEADWAY
        Top speed [m/s] and wanted time headway [s] of the vehicle as it entered.
    SPEED_SET, SPEED_DESIRED
        Top speed that was claimed, and the desired one that it changes to [m/s].
    HEADWAY_FACTOR
        Factor by which its headway was shortened [-].
    EXTINCTION, CHOICE
        Extinction coefficient where it was last [1/m], and the speed that goes with it [m/s].
    """

    FACTOR = 0
    FOLLOWS = auto()
    TOP_SPEED = auto()
    HEADWAY = auto()
    SPEED_SET = auto()
    SPEED_DESIRED = auto()
    HEADWAY_FACTOR = auto()
    EXTINCTION = auto()
    CHOICE = auto()


class DriverTable:
    """The table; it grows with every new driver.

    Parameters
    ----------
    setup : DriverSetup
        What drivers are like.
    seed : int
        With a vehicle's id it gives its driver's traits, so that they depend on nothing else.
    top_speeds, headways : Claims
        The session's claims to them.

    Attributes
    ----------
    values : (m, len(Column)) float64
        The rows; another array when the table has grown.
    """

    def __init__(self, setup: DriverSetup, seed: int, top_speeds: Claims, headways: Claims) -> None:
        self._top_speeds = top_speeds
        self._headways = headways
        self._setup = setup
        self._seed = seed
        self._row: dict[str, int] = {}
        self.values = np.empty((64, len(Column)))

    def rows(self, vehicles: Sequence[str]) -> NDArray[np.intp]:
        """Rows of vehicles (n,); a new one gets one.

        Parameters
        ----------
        vehicles : (n,) sequence of str
            Their ids.
        """
        known = self._row
        return np.array([known[v] if v in known else self._fill(v) for v in vehicles], dtype=np.intp)

    def reset(self, vehicles: Sequence[str]) -> None:
        """Fill rows anew for vehicles that have entered, come back, or bear the id of one that was there.

        Parameters
        ----------
        vehicles : sequence of str
            Their ids.
        """
        for vehicle in vehicles:
            self._fill(vehicle)

    def _fill(self, vehicle: str) -> int:
        row = self._row.get(vehicle, len(self._row))
        if row == len(self.values):
            self.values = np.concatenate((self.values, np.empty_like(self.values)))
        for claims in (self._top_speeds, self._headways):
            claims.withdraw(vehicle)
        driver, top_speed = driver_traits(self._setup, vehicle, self._seed), self._top_speeds.own_value(vehicle)
        headway = self._headways.own_value(vehicle)
        self.values[row] = (
            *(driver.speed_factor, driver.follows_advice, top_speed, headway),
            *(top_speed, top_speed, 1.0, -1.0, np.inf),
        )
        self._row[vehicle] = row
        return row
