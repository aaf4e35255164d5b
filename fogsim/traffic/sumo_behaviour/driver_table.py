"""Traits of drivers, what their vehicles entered with, and what was last set: a row for each driver."""

from collections.abc import Sequence
from enum import IntEnum, auto

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.drivers.following import FOLLOWING_MODELS, FollowingModel
from fogsim.traffic.drivers.speed_choice import DriverSetup, driver_traits
from fogsim.traffic.sumo.claims import SPEED_FACTOR, TIME_HEADWAY, TOP_SPEED, Claims
from fogsim.traffic.sumo.link import Api, vehicle_getter


class Column(IntEnum):
    """What a row holds.

    Attributes
    ----------
    FACTOR, REACHED_FROM, MOVED_FROM, KIND
        The driver's factor on the chosen speed, from which shares on advice reaches and moves them, how they
        follow: a place in `DriverTable.kinds` [-].
    TOP_SPEED, HEADWAY, SPEED_FACTOR, MINIMUM_GAP
        Top speed [m/s], wanted time headway [s], speed over the limit [-] and minimum gap [m] of the vehicle as it
        entered.
    SPEED_SET, SPEED_DESIRED
        Top speed that was claimed, and the desired one that it changes to [m/s].
    SHARE_SET, SHARE_DESIRED
        Share of the speed in clear air that was claimed, and the desired one that it changes to [-].
    HEADWAY_SET, HEADWAY_EXTINCTION
        Time headway that was claimed, or the own one [s], and the extinction coefficient that went with it [1/m].
    EXTINCTION, VISIBILITY, BODY_REACH, REACH
        Extinction coefficient where it was last [1/m]; what goes with it: the visibility that the driver goes by, and
        how far away a leader's body, and anything of it, is seen [m].
    CHOICE, SHARE, LIMIT
        What goes with that: the speed [m/s] and the share of the speed in clear air [-] of the driver's choice, and the
        speed not exceeded so as not to come too near to a leader [m/s].
    """

    FACTOR = 0
    REACHED_FROM = auto()
    MOVED_FROM = auto()
    KIND = auto()
    TOP_SPEED = auto()
    HEADWAY = auto()
    SPEED_FACTOR = auto()
    MINIMUM_GAP = auto()
    SPEED_SET = auto()
    SPEED_DESIRED = auto()
    SHARE_SET = auto()
    SHARE_DESIRED = auto()
    HEADWAY_SET = auto()
    HEADWAY_EXTINCTION = auto()
    EXTINCTION = auto()
    VISIBILITY = auto()
    BODY_REACH = auto()
    REACH = auto()
    CHOICE = auto()
    SHARE = auto()
    LIMIT = auto()


class DriverTable:
    """The table (m, len(Column)); it grows, into another array, with every new driver.

    Traits depend on the seed and the vehicle's id alone; `top_speeds`, `headways` and `speed_factors` are the session's
    claims to what is set of vehicles.
    """

    def __init__(self, api: Api, setup: DriverSetup, seed: int, session: str) -> None:
        self.top_speeds = Claims(api, TOP_SPEED, session)
        self.headways = Claims(api, TIME_HEADWAY, session)
        self.speed_factors = Claims(api, SPEED_FACTOR, session)
        self._minimum_gap = vehicle_getter(api, "getMinGap")
        self._setup = setup
        self._seed = seed
        names = list(setup.following_shares)
        self.kinds: tuple[FollowingModel, ...] = tuple(FOLLOWING_MODELS[name] for name in names)
        self._kind = {name: place for place, name in enumerate(names)}
        self._row: dict[str, int] = {}
        self.values = np.empty((64, len(Column)))

    def rows(self, vehicles: Sequence[str]) -> NDArray[np.intp]:
        """Rows of vehicles (n,); a new one gets one."""
        known = self._row
        return np.array([known[v] if v in known else self._fill(v) for v in vehicles], dtype=np.intp)

    def reset(self, vehicles: Sequence[str]) -> None:
        """Fill rows again for vehicles that have entered, come back, or bear the id of one that was there."""
        for vehicle in vehicles:
            self._fill(vehicle)

    def _fill(self, vehicle: str) -> int:
        row = self._row.get(vehicle, len(self._row))
        if row == len(self.values):
            self.values = np.concatenate((self.values, np.empty_like(self.values)))
        for claims in (self.top_speeds, self.headways, self.speed_factors):
            claims.withdraw(vehicle)
        driver, top_speed = driver_traits(self._setup, vehicle, self._seed), self.top_speeds.own_value(vehicle)
        headway = self.headways.own_value(vehicle)
        self.values[row] = (
            *(driver.speed_factor, driver.reached_from, driver.moved_from, self._kind[driver.following]),
            *(top_speed, headway, self.speed_factors.own_value(vehicle), self._minimum_gap(vehicle)),
            *(top_speed, top_speed, 1.0, 1.0, headway, 0.0),
            *(-1.0, np.inf, np.inf, np.inf, np.inf, 1.0, np.inf),
        )
        self._row[vehicle] = row
        return row
