"""Publishes to SUMO which lamps the ego and other equipped vehicles have lit."""

from collections.abc import Mapping

from fogsim.traffic.sumo.link import Api
from fogsim.values import Lamp
from fogsim.values.light import lamp_names

_LAMPS_PARAMETER = "fogsim-lamps"
"""Parameter of a vehicle that names its lit lamps, joined by "+"."""


class LampPublisher:
    """Publishes changes of vehicles' lamps to SUMO, for sumo-gui's parameter window, outputs and other clients.

    A parameter says it and not SUMO's own signals of the vehicle: who sets those takes braking and turning out of
    SUMO's hands, so that its stop lamps would stay dark.
    """

    def __init__(self, api: Api) -> None:
        self._api = api
        self._published: dict[str, Lamp] = {}

    def publish(self, lamps: Mapping[str, Lamp], present: set[str]) -> None:
        """Publish the lamps that have changed."""
        for vehicle, lit in lamps.items():
            if lit != self._published.get(vehicle) and vehicle in present:
                self._api.vehicle.setParameter(vehicle, _LAMPS_PARAMETER, lamp_names(lit))
                self._published[vehicle] = lit
