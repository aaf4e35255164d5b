"""Traffic lights ahead of vehicles."""

from fogsim.traffic.appearance import SIGNAL_COLOURS
from fogsim.traffic.sumo.link import Api, getter, vehicle_getter
from fogsim.traffic.sumo_lanes.directions import LaneDirections
from fogsim.values import SignalAhead

Light = tuple[str, int, float, str]
"""Of a light ahead: its id, the index of the vehicle's link, the way to its stop line [m], and what it shows."""


class LightsAhead:
    """Finds the next light that a vehicle is to obey.

    A link that its lights do not control has the index −1, as that of a track across a level crossing: what the lights
    show is for the road. While a vehicle overtakes on the oncoming lane, SUMO counts the way from the wrong end.
    """

    def __init__(self, api: Api) -> None:
        self._lights = vehicle_getter(api, "getNextTLS")
        self._lane, self._station = vehicle_getter(api, "getLaneID"), vehicle_getter(api, "getLanePosition")
        self._length, self._directions = getter(api, "lane", "getLength"), LaneDirections(api)
        self._has_lights = int(api.trafficlight.getIDCount()) > 0

    def next_of(self, vehicle: str) -> Light | None:
        """The next light of a vehicle; None without one."""
        lights = self._lights(vehicle) if self._has_lights else ()
        light: Light | None = next((one for one in lights if one[1] >= 0 and one[3] in SIGNAL_COLOURS), None)
        if light is None or not self._directions.is_against(vehicle, lane := self._lane(vehicle)):
            return light
        name, link, way, letter = light
        return name, link, way + 2.0 * float(self._station(vehicle)) - float(self._length(lane)), letter

    def shown_to(self, vehicle: str) -> SignalAhead | None:
        """The next light of a vehicle as what it shows; None without one."""
        light = self.next_of(vehicle)
        return None if light is None else SignalAhead(light[0], SIGNAL_COLOURS[light[3]], light[2])
