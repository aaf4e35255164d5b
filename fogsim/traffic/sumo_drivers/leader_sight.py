"""What drivers see of the vehicle ahead, and for how long that is sure to stay so."""

from collections.abc import Collection, Sequence

import numpy as np

from fogsim.traffic.appearance import OTHERS_LAMPS
from fogsim.traffic.drivers.lamp_intensity import BRIGHTEST, rear_intensity
from fogsim.traffic.drivers.sight import BODY_MIDDLE, DriverSight, FogAccess
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
        # SUMO's gap leaves out the follower's minimum gap.
        distances = [max(gap + self._minimum_gap(follower), 0.1) for follower, _, gap in pairs]
        depths = self._optical_depths(pairs, distances)
        return [
            self._assess_pair(pair, distance, depth, own_lamps, horizon)
            for pair, distance, depth in zip(pairs, distances, depths, strict=True)
        ]

    def _assess_pair(
        self, pair: Pair, distance: float, depth: float, own_lamps: OwnLamps, horizon: float
    ) -> tuple[bool, float]:
        # Plain numbers: mostly there is a pair or two, and making arrays of them would cost more than all the rest.
        follower, leader, _ = pair
        sight, contrast = self._sight, self._vehicles.body(leader).contrast
        # Lamps that are commanded may go dark at once; what the others light stays.
        steady = 0.0 if leader in own_lamps else STEADY_INTENSITY
        own = 0.0 if follower in own_lamps else 1.0
        if depth < sight.depth_limit(distance, contrast, steady, own, self._most_glare):
            closing, deepening = self._rates(follower, leader, horizon)
            farthest = distance + closing * horizon
            spare = sight.depth_limit(farthest, contrast, steady, own, self._most_glare) - depth
            return True, min(max(spare, 0.0) / deepening, horizon)
        lamps = self._vehicles.lamps(leader, own_lamps)
        own = 1.0 if self._vehicles.has_head_lamps(follower, own_lamps) else 0.0
        intensity = rear_intensity(lamps)
        if depth <= sight.depth_limit(distance, contrast, intensity, own):
            # Glare costs more than all the rest, and seldom decides.
            glare = self._most_glare
            if glare and depth > sight.depth_limit(distance, contrast, intensity, own, glare):
                glare = self._glare.veil(follower, leader, own_lamps)
            if depth <= sight.depth_limit(distance, contrast, intensity, own, glare):
                return True, 0.0
        closing, deepening = self._rates(follower, leader, horizon)
        nearest = max(distance - closing * horizon, 0.1)
        # Lamps that are commanded may be commanded otherwise in any step.
        brightest = BRIGHTEST if leader in own_lamps else rear_intensity(lamps | int(Lamp.STOP))
        limit = sight.depth_limit(nearest, contrast, brightest)
        return False, min(max(depth - limit, 0.0) / deepening, horizon)

    def _optical_depths(self, pairs: Sequence[Pair], distances: Sequence[float]) -> list[float]:
        """Optical depths between eyes and rears [-]."""
        if self._min_extinction == self._max_extinction:
            return [self._max_extinction * distance for distance in distances]
        heights = np.array([self._vehicles.eye_height(follower) for follower, _, _ in pairs])
        eyes = np.array([self._position(follower) for follower, _, _ in pairs])
        towards = np.array([self._position(leader) for _, leader, _ in pairs]) - eyes
        eyes[:, 2] += heights
        towards[:, 2] += np.minimum(heights, BODY_MIDDLE) - heights
        share = np.array(distances) / np.sqrt(np.einsum("ij,ij->i", towards, towards))
        depths: list[float] = self._fog.optical_depth(eyes, eyes + towards * share[:, None]).tolist()
        return depths

    def _rates(self, follower: str, leader: str, horizon: float) -> tuple[float, float]:
        """Bounds on how fast a gap closes [m/s] and on how fast its optical depth changes [1/s] up to a horizon."""
        speed, leader_speed = float(self._speed(follower)), float(self._speed(leader))
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
