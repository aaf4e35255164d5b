"""States of events and acts: what ends by itself, is overridden or replaced, transitions, and delays in late acts."""

from pathlib import Path

import pytest

from fogsim.errors import LeftOutWarning
from fogsim.openscenario import read_openscenario

from tests.openscenario.writing import (  # isort: skip
    CAR, TIMED, after, begun, changes_lane, event, follows, group, lane, linear, motion_at, on, polyline, run, speed,
    state, world, write,
)  # fmt: skip


def _three(folder: Path, story: dict[str, str], stop: float) -> Path:
    """A file in which Lead and Far drive at 10 m/s, far ahead of the ego."""
    begin = {"Ego": f"{lane(30)}\n{speed(5)}", "Lead": f"{lane(90)}\n{speed(10)}", "Far": f"{lane(300)}\n{speed(10)}"}
    return write(folder, dict.fromkeys(begin, CAR), begin, story, stop=after(stop), visibility=5000.0)


def _in_turn(*states: str, name: str = "up") -> dict[str, str]:
    """Events of the ego that wait for states of another event, by themselves."""
    return {"Ego": "".join(event(f"at_{one}", speed(4), group(state("event", name, one))) for one in states)}


def test_what_is_overridden_has_no_end_of_its_own(tmp_path: Path) -> None:
    up = event("up", speed(30, linear(4)), after(1.0), count=2)
    story = {"Lead": up + event("down", speed(10), after(3.0)), **_in_turn("endTransition", "completeState")}
    times = begun(run(_three(tmp_path, story, 8.0)))
    assert times["at_completeState"] == pytest.approx(3.1, abs=0.21)
    assert not {"at_endTransition", "up_2"} & times.keys()


@pytest.mark.parametrize("priority", ["override", "parallel"])
def test_a_speed_that_another_maneuver_orders_ends_it(tmp_path: Path, priority: str) -> None:
    down = event("down", speed(10, linear(2)), after(3.0)).replace("override", priority)
    up = event("up", speed(30, linear(20)), after(1.0)) + '</Maneuver><Maneuver name="other">'
    times = begun(run(_three(tmp_path, {"Lead": up + down, **_in_turn("endTransition")}, 6.0)))
    assert times["at_endTransition"] == pytest.approx(3.1, abs=0.21)


def test_a_speed_that_is_ordered_for_one_actor_ends_it_for_all(tmp_path: Path) -> None:
    story = {"Lead": event("up", speed(20, linear(10)), after(1.0)), "Far": event("down", speed(5), after(3.0))}
    file = _three(tmp_path, {**story, **_in_turn("completeState")}, 6.0)
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("</Actors>", '<EntityRef entityRef="Far"/></Actors>', 1), encoding="utf-8")
    steps = run(file)
    assert begun(steps)["at_completeState"] == pytest.approx(3.1, abs=0.21)
    assert motion_at(steps, 5.5, "Lead")[2] == pytest.approx(12.0, abs=0.15)


def _both(first: str, then: str) -> str:
    return group(first, then.removeprefix("<ConditionGroup>").removesuffix("</ConditionGroup>"))


@pytest.mark.parametrize("edge", ["none", "rising"])
def test_each_end_of_what_is_repeated_is_a_transition(tmp_path: Path, edge: str) -> None:
    ends = state("event", "up", "endTransition").replace('"none"', f'"{edge}"')
    again = event("again", speed(4), _both(ends, after(4.0)), count=3)
    up = event("up", speed(15, linear(2)), after(1.0), count=3)
    steps = run(_three(tmp_path, {"Lead": up, "Ego": again}, 9.0))
    times = [one.time for step in steps for one in step.begun if one.name.startswith("again") and not one.is_over]
    assert times == pytest.approx([5.0, 7.0], abs=0.41)


