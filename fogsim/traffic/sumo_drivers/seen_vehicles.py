"""What of SUMO's vehicles there is to see, from how high their drivers look, and what hides them from each other."""

import itertools
import math
from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.obstruction import CLEAR_SIGHT, Obstructions
from fogsim.traffic.appearance import OTHERS_LAMPS, body_kind, lamps_from_signals, paint
from fogsim.traffic.drivers.eye_heights import eye_height
from fogsim.traffic.drivers.own_beams import head_lamp_light
from fogsim.traffic.drivers.sight import DriverSight, FogAccess, inherent_contrast
from fogsim.traffic.sumo.claims import SOLE_SESSION
from fogsim.traffic.sumo.link import Api, Getter, vehicle_getter
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo.vehicle_getters import vehicle_getters
from fogsim.traffic.sumo_lanes.long_bodies import LongBodies, Part
from fogsim.values.light import MIDDLE_LAMPS, Side, dark_on

OwnLamps = dict[str, int]
"""Lamps, as `TrafficState.lamps` has them, of vehicles whose lamps are not SUMO's; with the sides that have failed."""

_Point = tuple[float, float, float]

_NO_THIRD_STOP_LAMP = frozenset({"truck", "motorcycle"})
"""Body kinds without a stop lamp in the middle next to two others."""

_CORNERS = np.array(list(itertools.product((-1.0, 0.0), (-0.5, 0.5), (0.5, 1.0))))
"""From the middle of the front bumper ahead, to the left and up, in lengths, widths and heights."""


class SeenBody(NamedTuple):
    """A vehicle's body, and how its driver sits in it."""

    minimum_gap: float  # The driver's [m]
    contrast: float  # To the airlight without fog between, 0 … 1
    eye_height: float  # Of the driver's eyes above the road [m]
    # length, width, height: [m]
    length: float
    width: float
    height: float
    missing: int  # Bits of sides on which there is no lamp


class SeenVehicles:
    """Bodies, each read once, and lit lamps of vehicles."""

    def __init__(self, api: Api, remote: bool, airlight_share: float) -> None:
        self._airlight_share = airlight_share
        (self._signals,) = vehicle_getters(api, remote, ("getSignals",))
        names = ("getColor", "getMinGap", "getLength", "getWidth", "getHeight", "getVehicleClass", "getShapeClass")
        self._getters = tuple(vehicle_getter(api, name) for name in names)
        self._bodies: dict[str, SeenBody] = {}
        self._rows: dict[str, int] = {}
        self._traits = np.empty((64, len(SeenBody._fields)))

    def forget(self, vehicles: Iterable[str]) -> None:
        """Forget vehicles whose ids others may bear now."""
        for vehicle in vehicles:
            self._bodies.pop(vehicle, None)

    def body(self, vehicle: str) -> SeenBody:
        """Body of a vehicle."""
        return self._bodies.get(vehicle) or self._read(vehicle)

    def traits(self, vehicles: Collection[str]) -> NDArray[np.float64]:
        """Bodies of vehicles (n, 7), in the order of the fields of `SeenBody`."""
        rows = self._rows
        if not self._bodies.keys() >= set(vehicles):
            for vehicle in vehicles:
                self.body(vehicle)
        return self._traits[[rows[vehicle] for vehicle in vehicles]]

    def _read(self, vehicle: str) -> SeenBody:
        colour, gap, length, width, height, vehicle_class, shape = (get(vehicle) for get in self._getters)
        contrast = inherent_contrast(paint(vehicle, colour), self._airlight_share)
        kind = body_kind(vehicle_class, shape, length)
        missing = dark_on(int(MIDDLE_LAMPS), Side.MIDDLE) if kind in _NO_THIRD_STOP_LAMP else 0
        eyes = eye_height(vehicle_class, shape, length)
        body = SeenBody(gap, contrast, eyes, length, width, height, missing)
        row = self._rows.setdefault(vehicle, len(self._rows))
        if row == len(self._traits):
            self._traits = np.concatenate((self._traits, np.empty_like(self._traits)))
        self._traits[row] = self._bodies[vehicle] = body
        return body

    def lamps(self, vehicle: str, own_lamps: OwnLamps) -> int:
        """Lit lamps of a vehicle, with sides that are dark."""
        own = own_lamps.get(vehicle)
        usual = lamps_from_signals(self._signals(vehicle))
        return usual | int(OTHERS_LAMPS) if own is None else usual | own | self.body(vehicle).missing

    @staticmethod
    def head_lamps(vehicle: str, own_lamps: OwnLamps) -> float:
        """Light of a vehicle's head lamps over that of low beams [-]; SUMO's vehicles have these, by `OTHERS_LAMPS`."""
        own = own_lamps.get(vehicle)
        return 1.0 if own is None else head_lamp_light(own)


class HiddenVehicles:
    """Finds vehicles hidden by obstructions: no corner of the body is in sight, neither halfway up nor at the top."""

    def __init__(self, api: Api, vehicles: SeenVehicles, obstructions: Obstructions, remote: bool) -> None:
        self._obstructions = obstructions
        self._vehicles = vehicles
        self._position, self._angle = vehicle_getters(api, remote, ("getPosition3D", "getAngle"))
        self._bodies = LongBodies(api)

    def are_hidden(self, pairs: Sequence[tuple[str, str]]) -> list[bool]:
        """Whether each observer's target is hidden, however clear the air is (`pairs` (str, str))."""
        if not pairs:
            return []
        # Mostly who leads one follows another.
        places = {vehicle: self._position(vehicle) for pair in pairs for vehicle in pair}
        angles = {target: math.radians(90.0 - self._angle(target)) for _, target in pairs}
        bodies = [self._vehicles.body(target) for _, target in pairs]
        parts = [
            self._bodies.parts(t, body.length, places[t], angles[t]) for (_, t), body in zip(pairs, bodies, strict=True)
        ]
        eyes = np.array([places[observer] for observer, _ in pairs])
        eyes[:, 2] += [self._vehicles.body(observer).eye_height for observer, _ in pairs]
        counts = [len(own) for own in parts]
        sizes = [
            (part.length, body.width, body.height) for body, own in zip(bodies, parts, strict=True) for part in own
        ]
        corners = _corners(list(itertools.chain.from_iterable(parts)), np.array(sizes))
        hidden = self._obstructions.hide(eyes.repeat(counts, axis=0), corners)
        each: list[bool] = np.logical_and.reduceat(hidden, np.cumsum([0, *counts[:-1]])).tolist()
        return each


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


class DriversView:
    """What all parts of drivers' perception go by.

    Takes `remote`, true where every call is a message to another process, and `obstructions`, what stands next to the
    roads.
    """

    def __init__(
        self,
        api: Api,
        fog: FogAccess,
        sight: DriverSight,
        roster: Roster,
        session: str = SOLE_SESSION,
        remote: bool = False,
        obstructions: Obstructions = CLEAR_SIGHT,
    ) -> None:
        self.api, self.fog, self.sight, self.roster = api, fog, sight, roster
        self.session, self.remote, self.obstructions = session, remote, obstructions
        self.extinction = fog.maximum_extinction if fog.minimum_extinction == fog.maximum_extinction else None
        """Extinction coefficient of fog that is the same everywhere [1/m]; None of other fog."""
        self.vehicles = SeenVehicles(api, remote, sight.airlight_share)
        self.hidden_vehicles = HiddenVehicles(api, self.vehicles, obstructions, remote) if obstructions else None

    def getters(self, *names: str) -> tuple[Getter, ...]:
        """Getters of what is asked of vehicles often."""
        return vehicle_getters(self.api, self.remote, names)
