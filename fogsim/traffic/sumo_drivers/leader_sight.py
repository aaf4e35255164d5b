"""What drivers see of the vehicle ahead, and for how long that is sure to stay so."""

import functools
import itertools
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import OTHERS_LAMPS, lamps_from_signals
from fogsim.traffic.drivers.lamp_intensity import BRIGHTEST as BRIGHTEST_LAMP
from fogsim.traffic.drivers.lamp_intensity import rear_intensity
from fogsim.traffic.drivers.own_beams import high_beam_veil, uses_high_beam
from fogsim.traffic.drivers.sight_kernels import (
    BRIGHTEST,
    CONTRAST,
    DAZZLED,
    DEPTH,
    DISTANCE,
    EYE_HEIGHT,
    INTENSITY,
    MINIMUM_GAP,
    OWN,
    OWN_STEADY,
    SEEN,
    SPEED,
    STEADY,
    Closing,
    Z,
    face_leaders,
)
from fogsim.traffic.sumo.link import Getter, vehicle_getter
from fogsim.traffic.sumo.update_schedule import closing_speed_bound
from fogsim.traffic.sumo_drivers.oncoming_glare import OncomingGlare, most_glare
from fogsim.traffic.sumo_drivers.seen_vehicles import DriversView, OwnLamps
from fogsim.values import Lamp

_LEAST_EXTINCTION = 1e-6
"""Below this, fog hides nothing that matters [1/m]."""

_FASTEST_DRIFT = 30.0
"""Fog drifts and changes no faster than if a wind of this speed carried it [m/s]."""

_STEADY_INTENSITY = rear_intensity(int(OTHERS_LAMPS))
"""Of the rear lamps that other drivers always light [cd]."""

Pair = tuple[str, str, float]
"""Follower, leader, and SUMO's gap between them [m], which leaves out the follower's minimum gap."""


