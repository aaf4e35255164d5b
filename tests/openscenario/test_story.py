"""Stories: changes of lane by distance and onto the oncoming lane, delays, repeated events, and the end of the road."""

import contextlib
import math
import re
from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError, LeftOutWarning
from fogsim.openscenario import read_openscenario
from fogsim.scenario.loading import load_scenario
from fogsim.values import Ending

from tests.openscenario.writing import (  # isort: skip
    CAR, CASES, QUIET, TWO_LANES, after, begun, changes_lane, event, group, lane, linear, motion_at, on, over,
    profile, run, speed, speed_of, state, write,
)  # fmt: skip


RATE, IN_TWO_SECONDS = linear(4, "rate"), linear(2)


def _faster_than(value: float, delay: float = 0.0, who: str = "Ego") -> str:
    return on(f'<SpeedCondition value="{value}" rule="greaterThan"/>', who, delay)


def _two_cars(folder: Path, events: str, stop: str, at: float = 20.0) -> Path:
    """A file whose events move Lead, which begins at a speed [m/s], far ahead of the ego."""
    begin = {"Ego": f"{lane(30)}\n{speed(5)}", "Lead": f"{lane(90)}\n{speed(at)}"}
    return write(folder, {"Ego": CAR, "Lead": CAR}, begin, {"Lead": events}, stop=stop, visibility=5000.0)


def test_forty_metres_at_fifteen_metres_a_second_take_2_7_seconds() -> None:
    # Lead changes from lane -1 at y = -1.75 m to lane 1, that of oncoming traffic, at y = 1.75 m.
    steps = run(CASES / "lane_change_by_distance.xosc")
    begins = next(step.time for step in steps if any(one.name == "leave" and not one.is_over for one in step.begun))
    ends = next(step.time for step in steps if any(one.name == "leave" and one.is_over for one in step.begun))
    assert ends - begins == pytest.approx(40.0 / 15.0, abs=0.11)
    assert motion_at(steps, begins - 0.1, "Lead")[1] == pytest.approx(-1.75, abs=0.01)
    assert motion_at(steps, begins + 40.0 / 30.0 + 0.1, "Lead")[1] == pytest.approx(0.0, abs=0.35)
    assert motion_at(steps, ends + 0.3, "Lead")[1] == pytest.approx(1.75, abs=0.05)
    # It keeps its speed and its direction, and stays there.
    assert motion_at(steps, 9.9, "Lead") == pytest.approx((90.0 + 3.7 + 15.0 * 9.9, 1.75, 15.0), abs=0.5)


def test_what_follows_a_change_by_distance_waits_until_it_is_over(tmp_path: Path) -> None:
    leave = event("leave", changes_lane(1, "distance", 30.0), after(1.0))
    back = event("back", changes_lane(-1, "time", 2.0), over("leave"))
    steps = run(_two_cars(tmp_path, leave + back, after(10), at=10.0))
    times = begun(steps)
    assert times["back"] - times["leave"] == pytest.approx(3.0, abs=0.25)
    assert motion_at(steps, times["back"] - 0.1, "Lead")[1] == pytest.approx(1.75, abs=0.1)
    assert motion_at(steps, times["back"] + 2.3, "Lead")[1] == pytest.approx(-1.75, abs=0.1)


def test_lanes_beyond_the_nearest_oncoming_one_and_a_rate_of_0_are_refused(tmp_path: Path) -> None:
    action = event("leave", changes_lane(2, "rate", 0.0), after(1.0))
    file = write(tmp_path, {"Ego": CAR}, {"Ego": lane(30)}, {"Ego": action}, road=TWO_LANES)
    with pytest.raises(InputError) as refused:
        read_openscenario(file)
    assert "AbsoluteTargetLane: of the oncoming lanes, vehicles drive on the nearest" in str(refused.value)
    assert "LaneChangeActionDynamics: value: expected a rate above 0" in str(refused.value)
    assert "does not know this attribute" not in str(refused.value)


