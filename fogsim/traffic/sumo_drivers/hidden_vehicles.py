"""Which vehicles are behind what stands beside the road, to a driver's eyes."""

import math
from collections.abc import Iterable, Sequence

from fogsim.obstruction import Obstructions
from fogsim.traffic.sumo.link import Api, vehicle_getter
from fogsim.traffic.sumo.vehicle_getters import vehicle_getters
from fogsim.traffic.sumo_drivers.seen_vehicles import SeenVehicles

_Point = tuple[float, float, float]


class HiddenVehicles:
    """Tells whom obstructions hide: those of whose body no corner is in sight, neither halfway up nor at the top.

    Parameters
    ----------
    api : Api
        The simulation.
    obstructions : Obstructions
        What stands there.
    remote : bool
        True where every call is a message to another process: what is asked often is subscribed to.
    """

    def __init__(self, api: Api, obstructions: Obstructions, remote: bool = False) -> None:
        self._obstructions = obstructions
        self._vehicles = SeenVehicles(api, remote)
        self._position, self._angle = vehicle_getters(api, remote, ("getPosition3D", "getAngle"))
        self._height = vehicle_getter(api, "getHeight")

    def forget(self, vehicles: Iterable[str]) -> None:
        """Forget vehicles whose ids others may bear now.

        Parameters
        ----------
        vehicles : iterable of str
            Their ids.
        """
        self._vehicles.forget(vehicles)

    def are_hidden(self, pairs: Sequence[tuple[str, str]]) -> list[bool]:
        """Whether each observer's target is hidden, however clear the air is.

        Parameters
        ----------
        pairs : sequence of (str, str)
            Observers and targets.
        """
        if not pairs:
            return []
        eyes, corners = [self._eyes(observer) for observer, _ in pairs], [self._corners(target) for _, target in pairs]
        hidden: list[bool] = self._obstructions.hide(eyes, corners).tolist()
        return hidden

    def _eyes(self, observer: str) -> _Point:
        x, y, z = self._position(observer)
        return x, y, z + self._vehicles.eye_height(observer)

    def _corners(self, target: str) -> list[_Point]:
        """The body's eight corners, of which the lower ones are halfway up."""
        x, y, z = self._position(target)
        heading, body = math.radians(90.0 - self._angle(target)), self._vehicles.body(target)
        east, north, half, top = math.cos(heading), math.sin(heading), 0.5 * body.width, float(self._height(target))
        return [
            (x - back * east - left * north, y - back * north + left * east, z + height)
            for height in (0.5 * top, top)
            for back in (0.0, body.length)
            for left in (-half, half)
        ]
