"""What drivers see of the vehicle ahead, and for how long that is sure to stay so."""

import itertools
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import OTHERS_LAMPS
from fogsim.traffic.drivers.lamp_intensity import BRIGHTEST as BRIGHTEST_LAMP
from fogsim.traffic.drivers.lamp_intensity import rear_intensity
from fogsim.traffic.drivers.sight import BODY_MIDDLE, DriverSight, FogAccess
from fogsim.traffic.drivers.sight_kernels import (
    BRIGHTEST,
    CLOSING,
    CONTRAST,
    DAZZLED,
    DEEPENING,
    DEPTH,
    DISTANCE,
    INTENSITY,
    NEAREST,
    OWN,
    OWN_STEADY,
    SEEN,
    STEADY,
)
from fogsim.traffic.sumo.link import Api, Getter, vehicle_getter
from fogsim.traffic.sumo.update_schedule import MAX_RELATIVE_ACCELERATION, closing_speed_bound
from fogsim.traffic.sumo_drivers.oncoming_glare import OncomingGlare, most_glare
from fogsim.traffic.sumo_drivers.seen_vehicles import OwnLamps, SeenVehicles
from fogsim.values import Lamp

LEAST_EXTINCTION = 1e-6
"""Below this, fog hides nothing that matters [1/m]."""

FASTEST_DRIFT = 30.0
"""Fog drifts and changes no faster than if a wind of this speed carried it [m/s]."""

STEADY_INTENSITY = rear_intensity(int(OTHERS_LAMPS))
"""Of the rear lamps that other drivers always light [cd]."""

_STOP = int(Lamp.STOP)

Pair = tuple[str, str, float]
"""Follower, leader, and SUMO's gap between them [m], which leaves out the follower's minimum gap."""