def test_a_transition_is_over_after_a_step(tmp_path: Path) -> None:
    story = {"Lead": event("up", speed(15, linear(2)), after(1.0)), "Ego": ""}
    for when in ("startTransition", "endTransition", "completeState"):
        story["Ego"] += event(f"late_{when}", speed(4), _both(state("event", "up", when), after(5.0)))
        story["Ego"] += event(f"soon_{when}", speed(4), _both(state("event", "up", when), after(0.5)))
    times = begun(run(_three(tmp_path, story, 7.0)))
    assert times["late_completeState"] == pytest.approx(5.0, abs=0.11)
    assert times["soon_startTransition"] == pytest.approx(1.0, abs=0.21)
    assert times["soon_endTransition"] == pytest.approx(3.0, abs=0.31)
    assert not {"late_startTransition", "late_endTransition"} & times.keys()


@pytest.mark.parametrize("begins", [after(3.0), group(on('<TraveledDistanceCondition value="15"/>'))])
def test_delays_count_from_the_beginning_of_an_act(tmp_path: Path, begins: str) -> None:
    fast = on('<SpeedCondition value="4" rule="greaterThan"/>', delay=2.0)
    starts = {
        "time": after(1.0, 2.0),
        "speed": group(fast),
        "both": group(fast, on('<SpeedCondition value="3" rule="greaterThan"/>')),
        "either": group(on('<SpeedCondition value="9" rule="greaterThan"/>')) + group(fast),
    }
    events = "".join(event(name, speed(5), start) for name, start in starts.items())
    file = _three(tmp_path, {"Ego": events}, 6.0)
    text = file.read_text(encoding="utf-8")
    act = f"<StartTrigger>{after(0)}</StartTrigger></Act>"
    file.write_text(text.replace(act, f"<StartTrigger>{begins}</StartTrigger></Act>"), encoding="utf-8")
    times = begun(run(file))
    assert [times[name] for name in starts] == pytest.approx([5.0] * 4, abs=0.31)


def test_a_time_that_is_past_when_its_act_begins_has_no_edge(tmp_path: Path) -> None:
    late = event("late", speed(4), after(0.0).replace('"none"', '"rising"'))
    file = _three(tmp_path, {"Ego": late}, 6.0)
    text = file.read_text(encoding="utf-8").replace(f"</ManeuverGroup><StartTrigger>{after(0)}", "{0}{1}")
    file.write_text(text.format(f"</ManeuverGroup><StartTrigger>{after(3.0)}", ""), encoding="utf-8")
    with pytest.warns(LeftOutWarning, match=r"conditionEdge: it holds before its act begins at 3 s"):
        read_openscenario(file)


def test_an_event_of_several_actions_ends_with_the_last_of_them(tmp_path: Path) -> None:
    across = f"</Action><Action name='across'>{changes_lane(1, 'time', 4.0)}</Action>"
    up = event("up", speed(30, linear(20)), after(1.0)).replace("</Action>", across, 1)
    story = {"Lead": f"{up}</Maneuver><Maneuver name='n'>{event('down', speed(9), after(2.0))}"}
    ends = [state("action", "up action", "completeState"), state("event", "up", "endTransition")]
    story["Ego"] = "".join(event(name, speed(4), group(one)) for name, one in zip(("first", "both"), ends, strict=True))
    times = begun(run(_three(tmp_path, story, 6.0)))
    assert (times["first"], times["both"]) == pytest.approx((2.1, 5.0), abs=0.21)


def test_a_change_of_lane_ends_once_another_one_begins(tmp_path: Path) -> None:
    events = event("up", changes_lane(1, "time", 5.0), after(1.0)) + "</Maneuver><Maneuver name='n'>"
    events += event("back", changes_lane(-1, "time", 2.0), after(3.0))
    times = begun(run(_three(tmp_path, {"Lead": events, **_in_turn("endTransition")}, 6.0)))
    assert times["at_endTransition"] == pytest.approx(3.1, abs=0.21)


