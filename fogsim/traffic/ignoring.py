"""Telling SUMO's drivers whom they do not see, in car-following and in lane changing."""

import contextlib

from fogsim.traffic.link import Api
from fogsim.traffic.traci_link import load_traci

_IGNORED = "carFollowModel.ignoreIDs"
_SPEED_GAIN = "laneChangeModel.lcSpeedGain"
"""Eagerness to change lanes for speed (LC2013, SL2015)."""

_NO_WISH = "0"


class Ignoring:
    """Lets a driver ignore the vehicle ahead, and not leave the lane because of it.

    SUMO's lane changing takes no notice of `_IGNORED`: it would avoid a slow leader that its driver cannot see. To a
    driver who sees nobody ahead the lane is free, and there is no speed to gain in another.

    Parameters
    ----------
    api : Api
        The simulation.
    """

    def __init__(self, api: Api) -> None:
        self._vehicles = api.vehicle
        # A connection of traci has no errors of its own; both modules do.
        self._refusal: type[Exception] = getattr(api, "TraCIException", None) or load_traci().TraCIException
        self._eagerness: dict[str, str] = {}

    def ignore(self, follower: str, leader: str) -> None:
        """Let a follower ignore one vehicle."""
        self._vehicles.setParameter(follower, _IGNORED, leader)
        # A lane-change model without such a parameter (DK2008) keeps seeing through the fog.
        if follower not in self._eagerness:
            with contextlib.suppress(self._refusal):
                self._eagerness[follower] = self._vehicles.getParameter(follower, _SPEED_GAIN)
                self._vehicles.setParameter(follower, _SPEED_GAIN, _NO_WISH)

    def heed(self, follower: str) -> None:
        """Let a follower ignore nobody, and change lanes as before."""
        self._vehicles.setParameter(follower, _IGNORED, "")
        if follower in self._eagerness:
            self._vehicles.setParameter(follower, _SPEED_GAIN, self._eagerness.pop(follower))

    def forget(self, follower: str) -> None:
        """Forget a vehicle that has gone."""
        self._eagerness.pop(follower, None)
