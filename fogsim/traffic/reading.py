"""Reading SUMO's vehicles into arrays: what changes for those near the ego, what never changes once."""

from dataclasses import dataclass

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
        """Vehicles near the ego; its lamps are those of the command, and the stop lamps that it lights itself."""
        get = self._api.vehicle
        ids, position = self._near()
        bodies = [self._body(v) for v in ids]
        lamps = np.array([int(OTHERS_LAMPS) | lamps_from_signals(get.getSignals(v)) for v in ids], dtype=np.int32)
        ego = ids.index(self._ego)
        lamps[ego] = int(ego_lamps) | (int(lamps[ego]) & int(Lamp.STOP))
        size = np.array([b.size for b in bodies])
        return TrafficState(
            time=self._api.simulation.getTime(),
            ids=ids,
            types=tuple(b.kind for b in bodies),
            position=position,
            heading=np.radians(90.0 - np.array([get.getAngle(v) for v in ids])),
            speed=np.array([get.getSpeed(v) for v in ids]),
            acceleration=np.array([get.getAcceleration(v) for v in ids]),
            length=size[:, 0],
            width=size[:, 1],
            height=size[:, 2],
            lane=tuple(get.getLaneID(v) for v in ids),
            lamps=lamps,
            paint=np.array([b.paint for b in bodies]),
        )

    def _near(self) -> tuple[tuple[str, ...], NDArray[np.float64]]:
        ids = tuple(self._api.vehicle.getIDList())
        position = np.array([self._api.vehicle.getPosition3D(v) for v in ids])
        offset = position - position[ids.index(self._ego)]
        near = np.hypot(offset[:, 0], offset[:, 1]) <= self._radius
        return tuple(v for v, is_near in zip(ids, near, strict=True) if is_near), position[near]

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
        """The vehicle ahead of the ego in its lane."""
        get = self._api.vehicle
        found = get.getLeader(self._ego, LEADER_RANGE)
        if found is None or not found[0]:
            return None
        # SUMO's gap leaves out the follower's minimum gap.
        return Leader(found[0], found[1] + get.getMinGap(self._ego), get.getSpeed(found[0]))
