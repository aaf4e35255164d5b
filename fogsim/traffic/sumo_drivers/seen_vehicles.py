"""What of SUMO's vehicles there is to see, their bodies and their lit lamps, and from how high their drivers look."""

from collections.abc import Iterable
from typing import NamedTuple

from fogsim.traffic.appearance import OTHERS_LAMPS, body_kind, lamps_from_signals, paint
from fogsim.traffic.drivers.eye_heights import eye_height
from fogsim.traffic.drivers.own_beams import head_lamp_light
from fogsim.traffic.drivers.sight import inherent_contrast
from fogsim.traffic.sumo.link import Api, vehicle_getter
from fogsim.traffic.sumo.vehicle_getters import vehicle_getters
from fogsim.values.fog import AIRLIGHT_SHARE
from fogsim.values.light import MIDDLE_LAMPS, Side, dark_on

OwnLamps = dict[str, int]
"""Lamps, as `TrafficState.lamps` has them, of vehicles whose lamps are not SUMO's; with the sides that have failed."""

_NO_THIRD_STOP_LAMP = frozenset({"truck", "motorcycle"})
"""Body kinds without a stop lamp in the middle next to two others."""


class SeenBody(NamedTuple):
    """A vehicle's body."""

    # length, width: [m]
    length: float
    width: float
    contrast: float  # To the airlight without fog between, 0 … 1
    missing: int  # Bits of sides on which there is no lamp


class SeenVehicles:
    """Bodies and heights of eyes, each read once, and lit lamps of vehicles."""

    def __init__(self, api: Api, remote: bool = False, airlight_share: float = AIRLIGHT_SHARE) -> None:
        self._airlight_share = airlight_share
        (self._signals,) = vehicle_getters(api, remote, ("getSignals",))
        self._get_colour = vehicle_getter(api, "getColor")
        self._get_length = vehicle_getter(api, "getLength")
        self._get_width = vehicle_getter(api, "getWidth")
        self._get_class = vehicle_getter(api, "getVehicleClass")
        self._get_shape = vehicle_getter(api, "getShapeClass")
        self._bodies: dict[str, SeenBody] = {}
        self._eye_heights: dict[str, float] = {}

    def forget(self, vehicles: Iterable[str]) -> None:
        """Forget vehicles whose ids others may bear now."""
        for vehicle in vehicles:
            self._bodies.pop(vehicle, None)
            self._eye_heights.pop(vehicle, None)

    def body(self, vehicle: str) -> SeenBody:
        """Body of a vehicle."""
        known = self._bodies.get(vehicle)
        if known is None:
            contrast = inherent_contrast(paint(vehicle, self._get_colour(vehicle)), self._airlight_share)
            length = float(self._get_length(vehicle))
            kind = body_kind(self._get_class(vehicle), self._get_shape(vehicle), length)
            missing = dark_on(int(MIDDLE_LAMPS), Side.MIDDLE) if kind in _NO_THIRD_STOP_LAMP else 0
            known = SeenBody(length, float(self._get_width(vehicle)), contrast, missing)
            self._bodies[vehicle] = known
        return known

    def eye_height(self, vehicle: str) -> float:
        """Height of the driver's eyes above the road [m]."""
        known = self._eye_heights.get(vehicle)
        if known is None:
            shape, length = self._get_shape(vehicle), float(self._get_length(vehicle))
            known = self._eye_heights[vehicle] = eye_height(self._get_class(vehicle), shape, length)
        return known

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