class LeaderSight:
    """Computes sight along the fog between drivers and the vehicles ahead of them.

    Parameters
    ----------
    api : Api
        The simulation.
    fog : FogAccess
        The fog.
    sight : DriverSight
        The drivers' eyes.
    speed : Getter
        Speed of a vehicle [m/s].
    remote : bool
        True where every call is a message to another process: what is asked often is subscribed to.
    """

    def __init__(self, api: Api, fog: FogAccess, sight: DriverSight, speed: Getter, remote: bool = False) -> None:
        self._speed = speed
        self._fog = fog
        self._min_extinction, self._max_extinction = fog.minimum_extinction, fog.maximum_extinction
        self._sight = sight
        self._position = vehicle_getter(api, "getPosition3D")
        self._vehicles = SeenVehicles(api, remote)
        self._glare = OncomingGlare(api, fog, self._vehicles, remote)
        self._most_glare = most_glare(sight.illuminance)
        self._get_minimum_gap = vehicle_getter(api, "getMinGap")
        self._minimum_gaps: dict[str, float] = {}

    def forget(self, vehicles: Collection[str]) -> None:
        """Forget vehicles whose ids others may bear now.

        Parameters
        ----------
        vehicles : iterable of str
            Their ids.
        """
        for vehicle in vehicles:
            self._minimum_gaps.pop(vehicle, None)
        self._vehicles.forget(vehicles)

    def assess(self, pairs: Sequence[Pair], own_lamps: OwnLamps, horizon: float) -> list[tuple[bool, float]]:
        """Whether each leader is seen, and for how long that is sure to stay so [s].

        Parameters
        ----------
        pairs : sequence of Pair
            Followers and their leaders.
        own_lamps : dict
            Lamps of vehicles whose lamps are not SUMO's.
        horizon : float
            Longest time of interest [s].
        """
        followers, leaders, _ = zip(*pairs, strict=True)
        # SUMO's gap leaves out the follower's minimum gap.
        distances = [max(gap + self._minimum_gap(follower), NEAREST) for follower, _, gap in pairs]
        contrasts = [self._vehicles.body(leader).contrast for leader in leaders]
        lamps = [self._vehicles.lamps(leader, own_lamps) for leader in leaders]
        facing = np.empty((OWN + 1, len(pairs)))
        facing[DISTANCE], facing[CONTRAST] = distances, contrasts
        facing[DEPTH] = self._optical_depths(followers, leaders, facing[DISTANCE])
        facing[CLOSING], facing[DEEPENING] = self._rates(followers, leaders, horizon)
        facing[STEADY], facing[OWN_STEADY], facing[OWN] = STEADY_INTENSITY, 1.0, 1.0
        facing[INTENSITY] = [rear_intensity(lit) for lit in lamps]
        facing[BRIGHTEST] = [rear_intensity(lit | _STOP) for lit in lamps]
        if not own_lamps.keys().isdisjoint((*followers, *leaders)):
            self._add_own_lamps(facing, pairs, own_lamps)
        judged, pauses = self._sight.judge_leaders(facing, self._most_glare, horizon)
        return [
            (verdict == SEEN if verdict != DAZZLED else self._is_seen(pairs[i], facing[:, i], own_lamps), pause)
            for i, (verdict, pause) in enumerate(zip(judged.tolist(), pauses.tolist(), strict=True))
        ]

    def _add_own_lamps(self, facing: NDArray[np.float64], pairs: Sequence[Pair], own_lamps: OwnLamps) -> None:
        for i, (follower, leader, _) in enumerate(pairs):
            if leader in own_lamps:
                # Lamps that are commanded may be commanded otherwise in any step.
                facing[STEADY, i], facing[BRIGHTEST, i] = 0.0, BRIGHTEST_LAMP
            if follower in own_lamps:
                facing[OWN_STEADY, i] = 0.0
                facing[OWN, i] = self._vehicles.head_lamps(follower, own_lamps)

    def _is_seen(self, pair: Pair, facing: NDArray[np.float64], own_lamps: OwnLamps) -> bool:
        """Whether a leader is seen who is unless glare hides it, which costs more than all the rest to know."""
        glare = self._glare.veil(pair[0], pair[1], own_lamps)
        distance, contrast, intensity, own = facing[[DISTANCE, CONTRAST, INTENSITY, OWN]].tolist()
        return bool(facing[DEPTH] <= self._sight.depth_limit(distance, contrast, intensity, own, glare))

    def _optical_depths(
        self, followers: Sequence[str], leaders: Sequence[str], distances: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Optical depths between eyes and rears (n,) [-]."""
        if self._min_extinction == self._max_extinction:
            return self._max_extinction * distances
        heights = np.array([self._vehicles.eye_height(follower) for follower in followers])
        # Mostly who leads one follows another.
        places = {vehicle: self._position(vehicle) for vehicle in {*followers, *leaders}}
        eyes = _points(places, followers)
        towards = _points(places, leaders) - eyes
        eyes[:, 2] += heights
        towards[:, 2] += np.minimum(heights, BODY_MIDDLE) - heights
        share = distances / np.sqrt(np.einsum("ij,ij->i", towards, towards))
        return self._fog.optical_depth(eyes, eyes + towards * share[:, None])

    def _rates(
        self, followers: Sequence[str], leaders: Sequence[str], horizon: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bounds (n,) on how fast gaps close [m/s] and how fast their optical depths change [1/s] up to a horizon."""
        speeds = {vehicle: self._speed(vehicle) for vehicle in {*followers, *leaders}}
        speed, leader_speed = (np.array([speeds[v] for v in vehicles]) for vehicles in (followers, leaders))
        closing = closing_speed_bound(speed, leader_speed, horizon)
        if self._min_extinction == self._max_extinction:
            return closing, max(self._max_extinction, LEAST_EXTINCTION) * closing
        # In a bank that one end has reached and the other has not, each end counts by itself; and the fog drifts.
        together = speed + leader_speed + MAX_RELATIVE_ACCELERATION * horizon
        return closing, self._max_extinction * (together + FASTEST_DRIFT)

    def _minimum_gap(self, vehicle: str) -> float:
        known = self._minimum_gaps.get(vehicle)
        if known is None:
            known = self._minimum_gaps[vehicle] = float(self._get_minimum_gap(vehicle))
        return known


def _points(places: Mapping[str, Sequence[float]], vehicles: Sequence[str]) -> NDArray[np.float64]:
    """Places of vehicles (n, 3) [m]."""
    flat = itertools.chain.from_iterable([places[vehicle] for vehicle in vehicles])
    return np.fromiter(flat, np.float64, 3 * len(vehicles)).reshape(-1, 3)