def test_a_rate_is_the_greatest_speed_across_and_the_lane_to_the_left_the_oncoming_one(tmp_path: Path) -> None:
    for target in [
        '<AbsoluteTargetLane value="1"/>',
        '<RelativeTargetLane entityRef="Ego" value="1"/>',
        '<RelativeTargetLane entityRef="Lead" value="1"/>',
    ]:
        for shape, lasts in [("linear", 3.5), ("sinusoidal", 0.5 * math.pi * 3.5), ("cubic", 5.25)]:
            action = (
                changes_lane(1, "rate", 1.0).replace("cubic", shape).replace('<AbsoluteTargetLane value="1"/>', target)
            )
            begin = {"Ego": lane(30), "Lead": lane(90)}
            file = write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, {"Ego": event("leave", action, after(1.0))})
            smooth = pytest.warns(LeftOutWarning, match="linear is read as sinusoidal")
            with smooth if shape == "linear" else contextlib.nullcontext():
                done = read_openscenario(file).data["timeline"][-1]["do"]["Ego"]["change_lane"]
            assert (done["to"], done["duration_s"]) == ("oncoming", pytest.approx(lasts))


@pytest.mark.parametrize(("number", "lanes"), [(1, 1), (2, 2), (-1, 1)])
def test_a_rate_is_across_as_many_lanes_as_there_are(tmp_path: Path, number: int, lanes: int) -> None:
    target = f'<RelativeTargetLane entityRef="Ego" value="{number}"/>'
    action = changes_lane(-1, "rate", 2.0).replace('<AbsoluteTargetLane value="-1"/>', target)
    file = write(
        tmp_path, {"Ego": CAR}, {"Ego": lane(30, -2)}, {"Ego": event("leave", action, after(1.0))}, road=TWO_LANES
    )
    done = read_openscenario(file).data["timeline"][-1]["do"]["Ego"]["change_lane"]
    assert (done["lanes"], done["duration_s"]) == (number, pytest.approx(lanes * 1.5 * 3.5 / 2.0))


@pytest.mark.parametrize("dynamics", ['dynamicsShape="step"', 'dynamicsShape="step" dynamicsDimension="distance"'])
def test_what_happens_at_once_needs_no_dimension_and_what_takes_time_does(tmp_path: Path, dynamics: str) -> None:
    begin = {"Ego": f"{lane(30)}\n{speed(12, dynamics)}"}
    file = write(tmp_path, {"Ego": CAR}, begin, {"Ego": event("slow", speed(2.0, dynamics), after(1.0))})
    assert read_openscenario(file).data["timeline"][-1]["do"]["Ego"]["speed"] == {"to_kmh": 7.2, "shape": "step"}
    # The one lacks the dimension, the other a value.
    missing = dynamics.replace("step", "linear").replace("distance", "time")
    missing += "" if "Dimension" in missing else ' value="3"'
    file = write(tmp_path, {"Ego": CAR}, begin, {"Ego": event("slow", speed(2.0, missing), after(1.0))})
    with pytest.raises(InputError, match=r"dynamicsDimension: this attribute is missing|expected a number for value"):
        read_openscenario(file)


@pytest.mark.parametrize(("shape", "lasts"), [("linear", 4.0), ("sinusoidal", 2.0 * math.pi), ("cubic", 6.0)])
def test_a_rate_is_the_greatest_acceleration(tmp_path: Path, shape: str, lasts: float) -> None:
    slows = event("slows", speed(4, RATE.replace("linear", shape)), after(1.0))
    done = read_openscenario(_two_cars(tmp_path, slows, after(9.0))).data["timeline"][-1]["do"]["Lead"]["speed"]
    assert (20.0 - 4.0) / done["rate_mps2"] == pytest.approx(lasts)


def test_at_a_rate_of_0_a_speed_stays_as_it_is(tmp_path: Path) -> None:
    never = event("never", speed(2, linear(0, "rate")), after(1.0))
    steps = run(_two_cars(tmp_path, never, after(3.0), at=10.0))
    assert motion_at(steps, 2.9, "Lead") == pytest.approx((90.0 + 3.7 + 29.0, -1.75, 10.0), abs=0.1)


