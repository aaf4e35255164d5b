"""Watches what is expected over the steps of a run, and says at its end what came of it."""

import math
from collections.abc import Iterable, Mapping
from typing import Protocol

from fogsim.conditions.clauses import (
    Always,
    Clause,
    Eventually,
    Finding,
    FindingVerdict,
    Happened,
    MetricCheck,
    Whenever,
)
from fogsim.conditions.logic import compared
from fogsim.conditions.moment import History, Moment
from fogsim.conditions.syntax import Comparison, Condition
from fogsim.conditions.watching import Watch
from fogsim.values import TrafficStep

_TICK = 1e-6
"""Rounding of times [s]."""

_SIGNS = {"<": -1.0, "<=": -1.0, ">": 1.0, ">=": 1.0}
"""Direction in which a comparison holds."""

_NEVER_KNOWN = "it was never known"

Sight = tuple[float, float | None, str]
"""When something was seen [s], where the ego was [m], and what the signals were."""


class ExpectationWatch:
    """Judges every clause of what is expected of a run by the truth, which no estimator and no adviser sees."""

    def __init__(self, clauses: Iterable[Clause]) -> None:
        self._history = History()
        self._watches = [(clause, _watch_of(clause)) for clause in clauses]

    def update(self, step: TrafficStep) -> None:
        """Take in the next step of the run."""
        moment = self._history.moment(step)
        for _, watch in self._watches:
            watch.look(moment)

    def findings(self, metrics: Mapping[str, object]) -> tuple[Finding, ...]:
        """What came of each clause in the steps so far, in their order; metrics by keys as in `RunSummary.flat`."""
        found = []
        for clause, watch in self._watches:
            verdict, sight, came, reason = watch.result(metrics)
            time, position = (None, None) if sight is None else sight[:2]
            found.append(
                Finding(
                    clause.name, clause.clause, verdict, clause.expected, came, time, position, reason, watch.margin
                )
            )
        return tuple(found)


Result = tuple[FindingVerdict, Sight | None, str, str]
"""A verdict, what decided it, what came, and why."""


class _ClauseWatch(Protocol):
    """Watches one clause."""

    @property
    def margin(self) -> float | None:
        """Least distance to the limit as a share of it."""

    def look(self, moment: Moment) -> None:
        """Take in a moment."""

    def result(self, metrics: Mapping[str, object]) -> Result:
        """Say what came."""


def _watch_of(clause: Clause) -> _ClauseWatch:
    match clause:
        case Always():
            return _AlwaysWatch(clause)
        case Eventually():
            return _EventuallyWatch(clause)
        case Whenever():
            return _WheneverWatch(clause)
        case Happened():
            return _HappenedWatch(clause)
        case MetricCheck():
            return _MetricWatch(clause)


def _passed(sight: Sight | None, came: str = "") -> Result:
    return FindingVerdict.PASSED, sight, came or ("" if sight is None else sight[2]), ""


def _failed(sight: Sight | None, came: str, reason: str = "") -> Result:
    return FindingVerdict.FAILED, sight, came, reason


def _open(reason: str, came: str = "") -> Result:
    return FindingVerdict.INCONCLUSIVE, None, came, reason


def _sight(moment: Moment, readings: str) -> Sight:
    step = moment.ego_step
    return moment.step.time, None if step is None else step.route_position, readings


class _Scope:
    """The steps that count: those at which a condition holds, or all; and the time of the run so far."""

    def __init__(self, condition: Condition | None) -> None:
        self._watch = None if condition is None else Watch(condition)
        self._before: float | None = None
        self.elapsed = self.end = 0.0
        self.was_entered = False

    def look(self, moment: Moment) -> bool:
        """Whether a step counts; `elapsed` is then the time since the one before."""
        time = self.end = moment.step.time
        self.elapsed = 0.0 if self._before is None else time - self._before
        self._before = time
        counts = self._watch is None or self._watch.look(moment) is True
        self.was_entered |= counts
        return counts


