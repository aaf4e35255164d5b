"""Where in their lanes vehicles drive, as a script has it."""

import math
from collections.abc import Collection
from dataclasses import dataclass

from fogsim.traffic.sumo.link import Api, is_off_lanes


@dataclass(frozen=True, slots=True)
class Glide:
    """A move across the lane along half a wave of a cosine, from one offset to the left to another [m]."""

    begun: float
    duration: float
    first: float
    last: float

    def offset(self, time: float) -> float:
        """Offset at a time [m]."""
        share = min((time - self.begun) / self.duration, 1.0) if self.duration > 0.0 else 1.0
        return self.first + (0.5 - 0.5 * math.cos(math.pi * share)) * (self.last - self.first)


class LaneOffsets:
    """Moves vehicles within their lanes; SUMO keeps each where it is, also in the next lane."""

    def __init__(self, api: Api) -> None:
        self._api = api
        self._glides: dict[str, Glide] = {}

    def begin(self, vehicle: str, offset: float, duration: float, time: float) -> None:
        """Begin a move to an offset to the left of the lane's middle [m]."""
        now = 0.0 if is_off_lanes(self._api, vehicle) else float(self._api.vehicle.getLateralLanePosition(vehicle))
        self._glides[vehicle] = Glide(time, duration, now, offset)

    def play(self, time: float, present: Collection[str]) -> None:
        """Move those under way to where they are at a time [s]."""
        for vehicle, glide in list(self._glides.items()):
            if vehicle in present and not is_off_lanes(self._api, vehicle):
                self._api.vehicle.setLateralLanePosition(vehicle, glide.offset(time))
            if time >= glide.begun + glide.duration:
                del self._glides[vehicle]
