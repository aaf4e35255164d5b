"""Telling SUMO's drivers whom they do not see, in car-following and in lane changing."""

import contextlib

from fogsim.traffic.sumo.claims import SOLE_SESSION, SPEED_GAIN, Claims, Notes
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo.traci_link import load_traci

_IGNORED = "carFollowModel.ignoreIDs"
_NO_WISH = 0.0


class Ignoring:
    """Lets a driver ignore the vehicle ahead, and not leave the lane because of it.

    SUMO's lane changing takes no notice of `_IGNORED`: it would avoid a slow leader that its driver cannot see. To a
    driver who sees nobody ahead the lane is free, and there is no speed to gain in another.

    Parameters
    ----------
    api : Api
        The simulation.
    session : str
        Name of the session; a driver ignores whom any session lets it ignore.
    """

    def __init__(self, api: Api, session: str = SOLE_SESSION) -> None:
        self._vehicles = api.vehicle
        # A connection of traci has no errors of its own; both modules do.
        self._refusal: type[Exception] = getattr(api, "TraCIException", None) or load_traci().TraCIException
        self._session = session
        self._notes = Notes[str](api, "ignored")
        self._eagerness = Claims(api, SPEED_GAIN, session)

    def ignore(self, follower: str, leader: str) -> None:
        """Let a follower ignore one vehicle."""
        notes = self._notes.read(follower)
        notes[self._session] = leader
        self._tell(follower, notes)
        # A lane-change model without such a parameter (DK2008) keeps seeing through the fog.
        with contextlib.suppress(self._refusal):
            self._eagerness.make(follower, _NO_WISH)

    def heed(self, follower: str) -> None:
        """Let a follower ignore nobody whom this session had it ignore, and change lanes as before."""
        notes = self._notes.read(follower)
        if notes.pop(self._session, None) is not None:
            self._tell(follower, notes)
            self._eagerness.withdraw(follower)

    def _tell(self, follower: str, notes: dict[str, str]) -> None:
        self._vehicles.setParameter(follower, _IGNORED, " ".join(sorted(set(notes.values()))))
        self._notes.write(follower, notes)
