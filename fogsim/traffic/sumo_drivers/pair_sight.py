"""What each of some drivers sees of the vehicle ahead, and how long that is sure to stay so."""

from collections.abc import Iterable, Sequence

import numpy as np

from fogsim.traffic.appearance import OTHERS_LAMPS, lamps_from_signals, paint
from fogsim.traffic.drivers.sight import (
    BRIGHTEST,
    EYE_HEIGHT,
    SILHOUETTE_ILLUMINANCE,
    DriverSight,
    FogAccess,
    inherent_contrast,
    rear_intensity,
)
from fogsim.traffic.sumo.getters import vehicle_getter
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.motion_bounds import MotionBounds
from fogsim.values import Lamp

LEAST_EXTINCTION = 1e-6
"""Below this, fog hides nothing that matters [1/m]."""

FASTEST_DRIFT = 30.0
"""Fog drifts and changes no faster than if a wind of this speed carried it [m/s]."""

OwnLamps = dict[str, int | None]
"""Lamps, as bits of `Lamp`, of vehicles whose lamps are not SUMO's; None where all have failed."""

Pair = tuple[str, str, float]
"""Follower, leader, and SUMO's gap between them [m], which leaves out the follower's minimum gap."""


class PairSight:
    """Computes sight along the fog between drivers and the vehicles ahead of them.

    Parameters
    ----------
    api : Api
        The simulation.
    fog : FogAccess
        The fog.
    sight : DriverSight
        The drivers' eyes.
    motion : MotionBounds
        How fast vehicles can move.
    """

    def __init__(self, api: Api, fog: FogAccess, sight: DriverSight, motion: MotionBounds) -> None:
        self._motion = motion
        self._fog = fog
        self._thinnest, self._densest = fog.minimum_extinction, fog.maximum_extinction
        self._sight = sight
        self._position = vehicle_getter(api, "getPosition3D")
        self._signals = vehicle_getter(api, "getSignals")
        self._get_colour = vehicle_getter(api, "getColor")
        self._get_minimum_gap = vehicle_getter(api, "getMinGap")
        self._contrasts: dict[str, float] = {}
        self._minimum_gaps: dict[str, float] = {}

    def forget(self, vehicles: Iterable[str]) -> None:
        """Forget vehicles whose ids others may bear now."""
        for vehicle in vehicles:
            self._contrasts.pop(vehicle, None)
            self._minimum_gaps.pop(vehicle, None)

    def look(self, pairs: Sequence[Pair], own_lamps: OwnLamps, horizon: float) -> list[tuple[bool, float]]:
        """Whether each leader is seen, and for how long that is sure to stay so [s].

        Parameters
        ----------
        pairs : sequence of Pair
            Who looks at whom.
        own_lamps : dict
            Lamps of vehicles whose lamps are not SUMO's.
        horizon : float
            Longest time of interest [s].
        """
        # SUMO's gap leaves out the follower's minimum gap.
        distances = [max(gap + self._minimum_gap(follower), 0.1) for follower, _, gap in pairs]
        depths = self._depths(pairs, distances)
        return [
            self._glance(pair, distance, depth, own_lamps, horizon)
            for pair, distance, depth in zip(pairs, distances, depths, strict=True)
        ]

    def _glance(
        self, pair: Pair, distance: float, depth: float, own_lamps: OwnLamps, horizon: float
    ) -> tuple[bool, float]:
        # Plain numbers: mostly there is a pair or two, and making arrays of them would cost more than all the rest.
        follower, leader, _ = pair
        contrast = self._contrast(leader)
        spare = self._sight.body_limit(distance, contrast) - depth
        if spare >= 0.0:
            # In the own headlamps, the limit falls with the distance, and is asked for anew in each step.
            if self._sight.illuminance < SILHOUETTE_ILLUMINANCE:
                return True, 0.0
            return True, min(spare / self._rates(follower, leader, horizon)[1], horizon)
        lit, brightest = self._intensities(leader, own_lamps)
        if depth <= self._sight.lamp_limit(distance, lit):
            # What lamps alone show may go dark at once.
            return True, 0.0
        closing, deepening = self._rates(follower, leader, horizon)
        nearest = max(distance - closing * horizon, 0.1)
        limit = max(self._sight.body_limit(nearest, contrast), self._sight.lamp_limit(nearest, brightest))
        return False, min(max(depth - limit, 0.0) / deepening, horizon)

    def _depths(self, pairs: Sequence[Pair], distances: Sequence[float]) -> list[float]:
        """Optical depths between eyes and rears [-]."""
        if self._thinnest == self._densest:
            return [self._densest * distance for distance in distances]
        lift = np.array([0.0, 0.0, EYE_HEIGHT])
        eyes = np.array([self._position(follower) for follower, _, _ in pairs]) + lift
        towards = np.array([self._position(leader) for _, leader, _ in pairs]) + lift - eyes
        share = np.array(distances) / np.sqrt(np.einsum("ij,ij->i", towards, towards))
        depths: list[float] = self._fog.optical_depth(eyes, eyes + towards * share[:, None]).tolist()
        return depths

    def _rates(self, follower: str, leader: str, horizon: float) -> tuple[float, float]:
        """Bounds on how fast a gap closes [m/s] and on how fast its optical depth changes [1/s] up to a horizon."""
        closing = self._motion.closing(follower, leader, horizon)
        if self._thinnest == self._densest:
            return closing, max(self._densest, LEAST_EXTINCTION) * closing
        # In a bank that one end has reached and the other has not, each end counts by itself; and the fog drifts.
        return closing, self._densest * (self._motion.travel(follower, leader, horizon) + FASTEST_DRIFT)

    def _intensities(self, vehicle: str, own_lamps: OwnLamps) -> tuple[float, float]:
        """Of the brightest rear lamp that is lit, and that could be lit before the next look [cd]."""
        if vehicle in own_lamps:
            own = own_lamps[vehicle]
            # Who is told which lamps to light may be told otherwise in any step.
            return (0.0 if own is None else rear_intensity(own | self._signalled(vehicle)), BRIGHTEST)
        lit = rear_intensity(int(OTHERS_LAMPS) | self._signalled(vehicle))
        return lit, max(lit, rear_intensity(int(Lamp.STOP)))

    def _signalled(self, vehicle: str) -> int:
        return lamps_from_signals(self._signals(vehicle))

    def _contrast(self, vehicle: str) -> float:
        known = self._contrasts.get(vehicle)
        if known is None:
            known = self._contrasts[vehicle] = inherent_contrast(paint(vehicle, self._get_colour(vehicle)))
        return known

    def _minimum_gap(self, vehicle: str) -> float:
        known = self._minimum_gaps.get(vehicle)
        if known is None:
            known = self._minimum_gaps[vehicle] = float(self._get_minimum_gap(vehicle))
        return known
