"""Which vehicles are on the road, without asking for all ids in every step."""

import itertools
from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple

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

_CHECK_PERIOD = 1.0
"""Time after which the vehicles are counted where that is a message [s], should somebody have removed one by hand."""


class Roster:
    """Keeps the set of vehicles on the road by which have entered and left in the last step.

    All ids are asked for at first, when steps were missed, and when their number is another: SUMO reports those that a
    calibrator removes a step late, and those that are removed by hand not at all. The `mark` is checked at every step,
    or, if that is a message (`remote`), whenever all ids are read again and once a `_CHECK_PERIOD`.
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
        self._entries = 0
        self.present: set[str] = set()  # Not to be changed by others
        self.teleported: Sequence[str] = ()
        self.arrived: Sequence[str] = ()
        self.removals = 0  # Steps in which vehicles have left
        self.time = float("nan")
        self.reload()

    def update(self, *, has_stepped: bool = False) -> None:
        """Read the last step; a second call in the same step costs next to nothing, unless SUMO `has_stepped` since."""
        now = self._now()
        if now == self.time and not has_stepped:
            return
        self.teleported, self.arrived = self._teleporting(), self._arrived()
        if now <= self.time:
            # A state was loaded, in which other vehicles may have the same ids.
            self._leave([*self.present])
        # Lists of changes are of one step only: after a jump of time they are incomplete.
        if not 0.0 < now - self.time < 1.5 * self._step:
            self.reload()
            return
        self.time = now
        if departed := self._departed():
            # A vehicle that departs under the id of one on the road replaces one that was removed by hand.
            self._leave(self.present.intersection(departed))
            self._enter(departed)
        # One that is teleported away and back in one step has ended up on the road.
        if self.teleported:
            self._leave(self.teleported)
        if returned := self._returned():
            self._enter(returned)
        self._leave(self.arrived)
        if not self._remote or now - self._checked >= _CHECK_PERIOD:
            self._checked = now
            self._check_mark()
            self._recount()

    def check_count(self) -> None:
        """Notice vehicles that are gone without a report; asks for all ids if there are any."""
        if not self._remote:
            self._check_mark()
        self._recount()

    def _recount(self) -> None:
        if self._count() != len(self.present):
            self.reload()

    def reload(self) -> None:
        """Ask for all ids."""
        self._check_mark()
        self.time = self._checked = self._now()
        ids = self._all_ids()
        self._leave(self.present.difference(ids))
        self._enter(ids)

    def _check_mark(self) -> None:
        """Check that the simulation is still the same."""
        if self._mark is not None:
            self._mark.check()

    def _enter(self, vehicles: Sequence[str]) -> None:
        new = [v for v in vehicles if v not in self.present]
        self._entered += new
        self._entries += len(new)
        self.present.update(new)

    def _leave(self, vehicles: Collection[str]) -> None:
        if vehicles:
            self.removals += 1
            self.present.difference_update(vehicles)

    def entered_since(self, since: int) -> tuple[list[str], int]:
        """Vehicles that have entered since an earlier call, and the mark to give to the next call."""
        return (self._entered[since:], self._entries) if since < self._entries else ([], since)


MAX_RELATIVE_ACCELERATION = 20.0
"""One vehicle's acceleration minus another's is never larger than this [m/s²]: emergency braking and driving off."""

_BATCH_PERIOD = 0.5
"""Vehicles that may wait this long are gathered with others in the steps of this period [s]: a batch costs less than
many single vehicles."""

_ROUNDING = 1e-6
"""Share of a step by which clocks may differ from a whole number of steps [-]."""


def closing_speed_bound(speed: float, leader_speed: float, horizon: float) -> float:
    """How fast the gap between two vehicles changes at most [m/s] (`horizon` [s])."""
    return abs(leader_speed - speed) + 0.5 * MAX_RELATIVE_ACCELERATION * horizon


class UpdateSchedule:
    """Vehicles by the step in which each is due; only those due are ever touched (`step` [s], `now` [s])."""

    def __init__(self, step: float, now: float) -> None:
        self._step = step
        self._batch = max(1, round(_BATCH_PERIOD / step))
        self._current = self._number(now)
        self._due: defaultdict[float, list[str]] = defaultdict(list)

    def _number(self, time: float) -> float:
        return (time / self._step + _ROUNDING) // 1.0

    def unscheduled(self, vehicles: Sequence[str]) -> list[str]:
        """Those of some vehicles that wait for no step, each once."""
        # Seldom asked for any, so that keeping a set of all scheduled vehicles would cost more.
        if not vehicles:
            return []
        scheduled = set(itertools.chain.from_iterable(self._due.values()))
        return [v for v in dict.fromkeys(vehicles) if v not in scheduled]

    def add(self, vehicles: Sequence[str], time: float) -> None:
        """Schedule vehicles that are not scheduled yet, at the earliest for the next step (`time` [s])."""
        self._due_at(time).extend(vehicles)

    def add_each(self, vehicles: Iterable[str], pauses: Iterable[float], now: float) -> None:
        """Schedule vehicles as `add` does, each for a pause of its own (`pauses`, `now` [s])."""
        waiting: dict[float, list[str]] = {}
        for vehicle, pause in zip(vehicles, pauses, strict=True):
            # Most have pauses of a few kinds.
            if pause not in waiting:
                waiting[pause] = self._due_at(now + pause)
            waiting[pause].append(vehicle)

    def _due_at(self, time: float) -> list[str]:
        """Those who wait with who waits until a time."""
        # As `_number` does, without a call for each.
        number, following, batch = (time / self._step + _ROUNDING) // 1.0, self._current + 1, self._batch
        number = number if number > following else following
        return self._due[number - number % batch if number - following >= batch - 1 else number]

    def bring_forward(self, vehicle: str) -> None:
        """Make a vehicle that waits due in the next step; one that waits for nothing stays so."""
        # Seldom asked for, so that keeping where each vehicle waits would cost more.
        for waiting in self._due.values():
            if vehicle in waiting:
                waiting.remove(vehicle)
                self._due[self._current + 1].append(vehicle)
                return

    def pop_due(self, now: float) -> list[str]:
        """Take out the vehicles that are due (`now` [s])."""
        number, last = self._number(now), self._current
        self._current = number
        if number - last == 1:
            return self._due.pop(number, [])
        passed = sorted(n for n in self._due if n <= number)
        return [vehicle for n in passed for vehicle in self._due.pop(n)]

    def clear(self) -> None:
        """Forget all vehicles."""
        self._due.clear()


class Due(NamedTuple):
    """Vehicles of one step."""

    vehicles: Sequence[str]  # Those to be looked at; all are on the road
    new: Sequence[str]  # Those that have entered the road since the last step, or come back to it, and are on it
    gone: Sequence[str]  # Those that have left it, if they were due, and all new ones, whose ids others may have borne


class DueVehicles:
    """Schedules the vehicles of a roster; a new one is due at once (`step` [s])."""

    def __init__(self, roster: Roster, step: float) -> None:
        self._roster = roster
        self._schedule = UpdateSchedule(step, roster.time)
        self._mark = 0

    def take(self) -> Due:
        """Take out those that are due, by a roster that is up to date; who is to wait again is scheduled again."""
        roster = self._roster
        # SUMO finds vehicles faster in the order in which it keeps them.
        due = sorted(self._schedule.pop_due(roster.time))
        entered, self._mark = roster.entered_since(self._mark)
        if not entered and roster.present.issuperset(due):
            return Due(due, (), ())
        gone = [v for v in due if v not in roster.present]
        due = [v for v in due if v in roster.present]
        new = [v for v in entered if v in roster.present]
        known = set(due)
        due += [v for v in self._schedule.unscheduled(new) if v not in known]
        return Due(due, new, gone + entered)

    def schedule(self, vehicles: Sequence[str], pause: float) -> None:
        """Schedule vehicles that have been taken out (`pause` [s])."""
        if vehicles:
            self._schedule.add(vehicles, self._roster.time + pause)

    def schedule_each(self, vehicles: Iterable[str], pauses: Iterable[float]) -> None:
        """Schedule vehicles that have been taken out, each for a pause of its own (`pauses` [s])."""
        self._schedule.add_each(vehicles, pauses, self._roster.time)

    def bring_forward(self, vehicle: str) -> None:
        """Let a vehicle that waits be due in the next step."""
        self._schedule.bring_forward(vehicle)
