"""What comes of expectations on runs made by hand: passed, failed, or nothing was tested."""

import math
import pickle
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import pytest

from fogsim.conditions import (
    Always,
    Clause,
    Eventually,
    ExpectationWatch,
    Finding,
    FindingVerdict,
    Happened,
    MetricCheck,
    Whenever,
    parse_condition,
)
from fogsim.scenario.expect.schema import metric_check
from fogsim.values import Begun, Collision, Leader, Step
from tests.recorders.synthetic import estimate, make_step

PASSED, FAILED, OPEN = FindingVerdict.PASSED, FindingVerdict.FAILED, FindingVerdict.INCONCLUSIVE


def run(count: int, make: Callable[[float], Mapping[str, Any]]) -> list[Step]:
    """Steps of half a second."""
    times = [0.5 * index for index in range(count)]
    return [make_step(i, time=t, route_position=20.0 * t, **make(t)) for i, t in enumerate(times)]


def find(clause: Clause, steps: Iterable[Step], metrics: Mapping[str, object] | None = None) -> Finding:
    watch = ExpectationWatch([clause])
    for step in steps:
        watch.update(step)
    (found,) = watch.findings(metrics or {})
    return found


def always(condition: str, *, never: bool = False, during: str | None = None, least: float = 0.0) -> Always:
    return Always("a", parse_condition(condition), never, None if during is None else parse_condition(during), least)


SLOWING = run(21, lambda t: {"speed": 30.0 - 2.0 * t})  # 30 m/s to 10 m/s in 10 s


def test_always_tells_the_first_step_that_broke_it_and_the_worst() -> None:
    found = find(always("ego.speed > 20 m/s"), SLOWING)
    assert (found.verdict, found.time, found.position) == (FAILED, 5.0, 100.0)
    assert (found.came, found.reason) == ("ego.speed = 20 m/s", "at worst ego.speed = 10 m/s at 10 s")
    assert found.expected == "always ego.speed > 20 m/s"
    kept = find(always("ego.speed > 5 m/s"), SLOWING)
    assert (kept.verdict, kept.came) == (PASSED, "at worst ego.speed = 10 m/s")


def test_never_is_the_contrary() -> None:
    assert find(always("ego.speed > 20 m/s", never=True), SLOWING).time == 0.0
    kept = find(always("ego.speed > 40 m/s", never=True), SLOWING)
    assert (kept.verdict, kept.came) == (PASSED, "at worst ego.speed = 30 m/s")


def test_a_collision_is_a_failure_from_then_on() -> None:
    hit = run(5, lambda t: {"collisions": (Collision(t, "ego", "other", 3.0),) if t == 1.0 else ()})
    found = find(always("ego.collision", never=True), hit)
    assert (found.verdict, found.time, found.came) == (FAILED, 1.0, "ego.collision = true")
    assert find(always("collisions == 0"), hit).came == "collisions = 1"


def test_only_steps_of_its_scope_count() -> None:
    in_scope = always("ego.speed < 20 m/s", during="time > 5 s")
    assert find(in_scope, SLOWING).verdict is PASSED
    assert find(in_scope, SLOWING[:8]).verdict is OPEN
    assert find(in_scope, SLOWING[:8]).reason == "time > 5 s never held"
    # Too short a time shows nothing.
    condition, during = "ego.speed < 20 m/s", "time > 5 s"
    assert find(always(condition, during=during, least=4.5), SLOWING).verdict is PASSED
    found = find(always(condition, during=during, least=6.0), SLOWING)
    assert (found.verdict, found.reason) == (OPEN, "it counted for 5 s, and 6 s were wanted")


def test_what_is_never_known_shows_nothing() -> None:
    found = find(always("gap(ego, ghost) > 3 m"), SLOWING)
    assert (found.verdict, found.reason) == (OPEN, "it was never known")
    assert find(Eventually("a", parse_condition("ghost.speed > 3 m/s")), SLOWING).verdict is OPEN


def eventually(condition: str, within: float = math.inf) -> Eventually:
    return Eventually("a", parse_condition(condition), None, within)


def test_eventually() -> None:
    for clause, verdict, time in [
        (eventually("ego.speed < 15 m/s"), PASSED, 8.0),
        (eventually("ego.speed < 15 m/s", 9.0), PASSED, 8.0),
        (eventually("ego.speed < 15 m/s", 7.0), FAILED, 8.0),
        (eventually("ego.speed < 5 m/s", 9.0), FAILED, 9.0),
        (eventually("ego.speed < 5 m/s"), FAILED, 10.0),
        (eventually("ego.speed < 5 m/s", 30.0), OPEN, None),
        (Eventually("a", parse_condition("ego.speed < 15 m/s"), parse_condition("time > 99 s")), OPEN, None),
    ]:
        found = find(clause, SLOWING)
        assert (found.verdict, found.time) == (verdict, time)


def reaction(delay: float, hold: float = 99.0) -> list[Step]:
    """Fog falls below 100 m at 2 s and at 12 s; advice follows after a delay, for a while."""

    def make(t: float) -> Mapping[str, Any]:
        since = t % 10.0 - 2.0
        return {
            "visibility": 80.0 if 0.0 <= since < 4.0 else 200.0,
            "advised": 15.0 if delay <= since < delay + hold else math.inf,
        }

    return run(41, make)


