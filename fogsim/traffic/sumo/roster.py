"""Which vehicles are on the road, without asking for all ids in every step."""

from collections.abc import Collection, Sequence

from fogsim.traffic.sumo.claims import LoadMark
from fogsim.traffic.sumo.link import Api, getter, subscribed

_GETTERS = {
    "getTime": 0x66,
    "getDepartedIDList": 0x74,
    "getEndingTeleportIDList": 0x78,
    "getStartingTeleportIDList": 0x76,
    "getArrivedIDList": 0x7A,
}
"""Getters, and their variables in SUMO's TraCI protocol."""

CHECK_PERIOD = 1.0
"""Time after which the vehicles are counted [s], should somebody have removed one by hand."""


class Roster:
    """Keeps the set of vehicles on the road by which have entered and left in the last step.

    All ids are asked for at first, when steps were missed, and when once a second their number is another.

    Parameters
    ----------
    api : Api
        The simulation.
    remote : bool
        True where every call is a message to another process.
    mark : LoadMark or None
        Checked at every step, or where that is a message, whenever all ids are read again and once a `CHECK_PERIOD`.

    Attributes
    ----------
    present : set of str
        Vehicles on the road at `time`; not to be changed by others.
    time : float
        Simulated time of the last update [s].
    teleported : sequence of str
        Vehicles that SUMO has begun to teleport in the last step.
    removals : int
        Number of steps in which vehicles have left: as long as it stays, none has.
    """

    def __init__(self, api: Api, remote: bool = False, mark: LoadMark | None = None) -> None:
        self._mark, self._remote = mark, remote
        getters = subscribed(api, _GETTERS) if remote else [getter(api, "simulation", name) for name in _GETTERS]
        self._now, self._departed, self._returned, self._teleporting, self._arrived = getters
        self._all_ids = getter(api, "vehicle", "getIDList")
        self._count = getter(api, "vehicle", "getIDCount")
        self._step = float(api.simulation.getDeltaT())
        self._checked = 0.0
        self._entered: list[str] = []
        self.present: set[str] = set()
        self.teleported: Sequence[str] = ()
        self.removals = 0
        self.time = float("nan")
        self.reload()

    def update(self) -> None:
        """Read the last step; a second call in the same step costs next to nothing."""
        now = self._now()
        if now == self.time:
            return
        self._check_mark(often=True)
        self.teleported = self._teleporting()
        # Lists of changes are of one step only: after a jump of time they are incomplete.
        if not 0.0 < now - self.time < 1.5 * self._step:
            self.reload()
            return
        self.time = now
        departed = self._departed()
        # A vehicle that departs under the id of one on the road replaces one that was removed by hand.
        self._leave(self.present.intersection(departed))
        self._enter(departed)
        # One that is teleported away and back in one step has ended up on the road.
        self._leave(self.teleported)
        self._enter(self._returned())
        self._leave(self._arrived())
        if now - self._checked >= CHECK_PERIOD:
            self._checked = now
            self._check_mark()
            self.check_count()

    def check_count(self) -> None:
        """Notice vehicles removed by hand, which SUMO does not report; asks for all ids if there are any."""
        self._check_mark(often=True)
        if self._count() != len(self.present):
            self.reload()

    def reload(self) -> None:
        """Ask for all ids."""
        self._check_mark()
        self.time = self._checked = self._now()
        ids = self._all_ids()
        self._leave(self.present.difference(ids))
        self._enter(ids)

    def _check_mark(self, *, often: bool = False) -> None:
        """Check that the simulation is still the same; often only where that is no message to another process."""
        if self._mark is not None and not (often and self._remote):
            self._mark.check()

    def _enter(self, vehicles: Sequence[str]) -> None:
        if vehicles:
            new = [v for v in vehicles if v not in self.present]
            self._entered += new
            self.present.update(new)

    def _leave(self, vehicles: Collection[str]) -> None:
        if vehicles:
            self.removals += 1
            self.present.difference_update(vehicles)

    def entered_since(self, since: int) -> tuple[list[str], int]:
        """Vehicles that have entered since an earlier call, and the mark to give to the next call."""
        entered = self._entered
        return (entered[since:], len(entered)) if since < len(entered) else ([], since)