@pytest.mark.parametrize(("priority", "speed_after"), [("override", 16.0), ("parallel", 10.0)])
def test_an_event_that_overrides_ends_a_change_of_speed(tmp_path: Path, priority: str, speed_after: float) -> None:
    brakes = event("brake", speed(2, linear(2, "rate")), after(1.0))
    leaves = event("leave", changes_lane(1, "time", 2.0), after(3.0)).replace("override", priority)
    steps = run(_two_cars(tmp_path, leaves + brakes, after(6.1)))
    assert motion_at(steps, 2.9, "Lead")[2] == pytest.approx(16.2, abs=0.25)
    assert motion_at(steps, 6.0, "Lead")[1:] == pytest.approx((1.75, speed_after), abs=0.25)


def _time(later: float) -> str:
    """Condition on the time [s]."""
    return after(later).removeprefix("<ConditionGroup>").removesuffix("</ConditionGroup>")


CONTINUES = speed(speed_of("Ego", more='continuous="true"'))


def test_what_is_over_stays_over(tmp_path: Path) -> None:
    events = event("up", speed(16, RATE), after(1.0)) + event("down", speed(10, RATE), after(4.0))
    steps = run(_two_cars(tmp_path, events, group(state("act", "a", "completeState")), at=10.0))
    assert steps[-1].ending is Ending.END_CONDITION
    assert steps[-1].time == pytest.approx(5.7, abs=0.21)


def test_a_stop_trigger_is_waited_for_longer_than_two_minutes(tmp_path: Path) -> None:
    data = read_openscenario(_two_cars(tmp_path, event("late", speed(5), after(125.0)), over("late"))).data
    assert (data["duration_s"], data["end_when"]) == (3600.0, "happened(late)")


def test_an_event_that_is_over_is_not_ended_by_one_that_overrides(tmp_path: Path) -> None:
    events = event("early", speed(20, IN_TWO_SECONDS), after(1.0))
    events += event("across", changes_lane(1, "time", 1.0), after(7.0)) + '</Maneuver><Maneuver name="n">'
    steps = run(_two_cars(tmp_path, events + event("slows", speed(5, linear(2, "rate")), after(5.0)), after(13.1)))
    assert motion_at(steps, 13.0, "Lead")[2] == pytest.approx(5.0, abs=0.1)


def test_an_endless_event_is_over_when_it_is_overridden_and_not_before(tmp_path: Path) -> None:
    events = event("across", changes_lane(1, "time", 1.0), after(0.5)) + event("like", CONTINUES, after(2.0))
    events += event("fast", speed(9), after(4.0))
    steps = run(_two_cars(tmp_path, events, group(state("maneuver", "m", "endTransition"))))
    assert steps[-1].ending is Ending.END_CONDITION
    assert steps[-1].time == pytest.approx(4.3, abs=0.15)


def test_acts_of_many_events_are_read(tmp_path: Path) -> None:
    events = "".join(event(f"slower_{n}", speed(n, RATE), after(n)) for n in range(1, 31))
    across = event("across", changes_lane(1, "time", 1.0), after(7.0))
    file = _two_cars(tmp_path, events + across, group(state("act", "a", "completeState")))
    scenario = load_scenario(file, QUIET)
    assert {"across_ends_others", "across_ends_others_2"} < {one.name for one in scenario.timeline}


def test_an_act_that_is_stopped_is_over(tmp_path: Path) -> None:
    file = _two_cars(tmp_path, event("late", speed(5), after(50.0)), group(state("act", "a", "completeState")))
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("</Act>", f"<StopTrigger>{after(2.0)}</StopTrigger></Act>"), encoding="utf-8")
    assert run(file)[-1].time == pytest.approx(2.2, abs=0.15)


def test_what_waits_when_its_act_is_stopped_never_begins(tmp_path: Path) -> None:
    waits = event("waits", speed(5), group(_faster_than(4, 3.0)))
    file = _two_cars(tmp_path, event("before", speed(15), group(_faster_than(4, 1.0))) + waits, after(5.0))
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("</Act>", f"<StopTrigger>{after(2.0)}</StopTrigger></Act>"), encoding="utf-8")
    times = begun(run(file))
    assert times["before"] == pytest.approx(1.0, abs=0.21)
    assert "waits" not in times