def whenever(
    within: float, *, throughout: bool = False, least: int = 1, require: str = "advice <= 70 km/h"
) -> Whenever:
    trigger = parse_condition("fog.visibility_at_camera falls below 100 m")
    return Whenever("a", trigger, parse_condition(require), within, throughout, least)


def test_whenever() -> None:
    for clause, steps, verdict in [
        (whenever(2.0), reaction(2.0), PASSED),
        (whenever(1.5), reaction(2.0), FAILED),
        (whenever(0.0), reaction(0.0), PASSED),
        (whenever(0.0), reaction(0.5), FAILED),
        # A window that is no multiple of the steps of 0.5 s ends between two of them.
        (whenever(0.3), reaction(0.5), FAILED),
        (whenever(0.7, throughout=True), reaction(0.0, hold=1.0), PASSED),
        (whenever(2.0, least=2), reaction(1.0), PASSED),
        (whenever(2.0, least=3), reaction(1.0), OPEN),
        (whenever(2.0), reaction(1.0)[:4], OPEN),
        (whenever(2.0, throughout=True), reaction(0.0), PASSED),
        (whenever(2.0, throughout=True), reaction(0.0, hold=2.0), FAILED),
        (whenever(2.0, throughout=True), reaction(0.5), FAILED),
        # The second time is not decided when the run ends.
        (whenever(2.0, least=2), reaction(2.0)[:28], OPEN),
        (whenever(2.0, require="ghost.speed > 3 m/s"), reaction(0.0), OPEN),
    ]:
        assert find(clause, steps).verdict is verdict


def test_whenever_tells_how_often_and_when_it_was_not_so() -> None:
    found = find(whenever(1.5), reaction(2.0))
    assert (found.time, found.came) == (3.5, "advice = inf")
    assert found.reason == "failed 2 of 2 times, first from 2 s"
    assert found.expected == "advice <= 70 km/h within 1.5 s whenever fog.visibility_at_camera falls below 100 m"
    assert find(whenever(2.0), reaction(2.0)).came == "2 of 2 times"
    level = Whenever("a", parse_condition("fog.visibility_at_camera < 100 m"), parse_condition("advice < 70 km/h"), 1.0)
    assert find(level, reaction(1.0)).came == "2 of 2 times"


@pytest.mark.parametrize(("within", "verdict"), [(math.inf, PASSED), (3.0, PASSED), (2.0, FAILED)])
def test_happened(within: float, verdict: FindingVerdict) -> None:
    steps = [replace(s, begun=(Begun("timeline.0", 2.9),)) if s.time == 3.0 else s for s in SLOWING]
    found = find(Happened("a", "timeline.0", within), steps)
    assert (found.verdict, found.time, found.position) == (verdict, 2.9, 60.0)


def test_what_never_happened_shows_nothing() -> None:
    found = find(Happened("a", "timeline.0"), SLOWING)
    assert (found.verdict, found.reason) == (OPEN, "timeline.0 never began")


OWN = "estimators.onnx:nets/own.onnx.count"
"""Metric of a method of one's own, whose name may have any sign."""


def test_metrics() -> None:
    for check, verdict in [
        (MetricCheck("a", "gap_m", ">=", 5.0), PASSED),
        (MetricCheck("a", "gap_m", "<", 5.0), FAILED),
        (metric_check("a", f"{OWN} == 3"), PASSED),
        (MetricCheck("a", "ending", "==", "arrived"), PASSED),
        (MetricCheck("a", "ending", "!=", "arrived"), FAILED),
        (MetricCheck("a", "ending", "==", 3.0), OPEN),
        (MetricCheck("a", "none_m", "<", 3.0), OPEN),
        (MetricCheck("a", "estimators", "<", 3.0), OPEN),
    ]:
        metrics = {"gap_m": 5, "ending": "arrived", "none_m": None, OWN: 3}
        assert find(check, SLOWING, metrics).verdict is verdict


def test_a_gap_that_shrinks_is_told_in_the_units_that_were_written() -> None:
    steps = run(3, lambda t: {"leader": Leader("other", 40.0 - 10.0 * t, 15.0), "speed": 25.0})
    found = find(always("ego.ttc >= 3.5 s and ego.speed > 10 km/h"), steps)
    assert (found.time, found.came) == (1.0, "ego.ttc = 3 s, ego.speed = 90 km/h")


def test_verdicts_are_of_the_truth_and_not_of_what_is_believed() -> None:
    clauses = [always("fog.visibility_ahead > 90 m"), always("estimate(joint_road).visibility > 90 m")]
    for truth, said, expected in ((100.0, 80.0, [PASSED, FAILED]), (80.0, 100.0, [FAILED, PASSED])):
        watch = ExpectationWatch(clauses)
        watch.update(make_step(visibility=truth, estimates=(estimate("joint_road", said),)))
        assert [found.verdict for found in watch.findings({})] == expected


def test_watching_changes_nothing() -> None:
    watch = ExpectationWatch([always("gap(ego, other) > 3 m"), whenever(2.0)])
    for step in reaction(1.0):
        before = pickle.dumps(step)
        watch.update(step)
        assert pickle.dumps(step) == before
