"""Making drivers ignore vehicles and persons at junctions, by what SUMO offers for it."""

from collections.abc import Collection

from fogsim.traffic.sumo.claims import SessionValues
from fogsim.traffic.sumo.link import Api

_IGNORED = "junctionModel.ignoreIDs"
_OWN = "own"


class IgnoredFoes:
    """Sets whom a driver does not yield to at a junction, outside it or on it, whoever has the right of way.

    A driver ignores what any session has it ignore, and whom it ignored by itself before.

    Parameters
    ----------
    api : Api
        The simulation.
    session : str
        Name of the session, or of a part of it.
    """

    def __init__(self, api: Api, session: str) -> None:
        self._vehicles = api.vehicle
        self._session = session
        self._values = SessionValues[list[str]](api, "ignoredFoes")

    def ignore(self, vehicle: str, foes: Collection[str]) -> None:
        """Let a driver ignore exactly these, as far as this session goes.

        Parameters
        ----------
        vehicle : str
            The driver's vehicle.
        foes : collection of str
            Ids of vehicles or persons; ids that nobody bears do no harm.
        """
        values = self._values.read(vehicle)
        if not foes and self._session not in values:
            return
        if not values:
            values[_OWN] = self._vehicles.getParameter(vehicle, _IGNORED).split()
        values.pop(self._session, None)
        if foes:
            values[self._session] = sorted(foes)
        ignored = set().union(*values.values())
        self._vehicles.setParameter(vehicle, _IGNORED, " ".join(sorted(ignored)))
        self._values.write(vehicle, values if len(values) > 1 else {})