class _AlwaysWatch:
    def __init__(self, clause: Always) -> None:
        self._clause = clause
        self._scope, self._watch = _Scope(clause.during), Watch(clause.condition)
        self._worst = _Worst(clause.condition, clause.is_never)
        self._counted, self._known_once = 0.0, False
        self._broken: Sight | None = None
        self._readings = ""

    @property
    def margin(self) -> float | None:
        return self._worst.margin

    def look(self, moment: Moment) -> None:
        counts, holds = self._scope.look(moment), self._watch.look(moment)
        if not counts or holds is None:
            return
        if not self._known_once:
            self._known_once, self._readings = True, self._watch.readings()
        self._counted += self._scope.elapsed
        self._worst.look(self._watch, moment)
        if holds == self._clause.is_never and self._broken is None:
            self._broken = _sight(moment, self._watch.readings())

    def result(self, _: Mapping[str, object]) -> Result:
        worst = self._worst.sight
        at_worst = "" if worst is None else f"at worst {worst[2]} at {worst[0]:g} s"
        if self._broken is not None:
            is_worst = worst is None or worst[0] == self._broken[0]
            return _failed(self._broken, self._broken[2], "" if is_worst else at_worst)
        if not self._scope.was_entered:
            return _open(f"{self._clause.during} never held")
        if not self._known_once:
            return _open(_NEVER_KNOWN, self._watch.readings())
        if self._counted < self._clause.for_at_least - _TICK:
            return _open(f"it counted for {self._counted:g} s, and {self._clause.for_at_least:g} s were wanted")
        return _passed(worst, self._readings if worst is None else f"at worst {worst[2]}")


class _Worst:
    """When a comparison of numbers was nearest to breaking a clause, or broke it most."""

    def __init__(self, condition: Condition, is_never: bool) -> None:
        self._margin = math.inf
        self._scale = 1.0
        self.sight: Sight | None = None
        self._comparison = condition if isinstance(condition, Comparison) else None
        relation = "" if self._comparison is None else self._comparison.relation
        self._sign = _SIGNS.get(relation, 0.0) * (-1.0 if is_never else 1.0)

    def look(self, watch: Watch, moment: Moment) -> None:
        """Take in a moment that counts."""
        if self._comparison is None or not self._sign:
            return
        left, right = watch.operands(self._comparison)
        if isinstance(left, float) and isinstance(right, float) and not math.isinf(right):
            margin = self._sign * (left - right)
            if margin < self._margin:
                self._margin, self._scale = margin, abs(right) or 1.0
                self.sight = _sight(moment, watch.readings())

    @property
    def margin(self) -> float | None:
        """Least distance to the limit, as a share of it; None if no number was compared."""
        return None if math.isinf(self._margin) else self._margin / self._scale


class _EventuallyWatch:
    margin = None

    def __init__(self, clause: Eventually) -> None:
        self._clause = clause
        self._scope, self._watch = _Scope(clause.during), Watch(clause.condition)
        self._known_once = False
        self._held: Sight | None = None

    def look(self, moment: Moment) -> None:
        counts, holds = self._scope.look(moment), self._watch.look(moment)
        if counts and holds is not None:
            self._known_once = True
            if holds and self._held is None:
                self._held = _sight(moment, self._watch.readings())

    def result(self, _: Mapping[str, object]) -> Result:
        within, end = self._clause.within, self._scope.end
        if self._held is not None:
            time, readings = self._held[0], self._held[2]
            return (
                _passed(self._held) if time <= within + _TICK else _failed(self._held, readings, f"only at {time:g} s")
            )
        if not self._scope.was_entered:
            return _open(f"{self._clause.during} never held")
        if not self._known_once:
            return _open(_NEVER_KNOWN)
        if end < within - _TICK and not math.isinf(within):
            return _open(f"the run ended at {end:g} s, before the {within:g} s were over")
        readings = f"{self._watch.readings()} at the end, {end:g} s"
        return _failed((min(within, end), None, readings), readings, "it never held")


