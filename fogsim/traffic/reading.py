"""Reading SUMO's vehicles into arrays: what changes for those near the ego, what never changes once."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import body_kind, lamps_from_signals, paint
from fogsim.traffic.link import Api
from fogsim.values import Lamp, Leader, TrafficState

LEADER_RANGE = 500.0
"""How far ahead a leader is looked for [m]."""

OTHERS_LAMPS = Lamp.POSITION | Lamp.LOW_BEAM
"""Lamps that other drivers light in fog, as the law of most countries asks by day."""


@dataclass(frozen=True, slots=True)
class _Body:
    """What never changes about a vehicle: body kind, size (length, width, height) [m] and paint."""

    kind: str
    size: tuple[float, float, float]
    paint: tuple[float, float, float]


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
        self._bodies: dict[str, _Body] = {}

    def state(self, ego_lamps: Lamp) -> TrafficState:
        """Vehicles near the ego; see `Reader.state`."""
        now = self._moving()
        bodies = [self._body(v) for v in now.ids]
        lamps = np.array([int(OTHERS_LAMPS) | lamps_from_signals(s) for s in now.signals], dtype=np.int32)
        ego = now.ids.index(self._ego)
        lamps[ego] = int(ego_lamps) | (int(lamps[ego]) & int(Lamp.STOP))
        size = np.array([b.size for b in bodies])
        return TrafficState(
            time=self._api.simulation.getTime(),
            ids=tuple(now.ids),
            types=tuple(b.kind for b in bodies),
            position=now.position,
            heading=np.radians(90.0 - np.array(now.angle)),
            speed=np.array(now.speed),
            acceleration=np.array(now.acceleration),
            length=size[:, 0],
            width=size[:, 1],
            height=size[:, 2],
            lane=tuple(now.lane),
            lamps=lamps,
            paint=np.array([b.paint for b in bodies]),
        )

    def _moving(self) -> Moving:
        get = self._api.vehicle
        everybody = tuple(get.getIDList())
        position = np.array([get.getPosition3D(v) for v in everybody])
        near = self._is_near(everybody, position)
        ids = [v for v, is_near in zip(everybody, near, strict=True) if is_near]
        return Moving(
            ids=ids,
            position=position[near],
            angle=[get.getAngle(v) for v in ids],
            speed=[get.getSpeed(v) for v in ids],
            acceleration=[get.getAcceleration(v) for v in ids],
            lane=[get.getLaneID(v) for v in ids],
            signals=[get.getSignals(v) for v in ids],
        )

    def _is_near(self, ids: Sequence[str], position: NDArray[np.float64]) -> NDArray[np.bool_]:
        offset = position - position[ids.index(self._ego)]
        return np.asarray(np.hypot(offset[:, 0], offset[:, 1]) <= self._radius)

    def _body(self, vehicle: str) -> _Body:
        known = self._bodies.get(vehicle)
        if known is None:
            get = self._api.vehicle
            known = self._bodies[vehicle] = _Body(
                body_kind(get.getVehicleClass(vehicle)),
                (get.getLength(vehicle), get.getWidth(vehicle), get.getHeight(vehicle)),
                paint(vehicle, get.getColor(vehicle)),
            )
        return known

    def leader(self) -> Leader | None:
        """The vehicle ahead of the ego; see `Reader.leader`."""
        get = self._api.vehicle
        found = get.getLeader(self._ego, LEADER_RANGE)
        if found is None or not found[0]:
            return None
        # SUMO's gap leaves out the follower's minimum gap.
        return Leader(found[0], found[1] + get.getMinGap(self._ego), get.getSpeed(found[0]))
