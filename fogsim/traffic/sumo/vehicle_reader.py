"""Reading SUMO's vehicles into arrays: what changes for those near the ego, what never changes once."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import OTHERS_LAMPS, lamps_from_many_signals
from fogsim.traffic.sumo.bodies import Bodies
from fogsim.traffic.sumo.getters import vehicle_getter
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.nearness import Nearness
from fogsim.traffic.sumo.roster import Roster
from fogsim.values import Lamp, Leader, TrafficState

LEADER_RANGE = 500.0
"""How far ahead a leader is looked for [m]."""

_CHANGING = ("getAngle", "getSpeed", "getAcceleration", "getSignals", "getLaneID")
"""Getters of what changes."""


class Moving(NamedTuple):
    """What changes about vehicles, in SUMO's units; entry i of each belongs to ``ids[i]``.

    A named tuple is made in a third of the time of a frozen dataclass, which is noticeable in each step.

    Attributes
    ----------
    ids : tuple of str
        Vehicle ids.
    position : (n, 3) float64
        Middle of the front bumper [m].
    angle : (n,) float64
        Heading, clockwise from north [°].
    speed, acceleration : (n,) float64
        Speed [m/s] and acceleration [m/s²].
    lane : tuple of str
        Lane ids.
    signals : sequence of int
        SUMO's signal bits.
    slope : (n,) float64
        From the rear to the front bumper, positive uphill [°].
    """

    ids: tuple[str, ...]
    position: NDArray[np.float64]
    angle: NDArray[np.float64]
    speed: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    lane: tuple[str, ...]
    signals: Sequence[int]
    slope: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Known:
    """What never changes about those near, and which row is the ego's."""

    ids: Sequence[str]
    ego: int
    kinds: tuple[str, ...]
    length: NDArray[np.float64]
    width: NDArray[np.float64]
    height: NDArray[np.float64]
    paint: NDArray[np.float64]


class Reader(Protocol):
    """Reads the vehicles near an ego that is on the road."""

    def state(self, ego_lamps: Lamp) -> TrafficState:
        """Vehicles near the ego; its lamps are those of the command, and the stop lamps that it lights itself."""

    def leader(self) -> Leader | None:
        """The vehicle ahead of the ego in its lane."""


class VehicleReader:
    """Reads vehicles by SUMO's plain getters, which inside the process beat subscriptions.

    Parameters
    ----------
    api : Api
        The simulation.
    ego : str
        Id of the ego, which is always read.
    radius : float
        Vehicles farther from the ego than this are left out [m].
    roster : Roster or None
        Who is on the road; None for one of its own.
    """

    def __init__(self, api: Api, ego: str, radius: float, roster: Roster | None = None) -> None:
        self._api = api
        self._ego = ego
        self._radius = radius
        self._bodies = Bodies(api)
        self._roster = Roster(api) if roster is None else roster
        self._nearness = Nearness(api, ego, radius, self._roster)
        self._getters = tuple(vehicle_getter(api, name) for name in _CHANGING)
        self._slope = vehicle_getter(api, "getSlope")
        self._level = math.nan
        self._leader = vehicle_getter(api, "getLeader")
        self._speed = vehicle_getter(api, "getSpeed")
        self._minimum_gap = vehicle_getter(api, "getMinGap")
        self._mark = 0
        self._known: _Known | None = None
        self._signals: tuple[Sequence[int], NDArray[np.int32]] = ([], np.zeros(0, dtype=np.int32))

    def state(self, ego_lamps: Lamp) -> TrafficState:
        """Vehicles near the ego; see `Reader.state`."""
        self._roster.look()
        new, self._mark = self._roster.newcomers(self._mark)
        self._bodies.forget(new)
        now = self._moving()
        known = self._knowledge(now.ids)
        ego = known.ego
        lamps = self._lamps(now.signals)
        lamps[ego] = int(ego_lamps) | (int(lamps[ego]) & int(Lamp.STOP))
        return TrafficState(
            time=self._roster.time,
            ids=now.ids,
            types=known.kinds,
            position=now.position,
            heading=np.radians(90.0 - now.angle),
            speed=now.speed,
            acceleration=now.acceleration,
            length=known.length,
            width=known.width,
            height=known.height,
            lane=now.lane,
            lamps=lamps,
            paint=known.paint,
            grade=np.radians(now.slope),
        )

    def _lamps(self, signals: Sequence[int]) -> NDArray[np.int32]:
        """Lamps of all as if nobody were told any; computed anew when a signal has changed."""
        if signals != self._signals[0]:
            self._signals = signals, lamps_from_many_signals(signals) | np.int32(OTHERS_LAMPS)
        return self._signals[1].copy()

    def _knowledge(self, ids: Sequence[str]) -> _Known:
        """What never changes; looked up anew when others are near than before."""
        if self._known is None or self._known.ids is not ids:
            kinds, numbers = self._bodies.of(ids)
            length, width, height = numbers[:, :3].T
            self._known = _Known(ids, ids.index(self._ego), kinds, length, width, height, numbers[:, 3:])
        return self._known

    def _moving(self) -> Moving:
        ids, position = self._nearness.find()
        angle, speed, acceleration, signals, lane = self._getters
        # One array for all: for few vehicles making arrays costs more than asking.
        flat = itertools.chain(map(angle, ids), map(speed, ids), map(acceleration, ids))
        angles, speeds, accelerations = np.fromiter(flat, np.float64, 3 * len(ids)).reshape(3, -1)
        lanes, lit, slopes = tuple(map(lane, ids)), list(map(signals, ids)), self._slopes(ids, position[:, 2])
        return Moving(ids, position, angles, speeds, accelerations, lanes, lit, slopes)

    def _slopes(self, ids: Sequence[str], heights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Slopes (n,) [°], which nobody is asked for while all stay on the level."""
        if (heights == self._level).all():
            return np.zeros(len(ids))
        slopes = np.fromiter(map(self._slope, ids), np.float64, len(ids))
        # Whoever leaves the level, or comes to it, is at another height first.
        self._level = math.nan if slopes.any() or np.ptp(heights) else float(heights[0])
        return slopes

    def _is_near(self, ids: Sequence[str], position: NDArray[np.float64]) -> NDArray[np.bool_]:
        offset = position - position[ids.index(self._ego)]
        return np.asarray(np.hypot(offset[:, 0], offset[:, 1]) <= self._radius)

    def leader(self) -> Leader | None:
        """The vehicle ahead of the ego; see `Reader.leader`."""
        found = self._leader(self._ego, LEADER_RANGE)
        if found is None or not found[0]:
            return None
        # SUMO's gap leaves out the follower's minimum gap.
        return Leader(found[0], found[1] + self._minimum_gap(self._ego), self._speed(found[0]))
