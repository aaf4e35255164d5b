"""Scripted manoeuvres: which vehicle is ordered to which speed at this instant."""

import math
from collections.abc import Callable, Iterable

from fogsim.traffic.setup import BrakeEvent


class Script:
    """Plays braking events; remembers which have begun and since when they hold.

    Parameters
    ----------
    events : iterable of BrakeEvent
        What is scripted.
    """

    def __init__(self, events: Iterable[BrakeEvent]) -> None:
        self._waiting = list(events)
        self._braking: dict[BrakeEvent, float] = {}

    def orders(
        self, time: float, present: set[str], distance_driven: Callable[[str], float]
    ) -> dict[str, tuple[float, float]]:
        """Orders in force: target speed [m/s] (``inf`` frees the vehicle) and deceleration [m/s²] by vehicle id.

        Parameters
        ----------
        time : float
            Simulated time [s].
        present : set of str
            Vehicles on the road.
        distance_driven : callable
            Distance that a vehicle has driven [m].
        """
        self._begin(time, present, distance_driven)
        orders = {}
        for event, since in list(self._braking.items()):
            over = time - since >= event.hold
            if event.vehicle in present:
                orders[event.vehicle] = (math.inf if over else event.to_speed, event.deceleration)
            if over or event.vehicle not in present:
                del self._braking[event]
        return orders

    def _begin(self, time: float, present: set[str], distance_driven: Callable[[str], float]) -> None:
        for event in list(self._waiting):
            if event.vehicle in present and distance_driven(event.vehicle) >= event.at_position:
                self._waiting.remove(event)
                self._braking[event] = time
