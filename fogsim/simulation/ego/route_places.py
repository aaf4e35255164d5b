"""Where vehicles are along a route, and who drives on it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.simulation.road_sections import stations
from fogsim.values import TrafficState

Floats = NDArray[np.float64]

_BESIDE = 15.0
"""How far from the line of a route a vehicle is on its road [m]."""

_SAME_WAY = 0.5
"""Least cosine of the angle between a vehicle's heading and the route for it to go the same way [-]."""


class Places(NamedTuple):
    """Vehicles along a route."""

    # along, aside (n,): how far along the route they are, and how far to its left [m]
    along: Floats
    aside: Floats
    on_way: NDArray[np.bool_]  # (n,) bool: Whether they are on its road and go its way


class RoutePlaces:
    """A route along which vehicles have places (`route` (m, 3) [m])."""

    def __init__(self, route: Floats) -> None:
        self.stations = stations(route)
        self._starts, self._ways = route[:-1, :2], np.diff(route[:, :2], axis=0)
        self._lengths = np.maximum(np.hypot(*self._ways.T), 1e-6)

    def of(self, state: TrafficState) -> Places:
        """Where vehicles are."""
        apart = state.position[:, None, :2] - self._starts
        shares = np.clip((apart * self._ways).sum(axis=-1) / self._lengths**2, 0.0, 1.0)
        beside = np.hypot(*np.moveaxis(apart - shares[:, :, None] * self._ways, -1, 0))
        nearest = beside.argmin(axis=1)
        row = np.arange(len(nearest))
        along = self.stations[nearest] + shares[row, nearest] * np.diff(self.stations)[nearest]
        (ahead, left), near = self._ways[nearest].T / self._lengths[nearest], apart[row, nearest]
        on_way = np.cos(state.heading) * ahead + np.sin(state.heading) * left >= _SAME_WAY
        return Places(along, ahead * near[:, 1] - left * near[:, 0], on_way & (beside[row, nearest] <= _BESIDE))