def test_what_is_repeated_ends_each_time(tmp_path: Path) -> None:
    twice = event("twice", speed(15, IN_TWO_SECONDS), after(1.0), count=2)
    for kind, name, when, ends in (
        ("event", "twice", "endTransition", 3.0),
        ("event", "twice", "completeState", 5.0),
        ("action", "twice action", "completeState", 3.0),
    ):
        steps = run(_two_cars(tmp_path, twice, group(state(kind, name, when))))
        assert steps[-1].time == pytest.approx(ends, abs=0.41)


def test_a_speed_that_another_event_replaces_is_over(tmp_path: Path) -> None:
    up = event("up", speed(40, RATE), after(1.0))
    down = event("down", speed(10, linear(1)), after(2.0)).replace("override", "parallel")
    steps = run(_two_cars(tmp_path, up + down + event("then", speed(12), over("up")), after(5.0)))
    assert begun(steps)["then"] == pytest.approx(2.0, abs=0.31)


def _soon(other: str, edge: str = "none") -> str:
    """Condition that the ego is less than 3 s behind another vehicle, which it does not have while that is behind."""
    inside = f'entityRef="{other}" value="3" rule="lessThan" freespace="true" alongRoute="true"'
    return on(f"<TimeHeadwayCondition {inside}/>", edge=edge)


def test_a_time_to_a_vehicle_behind_is_no_time_to_one_ahead(tmp_path: Path) -> None:
    """It is false, and begins to be true when the vehicle has overtaken."""
    begin = {"Ego": f"{lane(60)}\n{speed(10)}", "Lead": f"{lane(40, -2)}\n{speed(20)}"}
    events = event("overtaken", speed(15, linear(1)), group(_soon("Lead", "rising"))).replace("override", "parallel")
    events += event("behind", speed(21), group(_soon("Lead"), _time(9.0)))
    events += event("skips", speed(19), after(1.0)).replace("override", "skip")
    file = write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, {"Lead": events}, after(6), 5000.0, TWO_LANES)
    times = begun(run(file))
    assert times["skips"] == pytest.approx(1.0, abs=0.21)
    # The front of Lead is 20 m behind, and its rear must be ahead.
    assert times["overtaken"] == pytest.approx(24.6 / 10.0, abs=0.31)


def test_an_event_that_is_skipped_is_complete(tmp_path: Path) -> None:
    many = event("many", speed(15, linear(2)), after(1.0), count=30)
    skips = event("skips", speed(5), after(1.5)).replace("override", "skip")
    times = begun(run(_two_cars(tmp_path, many + skips + event("then", speed(4), over("skips")), after(4.0))))
    assert times["then"] == pytest.approx(1.5, abs=0.31)
    assert "skips" not in times


def test_ends_that_are_not_known_are_refused(tmp_path: Path) -> None:
    by_rate = speed(speed_of("Ego"), RATE)
    with pytest.raises(InputError, match="nor is the end of a relative speed by rate"):
        read_openscenario(_two_cars(tmp_path, event("like", by_rate, after(1.0)), over("like")))


def test_one_of_several_actions_of_an_event_has_an_end_of_its_own(tmp_path: Path) -> None:
    two = event("two", f'{speed(5)}</Action><Action name="lane">{changes_lane(1, "time", 3.0)}', after(1.0))
    for name, lasts in (("two action", 0.0), ("lane", 3.0)):
        steps = run(_two_cars(tmp_path, two, group(state("action", name, "completeState"))))
        assert steps[-1].time - begun(steps)["two"] == pytest.approx(lasts, abs=0.11)


