"""Which vehicles' drivers are to be looked at in this step."""

from collections.abc import Sequence
from typing import NamedTuple

from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo.update_schedule import UpdateSchedule


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
        """Take out those that are due; who is to be looked at again is to be scheduled again."""
        roster = self._roster
        roster.update()
        due = self._schedule.pop_due(roster.time)
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
        self._schedule.add(vehicles, self._roster.time + pause)
