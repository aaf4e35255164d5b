"""Gaps along the road, from bumper to bumper, with a sign: who is ahead and who is behind."""

from typing import NamedTuple

from fogsim.traffic.drivers.events import signed_gap
from fogsim.traffic.sumo.link import Api


class _Place(NamedTuple):
    """Where a front bumper is: on an edge of the vehicle's route, or past its end on the way across a junction."""

    edge: str
    station: float
    past_end: float


class GapToEgo:
    """Measures gaps to an ego in SUMO along the routes of both, junctions included, whichever lanes they are on.

    A vehicle is ahead if the ego's route leads to where it is, and behind if its own route leads to the ego.

    Parameters
    ----------
    api : Api
        The simulation.
    ego : str
        Id of the ego.
    """

    def __init__(self, api: Api, ego: str) -> None:
        self._api = api
        self._ego = ego

    def measure(self, vehicle: str) -> float | None:
        """Gap of a vehicle [m], with the sign and the None of `signed_gap`; both must be on the road."""
        own, other = self._place(self._ego), self._place(vehicle)
        length = self._api.vehicle.getLength
        return signed_gap(
            self._way(self._ego, own, other), self._way(vehicle, other, own), length(vehicle), length(self._ego)
        )

    def _way(self, vehicle: str, here: _Place, there: _Place) -> float | None:
        """Way of a vehicle from where it is to another place [m]; None if its route does not lead there."""
        if here.edge == there.edge:
            apart = there.station + there.past_end - here.station - here.past_end
            if apart >= 0.0:
                return apart
        # SUMO measures from inside a junction, but only to places outside of it.
        way = float(self._api.vehicle.getDrivingDistance(vehicle, there.edge, there.station, 0))
        return way + there.past_end if way >= 0.0 else None

    def _place(self, vehicle: str) -> _Place:
        get = self._api.vehicle
        lane, position = get.getLaneID(vehicle), get.getLanePosition(vehicle)
        if not lane.startswith(":"):
            return _Place(get.getRoadID(vehicle), position, 0.0)
        edge = get.getRoute(vehicle)[get.getRouteIndex(vehicle)]
        return _Place(edge, self._api.lane.getLength(f"{edge}_0"), self._before(edge, lane) + position)

    def _before(self, edge: str, inner: str) -> float:
        """Length of those lanes on the way from an edge across a junction that lie before one of them [m]."""
        get = self._api.lane
        for index in range(self._api.edge.getLaneNumber(edge)):
            for link in get.getLinks(f"{edge}_{index}"):
                passed, lane = 0.0, link[4]
                while lane:
                    if lane == inner:
                        return passed
                    passed += float(get.getLength(lane))
                    lane = next((further[4] for further in get.getLinks(lane)), "")
        return 0.0