class LeaderSight:
    """Computes sight along the fog between drivers and the vehicles ahead of them (`speed` [m/s], `horizon` [s])."""

    def __init__(self, view: DriversView, speed: Getter, horizon: float) -> None:
        self._speed, self._horizon = speed, horizon
        self._fog, self._sight, self._vehicles, self._extinction = view.fog, view.sight, view.vehicles, view.extinction
        self._position = vehicle_getter(view.api, "getPosition3D")
        (self._signals,) = view.getters("getSignals")
        self._glare = OncomingGlare(view)
        self._most_glare = most_glare(view.sight.illuminance)
        is_even, most = view.extinction is not None, view.fog.maximum_extinction
        densest, change = max(most, _LEAST_EXTINCTION) if is_even else most, closing_speed_bound(0.0, 0.0, horizon)
        self._closing = Closing(change, _FASTEST_DRIFT, densest, is_even)

    def assess(self, pairs: Sequence[Pair], own_lamps: OwnLamps) -> tuple[list[bool], list[float]]:
        """Whether each leader is seen, and for how long that is sure to stay so [s]."""
        facing = self._facing(pairs)
        if own_lamps:
            self._add_own_lamps(facing, pairs, own_lamps)
        judged, pauses = self._sight.judge_leaders(facing, self._most_glare, self._horizon)
        if own_lamps and self._most_glare > 0.0:
            self._doubt_own_beams(judged, pauses, pairs, own_lamps)
        seen: list[bool] = (judged == SEEN).tolist()
        for i in np.flatnonzero(judged == DAZZLED).tolist() if self._most_glare > 0.0 else ():
            seen[i] = self._is_seen(pairs[i], facing[:, i], own_lamps)
        return seen, pauses.tolist()

    def _facing(self, pairs: Sequence[Pair]) -> NDArray[np.float64]:
        """What is known of followers and their leaders (10, n), all with the lamps that SUMO's drivers light."""
        followers, leaders, gaps = zip(*pairs, strict=True)
        both = followers + leaders
        # Mostly who leads one follows another.
        place = {vehicle: i for i, vehicle in enumerate(dict.fromkeys(both))}
        rows = np.array([place[v] for v in both], dtype=np.int64).reshape(2, -1)
        facing, lines = np.empty((OWN + 1, len(pairs))), np.empty((2, len(pairs), 3))
        face_leaders(
            self._read(place), rows[0], rows[1], np.array(gaps, dtype=np.float64), self._closing, facing, lines
        )
        known = self._extinction
        facing[DEPTH] = self._fog.optical_depth(*lines) if known is None else known * facing[DISTANCE]
        facing[STEADY], facing[OWN_STEADY:] = _STEADY_INTENSITY, 1.0
        facing[INTENSITY], facing[BRIGHTEST] = zip(*map(_rear_light, map(self._signals, leaders)), strict=True)
        return facing

    def _read(self, vehicles: Collection[str]) -> NDArray[np.float64]:
        """What is known of vehicles (n, 7), where they are and how fast first."""
        read = np.empty((len(vehicles), EYE_HEIGHT + 1))
        flat = itertools.chain.from_iterable(map(self._position, vehicles))
        read[:, : Z + 1] = np.fromiter(flat, np.float64, 3 * len(vehicles)).reshape(-1, 3)
        read[:, SPEED] = np.fromiter(map(self._speed, vehicles), np.float64, len(vehicles))
        read[:, MINIMUM_GAP:] = self._vehicles.traits(vehicles)[:, : EYE_HEIGHT + 1 - MINIMUM_GAP]
        return read

    @staticmethod
    def _doubt_own_beams(
        judged: NDArray[np.float64], pauses: NDArray[np.float64], pairs: Sequence[Pair], own_lamps: OwnLamps
    ) -> None:
        """Look again, one by one, for drivers with high beams, which veil the fog; and soon, for those who may have."""
        for i, (follower, _, _) in enumerate(pairs):
            if follower in own_lamps:
                pauses[i] = 0.0
                if uses_high_beam(own_lamps[follower]):
                    judged[i] = DAZZLED

    def _add_own_lamps(self, facing: NDArray[np.float64], pairs: Sequence[Pair], own_lamps: OwnLamps) -> None:
        for i, (follower, leader, _) in enumerate(pairs):
            if leader in own_lamps:
                facing[INTENSITY, i] = rear_intensity(self._vehicles.lamps(leader, own_lamps))
                # Lamps that are commanded may be commanded otherwise in any step.
                facing[STEADY, i], facing[BRIGHTEST, i] = 0.0, BRIGHTEST_LAMP
            if follower in own_lamps:
                facing[OWN_STEADY, i] = 0.0
                facing[OWN, i] = self._vehicles.head_lamps(follower, own_lamps)

    def _is_seen(self, pair: Pair, facing: NDArray[np.float64], own_lamps: OwnLamps) -> bool:
        """Whether a leader is seen who is unless glare hides it, which costs more than all the rest to know."""
        follower, leader, _ = pair
        glare = self._glare.veil(follower, leader, own_lamps)
        if uses_high_beam(own_lamps.get(follower, 0)):
            glare += high_beam_veil(self._extinction_at(follower))
        elif glare == 0.0:
            # Without glare the kernel has looked already.
            return True
        distance, contrast, intensity, own = facing[[DISTANCE, CONTRAST, INTENSITY, OWN]].tolist()
        return bool(facing[DEPTH] <= self._sight.depth_limit(distance, contrast, intensity, own, glare))

    def _extinction_at(self, vehicle: str) -> float:
        """Extinction coefficient where a vehicle is [1/m]."""
        if self._extinction is not None:
            return self._extinction
        x, y, z = self._position(vehicle)
        return float(self._fog.extinction((x, y, z + self._vehicles.body(vehicle).eye_height)))


@functools.lru_cache(maxsize=1024)
def _rear_light(signals: int) -> tuple[float, float]:
    """Luminous intensity of the brightest rear lamp that SUMO's signals light, and that may soon be lit [cd]."""
    lit = int(OTHERS_LAMPS) | lamps_from_signals(signals)
    return rear_intensity(lit), rear_intensity(lit | int(Lamp.STOP))
