"""Who is on the road, without asking for all names in every step."""

from collections.abc import Collection, Sequence

from fogsim.traffic.sumo.getters import getter, subscribed
from fogsim.traffic.sumo.link import Api

_ASKED = {
    "getTime": 0x66,
    "getDepartedIDList": 0x74,
    "getEndingTeleportIDList": 0x78,
    "getStartingTeleportIDList": 0x76,
    "getArrivedIDList": 0x7A,
}
"""Getters, and their variables in SUMO's TraCI protocol."""

CHECK_PERIOD = 1.0
"""Time after which the vehicles are counted [s], should somebody have taken one away by hand."""


class Roster:
    """Keeps the set of vehicles on the road by who has come and who has gone in the last step.

    All names are asked for at the first look, when steps were missed, and when once a second their number is another.

    Parameters
    ----------
    api : Api
        The simulation.
    distant : bool
        True where every call is a message to another process.

    Attributes
    ----------
    present : set of str
        Vehicles on the road at `time`; not to be changed by others.
    time : float
        Simulated time of the last look [s].
    beamed_away : sequence of str
        Vehicles that SUMO has begun to teleport in the last step.
    departures : int
        How often somebody has gone: as long as it stays, nobody has.
    """

    def __init__(self, api: Api, distant: bool = False) -> None:
        getters = subscribed(api, _ASKED) if distant else [getter(api, "simulation", name) for name in _ASKED]
        self._now, self._departed, self._back, self._off, self._arrived = getters
        self._everybody = getter(api, "vehicle", "getIDList")
        self._count = getter(api, "vehicle", "getIDCount")
        self._step = float(api.simulation.getDeltaT())
        self._checked = 0.0
        self._came: list[str] = []
        self.present: set[str] = set()
        self.beamed_away: Sequence[str] = ()
        self.departures = 0
        self.time = float("nan")
        self.check()

    def look(self) -> None:
        """Take in the last step; a second look in the same step costs next to nothing."""
        now = self._now()
        if now == self.time:
            return
        self.beamed_away = self._off()
        # Lists of changes are of one step only: after a jump of time they do not tell all.
        if not 0.0 < now - self.time < 1.5 * self._step:
            self.check()
            return
        self.time = now
        departed = self._departed()
        # Who departs under the name of one on the road has come in place of one that was taken away by hand.
        self._go(self.present.intersection(departed))
        self._come(departed)
        # Who is beamed away and back in one step has ended up on the road.
        self._go(self.beamed_away)
        self._come(self._back())
        self._go(self._arrived())
        if now - self._checked >= CHECK_PERIOD:
            self._checked = now
            self.recount()

    def recount(self) -> None:
        """Notice at once whom somebody has taken away by hand, of which SUMO says nothing; asks for all if any."""
        if self._count() != len(self.present):
            self.check()

    def check(self) -> None:
        """Ask for all names."""
        self.time = self._checked = self._now()
        everybody = self._everybody()
        self._go(self.present.difference(everybody))
        self._come(everybody)

    def _come(self, vehicles: Sequence[str]) -> None:
        if vehicles:
            new = [v for v in vehicles if v not in self.present]
            self._came += new
            self.present.update(new)

    def _go(self, vehicles: Collection[str]) -> None:
        if vehicles:
            self.departures += 1
            self.present.difference_update(vehicles)

    def newcomers(self, since: int) -> tuple[list[str], int]:
        """Who has come since an earlier call, and the mark to give to the next call; the first mark is 0."""
        came = self._came
        return (came[since:], len(came)) if since < len(came) else ([], since)
