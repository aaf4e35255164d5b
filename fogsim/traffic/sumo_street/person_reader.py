"""Reading persons on foot: near the ego, or all."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.sumo.link import Api, getter
from fogsim.values import PersonState
from fogsim.values.traffic import NO_PERSONS

REACH = 400.0
"""Persons farther from the ego than this are left out [m]."""

LOOK_PERIOD = 0.5
"""Who is near is asked again after this time [s]."""

_MARGIN = 30.0  # farther than anybody, the ego or a person, comes in that time [m]
_WALKING_AREA, _CROSSING = "w", "c"
_ON_FOOT = ("pedestrian",)


class PersonReader:
    """Reads persons who walk or stand; those who ride are in their vehicles."""

    def __init__(self, api: Api, shared: bool = False) -> None:
        self._shared = shared
        self._allowed = getter(api, "lane", "getAllowed")
        self._arrived = getter(api, "simulation", "getArrivedPersonIDList")
        names = ("getIDList", "getIDCount", "getPosition3D", "getAngle", "getSpeed", "getLaneID", "getVehicle")
        getters = [getter(api, "person", name) for name in names]
        self._all, self._count, self._position, self._angle, self._speed, self._lane, self._vehicle = getters
        self._near: Sequence[str] = ()
        self._asked = -math.inf
        self._footways: dict[str, bool] = {}

    def state(self, here: NDArray[np.float64] | None, time: float) -> PersonState:
        """Persons on foot nearer than `REACH` to a place, or all (`here` (3,) [m], `time` [s])."""
        if not self._count():
            return NO_PERSONS
        persons = [person for person in self._candidates(here, time) if not self._vehicle(person)]
        position = np.array([self._position(person) for person in persons]).reshape(-1, 3)
        if here is not None:
            is_near = np.hypot(position[:, 0] - here[0], position[:, 1] - here[1]) < REACH
            persons, position = list(itertools.compress(persons, is_near.tolist())), position[is_near]
        if not persons:
            return NO_PERSONS
        lanes = tuple(self._lane(person) for person in persons)
        return PersonState(
            ids=tuple(persons),
            position=position,
            heading=np.radians(90.0 - np.array([self._angle(person) for person in persons])),
            speed=np.array([self._speed(person) for person in persons]),
            lane=lanes,
            raised=np.array([self._is_footway(lane) for lane in lanes]),
        )

    def look(self) -> None:
        """Notice in each step who has arrived."""
        if self._near and (gone := {*self._arrived()}):
            self._near = [person for person in self._near if person not in gone]

    def _candidates(self, here: NDArray[np.float64] | None, time: float) -> Sequence[str]:
        """Persons who may be near."""
        if here is None:
            return sorted(self._all())
        if self._shared or not 0.0 <= time - self._asked < LOOK_PERIOD:
            self._asked = time
            self._near = [person for person in sorted(self._all()) if self._is_within(person, here, REACH + _MARGIN)]
        return self._near

    def _is_within(self, person: str, here: NDArray[np.float64], reach: float) -> bool:
        x, y, _ = self._position(person)
        return math.hypot(x - here[0], y - here[1]) < reach

    def _is_footway(self, lane: str) -> bool:
        """Whether a lane is higher than the street."""
        if lane not in self._footways:
            edge, _, _ = lane.rpartition("_")
            part = edge.rpartition("_")[2] if edge.startswith(":") else ""
            is_area = part.startswith(_WALKING_AREA)
            on_foot = not part.startswith(_CROSSING) and lane != "" and tuple(self._allowed(lane)) == _ON_FOOT
            self._footways[lane] = is_area or on_foot
        return self._footways[lane]