def test_conditions_that_are_true_for_a_while_are_true_no_longer(tmp_path: Path) -> None:
    fast = _faster_than(18, who="Lead")
    running = state("event", "up", "runningState")
    events = event("up", speed(20, IN_TWO_SECONDS), after(2.0))
    events += event("at_3", speed(20), group(running, _time(3.0))).replace("override", "parallel")
    for name, conditions in {
        "too_late": group(running, _time(6.0)),
        "rising": group(_time(3.0).replace('"none"', '"rising"'), fast),
        "equal": group(_time(3.0).replace("greaterThan", "equalTo"), fast),
    }.items():
        events += event(name, speed(20), conditions).replace("override", "parallel")
    times = begun(run(_two_cars(tmp_path, events, after(8.0), at=10.0)))
    assert times["at_3"] == pytest.approx(3.0, abs=0.15)
    assert not {"too_late", "rising", "equal"} & times.keys()


def test_what_init_sets_replaces_the_declared_value(tmp_path: Path) -> None:
    file = _two_cars(tmp_path, event("waits", speed(5), _waits_for("true")), after(2.0))
    text = file.read_text(encoding="utf-8").replace("<CatalogLocations>", f"{DECLARED}<CatalogLocations>")
    file.write_text(text.replace("<Init><Actions>", f"<Init><Actions>{SETS}"), encoding="utf-8")
    assert begun(run(file))["waits"] == pytest.approx(0.1, abs=0.11)


def test_an_event_that_overrides_leaves_alone_what_begins_later(tmp_path: Path) -> None:
    brakes = event("brake", speed(2, linear(2, "rate")), after(2.0))
    leaves = event("leave", changes_lane(1, "time", 1.0), after(1.0))
    steps = run(_two_cars(tmp_path, leaves + brakes, after(5.1)))
    assert motion_at(steps, 5.0, "Lead")[2] == pytest.approx(14.0, abs=0.25)


def test_the_first_of_two_delayed_groups_ends_therun() -> None:
    steps = run(CASES / "stop_with_two_delays.xosc")
    assert steps[-1].time == pytest.approx(7.0, abs=0.11)


def test_groups_have_delays_of_their_own(tmp_path: Path) -> None:
    starts = group(_faster_than(99)) + group(_faster_than(10, delay=1.5))
    begin = {"Ego": f"{lane(30)}\n{speed(15)}"}
    file = write(tmp_path, {"Ego": CAR}, begin, {"Ego": event("brake", speed(5), starts)}, visibility=5000.0)
    # The speed holds in the first step; a mark and what waits for it are looked at once a camera period.
    assert begun(run(file))["brake"] == pytest.approx(1.5, abs=0.31)


def test_each_condition_of_a_group_has_its_delay(tmp_path: Path) -> None:
    begin = {"Ego": f"{lane(30)}\n{speed(15)}"}
    first = event("first", speed(12), after(1.0))
    second = event("second", speed(5), group(state("event", "first", "startTransition", 2.0), _faster_than(10)))
    file = write(tmp_path, {"Ego": CAR}, begin, {"Ego": first + second}, visibility=5000.0)
    times = begun(run(file))
    assert times["second"] - times["first"] == pytest.approx(2.0, abs=0.31)
    second = event("second", speed(5), group(state("event", "first", "completeState"), _faster_than(10, delay=2.5)))
    file = write(tmp_path, {"Ego": CAR}, begin, {"Ego": first + second}, visibility=5000.0)
    times = begun(run(file))
    # It was so fast from the beginning, which was 2.5 s ago.
    assert times["second"] == pytest.approx(2.5, abs=0.11)


def test_events_are_played_as_often_as_they_may(tmp_path: Path) -> None:
    slower = speed_of("Ego", -2, "delta", 'continuous="false"')
    events = event("slower", speed(slower, linear(1)), group(_faster_than(8)), count=5)
    file = write(tmp_path, {"Ego": CAR}, {"Ego": f"{lane(30)}\n{speed(13)}"}, {"Ego": events}, visibility=5000.0)
    steps = run(file)
    times = [one.time for step in steps for one in step.begun if one.name.startswith("slower") and not one.is_over]
    # 13, 11, 9 and then 7 m/s, which is not above 8 any more: three of five times.
    assert len(times) == 3
    assert np.diff(times) == pytest.approx([1.0, 1.0], abs=0.21)
    assert motion_at(steps, 9.9, "Ego")[2] == pytest.approx(7.0, abs=0.05)
    assert read_openscenario(file).data["expect"] == {"slower": {"happened": "slower"}}


