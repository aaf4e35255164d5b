"""Collisions, each pair of vehicles once."""

from fogsim.traffic.sumo.getters import getter
from fogsim.traffic.sumo.link import Api
from fogsim.values import Collision


class CollisionWatch:
    """Collects collisions; SUMO repeats one in every step while the vehicles overlap.

    Parameters
    ----------
    api : Api
        The simulation.
    """

    def __init__(self, api: Api) -> None:
        self._simulation = api.simulation
        self._collisions = getter(api, "simulation", "getCollisions")
        self._known: set[tuple[str, str]] = set()
        self._untold: list[Collision] = []

    def look(self) -> None:
        """Take in the collisions of the last simulation step."""
        for c in self._collisions():
            pair = (min(c.collider, c.victim), max(c.collider, c.victim))
            if pair not in self._known:
                self._known.add(pair)
                impact = abs(c.colliderSpeed - c.victimSpeed)
                self._untold.append(Collision(self._simulation.getTime(), c.collider, c.victim, impact))

    def tell(self) -> tuple[Collision, ...]:
        """Collisions that have not been told yet."""
        told = tuple(self._untold)
        self._untold.clear()
        return told
