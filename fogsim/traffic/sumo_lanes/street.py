"""Reading what the traffic lights near the ego show."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import SIGNAL_COLOURS
from fogsim.traffic.sumo.link import Api, getter, vehicle_getter
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.values import PersonState, SignalAhead, SignalHead, SignalState
from fogsim.values.traffic import NO_PERSONS, NO_SIGNALS

Light = tuple[str, int, float, str]
"""Of a light ahead: its id, the index of the vehicle's link, the way to its stop line [m], and what it shows."""


class LightsAhead:
    """Finds the next light that a vehicle is to obey.

    A link that its lights do not control has the index −1, as that of a track across a level crossing: what the lights
    show is for the road. While a vehicle overtakes on the oncoming lane, SUMO counts the way from the wrong end.
    """

    def __init__(self, api: Api) -> None:
        self._lights = vehicle_getter(api, "getNextTLS")
        self._lane, self._station = vehicle_getter(api, "getLaneID"), vehicle_getter(api, "getLanePosition")
        self._length, self._directions = getter(api, "lane", "getLength"), LaneDirections(api)
        self._has_lights = int(api.trafficlight.getIDCount()) > 0

    def next_of(self, vehicle: str) -> Light | None:
        """The next light of a vehicle; None without one."""
        for name, link, left, letter in self._lights(vehicle) if self._has_lights else ():
            if link >= 0 and letter in SIGNAL_COLOURS:
                way, lane = float(left), self._lane(vehicle)
                if self._directions.is_against(vehicle, lane):
                    way = way + 2.0 * float(self._station(vehicle)) - float(self._length(lane))
                return name, link, way, letter
        return None

    def shown_to(self, vehicle: str) -> SignalAhead | None:
        """The next light of a vehicle as what it shows; None without one."""
        light = self.next_of(vehicle)
        return None if light is None else SignalAhead(light[0], SIGNAL_COLOURS[light[3]], light[2])


_SIGNAL_REACH = 500.0
"""Traffic lights farther from the ego than this are left out [m]."""

_MOVED = 25.0  # which heads are near is asked again when the ego has moved so far [m]

_FIRST = "GgyYursoO"
"""Of the letters of a lane's links, the head shows that which stands first here: what lets most of them go."""


class SignalReader:
    """Reads the heads near a place."""

    def __init__(self, api: Api, heads: Sequence[SignalHead]) -> None:
        self._letters = getter(api, "trafficlight", "getRedYellowGreenState")
        known = set(api.trafficlight.getIDList()) if heads else set()
        self._heads = [head for head in heads if head.signal_id in known]
        self._places = np.array([head.position for head in self._heads]).reshape(-1, 3)
        self._asked = np.full(2, np.inf)
        self._near: list[SignalHead] = []
        self._last, self._signals = NO_SIGNALS, tuple[str, ...]()
        self._shown: dict[str, str] = {}

    def state(self, here: NDArray[np.float64]) -> SignalState:
        """Heads nearer than `_SIGNAL_REACH` to a place, and what they show (`here` (3,) [m])."""
        if not self._heads:
            return self._last
        if not np.hypot(*(here[:2] - self._asked)) < _MOVED:
            self._find_near(here[:2])
        shown = dict(zip(self._signals, map(self._letters, self._signals), strict=True))
        if shown != self._shown or len(self._last.colour) < len(self._near):
            self._shown = shown
            colours = tuple(SIGNAL_COLOURS[_letter(shown[head.signal_id], head.links)] for head in self._near)
            self._last = replace(self._last, colour=colours)
        return self._last

    def _find_near(self, here: NDArray[np.float64]) -> None:
        self._asked = here.copy()
        off = self._places[:, :2] - here
        near = np.flatnonzero(np.hypot(off[:, 0], off[:, 1]) < _SIGNAL_REACH + _MOVED).tolist()
        self._near = heads = [self._heads[row] for row in near]
        self._signals = tuple({head.signal_id: None for head in heads})
        self._last = SignalState(
            ids=tuple(head.signal_id for head in heads),
            lane=tuple(head.lane_id for head in heads),
            position=self._places[near],
            heading=np.array([head.heading for head in heads]),
            diameter=np.array([head.diameter for head in heads]),
            on_foot=np.array([head.on_foot for head in heads] if any(head.on_foot for head in heads) else [], np.bool_),
        )


def _letter(state: str, links: Sequence[int]) -> str:
    """What a head shows of the state of its traffic light; dark where that has no such links."""
    shown = {state[link] for link in links if link < len(state)}
    return next((letter for letter in _FIRST if letter in shown), "O")


_PERSON_REACH = 400.0
"""Persons farther from the ego than this are left out [m]."""

_LOOK_PERIOD = 0.5
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
        """Persons on foot nearer than `_PERSON_REACH` to a place, or all (`here` (3,) [m], `time` [s])."""
        if not self._count():
            return NO_PERSONS
        persons = [person for person in self._candidates(here, time) if not self._vehicle(person)]
        position = np.array([self._position(person) for person in persons]).reshape(-1, 3)
        if here is not None:
            is_near = np.hypot(position[:, 0] - here[0], position[:, 1] - here[1]) < _PERSON_REACH
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
        if self._shared or not 0.0 <= time - self._asked < _LOOK_PERIOD:
            self._asked = time
            self._near = [
                person for person in sorted(self._all()) if self._is_within(person, here, _PERSON_REACH + _MARGIN)
            ]
        return self._near

    def _is_within(self, person: str, here: NDArray[np.float64], reach: float) -> bool:
        x, y = self._position(person)[:2]  # SUMO gives no height in a vehicle that waits to be inserted
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