DECLARED = (
    '<ParameterDeclarations><ParameterDeclaration name="brakes" parameterType="boolean" value="false"/>'
    '</ParameterDeclarations><VariableDeclarations><VariableDeclaration name="seen" variableType="int" value="0"/>'
    "</VariableDeclarations>"
)
KEEPS = (
    '<PrivateAction><LongitudinalAction><LongitudinalDistanceAction entityRef="Ego" distance="9" freespace="true" '
    'continuous="true" displacement="leadingReferencedEntity"/></LongitudinalAction></PrivateAction>'
)
"""An action that FogSim cannot do in a story."""
SETS = '<GlobalAction><ParameterAction parameterRef="brakes"><SetAction value="true"/></ParameterAction></GlobalAction>'


def _waits_for(value: str) -> str:
    inner = f'<ParameterCondition parameterRef="brakes" rule="equalTo" value="{value}"/>'
    return group(
        f'<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>{inner}</ByValueCondition></Condition>'
    )


@pytest.mark.parametrize("whole_act", [True, False])
@pytest.mark.parametrize(
    ("value", "action", "is_idle"), [("true", KEEPS, True), ("false", KEEPS, False), ("true", SETS, False)]
)
def test_what_waits_for_a_value_that_nothing_sets_is_left_out(
    tmp_path: Path, whole_act: bool, value: str, action: str, is_idle: bool
) -> None:
    own, of_act = (after(1), _waits_for(value)) if whole_act else (_waits_for(value), after(0))
    idle, begin = event("idle", action, own), {"Ego": lane(30), "Lead": lane(90)}
    file = write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, {"Lead": idle})
    text = file.read_text(encoding="utf-8").replace("<CatalogLocations>", f"{DECLARED}<CatalogLocations>")
    act = f"<StartTrigger>{after(0)}</StartTrigger></Act>"
    waits = event("waits", speed(5), over("idle")).replace("waits action", "w")
    group = '<ManeuverGroup name="other" maximumExecutionCount="1"><Actors selectTriggeringEntities="false"><EntityRef '
    group += f'entityRef="Lead"/></Actors><Maneuver name="n">{waits}</Maneuver></ManeuverGroup>'
    second = f'<Act name="second">{group}{act}'
    file.write_text(text.replace(act, act.replace(after(0), of_act) + second), encoding="utf-8")
    if is_idle:
        with pytest.warns(LeftOutWarning, match="it never begins: its parameters have other values"):
            data = read_openscenario(file).data
        assert data["expect"] == {"waits": {"happened": "waits"}}
        assert data["timeline"][-1]["when"] == "time < 0 s"
    elif action == KEEPS:
        with pytest.raises(InputError, match=r"LongitudinalDistanceAction.*: displacement: while it drives"):
            read_openscenario(file)
    else:
        assert {*read_openscenario(file).data["expect"]} == {"idle", "waits"}


def test_counts_out_of_range_are_refused(tmp_path: Path) -> None:
    for count in ["0", "1.5", "101"]:
        events = event("e", speed(5), after(1)).replace('ExecutionCount="1"', f'ExecutionCount="{count}"')
        with pytest.raises(InputError, match=r"Event\[e\]: maximumExecutionCount: expected 1 … 100, got"):
            read_openscenario(write(tmp_path, {"Ego": CAR}, {"Ego": lane(30)}, {"Ego": events}))


def test_the_end_of_the_road_ends_therun(tmp_path: Path) -> None:
    end = group(on('<EndOfRoadCondition duration="0"/>'))
    steps = run(write(tmp_path, {"Ego": CAR}, {"Ego": f"{lane(700)}\n{speed(15)}"}, stop=end, visibility=5000.0))
    assert steps[-1].ending in (Ending.END_CONDITION, Ending.ARRIVED)
    # From a front bumper at 703.7 m to 10 m before the end of the road at 800 m.
    assert steps[-1].time == pytest.approx((790.0 - 703.7) / 15.0, abs=0.2)


