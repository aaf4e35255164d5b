"""Which vehicles are behind what stands next to the road, to a driver's eyes."""

import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.obstruction import Obstructions
from fogsim.traffic.sumo.link import Api, vehicle_getter
from fogsim.traffic.sumo.vehicle_getters import vehicle_getters
from fogsim.traffic.sumo_drivers.seen_vehicles import SeenVehicles
from fogsim.traffic.sumo_lanes.long_bodies import LongBodies, Part

_Point = tuple[float, float, float]

_CORNERS = np.array(list(itertools.product((-1.0, 0.0), (-0.5, 0.5), (0.5, 1.0))))
"""From the middle of the front bumper ahead, to the left and up, in lengths, widths and heights."""


class HiddenVehicles:
    """Finds vehicles hidden by obstructions: no corner of the body is in sight, neither halfway up nor at the top."""

    def __init__(self, api: Api, obstructions: Obstructions, remote: bool = False) -> None:
        self._obstructions = obstructions
        self._vehicles = SeenVehicles(api, remote)
        self._position, self._angle = vehicle_getters(api, remote, ("getPosition3D", "getAngle"))
        self._height = vehicle_getter(api, "getHeight")
        self._bodies = LongBodies(api)
        self._sizes: dict[str, _Point] = {}

    def forget(self, vehicles: Iterable[str]) -> None:
        """Forget vehicles whose ids others may bear now."""
        gone = tuple(vehicles)
        for vehicle in gone:
            self._sizes.pop(vehicle, None)
        self._vehicles.forget(gone)

    def are_hidden(self, pairs: Sequence[tuple[str, str]]) -> list[bool]:
        """Whether each observer's target is hidden, however clear the air is (`pairs` (str, str))."""
        if not pairs:
            return []
        # Mostly who leads one follows another.
        places = {vehicle: self._position(vehicle) for pair in pairs for vehicle in pair}
        angles = {target: math.radians(90.0 - self._angle(target)) for _, target in pairs}
        parts = [self._bodies.parts(t, self._size(t)[0], places[t], angles[t]) for _, t in pairs]
        eyes = np.array([places[observer] for observer, _ in pairs])
        eyes[:, 2] += [self._vehicles.eye_height(observer) for observer, _ in pairs]
        counts = [len(own) for own in parts]
        sizes = [(part.length, *self._size(t)[1:]) for (_, t), own in zip(pairs, parts, strict=True) for part in own]
        corners = _corners(list(itertools.chain.from_iterable(parts)), np.array(sizes))
        hidden = self._obstructions.hide(eyes.repeat(counts, axis=0), corners)
        each: list[bool] = np.logical_and.reduceat(hidden, np.cumsum([0, *counts[:-1]])).tolist()
        return each

    def _size(self, vehicle: str) -> _Point:
        """Length, width and height [m]."""
        known = self._sizes.get(vehicle)
        if known is None:
            body = self._vehicles.body(vehicle)
            known = self._sizes[vehicle] = body.length, body.width, float(self._height(vehicle))
        return known


def _corners(parts: Sequence[Part], sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners of parts of bodies (n, 8, 3) [m]; the lower ones are halfway up."""
    heading = np.array([part.heading for part in parts])
    forward = np.stack([np.cos(heading), np.sin(heading)], axis=1)[:, None]
    left = forward[..., ::-1] * (-1.0, 1.0)
    offsets = sizes[:, None] * _CORNERS
    corners = np.array([part.front for part in parts])[:, None] + np.zeros((1, len(_CORNERS), 1))
    corners[..., :2] += offsets[..., :1] * forward + offsets[..., 1:2] * left
    corners[..., 2] += offsets[..., 2]
    return corners
