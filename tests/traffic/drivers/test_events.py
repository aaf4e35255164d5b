"""Scripted events: gaps with a sign, triggers, and what has not been played; no simulation runs."""

import math
from collections.abc import Sequence

import highway_env  # noqa: F401 - registers its environments

from fogsim.traffic import BrakeEvent, LampFailureEvent, LaneChangeEvent, Trigger
from fogsim.traffic.drivers.events import Script, Situation
from fogsim.traffic.sumo_lanes.route_position import signed_gap
from fogsim.values import Reason, Unplayed, UnplayedEvent

NOW = Trigger(at_time=0.0, name="now")


def test_a_gap_has_the_sign_of_who_is_ahead() -> None:
    for ahead, behind, gap in [
        (20.0, None, 15.0),  # a truck of 5 m whose front is 20 m ahead
        (None, 20.0, -16.0),  # its front is 20 m behind that of an ego of 4 m
        (3.0, None, 0.0),
        (0.0, 0.0, 0.0),
        (None, 3.0, 0.0),
        (None, None, None),
        (20.0, 500.0, 15.0),
        (500.0, 20.0, -16.0),
    ]:
        assert signed_gap(ahead, behind, 5.0, 4.0) == gap


def fired_at(wanted: float, gaps: Sequence[float | None]) -> int | None:
    """Step in which an event begins."""
    script = Script([LampFailureEvent("a", Trigger(at_gap_to_ego=wanted))])
    for step, gap in enumerate(gaps):
        script.play(Situation(float(step), {"a"}, lambda _: 0.0, lambda _, gap=gap: gap, lambda *_: True))  # type: ignore[misc]  # bound
        if script.dark:
            return step
    return None


def test_an_event_begins_when_its_gap_is_reached() -> None:
    for wanted, gaps, step in [
        (15.0, [30.0, 20.0, 14.0], 2),  # the ego closes in
        (15.0, [-30.0, -5.0, 0.0, 5.0, 16.0], 4),  # overtakes and gets away: not as soon as it is ahead
        (15.0, [-15.0, -10.0, -15.0], None),  # the other side
        (-15.0, [-30.0, -14.0], 1),
        (-15.0, [14.0, 0.0, -16.0], 2),
        (15.0, [10.0], 0),  # nearer when it is first seen
        (15.0, [-10.0], None),
        (-15.0, [-10.0], 0),
        (15.0, [20.0, None, 10.0], 2),
        (0.0, [-3.0, 0.0], 1),
        (0.0, [-3.0, 3.0], 1),
        (15.0, [None, None], None),
    ]:
        assert fired_at(wanted, gaps) == step


def test_of_two_events_that_brake_a_vehicle_the_lower_speed_counts_until_both_are_over() -> None:
    events = [
        BrakeEvent("a", Trigger(at_time=1.0), to_speed=5.0, hold=4.0),
        BrakeEvent("a", Trigger(at_time=0.0), to_speed=10.0, hold=9.0),
    ]
    script = Script(events)
    situations = [Situation(t, {"a"}, lambda _: 0.0, lambda _: None, lambda *_: True) for t in range(11)]
    wanted = [script.play(situation).orders.get("a") for situation in situations]
    assert [o and o[0] for o in wanted] == [10.0, *[5.0] * 4, *[10.0] * 4, math.inf, None]


def after(script: Script, present: set[str], seen: set[str], *, lanes: bool = True) -> Unplayed:
    script.play(Situation(0.0, present, lambda _: 0.0, lambda _: None, lambda *_: lanes))
    return script.unplayed(seen, present)


def test_each_event_that_was_not_played_says_why() -> None:
    for event, reason in [
        (BrakeEvent("a", Trigger(at_position=5000.0, name="x")), Reason.NOT_REACHED),
        (BrakeEvent("gone", Trigger(at_time=0.0, name="x")), Reason.LEFT),
        (BrakeEvent("nobody", Trigger(at_time=0.0, name="x")), Reason.NEVER_SEEN),
        (LaneChangeEvent("a", Trigger(at_time=0.0, name="x"), -1), Reason.NO_LANE),
    ]:
        told = after(Script([event]), {"a"}, {"a", "gone"}, lanes=False)
        assert told.events == (UnplayedEvent("x", reason),)
        assert told.vehicles == (("nobody",) if reason is Reason.NEVER_SEEN else ())
        assert told.is_final == (reason in (Reason.LEFT, Reason.NO_LANE))
    played = Script([BrakeEvent("a", NOW), LampFailureEvent("a", NOW), LaneChangeEvent("a", NOW, 1)])
    assert not (nothing := after(played, {"a"}, {"a"}))
    assert nothing == Unplayed()
    late = Trigger(at_time=9.0, name="traffic.events.0 (break_down of a at_time_s=9)")
    told = after(Script([BrakeEvent("a", late), LampFailureEvent("a", late)]), {"a"}, {"a"})
    assert str(told) == f"{late.name}: its time, position or gap was not reached"  # one event that stands for two
