"""What drivers see of the vehicle ahead, and for how long that is sure to stay so."""

import functools
import itertools
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.traffic.appearance import OTHERS_LAMPS, lamps_from_signals
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
from fogsim.traffic.sumo.vehicle_getters import vehicle_getters
from fogsim.traffic.sumo_drivers.oncoming_glare import OncomingGlare, most_glare
from fogsim.traffic.sumo_drivers.seen_vehicles import OwnLamps, SeenVehicles
from fogsim.values import Lamp

LEAST_EXTINCTION = 1e-6
"""Below this, fog hides nothing that matters [1/m]."""

FASTEST_DRIFT = 30.0
"""Fog drifts and changes no faster than if a wind of this speed carried it [m/s]."""

STEADY_INTENSITY = rear_intensity(int(OTHERS_LAMPS))
"""Of the rear lamps that other drivers always light [cd]."""

_MINIMUM_GAP, _CONTRAST, _EYES = range(3)

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
        (self._signals,) = vehicle_getters(api, remote, ("getSignals",))
        self._vehicles = SeenVehicles(api, remote)
        self._glare = OncomingGlare(api, fog, self._vehicles, remote)
        self._most_glare = most_glare(sight.illuminance)
        self._get_minimum_gap = vehicle_getter(api, "getMinGap")
        self._rows: dict[str, int] = {}
        self._traits, self._traits_end = np.empty((64, 3)), 0

    def forget(self, vehicles: Collection[str]) -> None:
        """Forget vehicles whose ids others may bear now.

        Parameters
        ----------
        vehicles : iterable of str
            Their ids.
        """
        for vehicle in vehicles:
            self._rows.pop(vehicle, None)
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
        followers, leaders, gaps = zip(*pairs, strict=True)
        # Mostly who leads one follows another.
        place = {vehicle: i for i, vehicle in enumerate(dict.fromkeys((*followers, *leaders)))}
        behind, ahead = (np.array([place[v] for v in vehicles]) for vehicles in (followers, leaders))
        traits = self._look_up(place)
        facing = np.empty((OWN + 1, len(pairs)))
        # SUMO's gap leaves out the follower's minimum gap.
        facing[DISTANCE] = np.maximum(gaps + traits[behind, _MINIMUM_GAP], NEAREST)
        facing[CONTRAST] = traits[ahead, _CONTRAST]
        facing[DEPTH] = self._optical_depths(tuple(place), behind, ahead, facing[DISTANCE], traits[behind, _EYES])
        speeds = np.fromiter(map(self._speed, place), np.float64, len(place))
        facing[CLOSING], facing[DEEPENING] = self._rates(speeds[behind], speeds[ahead], horizon)
        facing[STEADY], facing[OWN_STEADY], facing[OWN] = STEADY_INTENSITY, 1.0, 1.0
        facing[INTENSITY : BRIGHTEST + 1] = np.transpose(
            [_rear_light(signals) for signals in map(self._signals, leaders)]
        )
        if not own_lamps.keys().isdisjoint(place):
            self._add_own_lamps(facing, pairs, own_lamps)
        judged, pauses = self._sight.judge_leaders(facing, self._most_glare, horizon)
        return [
            (verdict == SEEN if verdict != DAZZLED else self._is_seen(pairs[i], facing[:, i], own_lamps), pause)
            for i, (verdict, pause) in enumerate(zip(judged.tolist(), pauses.tolist(), strict=True))
        ]

    def _look_up(self, vehicles: Collection[str]) -> NDArray[np.float64]:
        """What never changes about vehicles (n, 3): minimum gap [m], contrast [-], height of the driver's eyes [m]."""
        known = self._rows
        for vehicle in vehicles if not known.keys() >= set(vehicles) else ():
            if vehicle not in known:
                row = known[vehicle] = self._traits_end
                self._traits_end += 1
                if row == len(self._traits):
                    self._traits = np.concatenate((self._traits, np.empty_like(self._traits)))
                contrast, eyes = self._vehicles.body(vehicle).contrast, self._vehicles.eye_height(vehicle)
                self._traits[row] = float(self._get_minimum_gap(vehicle)), contrast, eyes
        return self._traits[[known[vehicle] for vehicle in vehicles]]

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
        glare = self._glare.veil(pair[0], pair[1], own_lamps)
        distance, contrast, intensity, own = facing[[DISTANCE, CONTRAST, INTENSITY, OWN]].tolist()
        return bool(facing[DEPTH] <= self._sight.depth_limit(distance, contrast, intensity, own, glare))

    def _optical_depths(
        self,
        vehicles: Sequence[str],
        behind: NDArray[np.intp],
        ahead: NDArray[np.intp],
        distances: NDArray[np.float64],
        heights: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Optical depths (n,) between eyes at heights [m] above those behind and the rears of those ahead [-]."""
        if self._min_extinction == self._max_extinction:
            return self._max_extinction * distances
        flat = itertools.chain.from_iterable(map(self._position, vehicles))
        places = np.fromiter(flat, np.float64, 3 * len(vehicles)).reshape(-1, 3)
        eyes = places[behind]
        towards = places[ahead] - eyes
        eyes[:, 2] += heights
        towards[:, 2] += np.minimum(heights, BODY_MIDDLE) - heights
        share = distances / np.sqrt(np.einsum("ij,ij->i", towards, towards))
        return self._fog.optical_depth(eyes, eyes + towards * share[:, None])

    def _rates(
        self, speed: NDArray[np.float64], leader_speed: NDArray[np.float64], horizon: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bounds (n,) on how fast gaps close [m/s] and how fast their optical depths change [1/s] up to a horizon."""
        closing = closing_speed_bound(speed, leader_speed, horizon)
        if self._min_extinction == self._max_extinction:
            return closing, max(self._max_extinction, LEAST_EXTINCTION) * closing
        # In a bank that one end has reached and the other has not, each end counts by itself; and the fog drifts.
        together = speed + leader_speed + MAX_RELATIVE_ACCELERATION * horizon
        return closing, self._max_extinction * (together + FASTEST_DRIFT)


@functools.lru_cache(maxsize=1024)
def _rear_light(signals: int) -> tuple[float, float]:
    """Luminous intensity of the brightest rear lamp that SUMO's signals light, and that may soon be lit [cd]."""
    lit = int(OTHERS_LAMPS) | lamps_from_signals(signals)
    return rear_intensity(lit), rear_intensity(lit | int(Lamp.STOP))
