"""Reading SUMO's vehicles into arrays: what changes for those near the ego, what never changes once."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import lamps_from_many_signals
from fogsim.traffic.bodies import Bodies
from fogsim.traffic.getters import vehicle_getter
from fogsim.traffic.link import Api
from fogsim.traffic.nearness import Nearness
from fogsim.values import Lamp, Leader, TrafficState

LEADER_RANGE = 500.0
"""How far ahead a leader is looked for [m]."""

OTHERS_LAMPS = Lamp.POSITION | Lamp.LOW_BEAM
"""Lamps that other drivers light in fog, as the law of most countries asks by day."""

_CHANGING = ("getAngle", "getSpeed", "getAcceleration", "getLaneID", "getSignals")
"""Getters of what changes, in the order of `Moving`."""


@dataclass(frozen=True, slots=True)
class Moving:
    """What changes about vehicles, in SUMO's units; entry i of each belongs to ``ids[i]``.

    Attributes
    ----------
    ids : sequence of str
        Vehicle ids.
    position : (n, 3) float64
        Middle of the front bumper [m].
    angle : sequence of float
        Heading, clockwise from north [°].
    speed, acceleration : sequence of float
        Speed [m/s] and acceleration [m/s²].
    lane : sequence of str
        Lane ids.
    signals : sequence of int
        SUMO's signal bits.
    """

    ids: Sequence[str]
    position: NDArray[np.float64]
    angle: Sequence[float]
    speed: Sequence[float]
    acceleration: Sequence[float]
    lane: Sequence[str]
    signals: Sequence[int]


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
    """

    def __init__(self, api: Api, ego: str, radius: float) -> None:
        self._api = api
        self._ego = ego
        self._radius = radius
        self._bodies = Bodies(api)
        self._nearness = Nearness(api, ego, radius)
        self._getters = tuple(vehicle_getter(api, name) for name in _CHANGING)

    def state(self, ego_lamps: Lamp) -> TrafficState:
        """Vehicles near the ego; see `Reader.state`."""
        now = self._moving()
        kinds, fixed = self._bodies.of(now.ids)
        lamps = lamps_from_many_signals(now.signals) | np.int32(OTHERS_LAMPS)
        ego = now.ids.index(self._ego)
        lamps[ego] = int(ego_lamps) | (int(lamps[ego]) & int(Lamp.STOP))
        return TrafficState(
            time=self._api.simulation.getTime(),
            ids=tuple(now.ids),
            types=kinds,
            position=now.position,
            heading=np.radians(90.0 - np.array(now.angle)),
            speed=np.array(now.speed),
            acceleration=np.array(now.acceleration),
            length=fixed[:, 0],
            width=fixed[:, 1],
            height=fixed[:, 2],
            lane=tuple(now.lane),
            lamps=lamps,
            paint=fixed[:, 3:],
        )

    def _moving(self) -> Moving:
        ids, position = self._nearness.find()
        angle, speed, acceleration, lane, signals = (list(map(getter, ids)) for getter in self._getters)
        return Moving(ids, position, angle, speed, acceleration, lane, signals)

    def _is_near(self, ids: Sequence[str], position: NDArray[np.float64]) -> NDArray[np.bool_]:
        offset = position - position[ids.index(self._ego)]
        return np.asarray(np.hypot(offset[:, 0], offset[:, 1]) <= self._radius)

    def leader(self) -> Leader | None:
        """The vehicle ahead of the ego; see `Reader.leader`."""
        get = self._api.vehicle
        found = get.getLeader(self._ego, LEADER_RANGE)
        if found is None or not found[0]:
            return None
        # SUMO's gap leaves out the follower's minimum gap.
        return Leader(found[0], found[1] + get.getMinGap(self._ego), get.getSpeed(found[0]))