def test_another_vehicle_comes_to_the_end_of_its_own_road(tmp_path: Path) -> None:
    ends = event("end", speed(5), group(on('<EndOfRoadCondition duration="0"/>', "Other")))
    begin = {"Ego": f"{lane(30)}\n{speed(15)}", "Other": f"{lane(50, 1)}\n{speed(10)}"}
    steps = run(write(tmp_path, {"Ego": CAR, "Other": CAR}, begin, {"Ego": ends}, stop=after(6)))
    # It drives against the road, whose beginning is its end.
    assert begun(steps)["end"] == pytest.approx((50.0 - 3.7 - 10.0) / 10.0, abs=0.2)


def test_events_may_be_called_as_entries_of_fogsim_are(tmp_path: Path) -> None:
    events = event("Init", speed(8), after(1.0)) + event("stop", speed(6), over("Init"))
    stop = group(on('<SpeedCondition value="6.5" rule="lessThan"/>', "Lead", delay=0.5))
    begin = {"Ego": f"{lane(30)}\n{speed(5)}", "Lead": f"{lane(90)}\n{speed(10)}"}
    steps = run(write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, {"Lead": events}, stop=stop))
    assert [*begun(steps)] == ["Init_2", "Init", "stop", "stop_2"]
    assert steps[-1].time < 4.0


@pytest.mark.parametrize(("written", "is_kept"), [("1", True), ("True", True), ("0", False), ("yes", None)])
def test_truth_values_are_those_of_xml(tmp_path: Path, written: str, is_kept: bool | None) -> None:
    action = speed(speed_of("Ego", more=f'continuous="{written}"'))
    begin = {"Ego": lane(30), "Lead": lane(90)}
    file = write(tmp_path, {"Ego": CAR, "Lead": CAR}, begin, {"Lead": event("like", action, after(1.0))})
    if is_kept is None:
        with pytest.raises(InputError, match="continuous: expected true or false, got 'yes'"):
            read_openscenario(file)
    else:
        done = read_openscenario(file).data["timeline"][-1]["do"]["Lead"]["speed"]
        assert done.get("continuous", False) is is_kept


def test_what_a_vehicle_cannot_do_and_what_is_written_twice_is_refused(tmp_path: Path) -> None:
    slow = CAR.replace('maxSpeed="60"', 'maxSpeed="20"')
    events = {
        "over": speed(30, linear(3)),
        "hard": speed(5, linear(9.5, "rate")),
        "profile": profile((0.0, 10), (3.0, 21)),
        "half": changes_lane(1, "time", 2.0)
        .replace("Absolute", "Relative")
        .replace('value="1"', 'entityRef="Ego" value="1.5"'),
        "twice": speed(12).replace("<SpeedActionTarget>", "<SpeedActionTarget/><SpeedActionTarget>"),
    }
    story = {"Next": "".join(event(name, action, after(1.0)) for name, action in events.items())}
    begin = {"Ego": f"{lane(90)}\n{speed(25)}", "Next": f"{lane(60)}\n{speed(10)}"}
    with pytest.raises(InputError) as refused:
        read_openscenario(write(tmp_path, {"Ego": slow, "Next": slow}, begin, story))
    for end in (
        r"Private\[Ego\].*value: Ego drives at most 20 m/s \(Performance@maxSpeed\), got 25",
        r"Event\[over\].*value: Next drives at most 20 m/s \(Performance@maxSpeed\), got 30",
        r"Event\[hard\].*value: Next speeds up by 4 m/s² at most and brakes by 9 \(Performance\), got 9\.5",
        r"Event\[profile\].*speed: Next drives at most 20 m/s \(Performance@maxSpeed\), got 21",
        r"Event\[half\].*value: expected a whole number, got 1\.5",
        r"Event\[twice\].*/SpeedActionTarget: expected one SpeedActionTarget in SpeedAction, got 2",
    ):
        assert re.search(f"small.xosc:1: .*{end}$", str(refused.value), re.MULTILINE), end