def test_what_runs_when_its_act_is_stopped_ends_there(tmp_path: Path) -> None:
    story = {"Lead": event("up", speed(20, linear(10)), after(1.0)), **_in_turn("endTransition", "completeState")}
    file = _three(tmp_path, story, 12.0)
    text = file.read_text(encoding="utf-8")
    stopped = f"</ManeuverGroup><StartTrigger>{after(0)}</StartTrigger><StopTrigger>{after(3)}</StopTrigger></Act>"
    text = text.replace("</ManeuverGroup>", f'{stopped}<Act name="b">', 1)
    file.write_text(text, encoding="utf-8")
    steps = run(file)
    assert motion_at(steps, 6.0, "Lead")[2] == pytest.approx(12.0, abs=0.15)
    assert begun(steps)["at_completeState"] == pytest.approx(3.1, abs=0.21)
    assert "at_endTransition" not in begun(steps)


def test_what_begins_after_the_end_of_the_run_is_not_expected(tmp_path: Path) -> None:
    events = event("soon", speed(5), after(1.0)) + event("never", speed(5), after(10000.0))
    assert [*read_openscenario(_three(tmp_path, {"Ego": events}, 6.0)).data["expect"]] == ["soon"]


@pytest.mark.parametrize("reference", ["<None/>", TIMED])
@pytest.mark.parametrize("is_in_init", [True, False])
def test_a_change_of_lane_ends_a_trajectory(tmp_path: Path, reference: str, is_in_init: bool) -> None:
    path = follows(polyline((0, world(90, -1.75)), (20, world(290, -1.75))), reference)
    story = {"Lead": event("across", changes_lane(1, "time", 2.0), after(3.0)).replace("override", "parallel")}
    if not is_in_init:
        story["Far"] = event("path", path, after(0.0))
        story |= _in_turn("endTransition", name="path")
    file = _three(tmp_path, story, 6.0)
    text = file.read_text(encoding="utf-8")
    # The second group moves the same vehicle.
    text = text.replace('<EntityRef entityRef="Far"/></Actors>', '<EntityRef entityRef="Lead"/></Actors>')
    text = text.replace(
        '<Private entityRef="Far">', f'<Private entityRef="Lead">{path * is_in_init}</Private>' + "{0}", 1
    )
    file.write_text(text.replace("{0}", '<Private entityRef="Far">'), encoding="utf-8")
    steps = run(file)
    assert motion_at(steps, 2.9, "Lead")[1:] == pytest.approx((-1.75, 10.0), abs=0.05)
    assert motion_at(steps, 5.8, "Lead")[1:] == pytest.approx((1.75, 10.0), abs=0.05)
    assert is_in_init or begun(steps)["at_endTransition"] == pytest.approx(3.1, abs=0.21)


def test_a_speed_ends_a_trajectory_with_times(tmp_path: Path) -> None:
    path = follows(polyline((0, world(90, -1.75)), (20, world(290, -1.75))), TIMED)
    events = f"{event('path', path, after(0.0))}</Maneuver><Maneuver name='n'>{event('slow', speed(4), after(3.0))}"
    steps = run(_three(tmp_path, {"Lead": events, **_in_turn("endTransition", name="path")}, 6.0))
    assert motion_at(steps, 5.8, "Lead")[2] == pytest.approx(4.0, abs=0.05)
    assert begun(steps)["at_endTransition"] == pytest.approx(3.1, abs=0.21)


def test_an_offset_that_is_kept_ends_with_a_change_of_lane(tmp_path: Path) -> None:
    target = '<LaneOffsetTarget><AbsoluteTargetLaneOffset value="0.5"/></LaneOffsetTarget>'
    aside = f'<LaneOffsetAction continuous="true"><LaneOffsetActionDynamics dynamicsShape="step"/>{target}'
    aside = f"<PrivateAction><LateralAction>{aside}</LaneOffsetAction></LateralAction></PrivateAction>"
    lit = f"</Action><Action name='fast'>{speed(11)}</Action>"
    events = event("up", aside, after(1.0)).replace("</Action>", lit, 1) + "</Maneuver><Maneuver name='n'>"
    events += event("slow", speed(9), after(2.0)) + event("across", changes_lane(1, "time", 2.0), after(3.0))
    times = begun(run(_three(tmp_path, {"Lead": events, **_in_turn("endTransition")}, 6.0)))
    assert times["at_endTransition"] == pytest.approx(3.1, abs=0.21)