class _Trial:
    """One time that a condition became true, and what was required since."""

    def __init__(self, clause: Whenever, time: float) -> None:
        self._clause, self.time = clause, time
        self._known = False

    def look(self, holds: bool | None, time: float) -> bool | None:
        """Whether it is decided, and how; None while it is not."""
        if time > self.time + self._clause.within + _TICK:
            return self._clause.throughout if self._known else None
        self._known |= holds is not None
        if holds is not None and holds != self._clause.throughout:
            return holds
        if time < self.time + self._clause.within - _TICK:
            return None
        return self._clause.throughout if self._known else None

    def is_over(self, time: float) -> bool:
        """Whether its time is over."""
        return time >= self.time + self._clause.within - _TICK


class _WheneverWatch:
    margin = None

    def __init__(self, clause: Whenever) -> None:
        self._clause = clause
        self._trigger, self._require = Watch(clause.trigger), Watch(clause.require)
        self._was_true = False
        self._open: list[_Trial] = []
        self._fired = self._passed = self._failed = 0
        self._broken: tuple[Sight, float] | None = None

    def look(self, moment: Moment) -> None:
        time, is_true, holds = moment.step.time, self._trigger.look(moment) is True, self._require.look(moment)
        if is_true and not self._was_true:
            self._fired += 1
            self._open.append(_Trial(self._clause, time))
        self._was_true = is_true
        still_open = []
        for trial in self._open:
            decided = trial.look(holds, time)
            if decided:
                self._passed += 1
            elif decided is False:
                self._failed += 1
                self._broken = self._broken or (_sight(moment, self._require.readings()), trial.time)
            elif not trial.is_over(time):
                still_open.append(trial)
        self._open = still_open

    def result(self, _: Mapping[str, object]) -> Result:
        tried = self._passed + self._failed
        if self._broken is not None:
            sight, since = self._broken
            return _failed(sight, sight[2], f"failed {self._failed} of {tried} times, first from {since:g} s")
        came = f"{self._passed} of {tried} times" if tried else ""
        if tried < self._clause.at_least:
            undecided = f", {self._fired - tried} of them not decided" if self._fired > tried else ""
            wanted = f"{self._clause.at_least} wanted"
            return _open(f"{self._clause.trigger}: {self._fired} times{undecided}, {wanted}", came)
        return _passed(None, came)


class _HappenedWatch:
    margin = None

    def __init__(self, clause: Happened) -> None:
        self._clause = clause
        self._begun: Sight | None = None

    def look(self, moment: Moment) -> None:
        if self._begun is None and self._clause.event in moment.begun:
            begun = next((b.time for b in moment.step.begun if self._clause.event in (b.name, b.key)), moment.step.time)
            self._begun = (begun, _sight(moment, "")[1], f"{self._clause.event} began at {begun:g} s")

    def result(self, _: Mapping[str, object]) -> Result:
        if self._begun is None:
            return _open(f"{self._clause.event} never began")
        is_late = self._begun[0] > self._clause.within + _TICK
        return _failed(self._begun, self._begun[2], "too late") if is_late else _passed(self._begun)


class _MetricWatch:
    def __init__(self, clause: MetricCheck) -> None:
        self._clause = clause
        self.margin: float | None = None

    def look(self, moment: Moment) -> None:
        """Take in nothing: metrics are there at the end."""

    def result(self, metrics: Mapping[str, object]) -> Result:
        value = metrics.get(self._clause.metric)
        if not isinstance(value, int | float | str):
            return _open(f"{self._clause.metric} has no value in this run")
        came = f"{self._clause.metric} = {value if isinstance(value, str) else f'{value:.6g}'}"
        operand = self._clause.value
        left = value if isinstance(value, str) else float(value)
        holds = (
            compared(left, self._clause.relation, operand)
            if isinstance(left, str) == isinstance(operand, str)
            else None
        )
        if isinstance(left, float) and isinstance(operand, float):
            self.margin = _SIGNS.get(self._clause.relation, 0.0) * (left - operand) / (abs(operand) or 1.0) or None
        if holds is None:
            return _open(f"{came} does not compare with {operand!r}", came)
        return _passed(None, came) if holds else _failed(None, came)
